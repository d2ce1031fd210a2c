//! Every command × a full disk, a file that is read-only, a file of another kind, an output that is an input, a pipe
//! that closes: no exit 0 where a result is missing, no half file, nothing of the user's written over.
#![cfg(unix)]
#![allow(clippy::unwrap_used, reason = "a test may fail where it stands")]
use std::collections::{BTreeMap, BTreeSet};
use std::fs;
use std::path::Path;
use std::process::{Command, Output, Stdio};

const GIOTTO: &str = env!("CARGO_BIN_EXE_giotto");

const PLAN: &str = "[campaign]\nname = \"bench\"\nmachine = \"mill\"\n[machine]\nboth = { kv_per_s = 40.0 }\n\
                    [instrument]\nnoise_um = 1.0\n[grid]\nradii_mm = [50.0, 100.0]\nfeeds_mm_s = [20.0, 100.0, 200.0]\n";
const MODEL: &str = "format = 1\ncampaign = \"bench\"\nmachine = \"mill\"\n[servo]\nkind = \"lag\"\nkv_per_s = 40.0\n\
                     [valid]\nradius_mm = [50.0, 100.0]\nfeed_mm_s = [20.0, 200.0]\n";

/// Lines that give a result on stdout, at least one for each command that ends by itself.
const SPEAKERS: &[&str] = &[
    "",
    "--help",
    "--version",
    "import ball.csv --radius 100 --feed 100 --direction ccw -o new",
    "analyze campaign",
    "analyze campaign --tolerance 5",
    "fit campaign",
    "simulate plan.toml -o new",
    "diagnose campaign",
    "diagnose campaign --corrected-by model.toml",
    "plan campaign",
    "report campaign -o new.html",
    "compensate part.nc --model model.toml -o new.nc",
    "compare campaign campaign",
    "history months",
    "table model.toml -o new.bin",
    "table show table.bin",
    "flash table.bin --port sim",
    "key new new.key",
    "key sign model.toml --key owner.key --machine 000102030405060708090a0b --serial 7 -o new.bin",
    "key show --port sim",
    "key provision owner.key --port sim",
    "status --port sim",
    "bypass on --port sim",
    "stop --port sim",
    "reset --at 0,0,0 --port sim",
    "feed 50 --port sim",
    "log --once --port sim",
    "config get --port sim",
    "campaign list campaign",
    "run circle --radius 50 --feed 100 --direction ccw --port sim",
    "demo",
    "kinematics robot.urdf",
    "completions bash",
    "man -o new",
];

/// Lines that write a file, `{}` standing for it; a name of the kind that they write.
const WRITERS: &[(&str, &str)] = &[
    ("fit campaign -o {}", "new.toml"),
    ("diagnose campaign -o {}", "new.toml"),
    ("diagnose campaign --report {}", "new.html"),
    ("report campaign -o {}", "new.html"),
    ("report campaign -o page.html --pdf {}", "new.pdf"),
    ("compare campaign campaign --html {}", "new.html"),
    ("history months --html {}", "new.html"),
    ("plan campaign -o {}", "new.toml"),
    ("plan campaign --gcode {}", "new.nc"),
    ("plan campaign --rapid {}", "new.mod"),
    ("compensate part.nc --model model.toml -o {}", "new.nc"),
    ("table model.toml -o {}", "new.bin"),
    ("key new {}", "new.key"),
    (
        "key sign table.bin --key owner.key --machine 000102030405060708090a0b -o {}",
        "new.bin",
    ),
    ("demo --svg {}", "new.svg"),
    (
        "run circle --radius 50 --feed 100 --direction ccw --port sim -o {}",
        "new.csv",
    ),
];

/// Lines that fill a directory.
const FILLERS: &[&str] = &[
    "import ball.csv --radius 100 --feed 100 --direction ccw -o new",
    "simulate plan.toml -o new",
    "fit campaign --figures new",
    "man -o new",
];

