//! `giotto start` on a real pty: the questions, answers that it cannot take, and the verdict; without a terminal it says what to do.
#![cfg(target_os = "linux")]
#![allow(clippy::unwrap_used, reason = "a test may fail where it stands")]
use giotto_tests::command::{giotto, outcome};
use giotto_tests::terminal::Terminal;
use std::f64::consts::TAU;
use std::fmt::Write;
use std::path::Path;

/// A circle of a machine whose X loses 30 µm at each reversal, as a ballbar records it.
fn circle(path: &Path, sign: f64) {
    let mut text = String::from("time_s,deviation_um\n");
    for k in 0..720 {
        let share = f64::from(k) / 720.0;
        let angle = sign * TAU * share;
        let lost = sign * 15.0 * angle.sin().signum() * angle.cos();
        // Noise that no order of the samples repeats.
        let noise = 0.5 * (f64::from(k) * f64::from(k) * 0.37 + sign).sin();
        writeln!(text, "{:.5},{:.2}", share * TAU, lost + noise).unwrap();
    }
    std::fs::write(path, text).unwrap();
}

fn session(folder: &Path) -> Terminal {
    let script = folder.join("session.sh");
    let binary = giotto().get_program().to_owned();
    let text = format!(
        "stty rows 60 cols 80\ncd '{}'\n'{}' start\necho \"it ended with $?\"\n",
        folder.display(),
        binary.to_string_lossy()
    );
    std::fs::write(&script, text).unwrap();
    Terminal::run(&script, [60, 80])
}

#[test]
fn two_files_become_a_provisional_verdict_and_one_thing_to_do() {
    let folder = tempfile::tempdir().unwrap();
    circle(&folder.path().join("ball-ccw.csv"), 1.0);
    circle(&folder.path().join("ball-cw.csv"), -1.0);
    let mut terminal = session(folder.path());
    let mut answer = |question: &str, keys: &str| {
        let last = |shown: &str| {
            shown
                .trim_end()
                .lines()
                .last()
                .unwrap_or("")
                .contains(question)
        };
        terminal.wait(last, question);
        terminal.press(keys);
    };
    answer("Directory for the campaign [campaign]?", "\n");
    // What is no file and what is no measurement is said, and asked again.
    answer("File of a measured circle, or its number?", "nowhere.csv\n");
    answer("File of a measured circle, or its number?", "session.sh\n");
    answer("File of a measured circle, or its number?", "1\n");
    answer("Programmed radius, mm?", "a hundred\n");
    answer("Programmed radius, mm?", "100\n");
    answer("Programmed feed, mm/s?", "100\n");
    answer("Direction, ccw or cw [ccw]?", "\n");
    answer("Name of the machine [machine]?", "mill\n");
    answer("or its number (Enter: no more)?", "1\n");
    answer("Programmed radius, mm [100]?", "\n");
    answer("Programmed feed, mm/s [100]?", "\n");
    answer("Direction, ccw or cw [cw]?", "\n");
    answer("File of the next circle (Enter: no more)?", "\n");
    terminal.wait(|s| s.contains("it ended with"), "the end");
    assert!(terminal.end());
    let shown = terminal.shown();
    for wanted in [
        "nowhere.csv: no such file",
        "a hundred: expected a number above 0",
        "provisionally",
        "backlash of X",
        "raise its backlash compensation",
        "Next: ",
        "giotto plan campaign --gcode measure.nc",
        "it ended with 0",
    ] {
        assert!(shown.contains(wanted), "{wanted} is not in:\n{shown}");
    }
    assert!(!shown.contains('`'), "{shown}");
    let campaign = std::fs::read_to_string(folder.path().join("campaign/campaign.toml")).unwrap();
    assert!(campaign.contains("machine = \"mill\""), "{campaign}");
    for said in ["\"ccw\"", "\"cw\""] {
        assert!(
            campaign.contains(&format!("direction = {said}")),
            "{campaign}"
        );
    }
}

#[test]
fn who_leaves_early_keeps_what_was_brought_in() {
    let folder = tempfile::tempdir().unwrap();
    circle(&folder.path().join("ball.csv"), 1.0);
    let mut terminal = session(folder.path());
    for (question, keys) in [
        ("Directory for the campaign", "pair\n"),
        ("File of a measured circle", "'ball.csv'\n"),
        ("Programmed radius", "100\n"),
        ("Programmed feed", "100\n"),
        ("Direction", "\n"),
        ("Name of the machine", "\n"),
        // The end of the input, as Ctrl-D types it.
        ("Enter: no more", "\u{4}"),
    ] {
        let last = |shown: &str| {
            shown
                .trim_end()
                .lines()
                .last()
                .unwrap_or("")
                .contains(question)
        };
        terminal.wait(last, question);
        terminal.press(keys);
    }
    terminal.wait(|s| s.contains("it ended with 130"), "the exit code");
    terminal.end();
    assert!(folder.path().join("pair/run000.csv").is_file());
}

#[test]
fn without_a_terminal_it_says_what_to_do_instead() {
    let folder = tempfile::tempdir().unwrap();
    for more in [&[][..], &["--json"], &["--non-interactive"]] {
        let mut command = giotto();
        command.arg("start").args(more).current_dir(folder.path());
        let (code, out, words) = outcome(&command.output().unwrap());
        assert_eq!((code, out.as_str()), (2, ""), "{words}");
        assert!(words.contains("needs a terminal"), "{words}");
        assert!(words.contains("giotto import FILE --radius MM"), "{words}");
    }
    assert_eq!(std::fs::read_dir(folder.path()).unwrap().count(), 0);
}
