//! The last gate before a drive: bounds on the offset between programmed and commanded position.

/// Bounds per axis and the offset that passed last.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct Guard {
    offset_nm: i32,
    slew_nm: i32,
    last_nm: [i32; 3],
}

/// What the gate had to do.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Default)]
pub(crate) struct Verdict {
    /// The offset was cut to its bound.
    pub(crate) offset_cut: bool,
    /// The change of the offset was cut to its bound.
    pub(crate) slew_cut: bool,
}

impl Guard {
    /// Bounds in nm and nm per tick.
    pub(crate) const fn new(offset_nm: i32, slew_nm: i32) -> Self {
        Self { offset_nm, slew_nm, last_nm: [0; 3] }
    }

    /// New bounds; the offset stays where it is.
    pub(crate) fn set(&mut self, offset_nm: i32, slew_nm: i32) {
        (self.offset_nm, self.slew_nm) = (offset_nm, slew_nm);
    }

    /// The offset that passed last, nm.
    #[cfg(test)]
    pub(crate) const fn last_nm(&self) -> [i32; 3] {
        self.last_nm
    }

    /// The offset that may go out, axis by axis.
    #[inline(always)]
    pub(crate) fn pass(&mut self, wanted: [i32; 3]) -> ([i32; 3], Verdict) {
        let [x, y, z] = wanted;
        let [lx, ly, lz] = self.last_nm;
        // One unsigned comparison an axis: −bound ≤ v ≤ bound.
        let within = |v: i32, bound: i32| (v.wrapping_add(bound) as u32) <= (bound as u32).wrapping_mul(2);
        let (o, s) = (self.offset_nm, self.slew_nm);
        let fine = within(x, o)
            & within(y, o)
            & within(z, o)
            & within(x.wrapping_sub(lx), s)
            & within(y.wrapping_sub(ly), s)
            & within(z.wrapping_sub(lz), s);
        if fine {
            self.last_nm = wanted;
            return (wanted, Verdict::default());
        }
        self.cut(wanted)
    }

    #[cold]
    #[inline(never)]
    fn cut(&mut self, wanted: [i32; 3]) -> ([i32; 3], Verdict) {
        let mut verdict = Verdict::default();
        let mut passed = [0; 3];
        for ((out, want), last) in passed.iter_mut().zip(wanted).zip(self.last_nm) {
            let bounded = want.max(self.offset_nm.wrapping_neg()).min(self.offset_nm);
            let change = bounded.saturating_sub(last);
            let slewed = change.max(self.slew_nm.wrapping_neg()).min(self.slew_nm);
            verdict.offset_cut |= bounded != want;
            verdict.slew_cut |= slewed != change;
            *out = last.wrapping_add(slewed);
        }
        self.last_nm = passed;
        (passed, verdict)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn nothing_passes_beyond_its_bounds_and_everything_within_passes_unchanged() {
        let mut guard = Guard::new(1000, 100);
        assert_eq!(guard.pass([100, -100, 0]), ([100, -100, 0], Verdict::default()));
        let (out, verdict) = guard.pass([i32::MAX, i32::MIN, 50]);
        assert_eq!(out, [200, -200, 50]);
        assert_eq!(verdict, Verdict { offset_cut: true, slew_cut: true });
        for _ in 0..50 {
            guard.pass([i32::MAX, i32::MIN, 50]);
        }
        assert_eq!(guard.last_nm(), [1000, -1000, 50]);
        assert_eq!(guard.pass([1000, -1000, 51]).1, Verdict::default());
        assert!(guard.pass([1001, -1000, 51]).1.offset_cut);
    }
}