/// Lines that change what is there; on a full disk it stays as it was.
const EDITORS: &[&str] = &[
    "campaign set campaign run000.csv --start-angle 5",
    "campaign remove campaign run000.csv",
    "import ball.csv --radius 100 --feed 100 --direction ccw -o campaign",
    "history months",
];

/// Lines whose output is their input or belongs to it.
const SWALLOWERS: &[&str] = &[
    "fit campaign -o campaign/campaign.toml",
    "diagnose campaign -o campaign/campaign.toml",
    "diagnose campaign --model model.toml -o model.toml",
    "diagnose campaign --report campaign/campaign.toml",
    "report campaign -o campaign/campaign.toml",
    "report campaign -o campaign/run000.csv",
    "report campaign -o new.html --pdf campaign/run000.csv",
    "report campaign -o new.html --pdf new.html",
    "diagnose campaign -o new.toml --report ./new.toml",
    "plan campaign -o new.toml --gcode new.toml",
    "diagnose campaign --corrected-by model.toml -o model.toml",
    "history months --html months/a/campaign.toml",
    "run program part.nc --port sim -o part.nc",
    "run stream ball.csv --port sim -o ball.csv",
    "report ball.csv --radius 100 --feed 100 --direction ccw -o ball.csv",
    "plan campaign -o campaign/campaign.toml",
    "plan campaign --gcode campaign/run000.csv",
    "plan campaign --rapid campaign/campaign.toml",
    "table model.toml -o model.toml",
    "key sign table.bin --key owner.key --machine 000102030405060708090a0b -o table.bin",
    "key sign table.bin --key owner.key --machine 000102030405060708090a0b -o owner.key",
    "table model.toml -o link.toml",
    "compare campaign campaign --html campaign/campaign.toml",
    "compensate part.nc --model model.toml -o part.nc",
    "compensate part.nc --model model.toml -o model.toml",
];

/// Commands that no line above stands for: they need a live controller, ask a terminal, or never end by themselves.
const OTHERS: &[&str] = &[
    "monitor",
    "controller",
    "rollback",
    "verify",
    "bridge",
    "calibrate",
    "start",
    "help",
];

/// An ABB IRB 1600 by its joints.
fn urdf() -> String {
    let joints = [
        ("0 0 0.4865", "0 0 1"),
        ("0.15 0 0", "0 1 0"),
        ("0 0 0.7", "0 1 0"),
        ("0.314 0 0", "1 0 0"),
        ("0.286 0 0", "0 1 0"),
        ("0.065 0 0", "1 0 0"),
    ];
    let mut text = String::from("<robot name='irb1600'>");
    for (n, (place, axis)) in joints.iter().enumerate() {
        text += &format!(
            "<joint name='j{n}' type='revolute'><parent link='l{n}'/><child link='l{}'/><origin xyz='{place}'/><axis xyz='{axis}'/></joint>\n",
            n + 1
        );
    }
    text + "</robot>"
}

fn lay_out(folder: &Path) {
    let at = |name: &str| folder.join(name);
    fs::write(at("plan.toml"), PLAN).unwrap();
    fs::write(at("model.toml"), MODEL).unwrap();
    fs::write(at("robot.urdf"), urdf()).unwrap();
    let key = format!("giotto-key-1 {}\n", "5a".repeat(32));
    fs::write(at("owner.key"), key).unwrap();
    std::os::unix::fs::symlink(at("model.toml"), at("link.toml")).unwrap();
    fs::write(at("part.nc"), "G0 X20 Y0\nG3 I-20 F1500\n").unwrap();
    let mut ball = String::from("time_s,deviation_um\n");
    for k in 0..360 {
        let angle = f64::from(k).to_radians();
        ball += &format!(
            "{},{:.3}\n",
            f64::from(k) * 0.0175,
            5.0 * (2.0 * angle).sin()
        );
    }
    fs::write(at("ball.csv"), ball).unwrap();
    for line in [
        "simulate plan.toml -o campaign",
        "table model.toml -o table.bin",
        "simulate plan.toml --seed 1 -o months/a",
        "simulate plan.toml --seed 2 -o months/b",
    ] {
        let done = run(folder, line);
        assert!(done.status.success(), "{line}: {}", words(&done));
    }
}

