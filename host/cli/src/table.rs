//! `giotto table`: model to controller table, and back to words.
use super::destination::{Destination, Kind};
use super::table_file::{self, TableFile};
use super::{Failure, Output};
use giotto_shared::table::{Header, SCHEMA_HASH, Table, image};
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
            "giotto table needs MODEL.toml and -o TABLE.bin, or `show TABLE.bin`",
        )),
    }
}

fn show(file: &TableFile, out: Output) -> Result<(), Failure> {
    let TableFile { table, image } = file;
    let header = Header::read(image).map_err(Failure::input)?;
    let signed = header.flags & image::FLAG_SIGNED != 0;
    if out.json {
        return out.document(&json!({
            "format": header.version,
            "schema": format!("{SCHEMA_HASH:08x}"),
            "crc": format!("{:08x}", header.crc),
            "bytes": image.len(),
            "signed": signed,
            "table": table,
        }));
    }
    out.say(format_args!(
        "table of {} for \"{}\", format {}, schema {SCHEMA_HASH:08x}, CRC {:08x}, {}",
        bytes(image.len()),
        table.machine,
        header.version,
        header.crc,
        if signed { "signed" } else { "not signed" },
    ));
    words(table, out);
    Ok(())
}

fn bytes(count: usize) -> String {
    format!("{count} bytes")
}

fn words(table: &Table, out: Output) {
    let mm = |metres: f32| metres * 1e3;
    out.say(format_args!(
        "limits: offset up to {:.4} mm, changing by up to {:.3} mm/s",
        mm(table.limits.offset_m),
        mm(table.limits.slew_m_s)
    ));
    for (number, zone) in table.zones.iter().enumerate() {
        let ([r0, r1], [f0, f1]) = (zone.radius_m.map(mm), zone.feed_m_s.map(mm));
        out.say(format_args!(
            "zone {}: radius {r0:.3} to {r1:.3} mm, feed {f0:.3} to {f1:.3} mm/s, {:?}, {}",
            number + 1,
            zone.travel,
            match zone.place_m {
                Some([lo, hi]) => format!("centre {:?} to {:?} mm", lo.map(mm), hi.map(mm)),
                None => "any place".to_owned(),
            }
        ));
        let cumulants = zone.cumulants;
        out.say(format_args!(
            "  kappa2 {:.6e} s^2, kappa4 {:.6e} s^4",
            cumulants.kappa2_s2, cumulants.kappa4_s4
        ));
        for term in &zone.terms {
            out.say(format_args!("  {term:?}"));
        }
    }
}
