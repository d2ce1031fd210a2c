//! Set-points of a stream in few bytes: for each axis the change of the step from one to the next. At 1 kHz and 5 m/s² that
//! is two bytes, where the place itself takes five.
use super::Chunk;
use crate::encoding::{Writer, take};
use serde::Serialize;

/// How far a stream has come.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Steps {
    /// The newest set-point, nm.
    pub place_nm: [i32; 3],
    /// The step that led to it, nm.
    step_nm: [i32; 3],
}

impl Steps {
    /// At rest at a place.
    pub const fn from(place_nm: [i32; 3]) -> Self {
        Self {
            place_nm,
            step_nm: [0; 3],
        }
    }

    /// The step that led to the newest set-point, nm.
    pub const fn step_nm(&self) -> [i32; 3] {
        self.step_nm
    }

    /// Appends a set-point to a message; `false`: there is no room for it, and nothing has changed.
    pub fn write(&mut self, place_nm: [i32; 3], steps: &mut Chunk) -> bool {
        let (mut changes, mut step_nm) = ([0i32; 3], [0i32; 3]);
        for (axis, (change, step)) in changes.iter_mut().zip(&mut step_nm).enumerate() {
            *step = place_nm[axis].wrapping_sub(self.place_nm[axis]);
            *change = step.wrapping_sub(self.step_nm[axis]);
        }
        let mut bytes = [0; 15];
        let mut writer = Writer::new(&mut bytes);
        let written = changes.serialize(&mut writer).is_ok();
        let length = writer.length().filter(|_| written).unwrap_or(0);
        if steps
            .extend_from_slice(bytes.get(..length).unwrap_or(&[]))
            .is_err()
        {
            return false;
        }
        (self.place_nm, self.step_nm) = (place_nm, step_nm);
        true
    }

    /// Reads the next set-point; what is behind it, or `None` if the bytes are none.
    #[inline(never)]
    pub fn read<'a>(&mut self, mut bytes: &'a [u8]) -> Option<&'a [u8]> {
        for (place, step) in self.place_nm.iter_mut().zip(&mut self.step_nm) {
            let (change, rest) = take::<i32>(bytes)?;
            *step = step.wrapping_add(change);
            *place = place.wrapping_add(*step);
            bytes = rest;
        }
        Some(bytes)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    proptest! {
        #[test]
        fn what_was_written_is_read(places in proptest::collection::vec(any::<[i32; 3]>(), 1..30), start: [i32; 3]) {
            let (mut writer, mut reader) = (Steps::from(start), Steps::from(start));
            let mut chunk = Chunk::new();
            let fitting = places.iter().take_while(|&&place| writer.write(place, &mut chunk)).count();
            prop_assert!(fitting >= 8 || fitting == places.len());
            let mut rest = &chunk[..];
            for place in &places[..fitting] {
                rest = reader.read(rest).unwrap();
                prop_assert_eq!(reader.place_nm, *place);
            }
            prop_assert!(rest.is_empty());
            prop_assert_eq!(reader, writer);
        }
    }

    #[test]
    fn a_smooth_path_takes_two_bytes_an_axis() {
        let mut writer = Steps::from([0; 3]);
        let mut chunk = Chunk::new();
        // 5 m/s² in two axes, at 1 kHz.
        let places = (1..).map(|n: i32| [2500 * n * n, -2500 * n * n, 0]);
        assert_eq!(
            places
                .take_while(|&place| writer.write(place, &mut chunk))
                .count(),
            128 / 5
        );
    }
}