fn command(folder: &Path, line: &str) -> Command {
    let mut command = Command::new(GIOTTO);
    command
        .args(line.split_whitespace())
        .current_dir(folder)
        .env("NO_COLOR", "1")
        .stdin(Stdio::null());
    command
}

fn run(folder: &Path, line: &str) -> Output {
    command(folder, line).output().unwrap()
}

fn words(output: &Output) -> String {
    String::from_utf8_lossy(&output.stderr).into_owned()
}

/// Every file below `folder` with its bytes.
fn state(folder: &Path) -> BTreeMap<String, Vec<u8>> {
    let mut out = BTreeMap::new();
    let mut open = vec![folder.to_path_buf()];
    while let Some(next) = open.pop() {
        for entry in fs::read_dir(next).unwrap() {
            let path = entry.unwrap().path();
            if path.is_dir() {
                open.push(path);
            } else {
                out.insert(path.display().to_string(), fs::read(&path).unwrap());
            }
        }
    }
    out
}

/// Removes what a line made.
fn clean(folder: &Path, before: &BTreeMap<String, Vec<u8>>) {
    for (path, _) in state(folder) {
        if !before.contains_key(&path) {
            fs::remove_file(path).unwrap();
        }
    }
    let _ = fs::remove_dir(folder.join("new"));
}

fn refused(output: &Output, line: &str) {
    let code = output.status.code();
    assert!(
        code.is_some_and(|code| (2..=5).contains(&code)),
        "{line}: {code:?}: {}",
        words(output)
    );
    assert!(words(output).contains("error"), "{line}: {}", words(output));
    assert!(
        !words(output).contains("panicked"),
        "{line}: {}",
        words(output)
    );
}

#[test]
fn every_command_is_in_a_list() {
    let folder = tempfile::tempdir().unwrap();
    let help = run(folder.path(), "--help");
    let help = String::from_utf8_lossy(&help.stdout).into_owned();
    let commands = help
        .lines()
        .skip_while(|line| *line != "Commands:")
        .skip(1)
        .take_while(|line| !line.is_empty())
        .filter(|line| line.starts_with("  ") && !line.starts_with("   "))
        .filter_map(|line| line.split_whitespace().next());
    let lines = SPEAKERS
        .iter()
        .chain(FILLERS)
        .chain(SWALLOWERS)
        .chain(OTHERS);
    let known: BTreeSet<&str> = lines.filter_map(|line| line.split(' ').next()).collect();
    let mut count = 0;
    for command in commands {
        assert!(
            known.contains(command),
            "{command} is in no list of this test"
        );
        count += 1;
    }
    assert!(count > 15, "{help}");
}

#[test]
fn a_full_disk_behind_stdout_is_no_success() {
    let folder = tempfile::tempdir().unwrap();
    let folder = folder.path();
    lay_out(folder);
    let before = state(folder);
    for line in SPEAKERS {
        for json in ["", " --json"] {
            let line = format!("{line}{json}");
            let full = fs::OpenOptions::new()
                .write(true)
                .open("/dev/full")
                .unwrap();
            let output = command(folder, &line).stdout(full).output().unwrap();
            refused(&output, &line);
            clean(folder, &before);
        }
    }
}

#[test]
fn a_pipe_that_closes_is_forgiven_and_nothing_panics() {
    let folder = tempfile::tempdir().unwrap();
    let folder = folder.path();
    lay_out(folder);
    let before = state(folder);
    for line in SPEAKERS {
        for json in ["", " --json"] {
            let line = format!("{line}{json}");
            let (reader, writer) = std::io::pipe().unwrap();
            drop(reader);
            let output = command(folder, &line).stdout(writer).output().unwrap();
            let expected = run_code(folder, &line, &before);
            assert_eq!(output.status.code(), expected, "{line}: {}", words(&output));
            assert!(!words(&output).contains("panicked"), "{line}");
            clean(folder, &before);
        }
    }
}

