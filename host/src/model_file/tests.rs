//! Files go round; whatever is missing, misspelt or absurd is refused by its place.
use super::*;
use crate::causes::{ALL, Cause, Seat, Site};
use giotto_shared::Actuator;

const TEXT: &str = r#"format = 1
campaign = "lab"
machine = "ABB"

[servo]
kind = "beta"
beta1_s2 = -2.329e-5
beta2_s4 = -2.3e-7
half_width95 = [2.1e-6, 1.3e-7]

[valid]
radius_mm = [100.0, 300.0]
feed_mm_s = [20.0, 700.0]

[[effect]]
cause = "backlash"
axis = "x"
value = 0.012
ci95 = [0.011, 0.013]

[[effect]]
cause = "cyclic_error"
axis = "y"
value = 2.5
ci95 = [2.0, 3.0]

[effect.params]
pitch_mm = 10.0
phase_rad = 0.5
"#;

fn refuse(from: &str, to: &str) -> String {
    assert!(TEXT.contains(from));
    ModelFile::parse(&TEXT.replacen(from, to, 1), Path::new("M.toml"))
        .unwrap_err()
        .to_string()
}

#[test]
fn reads_what_it_should() {
    let model = ModelFile::parse(TEXT, Path::new("M.toml")).unwrap();
    assert_eq!(
        model.servo,
        Servo::Beta {
            beta1_s2: -2.329e-5,
            beta2_s4: -2.3e-7,
            half_width95: [2.1e-6, 1.3e-7]
        }
    );
    assert_eq!(model.effects[0].cause(), Cause::Backlash);
    assert_eq!(model.effects[0].site(), Site::One(Actuator::X));
    let parameters: Vec<_> = model.effects[1].parameters().iter().collect();
    assert_eq!(parameters, [("phase_rad", 0.5), ("pitch_mm", 10.0)]);
}

#[test]
fn refusals_name_the_place() {
    assert_eq!(
        refuse("format = 1", "format = 7"),
        "M.toml:1:10: format 7, and this build reads format 2"
    );
    assert_eq!(
        refuse("beta2_s4 = -2.3e-7", "beta2_s4 = nan"),
        "M.toml:8:12: `servo.beta2_s4` is NaN; expected a finite number"
    );
    assert_eq!(
        refuse("radius_mm = [100.0, 300.0]", "radius_mm = [300.0, 100.0]"),
        "M.toml:12:13: `valid.radius_mm` is [300, 100]; expected two positive numbers, the smaller first"
    );
    assert_eq!(
        refuse("value = 2.5", "value = inf"),
        "M.toml:24:9: `effect.value` is inf; expected 0 to 1000"
    );
    let delayed = refuse("\n[servo]", "delay_s = 7.5\n[servo]");
    assert!(
        delayed.ends_with("`delay_s` is 7.5; expected a delay of 0 to 1 s"),
        "{delayed}"
    );
    assert!(
        refuse("pitch_mm = 10.0", "pitch_mm = nan")
            .starts_with("M.toml:28:12: `effect.params.pitch_mm`")
    );
    assert!(refuse("[2.0, 3.0]", "[3.0, 2.0]").contains("M.toml:25:8: `effect.ci95` is [3, 2]"));
    assert!(
        refuse("-2.329e-5", "\"small\"").starts_with("M.toml:"),
        "text for a number"
    );
    assert!(refuse("kind = \"beta\"", "kind = \"magic\"").contains("magic"));
    assert!(refuse("machine = \"ABB\"", "machin = \"ABB\"").starts_with("M.toml:3:1: unknown key"));
    assert!(refuse("machine = \"ABB\"", "machine = \"ABB").starts_with("M.toml:3:"));
    assert!(
        refuse("\"backlash\"", "\"gremlin\"").contains("M.toml:16:9: unknown variant `gremlin`")
    );
    let lag = TEXT.replace("kind = \"beta\"", "kind = \"lag\"\nkv_per_s = -3.0");
    let error = ModelFile::parse(&lag, Path::new("M.toml"))
        .unwrap_err()
        .to_string();
    assert_eq!(
        error,
        "M.toml:7:12: `servo.kv_per_s` is -3; expected a positive number"
    );
}

