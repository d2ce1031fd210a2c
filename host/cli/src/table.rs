//! `giotto table`: model to controller table, and back to words.
use super::destination::{Destination, Kind};
use super::table_file::{self, TableFile};
use super::{Failure, Output};
use giotto::units::number;
use giotto_link::signing::hex;
use giotto_shared::model::Cumulants;
use giotto_shared::table::{Header, SCHEMA_HASH, Table, Travel, image};
use giotto_shared::term::Term;
use giotto_shared::{Actuator, Plane};
use serde_json::json;
use std::path::PathBuf;

/// Arguments of `giotto table`.
#[derive(clap::Args, Debug)]
#[command(args_conflicts_with_subcommands = true)]
pub struct Args {
    #[command(subcommand)]
    command: Option<Show>,
    /// Model to make the table of.
    #[arg(required = true)]
    model: Option<PathBuf>,
    /// Where to write the table.
    #[arg(short, long, value_name = "TABLE.bin", required = true)]
    output: Option<PathBuf>,
}

#[derive(clap::Subcommand, Debug)]
enum Show {
    /// A table in words.
    Show {
        /// The table.
        table: PathBuf,
    },
}

/// Runs the command.
pub fn run(args: Args, out: Output) -> Result<(), Failure> {
    match (args.command, args.model, args.output) {
        (Some(Show::Show { table }), ..) => show(&table_file::read(&table, out)?, out),
        (None, Some(model), Some(output)) => {
            let place = Destination::new(&output, Kind::Table, &[&model])?;
            let made = table_file::from_model(&model, out)?;
            place.write(&made.image)?;
            if out.json {
                return out.document(&json!({ "table": output, "bytes": made.image.len() }));
            }
            out.say(format_args!(
                "{}: {} bytes",
                output.display(),
                made.image.len()
            ));
            Ok(())
        }
        _ => Err(Failure::usage(
            "giotto table needs MODEL.toml and -o TABLE.bin, or giotto table show TABLE.bin",
        )),
    }
}

fn show(file: &TableFile, out: Output) -> Result<(), Failure> {
    let TableFile { table, image } = file;
    let header = Header::read(image).map_err(Failure::input)?;
    let signed = header.flags & image::FLAG_SIGNED != 0;
    let bound = image::binding(image);
    let signature = match bound {
        Some(bound) => format!(
            "signed for machine {}, serial {}",
            hex(&bound.machine),
            bound.serial
        ),
        None if signed => "signed, for no machine in particular".to_owned(),
        None => "not signed".to_owned(),
    };
    if out.json {
        return out.document(&json!({
            "format": header.version,
            "schema": format!("{SCHEMA_HASH:08x}"),
            "crc": format!("{:08x}", header.crc),
            "bytes": image.len(),
            "signed": signed,
            "machine": bound.map(|bound| hex(&bound.machine)),
            "serial": bound.map(|bound| bound.serial),
            "table": table,
        }));
    }
    out.say(format_args!(
        "table of {} for \"{}\", format {}, schema {SCHEMA_HASH:08x}, CRC {:08x}, {}",
        bytes(image.len()),
        table.machine,
        header.version,
        header.crc,
        signature,
    ));
    words(table, out);
    Ok(())
}

fn bytes(count: usize) -> String {
    format!("{count} bytes")
}

fn words(table: &Table, out: Output) {
    let mm = |metres: f32| number(f64::from(metres) * 1e3);
    out.tell(
        0,
        format_args!(
            "No correction is larger than {} mm or changes faster than {} mm/s.",
            mm(table.limits.offset_m),
            mm(table.limits.slew_m_s)
        ),
    );
    for (at, zone) in table.zones.iter().enumerate() {
        let ([r0, r1], [f0, f1]) = (zone.radius_m.map(mm), zone.feed_m_s.map(mm));
        let travel = match zone.travel {
            Travel::Both => "both directions",
            Travel::Ccw => "counter-clockwise",
            Travel::Cw => "clockwise",
        };
        let place = match zone.place_m {
            Some([lo, hi]) => format!(
                "centre from {} to {} mm",
                lo.map(mm).join(" "),
                hi.map(mm).join(" ")
            ),
            None => "any place".to_owned(),
        };
        out.tell(
            0,
            format_args!(
                "Zone {}: radius {r0} to {r1} mm, feed {f0} to {f1} mm/s, {travel}, {place}",
                at + 1
            ),
        );
        out.tell(2, response(&zone.cumulants));
        for term in &zone.terms {
            out.tell(2, in_words(term));
        }
    }
}

/// The shared response: what it does to a circle, and its cumulants.
fn response(cumulants: &Cumulants<f32>) -> String {
    let [k2, k4] = [cumulants.kappa2_s2, cumulants.kappa4_s4].map(f64::from);
    let what = if k2 > 0.0 {
        format!(
            "response as of a lag with kv {} /s: circles shrink by {} µm for each m/s² of f²/R",
            number(k2.powf(-0.5)),
            number(0.5e6 * k2)
        )
    } else if k2 < 0.0 {
        format!(
            "response that swings out: circles grow by {} µm for each m/s² of f²/R",
            number(-0.5e6 * k2)
        )
    } else {
        "no response of the servo".to_owned()
    };
    format!(
        "{what} (κ2 {} ms², κ4 {} 10⁻⁶ s⁴)",
        number(k2 * 1e6),
        number(k4 * 1e6)
    )
}