/// The exit code with a whole stdout.
fn run_code(folder: &Path, line: &str, before: &BTreeMap<String, Vec<u8>>) -> Option<i32> {
    clean(folder, before);
    run(folder, line).status.code()
}

#[test]
fn a_full_disk_leaves_no_file() {
    let folder = tempfile::tempdir().unwrap();
    let folder = folder.path();
    lay_out(folder);
    let before = state(folder);
    let lines = WRITERS
        .iter()
        .map(|(line, name)| line.replace("{}", name))
        .chain(FILLERS.iter().chain(EDITORS).map(|line| (*line).to_owned()));
    for line in lines {
        // A limit of no bytes a file: what writes fails as on a full disk; pipes are not limited.
        let script = format!("trap '' XFSZ; ulimit -f 0; exec \"$0\" {line}");
        let output = Command::new("sh")
            .args(["-c", &script, GIOTTO])
            .current_dir(folder)
            .stdin(Stdio::null())
            .output()
            .unwrap();
        refused(&output, &line);
        assert_eq!(state(folder), before, "{line}");
    }
}

#[test]
fn what_stands_in_the_way_stays() {
    let folder = tempfile::tempdir().unwrap();
    let folder = folder.path();
    lay_out(folder);
    fs::write(folder.join("notes.rs"), "fn main() {}\n").unwrap();
    fs::write(folder.join("package.toml"), "[package]\nname = \"a\"\n").unwrap();
    fs::write(folder.join("noise"), [0_u8, 255, 3, 7]).unwrap();
    fs::create_dir(folder.join("folder")).unwrap();
    for (name, text) in [
        ("r.html", "<!doctype html>"),
        ("r.toml", MODEL),
        ("r.nc", "G0 X1\n"),
        ("r.bin", ""),
        ("r.svg", "<svg>"),
        ("r.csv", "a,b\n"),
        ("r.mod", "MODULE a\n"),
        ("r.key", "a\n"),
        ("r.pdf", "%PDF-1.4\n"),
    ] {
        fs::write(folder.join(name), text).unwrap();
        let mut permissions = fs::metadata(folder.join(name)).unwrap().permissions();
        permissions.set_readonly(true);
        fs::set_permissions(folder.join(name), permissions).unwrap();
    }
    let before = state(folder);
    for (line, name) in WRITERS {
        let ending = name.trim_start_matches("new");
        let read_only = format!("r{ending}");
        let places = [
            "notes.rs",
            "package.toml",
            "noise",
            "folder",
            "nowhere/file",
            "noise/file",
            "part.nc",
            "ball.csv",
            "table.bin",
            &read_only,
        ];
        let own = |place: &str| {
            // A program may replace a program, in whatever language.
            let program = ending == ".mod" && place == "part.nc";
            (place.ends_with(ending) || program) && place != read_only
        };
        for place in places.iter().filter(|place| !own(place)) {
            let line = line.replace("{}", place);
            let output = run(folder, &line);
            refused(&output, &line);
            assert_eq!(state(folder), before, "{line}");
        }
    }
}

/// A manifest that is marked read-only is not changed; a result is not put beside it either.
#[test]
fn a_campaign_that_is_read_only_stays() {
    let folder = tempfile::tempdir().unwrap();
    let folder = folder.path();
    lay_out(folder);
    let manifest = folder.join("campaign/campaign.toml");
    let mut permissions = fs::metadata(&manifest).unwrap().permissions();
    permissions.set_readonly(true);
    fs::set_permissions(&manifest, permissions).unwrap();
    let before = state(folder);
    for line in EDITORS.iter().filter(|line| line.contains(" campaign")) {
        let output = run(folder, line);
        refused(&output, line);
        assert_eq!(state(folder), before, "{line}");
    }
}

#[test]
fn an_output_that_is_an_input_is_refused() {
    let folder = tempfile::tempdir().unwrap();
    let folder = folder.path();
    lay_out(folder);
    let before = state(folder);
    for line in SWALLOWERS {
        let output = run(folder, line);
        refused(&output, line);
        assert_eq!(state(folder), before, "{line}");
    }
}
