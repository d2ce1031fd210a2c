//! A network in virtual time that loses, delays and reorders.
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use std::collections::BTreeMap;

/// Datagrams on their way, by the time they arrive, ns.
pub struct Net {
    rng: ChaCha8Rng,
    on_the_way: BTreeMap<(u64, u64), Vec<u8>>,
    count: u64,
    /// Share that is lost, and share that comes more than a cycle late.
    pub loss: f64,
    pub overtaken: f64,
    /// Jitter, share of a cycle.
    pub jitter: f64,
    cycle_s: f64,
    pub sent: u64,
    pub lost: u64,
}

impl Net {
    pub fn new(seed: u64, cycle_s: f64) -> Self {
        Self {
            rng: ChaCha8Rng::seed_from_u64(seed),
            on_the_way: BTreeMap::new(),
            count: 0,
            loss: 0.01,
            overtaken: 0.005,
            jitter: 0.4,
            cycle_s,
            sent: 0,
            lost: 0,
        }
    }

    pub fn send(&mut self, now_s: f64, bytes: Vec<u8>) {
        self.sent += 1;
        if self.rng.random::<f64>() < self.loss {
            self.lost += 1;
            return;
        }
        let mut delay = self.jitter * self.rng.random::<f64>() * self.cycle_s;
        if self.rng.random::<f64>() < self.overtaken {
            delay += self.cycle_s * (1.0 + 1.5 * self.rng.random::<f64>());
        }
        self.count += 1;
        let at = ((now_s + delay) * 1e9) as u64;
        self.on_the_way.insert((at, self.count), bytes);
    }

    /// What arrives until then, in order, with its time, s.
    pub fn arrived(&mut self, until_s: f64) -> Vec<(f64, Vec<u8>)> {
        let later = self.on_the_way.split_off(&((until_s * 1e9) as u64, 0));
        let now = std::mem::replace(&mut self.on_the_way, later);
        now.into_iter()
            .map(|((at, _), bytes)| (at as f64 * 1e-9, bytes))
            .collect()
    }
}