#[test]
fn files_go_round() {
    let dir = tempfile::tempdir().unwrap();
    let file = dir.path().join("model.toml");
    let mut model = ModelFile::parse(TEXT, Path::new("M.toml")).unwrap();
    for servo in [
        model.servo,
        Servo::Lag {
            kv_per_s: 1.0 / 3.0 * 100.0,
        },
        Servo::SecondOrder {
            omega_n_rad_s: 38.0 + f64::EPSILON * 64.0,
            zeta: 0.72,
        },
    ] {
        model.servo = servo;
        model.save(&file).unwrap();
        assert_eq!(ModelFile::load(&file).unwrap(), model);
    }
    model.valid.radius_mm = [f64::NAN, 1.0];
    assert!(
        model
            .save(&file)
            .unwrap_err()
            .to_string()
            .contains("valid.radius_mm")
    );
    assert!(
        ModelFile::load(&file).unwrap().effects[0]
            .value()
            .is_finite(),
        "the old file is whole"
    );
    assert!(
        ModelFile::load(dir.path())
            .unwrap_err()
            .to_string()
            .contains("is a directory")
    );
    assert!(
        ModelFile::load(&dir.path().join("no"))
            .unwrap_err()
            .to_string()
            .contains("no such file")
    );
    std::fs::write(&file, b"format = 1\nmachine = \"\xff\"").unwrap();
    assert!(
        ModelFile::load(&file)
            .unwrap_err()
            .to_string()
            .contains(":2:12: not UTF-8")
    );
}

/// A whole effect of a cause, as a file would hold it, and the names of its parameters that have to be there.
fn whole(cause: Cause) -> (String, Vec<&'static str>) {
    let place = match cause.model().seat() {
        Seat::Machine | Seat::MachineOrOne | Seat::MachineOrJoint => "",
        Seat::One => "axis = \"z\"\n",
        Seat::Pair | Seat::PairOrJoint => "plane = \"zx\"\n",
        Seat::Joint => "axis = \"joint2\"\n",
        Seat::Across => "axis = \"z\"\nacross = \"y\"\n",
    };
    let inside = |[lowest, highest]: [f64; 2]| 0.9 * lowest + 0.1 * highest;
    let value = inside(cause.model().size().range);
    let params: String = cause
        .model()
        .parameters()
        .iter()
        .map(|p| format!("{} = {:?}\n", p.name, inside(p.range)))
        .collect();
    let needed = cause.model().parameters().iter();
    let needed = needed.filter(|p| p.otherwise.is_none()).map(|p| p.name);
    (
        format!(
            "[[effect]]\ncause = \"{}\"\n{place}value = {value:?}\nci95 = [0.0, 0.0]\n[effect.params]\n{params}",
            cause.id()
        ),
        needed.collect(),
    )
}

fn with_effect(effect: &str) -> Result<ModelFile, TomlFileError> {
    let head = TEXT.split("[[effect]]").next().unwrap();
    let head = head.replace("format = 1", "format = 2");
    // Of joints there are those of an arm.
    let arm = if effect.contains("joint") { ARM } else { "" };
    ModelFile::parse(&format!("{head}{arm}{effect}"), Path::new("M.toml"))
}

const ARM: &str = "[kinematics]\nrobot = \"abb-irb1600-6-1.45\"\ntool_mm = [0, 65, 149]\norientation = [0, 0, 1, 0]\nbranch = \"elbow-up\"\n";

#[test]
fn an_effect_on_a_joint_needs_the_arm() {
    let (text, _) = whole(Cause::JointBacklash);
    let alone = |kinematics: &str| {
        let head = TEXT
            .split("[[effect]]")
            .next()
            .unwrap()
            .replace("format = 1", "format = 2");
        ModelFile::parse(&format!("{head}{kinematics}{text}"), Path::new("M.toml"))
    };
    assert!(alone(ARM).is_ok());
    let error = alone("").unwrap_err().to_string();
    assert!(
        error.contains("joint2") && error.contains("[kinematics]"),
        "{error}"
    );
    assert!(!error.starts_with("M.toml:1:"), "{error}");
    let two =
        "[kinematics]\nmodel = \"scara\"\nl1_mm = 475.0\nl2_mm = 720.0\nelbow = \"positive\"\n";
    assert!(alone(two).is_ok());
    let third = text.replace("joint2", "joint3");
    let head = TEXT
        .split("[[effect]]")
        .next()
        .unwrap()
        .replace("format = 1", "format = 2");
    let error = ModelFile::parse(&format!("{head}{two}{third}"), Path::new("M.toml"))
        .unwrap_err()
        .to_string();
    assert!(
        error.contains("joint3") && error.contains("joint2"),
        "{error}"
    );
}

