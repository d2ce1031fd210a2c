//! Slots and confirmations: a flash in a file.
use super::page::Page;
use crate::virtual_controller::{Flash, LAYOUT};
use giotto::whole_file;
use giotto_firmware::store::{ImageBuffer, Store};
use giotto_shared::table::MAX_IMAGE_BYTES;
use std::io;
use std::path::{Path, PathBuf};

/// Where they are kept.
#[derive(Debug)]
pub(super) struct Kept {
    /// The flash.
    file: PathBuf,
    /// The table that LinuxCNC loads; `None`: none was named, and all is forgotten when LinuxCNC ends.
    table: Option<PathBuf>,
    flash: Flash,
    /// CRC of the table that `table` holds.
    crc: u32,
}

impl Kept {
    /// Opens the store of a component. The table that it was loaded with is confirmed there: it is what boots.
    pub(super) fn open(page: &Page) -> io::Result<(Self, Flash)> {
        let table = page.path()?;
        let file = match &table {
            Some(path) => {
                let mut name = path.clone().into_os_string();
                name.push(".store");
                PathBuf::from(name)
            }
            None => {
                forget_the_dead();
                PathBuf::from(format!("{MEMORY}{PREFIX}{}{SUFFIX}", page.process()?))
            }
        };
        let mut flash = Flash::new();
        if let Ok(bytes) = std::fs::read(&file)
            && bytes.len() == flash.bytes_mut().len()
        {
            flash.bytes_mut().copy_from_slice(&bytes);
        }
        let crc = page.crc()?;
        let flash = confirm(flash, crc, &page.image()?);
        let mut kept = Self {
            file,
            table,
            flash: Flash::new(),
            crc,
        };
        kept.write(&flash)?;
        Ok((kept, flash))
    }

    /// Writes what has changed.
    pub(super) fn keep(&mut self, store: &mut Store<Flash>, active: Option<u8>) -> io::Result<()> {
        if *store.flash_mut() == self.flash {
            return Ok(());
        }
        let flash = store.flash_mut().clone();
        self.write(&flash)?;
        let boots = store.confirmed().into_iter().flatten().next();
        let Some(slot) = boots.filter(|slot| Some(*slot) == active) else {
            return Ok(());
        };
        let mut buffer: Box<ImageBuffer> = Box::new([0; MAX_IMAGE_BYTES]);
        let crc = store.table(slot).map_or(0, |info| info.crc);
        if crc != self.crc
            && let (Some(path), Ok(image)) = (&self.table, store.load(slot, &mut buffer))
        {
            whole_file::write(path, image)?;
            self.crc = crc;
        }
        Ok(())
    }

    fn write(&mut self, flash: &Flash) -> io::Result<()> {
        let mut flash = flash.clone();
        whole_file::write(&self.file, flash.bytes_mut())?;
        self.flash = flash;
        Ok(())
    }
}

/// Where a store is kept that is forgotten with its LinuxCNC.
const MEMORY: &str = "/dev/shm/";
const PREFIX: &str = "giotto-linuxcnc.";
const SUFFIX: &str = ".store";

/// Takes away the stores of those LinuxCNCs that have ended.
fn forget_the_dead() {
    for entry in std::fs::read_dir(MEMORY).into_iter().flatten().flatten() {
        let name = entry.file_name();
        let process = name
            .to_str()
            .and_then(|name| name.strip_prefix(PREFIX)?.strip_suffix(SUFFIX));
        let process = process.and_then(|process| process.parse::<u32>().ok());
        if process.is_some_and(|process| !Path::new(&format!("/proc/{process}")).exists()) {
            // One that belongs to somebody else stays.
            let _ = std::fs::remove_file(entry.path());
        }
    }
}

/// The flash with this table as the one that boots.
fn confirm(flash: Flash, crc: u32, image: &[u8]) -> Flash {
    let mut buffer: Box<ImageBuffer> = Box::new([0; MAX_IMAGE_BYTES]);
    let mut store = Store::open(flash, LAYOUT, &mut buffer);
    let boots = store.confirmed().into_iter().flatten().next();
    let in_slot = |slot: Option<u8>| slot.and_then(|slot| store.table(slot)).map(|info| info.crc);
    if crc == 0 || in_slot(boots) == Some(crc) {
        return store.into_flash();
    }
    let slot = if boots == Some(0) { 1 } else { 0 };
    if let Some(place) = buffer.get_mut(..image.len()) {
        place.copy_from_slice(image);
        // In memory neither fails; if one did, the table would not be in the store, and go on being used.
        let _ = store
            .write(slot, image.len(), &mut buffer)
            .and_then(|()| store.confirm(slot, false, &mut buffer));
    }
    store.into_flash()
}
