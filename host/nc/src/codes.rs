//! What the G- and M-codes of LinuxCNC, Grbl, Fanuc, Haas, Marlin and their like do to the state of a program.
use super::state::{FeedMode, Plane};
use super::word::{CIP_TENTHS, UNKNOWN_TENTHS};

/// What a G-code does.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) enum G {
    /// G0 to G3, in tenths.
    Motion(i64),
    /// Another motion that stays in force: cycles, threads, splines. Axis words are its own.
    Cycle,
    /// No motion in force (G80).
    NoMotion,
    Plane(Plane),
    Inch(bool),
    /// G70 and G71: units of some controllers, cycles of others.
    DoubtfulUnit,
    Absolute(bool),
    AbsoluteCentres(bool),
    Feed(FeedMode),
    CutterCompensation(bool),
    /// Every block ends in a stop (G61, G61.1), or blocks may be blended again (G64).
    ExactStop(bool),
    /// This block ends in a stop (G9).
    StopsHere,
    /// Moves nothing and changes nothing that arcs need.
    Nothing,
    /// G4.
    Dwell,
    /// Tool length: the third axis has another number from here on.
    ToolLength,
    /// The tool's offset in all axes.
    ToolOffset,
    /// Coordinates count from elsewhere; axis words are its own.
    Frame,
    /// Coordinates count from elsewhere (G54), and axis words are in these.
    WorkOffset,
    /// G92: the axes that are named have another number; the others keep theirs.
    SetPosition,
    /// The machine goes elsewhere; axis words are its own.
    Away,
    /// A mode begins in which coordinates mean something else, up to its end.
    Opens(Mode),
    /// Its end.
    Closes(Mode),
    /// A program of the controller is run (G65).
    Macro,
    Unknown,
}

/// Modes in which the numbers of a block are not those of the path.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Mode {
    Polar,
    Scaling,
    Mirror,
    Rotation,
    ModalMacro,
    Cylinder,
}

/// What a G-code does, by its tenths and by whether axis words stand beside it; `printer` as for [`m`].
pub(super) fn g(tenths: i64, axes: bool, printer: bool) -> G {
    match tenths {
        0 | 10 | 20 | 30 | CIP_TENTHS => G::Motion(tenths),
        40 => G::Dwell,
        // G5.1 Q1, G05 P10000: look-ahead of Fanuc; with axis words splines of LinuxCNC.
        50..=53 if axes => G::Cycle,
        50 | 51 | 80 | 450 | 620 => G::Nothing,
        150 => G::Closes(Mode::Polar),
        90 => G::StopsHere,
        // G10 sets offsets, G11 ends that; a place of the machine may count from elsewhere.
        // Marlin: filament back and forth.
        100 | 110 if printer => G::Nothing,
        100 | 110 => G::Frame,
        160 => G::Opens(Mode::Polar),
        170 => G::Plane(Plane::Xy),
        180 => G::Plane(Plane::Zx),
        190 => G::Plane(Plane::Yz),
        200 => G::Inch(true),
        210 => G::Inch(false),
        700 | 710 => G::DoubtfulUnit,
        270 | 280 | 290 | 300 | 310..=314 | 360 | 370 | 382..=385 | 530 => G::Away,
        // The point that G28 and G30 go to.
        281 | 301 => G::Nothing,
        400 => G::CutterCompensation(false),
        410 | 411 | 420 | 421 => G::CutterCompensation(true),
        430 | 440 | 490 => G::ToolLength,
        // 43.4, 43.5: the tool's point is kept where it is; 43.1: an offset of all axes.
        434 | 435 => G::ToolLength,
        431 | 432 => G::ToolOffset,
        500 => G::Closes(Mode::Scaling),
        510 => G::Opens(Mode::Scaling),
        501 => G::Closes(Mode::Mirror),
        511 => G::Opens(Mode::Mirror),
        540..=593 | 1540 => G::WorkOffset,
        520 | 921..=923 => G::Frame,
        920 => G::SetPosition,
        610 | 611 => G::ExactStop(true),
        640 => G::ExactStop(false),
        650 => G::Macro,
        660 | 661 => G::Opens(Mode::ModalMacro),
        670 => G::Closes(Mode::ModalMacro),
        680 | 682 | 683 => G::Opens(Mode::Rotation),
        690 | 691 => G::Closes(Mode::Rotation),
        1071 | 1121 | 1120 => G::Opens(Mode::Cylinder),
        1130 | 1131 => G::Closes(Mode::Cylinder),
        330 | 331 | 730 | 740 | 760 | 810..=890 => G::Cycle,
        800 => G::NoMotion,
        900 => G::Absolute(true),
        910 => G::Absolute(false),
        901 => G::AbsoluteCentres(true),
        911 => G::AbsoluteCentres(false),
        930 => G::Feed(FeedMode::InverseTime),
        940 => G::Feed(FeedMode::PerMinute),
        950 => G::Feed(FeedMode::PerTurn),
        // Spindle, return levels, smoothness of Haas.
        70 | 960..=999 | 1030 | 1870 => G::Nothing,
        _ => G::Unknown,
    }
}

