//! What is loaded on the controller so that it opens its door: RAPID, KRL with the configuration of RSI, a TP program.
//!
//! A circle of 100 mm radius at 20 mm/s stands in each for a first try; the places have to be taught. None was ever loaded on a
//! real controller.
use crate::protocol::{Kind, Mode};
use crate::rsi::SENTYPE;
use crate::setup::Setup;

/// The door has another end there.
#[derive(Clone, Debug)]
pub struct Program<'a> {
    /// What the door will be told.
    pub setup: &'a Setup,
    /// Name of the module: letters, digits and underscores.
    pub name: &'a str,
    /// Address and port of this computer as the robot sees it.
    pub host: (&'a str, u16),
}

/// Most letters of a module's name: a controller has no longer ones.
const LONGEST_NAME: usize = 24;

impl Program<'_> {
    /// Whether a controller takes the name.
    pub fn is_name(name: &str) -> bool {
        let letter = name.chars().next().is_some_and(|c| c.is_ascii_alphabetic());
        letter
            && name.len() <= LONGEST_NAME
            && name.chars().all(|c| c.is_ascii_alphanumeric() || c == '_')
    }

    /// Endings and texts of the files; the first is the program.
    pub fn files(&self) -> Vec<(&'static str, String)> {
        let fill = |text: &str| self.fill(text);
        match self.setup.kind {
            Kind::Egm => vec![("mod", fill(include_str!("program/egm.mod")))],
            Kind::EgmPath => vec![("mod", fill(include_str!("program/egm_path.mod")))],
            Kind::Rsi => vec![
                ("src", fill(include_str!("program/rsi.src"))),
                ("xml", fill(include_str!("program/rsi.xml"))),
                ("rsi.xml", fill(include_str!("program/rsi.rsi.xml"))),
            ],
            Kind::J519 => vec![("ls", fill(include_str!("program/j519.ls")))],
        }
    }

    fn fill(&self, text: &str) -> String {
        let (host, port) = self.host;
        let relative = self.setup.mode == Mode::Relative;
        [
            ("{name}", self.name.to_owned()),
            ("{NAME}", self.name.to_ascii_uppercase()),
            ("{host}", host.to_owned()),
            ("{port}", port.to_string()),
            ("{cycle}", format!("{:.0}", self.setup.cycle_ms)),
            ("{limit}", format!("{:.1}", self.setup.limit_mm)),
            ("{sentype}", SENTYPE.to_owned()),
            (
                "{mode}",
                if relative { "RELATIVE" } else { "ABSOLUTE" }.to_owned(),
            ),
            (
                "{ipo}",
                if self.setup.cycle_ms < 8.0 {
                    "IPO_FAST"
                } else {
                    "IPO"
                }
                .to_owned(),
            ),
            ("{holdon}", if relative { "0" } else { "1" }.to_owned()),
        ]
        .iter()
        .fold(text.to_owned(), |text, (mark, value)| {
            text.replace(mark, value)
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn no_mark_is_left_and_the_bounds_stand_in_the_files() {
        for kind in [Kind::Egm, Kind::EgmPath, Kind::Rsi, Kind::J519] {
            let mut setup = Setup::new(kind, Vec::new());
            setup.limit_mm = 3.0;
            setup.mode = Mode::Relative;
            let program = Program {
                setup: &setup,
                name: "Giotto_1",
                host: ("192.168.1.10", 6511),
            };
            let files = program.files();
            for (ending, text) in &files {
                // A mark is a word in braces.
                let mark = text.split('{').skip(1).find(|rest| {
                    let letters = rest.chars().take_while(char::is_ascii_alphabetic).count();
                    letters > 0 && rest[letters..].starts_with('}')
                });
                assert_eq!(mark, None, "{ending}");
                assert!(text.is_ascii(), "{ending}");
                assert!(text.to_ascii_lowercase().contains("giotto_1"), "{ending}");
            }
            if kind == Kind::Rsi {
                let [(_, src), (_, ethernet), (_, flow)] = &files[..] else {
                    panic!()
                };
                assert!(src.contains("RSI_ON(#RELATIVE, #IPO_FAST)"));
                assert!(
                    ethernet.contains("<PORT>6511</PORT>") && ethernet.contains("HOLDON=\"0\"")
                );
                assert!(flow.contains("\"UpperLimX\" ParamID=\"4\" ParamValue=\"3.0\""));
            }
        }
        for (name, good) in [
            ("giotto", true),
            ("1giotto", false),
            ("gi otto", false),
            ("", false),
        ] {
            assert_eq!(Program::is_name(name), good);
        }
    }
}
