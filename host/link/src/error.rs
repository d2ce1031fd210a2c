//! What can go wrong between host and controller, and what to do about it.
use giotto_shared::path::PathError;
use giotto_shared::table::TableError;
use giotto_shared::wire::{MotionRefusal, Refusal};
use std::path::PathBuf;
use std::time::Duration;

/// Why the controller did not do what it was asked.
#[derive(Debug, thiserror::Error)]
pub enum ControllerError {
    /// No such device.
    #[error("{port}: no such port")]
    NoPort {
        /// The port.
        port: String,
    },
    /// Someone else has it open.
    #[error("{port}: port is in use by another program")]
    InUse {
        /// The port.
        port: String,
    },
    /// It exists but is no serial device, or the system does not let us.
    #[error("{port}: cannot open: {reason}")]
    CannotOpen {
        /// The port.
        port: String,
        /// The system's words.
        reason: String,
    },
    /// Nothing came back.
    #[error("{port}: no answer from a controller within {:.1} s", waited.as_secs_f64())]
    NoAnswer {
        /// The port.
        port: String,
        /// How long.
        waited: Duration,
    },
    /// The device failed, or went away.
    #[error("{port}: connection lost: {reason}")]
    Lost {
        /// The port.
        port: String,
        /// The system's words.
        reason: String,
    },
    /// It answers, but speaks another version.
    #[error("{port}: controller speaks protocol {theirs}, this giotto {ours}")]
    OtherProtocol {
        /// The port.
        port: String,
        /// Version of the controller.
        theirs: u16,
        /// Version of this build.
        ours: u16,
    },
    /// It answers, but its tables mean something else.
    #[error("{port}: controller's table schema is {theirs:08x}, this giotto's {ours:08x}")]
    OtherSchema {
        /// The port.
        port: String,
        /// Hash of the controller.
        theirs: u32,
        /// Hash of this build.
        ours: u32,
    },
    /// It answers, and says no.
    #[error("refused by the controller: {0}")]
    Refused(Refusal),
    /// An answer that does not fit the request: a defect.
    #[error("the controller's answer does not fit the request")]
    WrongReply,
    /// The slot does not read back as written.
    #[error("slot {slot} of the controller does not read back as written, from byte {offset} on")]
    ReadBack {
        /// The slot.
        slot: u8,
        /// First byte that differs.
        offset: usize,
    },
    /// A path that no controller could be told.
    #[error("{0}")]
    Path(#[from] PathError),
    /// The table itself is wrong.
    #[error("{0}")]
    Table(#[from] TableError),
    /// The controller ran out of set-points.
    #[error("the controller ran out of set-points, {missing} ticks without one, and came to rest")]
    Starved {
        /// Ticks for which none had come.
        missing: u32,
    },
    /// The person here stopped the run.
    #[error("stopped")]
    Stopped,
    /// Set-points were lost on the way.
    #[error("{lost} set-points of the run were lost on the way")]
    SetPointsLost {
        /// How many.
        lost: usize,
    },
    /// No LinuxCNC with the component runs here.
    #[error("linuxcnc: no LinuxCNC that has loaded giotto runs on this computer: {reason}")]
    NoComponent {
        /// What was looked for, and what was found.
        reason: String,
    },
    /// LinuxCNC does not run a program.
    #[error("linuxcnc: {reason}")]
    NoProgram {
        /// What it says.
        reason: String,
    },
    /// No emulator.
    #[error("{program} is not installed")]
    NoEmulator {
        /// Its name.
        program: String,
    },
    /// The emulator did not start.
    #[error("the emulator did not start: {reason}")]
    Emulator {
        /// Its words.
        reason: String,
    },
    /// No image, and none could be built.
    #[error("no firmware image at {}: {reason}", path.display())]
    NoImage {
        /// Where it should be.
        path: PathBuf,
        /// Why it could not be built.
        reason: String,
    },
}

impl ControllerError {
    /// What to do next.
    pub fn help(&self) -> Option<&'static str> {
        Some(match self {
            Self::NoPort { .. } | Self::CannotOpen { .. } => {
                "name a serial device such as /dev/ttyUSB0, `sim`, or `qemu`; \
                 `giotto controller sim` starts a virtual controller and prints its port"
            }
            Self::NoComponent { .. } => {
                "start LinuxCNC with `loadrt giotto joints=3` and `addf giotto.update servo-thread` in its HAL file, as the \
                 user who runs this; the guide's page on LinuxCNC has the lines"
            }
            Self::NoProgram { .. } => {
                "nothing moves any more; LinuxCNC has to be on, homed and idle, and run by the user who runs this"
            }
            Self::InUse { .. } => "close the other program, or wait until it is done",
            Self::NoAnswer { .. } | Self::Lost { .. } => {
                "check power, cable and that the port is the controller's; the table in use is untouched"
            }
            Self::OtherProtocol { .. } | Self::OtherSchema { .. } => {
                "use the giotto and the firmware of the same release"
            }
            Self::Refused(refusal) => return refusal_help(refusal),
            Self::Path(_) => "choose numbers inside what is possible",
            Self::ReadBack { .. } => {
                "the table in use is untouched; flash again, and replace worn flash"
            }
            Self::Table(TableError::NewerVersion { .. }) => {
                "use the giotto that wrote it, or a newer one"
            }
            Self::Table(_) => "make the table anew with `giotto table MODEL.toml -o TABLE.bin`",
            Self::Starved { .. } => {
                "`giotto reset` clears the fault; stream over a faster port, from a less busy computer"
            }
            Self::SetPointsLost { .. } => "run again; a shorter run or a faster port loses less",
            Self::NoEmulator { .. } => {
                "apt-get install --no-install-recommends qemu-system-arm (or run .ci/setup), or use --port sim"
            }
            Self::Emulator { .. } | Self::NoImage { .. } => {
                "run .ci/setup once, or give an image with --image PATH, or use --port sim"
            }
            Self::WrongReply | Self::Stopped => return None,
        })
    }
}

fn refusal_help(refusal: &Refusal) -> Option<&'static str> {
    Some(match refusal {
        Refusal::Busy | Refusal::Motion(MotionRefusal::Busy) => {
            "wait for the end of the run; `giotto status` shows it"
        }
        Refusal::ProbationOver => "flash the table again (which confirms it), or `giotto rollback`",
        Refusal::NothingToRollBack => "`giotto bypass on` switches the correction off",
        Refusal::NoTable => "flash a table first",
        Refusal::Motion(MotionRefusal::OutOfBounds { .. }) => {
            "choose a radius and feed inside the bounds"
        }
        Refusal::Flash(_) => "the table in use is untouched; flash again, and replace worn flash",
        Refusal::Table(TableError::Unsigned | TableError::Unbound | TableError::BadSignature) => {
            "sign it with the key of this controller: `giotto flash TABLE --key FILE`"
        }
        Refusal::Table(TableError::OtherMachine) => {
            "sign it for this one: `giotto flash TABLE --key FILE`, or `giotto key sign` with the machine that `giotto key show` says"
        }
        Refusal::Table(TableError::OldSerial { .. }) => {
            "sign it again, which gives it a higher serial: `giotto flash TABLE --key FILE`; `giotto rollback` returns to the table in the other slot"
        }
        Refusal::KeyProvisioned => "its owner hands it on: `giotto key replace OLD NEW`",
        Refusal::KeyLost => {
            "give it its key again: `giotto key provision FILE`, with the key that a table on it is signed with"
        }
        Refusal::NoKey => "give it its first one: `giotto key provision FILE`",
        Refusal::NotTheOwner => {
            "use the key that the controller has; `giotto key show` says its public half, or that it is lost"
        }
        Refusal::NoSignatures => "build the firmware with its feature `signed`",
        Refusal::Motion(MotionRefusal::NoPosition) => {
            "`giotto reset --at X,Y,Z` says where it stands, mm; a stream begins where its first set-point is"
        }
        Refusal::Motion(MotionRefusal::NoRoomToStop) => {
            "slow the path down before it nears 2.1 m from the machine's origin"
        }
        Refusal::Motion(MotionRefusal::StopInput) => "release the stop input",
        Refusal::Motion(MotionRefusal::Fault) => {
            "`giotto status` names the fault, `giotto reset` clears it"
        }
        Refusal::NotUnderstood => "use the giotto and the firmware of the same release",
        _ => return None,
    })
}
