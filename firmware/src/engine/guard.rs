//! The last gate before a drive: bounds on the offset between programmed and commanded position.

/// Bounds per axis and the offset that passed last.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct Guard {
    last_nm: [i32; 3],
    /// The largest powers of two not above the bounds: below them one comparison does for all axes.
    easy_offset_nm: u32,
    easy_slew_nm: u32,
    offset_nm: i32,
    slew_nm: [i32; 3],
}

/// The largest power of two not above a bound; 0 for 0.
const fn easy(bound: i32) -> u32 {
    if bound <= 0 {
        0
    } else {
        1 << (31 - bound.leading_zeros())
    }
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
    /// Bounds in nm, and by axis in nm per tick.
    pub(crate) const fn new(offset_nm: i32, slew_nm: [i32; 3]) -> Self {
        let [x, y, z] = slew_nm;
        let tighter = if x < y { x } else { y };
        let tightest = if tighter < z { tighter } else { z };
        let (easy_offset_nm, easy_slew_nm) = (easy(offset_nm), easy(tightest));
        Self {
            last_nm: [0; 3],
            easy_offset_nm,
            easy_slew_nm,
            offset_nm,
            slew_nm,
        }
    }

    /// New bounds; the offset stays where it is.
    pub(crate) fn set(&mut self, offset_nm: i32, slew_nm: [i32; 3]) {
        *self = Self {
            last_nm: self.last_nm,
            ..Self::new(offset_nm, slew_nm)
        };
    }

    /// While watched, nothing passes easily.
    pub(crate) fn watch(&mut self, watched: bool) {
        self.easy_offset_nm = if watched { 0 } else { easy(self.offset_nm) };
    }

    /// The offset that passed last, nm.
    #[cfg(test)]
    pub(crate) const fn last_nm(&self) -> [i32; 3] {
        self.last_nm
    }

    /// The offset is easily seen to be within its bound.
    #[inline(always)]
    fn small(&self, [x, y, z]: [i32; 3]) -> bool {
        // v or its ones' complement, whichever is not negative: below 2ⁿ if and only if −2ⁿ ≤ v < 2ⁿ.
        let size = |v: i32| (v ^ (v >> 31)) as u32;
        (size(x) | size(y) | size(z)) < self.easy_offset_nm
    }

    /// Lets the offset pass unchanged if that is easily seen to be within the bounds.
    #[inline(always)]
    pub(crate) fn pass_easily(&mut self, wanted: [i32; 3]) -> bool {
        let ([x, y, z], [lx, ly, lz]) = (wanted, self.last_nm);
        let size = |now: i32, last: i32| {
            let change = now.wrapping_sub(last);
            (change ^ (change >> 31)) as u32
        };
        let slew = size(x, lx) | size(y, ly) | size(z, lz);
        let easy = self.small(wanted) && slew < self.easy_slew_nm;
        if easy {
            self.last_nm = wanted;
        }
        easy
    }

    /// Joins the size of one axis' offset and that of its change to the others'. For ticks that make one axis after
    /// the other and keep the last offset themselves.
    #[inline(always)]
    pub(crate) fn weigh(wanted: i32, last: i32, (sizes, changes): (u32, u32)) -> (u32, u32) {
        let size = |v: i32| (v ^ (v >> 31)) as u32;
        (
            sizes | size(wanted),
            changes | size(wanted.wrapping_sub(last)),
        )
    }

    /// Whether offsets and changes are easily seen to be within the bounds.
    #[inline(always)]
    pub(crate) fn easy(&self, (sizes, changes): (u32, u32)) -> bool {
        sizes < self.easy_offset_nm && changes < self.easy_slew_nm
    }

    /// [`Self::pass`] after an offset that was not kept here.
    pub(crate) fn pass_after(&mut self, last: [i32; 3], wanted: [i32; 3]) -> ([i32; 3], Verdict) {
        self.last_nm = last;
        self.pass(wanted)
    }

    /// The offset that may go out, axis by axis.
    pub(crate) fn pass(&mut self, wanted: [i32; 3]) -> ([i32; 3], Verdict) {
        let (most, [fx, fy, fz]) = (self.offset_nm, self.slew_nm);
        let (mut offset_cut, mut slew_cut) = (0, 0);
        let mut axis = |want: i32, last: i32, fastest: i32| {
            let bounded = want.max(most.wrapping_neg()).min(most);
            let change = bounded.saturating_sub(last);
            let slewed = change.max(fastest.wrapping_neg()).min(fastest);
            offset_cut |= bounded ^ want;
            slew_cut |= slewed ^ change;
            last.wrapping_add(slewed)
        };
        let ([x, y, z], [lx, ly, lz]) = (wanted, self.last_nm);
        let passed = [axis(x, lx, fx), axis(y, ly, fy), axis(z, lz, fz)];
        let verdict = Verdict {
            offset_cut: offset_cut != 0,
            slew_cut: slew_cut != 0,
        };
        self.last_nm = passed;
        (passed, verdict)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_passes_easily_is_within_the_bounds() {
        for v in [0, 511, -512, 512, -513, 1000, -1000, i32::MAX, i32::MIN] {
            let mut guard = Guard::new(1000, [i32::MAX; 3]);
            let weights = [0, v, 0]
                .into_iter()
                .fold((0, 0), |w, v| Guard::weigh(v, 0, w));
            let weighed = guard.easy(weights);
            let easy = guard.pass_easily([0, v, 0]);
            assert_eq!(weighed, easy);
            assert_eq!(easy, (-512..512).contains(&v), "{v}");
            assert_eq!(guard.last_nm()[1], if easy { v } else { 0 });
        }
        assert!(!Guard::new(0, [0; 3]).pass_easily([0; 3]));
    }

    #[test]
    fn nothing_passes_beyond_its_bounds_and_everything_within_passes_unchanged() {
        let mut guard = Guard::new(1000, [100; 3]);
        assert_eq!(
            guard.pass([100, -100, 0]),
            ([100, -100, 0], Verdict::default())
        );
        let (out, verdict) = guard.pass([i32::MAX, i32::MIN, 50]);
        assert_eq!(out, [200, -200, 50]);
        assert_eq!(
            verdict,
            Verdict {
                offset_cut: true,
                slew_cut: true
            }
        );
        for _ in 0..50 {
            guard.pass([i32::MAX, i32::MIN, 50]);
        }
        assert_eq!(guard.last_nm(), [1000, -1000, 50]);
        assert_eq!(guard.pass([1000, -1000, 51]).1, Verdict::default());
        assert!(guard.pass([1001, -1000, 51]).1.offset_cut);
    }

    /// Each axis has its own rate, and the tightest one says what passes easily.
    #[test]
    fn an_axis_is_as_slow_as_it_has_to_be() {
        for slow in 0..3 {
            let mut slew_nm = [1000; 3];
            slew_nm[slow] = 100;
            let mut guard = Guard::new(10_000, slew_nm);
            let (out, verdict) = guard.pass([700; 3]);
            let mut expected = [700; 3];
            expected[slow] = 100;
            assert_eq!(out, expected);
            assert!(verdict.slew_cut);
            assert!(!guard.pass_easily([764; 3]));
            assert!(guard.pass_easily(core::array::from_fn(|k| expected[k] + 63)));
        }
    }
}
