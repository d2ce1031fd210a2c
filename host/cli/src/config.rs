//! `giotto config`: the limits that a controller keeps.
use super::port::PortArgs;
use super::{Failure, Output};
use giotto_link::{Controller, ControllerError};
use giotto_shared::path::MAX_POSITION_M;
use giotto_shared::wire::{Command, ConfigField, MachineConfig, Refusal, STEP_MOST, TICK_HZ};
use serde_json::{Map, Value, json};

/// Arguments of `giotto config`.
#[derive(clap::Args, Debug)]
pub struct Args {
    #[command(subcommand)]
    what: Verb,
}

#[derive(clap::Subcommand, Debug)]
enum Verb {
    /// The limits in use.
    Get {
        #[command(flatten)]
        port: PortArgs,
    },
    /// Uses other limits from now on, until the next start unless they are saved.
    Set {
        /// NAME=VALUE, as `get` shows them; soft limits as NAME=LEAST,MOST.
        #[arg(required = true, value_name = "NAME=VALUE")]
        values: Vec<String>,
        #[command(flatten)]
        port: PortArgs,
    },
    /// Stores the limits in use.
    Save {
        #[command(flatten)]
        port: PortArgs,
    },
}

/// A number of the configuration: its name, how many of its unit make one of the controller's, where it is, and what it is called
/// on the wire.
type Number = (
    &'static str,
    f64,
    fn(&mut MachineConfig) -> &mut f32,
    ConfigField,
);

const NUMBERS: [Number; 9] = [
    ("feed_mm_s", 1e-3, |c| &mut c.feed_m_s, ConfigField::Feed),
    (
        "acceleration_mm_s2",
        1e-3,
        |c| &mut c.acceleration_m_s2,
        ConfigField::Acceleration,
    ),
    ("jerk_mm_s3", 1e-3, |c| &mut c.jerk_m_s3, ConfigField::Jerk),
    (
        "positioning_mm_s",
        1e-3,
        |c| &mut c.positioning_m_s,
        ConfigField::Positioning,
    ),
    ("offset_mm", 1e-3, |c| &mut c.offset_m, ConfigField::Offset),
    (
        "offset_rate_x_mm_s",
        1e-3,
        |c| &mut c.slew_m_s[0],
        ConfigField::Slew,
    ),
    (
        "offset_rate_y_mm_s",
        1e-3,
        |c| &mut c.slew_m_s[1],
        ConfigField::Slew,
    ),
    (
        "offset_rate_z_mm_s",
        1e-3,
        |c| &mut c.slew_m_s[2],
        ConfigField::Slew,
    ),
    (
        "stream_window_ms",
        1e-3,
        |c| &mut c.stream_window_s,
        ConfigField::Window,
    ),
];
const SOFT: [&str; 3] = ["soft_x_mm", "soft_y_mm", "soft_z_mm"];
const CLOCK: &str = "internal_clock";
const RATE: &str = "tick_hz";
const STEPS: [&str; 3] = ["step_x_mm", "step_y_mm", "step_z_mm"];
/// All rates of the offset at once.
const RATES: &str = "offset_rate_mm_s";

fn document(config: &MachineConfig) -> Map<String, Value> {
    let mut copy = *config;
    let mut all = Map::new();
    for (name, unit, place, _) in NUMBERS {
        // Single precision, shown to its digits.
        let value = f64::from(*place(&mut copy)) / unit;
        let digits = format!("{value:.6e}").parse::<f64>().unwrap_or(value);
        all.insert(name.to_owned(), json!(digits));
    }
    for (name, limits) in SOFT.into_iter().zip(config.soft_nm) {
        all.insert(
            name.to_owned(),
            json!(limits.map(|nm| f64::from(nm) * 1e-6)),
        );
    }
    all.insert(CLOCK.to_owned(), json!(config.internal_clock));
    all.insert(RATE.to_owned(), json!(config.tick_hz));
    for (name, [nm, steps]) in STEPS.into_iter().zip(config.step) {
        all.insert(name.to_owned(), json!([f64::from(nm) / 1e6, steps]));
    }
    all
}

fn change(config: &mut MachineConfig, text: &str) -> Result<(), Failure> {
    let names = || {
        let numbers = NUMBERS.iter().map(|(name, ..)| *name);
        let others = SOFT.into_iter().chain([CLOCK, RATE]).chain(STEPS);
        let all: Vec<&str> = numbers.chain(others).chain([RATES]).collect();
        all.join(", ")
    };
    let wrong = |what: &str| Failure::usage(format_args!("\"{text}\": {what}"));
    let (name, value) = text
        .split_once('=')
        .ok_or_else(|| wrong("expected NAME=VALUE").help(format_args!("names: {}", names())))?;
    let number = |text: &str| {
        let value = text
            .trim()
            .parse::<f64>()
            .ok()
            .filter(|value| value.is_finite());
        value.ok_or_else(|| wrong("expected a number"))
    };
    if let Some((_, unit, place, _)) = NUMBERS.iter().find(|(known, ..)| *known == name) {
        *place(config) = (number(value)? * unit) as f32;
    } else if let Some(axis) = SOFT.iter().position(|known| *known == name) {
        let (least, most) = value
            .split_once(',')
            .ok_or_else(|| wrong("expected LEAST,MOST in mm"))?;
        // Out of what an i32 can say saturates, and is refused by the controller.
        config.soft_nm[axis] = [number(least)?, number(most)?].map(|mm| (mm * 1e6).round() as i32);
    } else if name == CLOCK {
        config.internal_clock = value.parse().map_err(|_| wrong("expected true or false"))?;
    } else if name == RATES {
        config.slew_m_s = [(number(value)? * 1e-3) as f32; 3];
    } else if name == RATE {
        config.tick_hz = value
            .trim()
            .parse()
            .map_err(|_| wrong("expected a whole number"))?;
    } else if let Some(axis) = STEPS.iter().position(|known| *known == name) {
        config.step[axis] = step(value)
            .ok_or_else(|| wrong("expected MM,STEPS: so many mm (whole nm) in so many steps"))?;
    } else {
        return Err(wrong("no such limit").help(format_args!("names: {}", names())));
    }
    Ok(())
}

