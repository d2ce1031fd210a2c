//! Bytes for the targets of [`crate::fuzz`], without coverage: each number has its own, on any machine.
use crate::fuzz::Target;
use rand::{Rng, RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;

/// Most bytes made up.
const LONGEST: usize = 1500;

/// Makes up bytes for a target.
pub struct Noise {
    seeds: Vec<Vec<u8>>,
    /// Its bytes are a conversation.
    talks: bool,
}

impl Noise {
    /// For this target.
    pub fn new(target: &Target) -> Self {
        Self {
            seeds: (target.seeds)(),
            talks: matches!(target.name, "server" | "motion"),
        }
    }

    /// The bytes of one execution: a seed of the target with some of it changed, cut, repeated, or nothing but noise.
    pub fn bytes(&self, seed: u64) -> Vec<u8> {
        let (seeds, mut random) = (&self.seeds, ChaCha8Rng::seed_from_u64(seed));
        let mut bytes = match random.random_range(0..8_u8) {
            0 => vec![0; random.random_range(0..200)],
            _ => seeds[random.random_range(0..seeds.len())].clone(),
        };
        if bytes.iter().all(|byte| *byte == 0) {
            random.fill_bytes(&mut bytes);
        }
        for _ in 0..random.random_range(0..6_u8) {
            let at = random.random_range(0..=bytes.len());
            match random.random_range(0..6_u8) {
                0 => bytes.truncate(at),
                1 => bytes.insert(at, random.random()),
                2 => bytes.extend_from_within(..at),
                3 => bytes.extend_from_slice(&seeds[random.random_range(0..seeds.len())]),
                _ => {
                    if let Some(byte) = bytes.get_mut(at) {
                        *byte = if random.random() {
                            random.random()
                        } else {
                            *byte ^ 1 << random.random_range(0..8_u8)
                        };
                    }
                }
            }
        }
        if self.talks {
            // Steps of a conversation are short: more of them.
            let more = random.random_range(0..24_usize);
            bytes.extend((0..more).map(|_| random.random::<u8>()));
            bytes.truncate(80);
        }
        bytes.truncate(LONGEST);
        bytes
    }
}
