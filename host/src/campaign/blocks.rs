//! Text files in blocks of whole lines, results in the order of the file. Of a large file the next window is read while this
//! one is parsed on all cores; a small one is a block, for whoever reads many has all cores at work already. Memory is a
//! window and its results, whatever the size of the file.
use super::CampaignError;
use rayon::prelude::*;
use std::fs::File;
use std::io::{Cursor, Read, Seek, SeekFrom};
use std::ops::ControlFlow;
use std::sync::Arc;

/// Bytes parsed by one task. Blocks begin at the same bytes whatever the number of threads, and so do sums over them.
/// A block and its numbers stay in the cache of a core until they are taken.
pub(super) const BLOCK: usize = 1 << 17;
/// Blocks of a window of a large file.
const BLOCKS: usize = 16;
/// Bytes of a large file.
const LARGE: u64 = 4 << 20;
/// A line longer than this is no row of numbers.
const LONGEST_LINE: usize = BLOCK * BLOCKS;

/// Where bytes come from.
#[derive(Debug)]
enum Bytes {
    File(File),
    Memory(Cursor<Arc<[u8]>>),
}

impl Read for Bytes {
    fn read(&mut self, buffer: &mut [u8]) -> std::io::Result<usize> {
        match self {
            Self::File(file) => file.read(buffer),
            Self::Memory(text) => text.read(buffer),
        }
    }
}

/// A file from some byte on.
#[derive(Debug)]
pub(super) struct Text {
    file: std::io::Take<Bytes>,
    /// Bytes already read, of which the first `skip` were used.
    buffer: Vec<u8>,
    skip: usize,
    /// Byte of the file at which `buffer` begins.
    at: u64,
    /// Bytes of the file.
    size: u64,
}

/// Why a walk ended early.
pub(super) enum Fault {
    /// The operating system says so.
    Io(std::io::Error),
    /// No line end for a long way behind this byte.
    Endless(u64),
    /// Whoever took the results.
    Taken(CampaignError),
}

impl Text {
    /// A file with all of its bytes read if it is small, else the first.
    pub(super) fn open(file: File) -> std::io::Result<Self> {
        let size = file.metadata()?.len();
        // One byte more than there are shows the end.
        let head = if size > LARGE {
            BLOCK
        } else {
            size as usize + 1
        };
        let mut buffer = Vec::with_capacity(head);
        let mut file = Bytes::File(file).take(u64::MAX);
        file.by_ref().take(head as u64).read_to_end(&mut buffer)?;
        Ok(Self {
            file,
            buffer,
            skip: 0,
            at: 0,
            size,
        })
    }

    /// The bytes `from` to `to` of a file, nothing read yet.
    pub(super) fn between(mut file: File, from: u64, to: u64) -> std::io::Result<Self> {
        let size = file.metadata()?.len().min(to);
        file.seek(SeekFrom::Start(from))?;
        Ok(Self {
            file: Bytes::File(file).take(to.saturating_sub(from)),
            buffer: Vec::new(),
            skip: 0,
            at: from,
            size,
        })
    }

    /// The bytes `from` to `to` of a text in memory.
    pub(super) fn of_memory(text: Arc<[u8]>, from: u64, to: u64) -> Self {
        let size = (text.len() as u64).min(to);
        let mut cursor = Cursor::new(text);
        cursor.set_position(from);
        Self {
            file: Bytes::Memory(cursor).take(to.saturating_sub(from)),
            buffer: Vec::new(),
            skip: 0,
            at: from,
            size,
        }
    }

    /// What was read and not skipped.
    pub(super) fn head(&self) -> &[u8] {
        &self.buffer[self.skip..]
    }

    /// Leaves out the next `bytes` of what was read.
    pub(super) fn skip(&mut self, bytes: usize) {
        self.skip = (self.skip + bytes).min(self.buffer.len());
    }