/// What a G-code of Siemens does that means something else, or nothing, to the others.
pub(super) fn siemens(tenths: i64) -> Option<G> {
    Some(match tenths {
        710 | 7100 => G::Inch(false),
        // The unit of places, and by G700 that of the feed as well.
        700 | 7000 => G::DoubtfulUnit,
        600 => G::ExactStop(true),
        6010 | 6020 | 6030 => G::Nothing,
        640 | 6410..=6450 => G::ExactStop(false),
        // At corners under cutter radius compensation.
        4500 | 4510 => G::Nothing,
        5000 | 5050..=5990 => G::WorkOffset,
        1530 => G::Away,
        _ => return None,
    })
}

/// What an M-code does.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum M {
    /// Spindle on, coolant on, outputs: acts where its block begins.
    AtStart,
    /// Acts at one end of its block or the other, as the controller has it; moves nothing.
    Nothing,
    /// The machine stands still at the end of the block (M0, M1, M60).
    Stops,
    /// M2, M30.
    Ends,
    /// The tool changes: the machine may have gone elsewhere.
    ToolChange,
    /// M98, M97.
    Call,
    /// M99.
    Return,
    /// M70, M73.
    SaveModes,
    /// M71.
    DropModes,
    /// M72.
    RestoreModes,
    /// M82, M83: what E counts from.
    AbsoluteExtruder(bool),
    Unknown,
}

/// What an M-code does, by its tenths; `printer` adds what Marlin and Klipper know.
pub(super) fn m(tenths: i64, printer: bool) -> M {
    match tenths {
        0 | 10 | 600 => M::Stops,
        20 | 300 => M::Ends,
        30 | 40 | 70 | 80 | 620 | 630 | 640 | 650 | 670 | 680 => M::AtStart,
        60 | 61 | 610 => M::ToolChange,
        970 | 980 => M::Call,
        990 => M::Return,
        700 | 730 => M::SaveModes,
        710 => M::DropModes,
        720 => M::RestoreModes,
        820 => M::AbsoluteExtruder(true),
        830 => M::AbsoluteExtruder(false),
        // A jump if an input is not set.
        960 => M::Unknown,
        0..=990 => M::Nothing,
        UNKNOWN_TENTHS => M::Unknown,
        // Home offsets, offsets of a second nozzle, steps of the bed.
        2060 | 2180 | 2900 | 4280 => M::Unknown,
        1000..=9999 if printer => M::Nothing,
        _ => M::Unknown,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn codes_that_move_nothing_are_known() {
        for tenths in [80, 51, 50, 1870, 960, 980, 281] {
            assert_eq!(g(tenths, false, false), G::Nothing, "{tenths}");
        }
        assert_eq!(g(150, false, false), G::Closes(Mode::Polar));
        assert_eq!(g(1540, false, false), G::WorkOffset);
        assert_eq!(g(434, false, false), G::ToolLength);
        assert_eq!(g(51, true, false), G::Cycle);
        assert_eq!(g(690, false, false), G::Closes(Mode::Rotation));
        assert_eq!(g(1234, false, false), G::Unknown);
        assert_eq!(g(UNKNOWN_TENTHS, false, false), G::Unknown);
    }

    #[test]
    fn siemens_has_its_own() {
        assert_eq!(siemens(710), Some(G::Inch(false)));
        assert_eq!(siemens(6420), Some(G::ExactStop(false)));
        assert_eq!(siemens(5070), Some(G::WorkOffset));
        assert_eq!(siemens(20), None);
    }

    #[test]
    fn user_codes_are_known_to_a_printer_only() {
        assert_eq!(m(1040, true), M::Nothing);
        assert_eq!(m(1040, false), M::Unknown);
        assert_eq!(m(660, false), M::Nothing);
        assert_eq!(m(640, false), M::AtStart);
    }
}