/// "MM,STEPS" as nanometres and steps without a common divisor.
fn step(text: &str) -> Option<[u32; 2]> {
    let (mm, steps) = text.split_once(',')?;
    let nm = mm.trim().parse::<f64>().ok()? * 1e6;
    let (whole, steps) = (nm.round(), steps.trim().parse::<u32>().ok()?);
    if !((nm - whole).abs() < 1e-3 && whole >= 1.0 && whole < f64::from(u32::MAX)) || steps == 0 {
        return None;
    }
    let (mut a, mut b) = (whole as u32, steps);
    while b > 0 {
        (a, b) = (b, a % b);
    }
    Some([whole as u32 / a, steps / a])
}

/// What a controller takes, in the user's units.
fn possible(field: ConfigField) -> String {
    let number = NUMBERS.iter().find(|(.., own)| *own == field);
    match (number, field.most()) {
        (Some((name, ..)), _) if field == ConfigField::Positioning => {
            format!("{name} may be above 0 and no more than {}", NUMBERS[0].0)
        }
        (Some((name, unit, ..)), Some(most)) => {
            format!("{name} may be above 0 and up to {}", most / unit)
        }
        _ if field == ConfigField::Rate => format!(
            "{RATE} may be {} to {}, as far as the board bears it: up to 8000 on the mps2_an386; on the stm32f405 up to 4000, \
             and 1,400,000 a multiple of it",
            TICK_HZ[0], TICK_HZ[1]
        ),
        _ if field == ConfigField::Step => format!(
            "steps are MM,STEPS: without a common divisor at most {:.6} mm and {STEP_MOST} steps",
            f64::from(STEP_MOST) * 1e-6
        ),
        _ => {
            let most = MAX_POSITION_M * 1e3;
            format!("soft limits are LEAST,MOST within -{most} to {most} mm, the smaller one first")
        }
    }
}

fn show(controller: &mut Controller, out: Output) -> Result<(), Failure> {
    let (config, stored) = controller.config()?;
    let all = document(&config);
    if out.json {
        return out
            .document(&json!({ "port": controller.port(), "stored": stored, "config": all }));
    }
    for (name, value) in all {
        let value = value.to_string();
        out.say(format_args!("{name} = {}", value.trim_matches(['[', ']'])));
    }
    let kept = if stored {
        "stored"
    } else {
        "not stored: gone after the next start"
    };
    out.say(format_args!("({kept})"));
    Ok(())
}

/// Runs the command.
pub fn run(args: Args, out: Output) -> Result<(), Failure> {
    match args.what {
        Verb::Get { port } => show(&mut port.open(out)?, out),
        Verb::Set { values, port } => {
            // What is no limit is said before a port is opened.
            let mut blank = MachineConfig {
                feed_m_s: 0.0,
                acceleration_m_s2: 0.0,
                jerk_m_s3: 0.0,
                positioning_m_s: 0.0,
                offset_m: 0.0,
                slew_m_s: [0.0; 3],
                stream_window_s: 0.0,
                soft_nm: [[0; 2]; 3],
                internal_clock: false,
                tick_hz: 0,
                step: [[0; 2]; 3],
            };
            values
                .iter()
                .try_for_each(|text| change(&mut blank, text))?;
            let mut controller = port.open(out)?;
            let (mut config, _) = controller.config()?;
            values
                .iter()
                .try_for_each(|text| change(&mut config, text))?;
            let told = controller.command(Command::Configure(config));
            told.map_err(|error| match error {
                ControllerError::Refused(Refusal::Config(field)) => {
                    Failure::controller(format_args!("{}: {error}", values.join(" ")))
                        .help(possible(field))
                }
                error => error.into(),
            })?;
            show(&mut controller, out)
        }
        Verb::Save { port } => {
            let mut controller = port.open(out)?;
            controller.command(Command::SaveConfig)?;
            show(&mut controller, out)?;
            let (config, _) = controller.config()?;
            if config.tick_hz != controller.identity().tick_hz {
                out.say("ticks and steps hold from the next start on: giotto reset --restart");
            }
            Ok(())
        }
    }
}