/// Of a pair the one with more first: words follow the sign.
fn larger_first(pair: [String; 2], value: f32) -> ([String; 2], f32) {
    let [a, b] = pair;
    if value < 0.0 {
        ([b, a], -value)
    } else {
        ([a, b], value)
    }
}

/// A difference of two slides as a person says it; `None` for another term.
fn of_pair(term: &Term<f32>) -> Option<String> {
    let n = |value: f32, factor: f64| number(f64::from(value) * factor);
    let pair = |plane: Plane| plane.axes().map(|axis| axis.name().to_uppercase());
    Some(match *term {
        Term::ScaleMismatch { plane, relative } => {
            let ([a, b], size) = larger_first(pair(plane), relative);
            format!(
                "scale mismatch, {a} longer than {b} by {} µm/m",
                n(size, 1e6)
            )
        }
        Term::Squareness { plane, shear_rad } => {
            let [a, b] = pair(plane);
            let side = if shear_rad < 0.0 { "over" } else { "under" };
            let size = n(shear_rad.abs(), 1e6);
            format!("squareness, the angle between {a} and {b} is {size} µm/m {side} 90°")
        }
        Term::ServoMismatch { plane, delta_tau_s } => {
            let ([a, b], size) = larger_first(pair(plane), delta_tau_s);
            format!(
                "servo mismatch, {a} follows {} µs later than {b}",
                n(size, 1e6)
            )
        }
        Term::BandwidthMismatch {
            plane,
            delta_kappa2_s2,
        } => {
            let ([a, b], size) = larger_first(pair(plane), delta_kappa2_s2);
            let size = n(size, 1e6);
            format!("bandwidth mismatch, {a} rounds off its motion more than {b}: κ2 by {size} ms²")
        }
        _ => return None,
    })
}

/// A term as a person says it; what stands in the table is the machine's error, the controller does the opposite.
fn in_words(term: &Term<f32>) -> String {
    let n = |value: f32, factor: f64| number(f64::from(value) * factor);
    let of = |actuator: Actuator| actuator.name().to_uppercase();
    match *term {
        Term::RadiusOffset { offset_m } => format!("radius offset {} µm", n(offset_m, 1e6)),
        Term::ScaleError { relative } => format!("scale error {} µm/m", n(relative, 1e6)),
        Term::AxisScale { actuator, relative } => {
            format!("scale error of {} {} µm/m", of(actuator), n(relative, 1e6))
        }
        Term::ScaleMismatch { .. }
        | Term::Squareness { .. }
        | Term::ServoMismatch { .. }
        | Term::BandwidthMismatch { .. } => of_pair(term).unwrap_or_default(),
        Term::Backlash { actuator, step_m } => {
            format!("backlash of {} {} µm", of(actuator), n(step_m, 1e6))
        }
        Term::LateralPlay {
            actuator,
            across,
            shift_m,
        } => format!(
            "lateral play along {} with the travel of {} {} µm",
            of(across),
            of(actuator),
            n(shift_m, 1e6)
        ),
        Term::ReversalSpike {
            actuator,
            peak_m,
            decay_s,
        } => format!(
            "reversal spike of {} {} µm, dying away in {} ms",
            of(actuator),
            n(peak_m, 1e6),
            n(decay_s, 1e3)
        ),
        Term::Cyclic {
            actuator,
            amplitude_m,
            pitch_m,
            phase_rad,
        } => format!(
            "cyclic error of {} {} µm, pitch {} mm, phase {}°",
            of(actuator),
            n(amplitude_m, 1e6),
            n(pitch_m, 1e3),
            n(phase_rad.to_degrees(), 1.0)
        ),
        Term::Straightness {
            actuator,
            across,
            curvature_per_m,
        } => format!(
            "bow of the guide of {} along {}: {} µm over ±100 mm",
            of(actuator),
            of(across),
            n(curvature_per_m, 1e4)
        ),
        _ => of_joint(term).unwrap_or_default(),
    }
}

/// A term of an arm as a person says it; `None` for another term.
fn of_joint(term: &Term<f32>) -> Option<String> {
    let n = |value: f32, factor: f64| number(f64::from(value) * factor);
    Some(match *term {
        Term::JointLag {
            actuator,
            delta_tau_s,
            delta_kappa2_s2,
        } => format!(
            "{actuator} follows {} µs later than the others and rounds off its motion more: κ2 by {} ms²",
            n(delta_tau_s, 1e6),
            n(delta_kappa2_s2, 1e6)
        ),
        Term::JointBacklash {
            actuator, play_rad, ..
        } => {
            format!("play in the gear of {actuator} {} mrad", n(play_rad, 1e3))
        }
        Term::JointReversal {
            actuator,
            peak_rad,
            decay_s,
            ..
        } => format!(
            "reversal spike of {actuator} {} mrad, dying away in {} ms",
            n(peak_rad, 1e3),
            n(decay_s, 1e3)
        ),
        Term::JointCyclic {
            actuator,
            amplitude_rad,
            waves,
            phase_rad,
        } => format!(
            "gear of {actuator} {} mrad, {} waves a turn, phase {}°",
            n(amplitude_rad, 1e3),
            n(waves, 1.0),
            n(phase_rad.to_degrees(), 1.0)
        ),
        Term::JointZero {
            actuator,
            offset_rad,
        } => format!("zero of {actuator} off by {} mrad", n(offset_rad, 1e3)),
        Term::LinkLength { actuator, longer_m } => {
            format!("link behind {actuator} longer by {} mm", n(longer_m, 1e3))
        }
        _ => return None,
    })
}