/// All causes, all parameters: missing, misspelt, of another unit, no number, beyond what can be.
#[test]
fn no_number_of_an_effect_is_invented() {
    let first_line = TEXT.split("[[effect]]").next().unwrap().lines().count();
    for model in ALL {
        let (text, needed) = whole(model.cause());
        let id = model.words().id;
        let read = with_effect(&text).unwrap();
        assert_eq!(read.effects[0].cause(), model.cause());
        let again = with_effect(
            &toml::to_string(&Only {
                effect: &read.effects,
            })
            .unwrap(),
        );
        assert_eq!(
            again.unwrap().effects,
            read.effects,
            "{id}: written and read back"
        );
        let refused = |text: String, words: &[&str]| {
            let error = with_effect(&text).err();
            let error = error
                .unwrap_or_else(|| panic!("{id} is taken:\n{text}"))
                .to_string();
            for word in words {
                assert!(error.contains(word), "{id}: {error}, without {word}");
            }
            let line: usize = error.split(':').nth(1).unwrap().parse().unwrap();
            assert!(line > first_line, "{id}: {error}");
        };
        for key in ["axis", "plane", "across"] {
            if text.contains(&format!("\n{key} = ")) {
                let without: Vec<&str> = text
                    .lines()
                    .filter(|line| !line.starts_with(&format!("{key} = ")))
                    .collect();
                refused(without.join("\n"), &[key]);
            } else {
                let more = text.replace("\nvalue", &format!("\n{key} = \"xy\"\nvalue"));
                assert!(with_effect(&more).is_err(), "{id} takes `{key}`");
            }
        }
        for parameter in model.parameters() {
            let name = parameter.name;
            let line = text
                .lines()
                .find(|line| line.starts_with(&format!("{name} = ")))
                .unwrap();
            let but = |new: &str| text.replace(line, new);
            if needed.contains(&name) {
                refused(but(""), &[name, "missing"]);
            }
            let stem = name.rsplit_once('_').map_or(name, |(stem, _)| stem);
            for other in [
                format!("{name}x"),
                format!("{stem}_furlong"),
                stem.to_owned(),
            ] {
                if !model.parameters().iter().any(|p| p.name == other) {
                    refused(but(&format!("{other} = 1.0")), &[]);
                }
            }
            let beyond = format!("{:?}", 2.0 * parameter.range[1] + 1.0);
            for value in ["nan", "inf", "-inf", &beyond, "\"10\""] {
                refused(but(&format!("{name} = {value}")), &[name]);
            }
        }
        let size = text.lines().find(|line| line.starts_with("value")).unwrap();
        let beyond = format!("{:?}", 2.0 * model.size().range[1] + 1.0);
        for value in ["nan", "inf", &beyond] {
            refused(text.replace(size, &format!("value = {value}")), &["value"]);
        }
        refused(text.replace(size, ""), &["value"]);
        refused(
            text.replace("[effect.params]", "[effect.parms]"),
            &["parms"],
        );
    }
}

#[derive(Serialize)]
struct Only<'a> {
    effect: &'a [Effect],
}

#[test]
fn a_file_without_planes_means_x_and_y() {
    let flat = TEXT.replace(
        "cause = \"backlash\"\naxis = \"x\"\nvalue = 0.012",
        "cause = \"squareness\"\nvalue = 0.012",
    );
    let read = ModelFile::parse(&flat, Path::new("M.toml")).unwrap();
    assert_eq!(read.format, FORMAT);
    assert_eq!(read.effects[0].site(), Site::Pair(giotto_shared::Plane::Xy));
    let now = flat.replace("format = 1", "format = 2");
    let refused = ModelFile::parse(&now, Path::new("M.toml")).unwrap_err();
    assert!(
        refused.to_string().contains("`plane` is missing"),
        "{refused}"
    );
}