    /// Rows to expect of a large file, by the length of those read so far, with some to spare. Those of a small one come at
    /// once.
    pub(super) fn rows(&self) -> Option<usize> {
        if self.size <= LARGE {
            return None;
        }
        let sample = self.head();
        let lines = memchr::memchr_iter(b'\n', sample).count().max(1) as u64;
        let rows = self.size * lines / (sample.len().max(1) as u64) + self.size / 64 + 16;
        Some(usize::try_from(rows.min(self.size / 2 + 1)).unwrap_or(0))
    }

    /// Parses the rest block by block. `parse` is given the byte at which a block begins; `take` gets the results in order
    /// and may end the walk.
    pub(super) fn walk<T: Send>(
        mut self,
        parse: impl Fn(u64, &[u8]) -> T + Sync,
        mut take: impl FnMut(T) -> Result<ControlFlow<()>, CampaignError>,
    ) -> Result<(), Fault> {
        let mut body = self.skip;
        let rest = self.size.saturating_sub(self.at);
        let large = rest > LARGE;
        let window = if large {
            BLOCK * BLOCKS
        } else {
            BLOCK.max(rest as usize)
        };
        let block = if large { BLOCK } else { 1 };
        let mut next = Vec::new();
        let mut last = self.fill()?;
        loop {
            let buffer = &self.buffer;
            let whole = if last {
                buffer.len()
            } else {
                buffer
                    .iter()
                    .rposition(|&b| b == b'\n')
                    .map_or(body, |p| p + 1)
            };
            if whole == body && !last && buffer.len() - body > LONGEST_LINE {
                return Err(Fault::Endless(self.at + body as u64));
            }
            let mut from = self.at + body as u64;
            let blocks: Vec<(u64, &[u8])> = split_at_lines(&buffer[body..whole], block)
                .into_iter()
                .map(|block| {
                    let at = from;
                    from += block.len() as u64;
                    (at, block)
                })
                .collect();
            let mut more = Ok(0);
            let mut read = || {
                if !last {
                    next.clear();
                    next.reserve_exact(buffer.len() - whole + window);
                    next.extend_from_slice(&buffer[whole..]);
                    more = self
                        .file
                        .by_ref()
                        .take(window as u64)
                        .read_to_end(&mut next);
                }
            };
            if large {
                let work = || {
                    blocks
                        .par_iter()
                        .map(|(at, block)| parse(*at, block))
                        .collect::<Vec<T>>()
                };
                for result in rayon::join(work, read).0 {
                    if take(result).map_err(Fault::Taken)?.is_break() {
                        return Ok(());
                    }
                }
            } else {
                for (at, block) in blocks {
                    if take(parse(at, block)).map_err(Fault::Taken)?.is_break() {
                        return Ok(());
                    }
                }
                read();
            }
            if last {
                return Ok(());
            }
            last = more.map_err(Fault::Io)? == 0;
            self.at += whole as u64;
            std::mem::swap(&mut self.buffer, &mut next);
            body = 0;
        }
    }

    /// Reads the first window where the head was not the whole file; whether that was all.
    fn fill(&mut self) -> Result<bool, Fault> {
        if self.at + self.buffer.len() as u64 >= self.size {
            // Longer than it was when opened, or of a size that is not known: one more look tells.
            let before = self.buffer.len();
            self.file
                .by_ref()
                .take(BLOCK as u64)
                .read_to_end(&mut self.buffer)
                .map_err(Fault::Io)?;
            return Ok(self.buffer.len() == before);
        }
        Ok(false)
    }
}

/// Cuts at line ends into blocks of at least `least` bytes (the last may be shorter).
fn split_at_lines(mut bytes: &[u8], least: usize) -> Vec<&[u8]> {
    let mut blocks = Vec::new();
    while bytes.len() > least {
        let cut = memchr::memchr(b'\n', &bytes[least..]).map_or(bytes.len(), |p| least + p + 1);
        let (block, rest) = bytes.split_at(cut);
        blocks.push(block);
        bytes = rest;
    }
    if !bytes.is_empty() {
        blocks.push(bytes);
    }
    blocks
}
