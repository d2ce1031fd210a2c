//! What is rewritten, what is not, and that the rest is copied to the letter.
use super::state::{Action, State};
use super::*;
use giotto::model_file::{FORMAT, Servo, Valid};
use proptest::prelude::*;

pub(super) fn model(servo: Servo) -> ModelFile {
    ModelFile {
        format: FORMAT,
        campaign: "c".into(),
        machine: "m".into(),
        servo,
        valid: Valid {
            radius_mm: [50.0, 300.0],
            feed_mm_s: [20.0, 700.0],
            centre_mm: None,
        },
        kinematics: None,
        effects: Vec::new(),
        delay_s: None,
    }
}

/// κ2 = 533e-6 s², as a lag of 23 ms.
pub(super) fn lag() -> ModelFile {
    model(Servo::Lag { kv_per_s: 43.3 })
}

fn zero() -> ModelFile {
    model(Servo::Beta {
        beta1_s2: 0.0,
        beta2_s4: 0.0,
        half_width95: [0.0; 2],
    })
}

fn run(program: &str, options: &Options) -> (String, Vec<Fate>) {
    let result = compensate(program.as_bytes(), &lag(), options);
    (
        String::from_utf8(result.program).unwrap(),
        result.arcs.iter().map(|a| a.fate).collect(),
    )
}

fn left(program: &str) -> Left {
    let (text, fates) = run(program, &Options::default());
    assert_eq!(text, program, "what is left is not touched");
    match fates.last() {
        Some(Fate::Left(left)) => *left,
        other => panic!("{program}: {other:?}"),
    }
}

const HEAD: &str = "G21 G17 G90 G94 F1500\nG0 X20 Y0\n";

/// A code in a line.
fn because(line: usize, letter: char, tenths: i64) -> Because {
    Because {
        line,
        code: Code::Word(letter, tenths),
    }
}

#[test]
fn reasons_to_leave_an_arc() {
    let arc = "G3 X-20 Y0 I-20 J0\n";
    let behind = |line: &str| left(&format!("{HEAD}{line}\n{arc}"));
    assert!(matches!(
        run(&format!("{HEAD}{arc}"), &Options::default()).1[..],
        [Fate::Corrected { .. }]
    ));
    assert_eq!(left(&format!("F1500\n{arc}")), Left::UnknownPosition(None));
    assert_eq!(
        left("G0 X20 Y0\nG3 X-20 Y0 I-20 J0\n"),
        Left::UnknownFeed(None)
    );
    for geometry in [
        "X-20 Y1 I-20 J0",
        "X-20 Y0",
        "X-20 Y0 R10",
        "X-20 I-20 P0.5",
    ] {
        assert_eq!(left(&format!("{HEAD}G3 {geometry}\n")), Left::Geometry);
    }
    let block = |words: &str| left(&format!("{HEAD}G3 X-20 Y0 I-20 J0 {words}\n"));
    assert_eq!(block("A9"), Left::OtherAxes('A'));
    assert_eq!(block("E9"), Left::OtherAxes('E'));
    assert_eq!(block("U9"), Left::SecondaryAxes);
    assert_eq!(block("K1"), Left::ThirdCentre);
    for (words, letter, tenths) in [
        ("M0", 'M', 0),
        ("M5", 'M', 50),
        ("M98 P5", 'M', 980),
        ("G54", 'G', 540),
        ("D1", 'D', 10),
    ] {
        let found = block(words);
        assert!(
            found == Left::Words(Code::Word(letter, tenths))
                || matches!(
                    found,
                    Left::UnknownPosition(Some(_)) | Left::UnknownModes(_)
                ),
            "{words}: {found:?}"
        );
    }
    assert_eq!(
        left(&format!("{HEAD}G3 X-20 X3 Y0 I-20 J0\n")),
        Left::Words(Code::Word('X', -200))
    );
    assert_eq!(
        left(&format!("{HEAD}G3 X[1-21] Y0 I-20 J0\n")),
        Left::Expression
    );
    assert_eq!(left(&format!("{HEAD}/{arc}")), Left::OptionalBlock(3));
    assert_eq!(
        left(&format!("{HEAD}G3 X20.1 Y0 I0.05 J0\n")),
        Left::BeyondModel
    );
    assert_eq!(left(&format!("{HEAD}F60\n{arc}")), Left::Negligible);
    assert_eq!(
        left(&format!("{HEAD}G3 X19.99 Y0.632 I-20 J0\n")),
        Left::TooShort
    );
    let g = |tenths| because(3, 'G', tenths);
    assert_eq!(behind("G41 D1"), Left::CutterCompensation(g(410)));
    assert_eq!(behind("G95 F0.1"), Left::UnknownFeed(Some(g(950))));
    for (line, tenths) in [("G28", 280), ("G55", 550), ("G92 X3", 920), ("G53 X1", 530)] {
        assert_eq!(
            behind(line),
            Left::UnknownPosition(Some(g(tenths))),
            "{line}"
        );
    }
    for (line, tenths) in [
        ("G68 X0 Y0 R30", 680),
        ("G51 X0 Y0 P2", 510),
        ("G51.1 X0", 511),
        ("G16", 160),
        ("G66 P9000", 660),
    ] {
        assert_eq!(behind(line), Left::Coordinates(g(tenths)), "{line}");
    }
    assert_eq!(behind("G77"), Left::UnknownCode(g(770)));
    assert_eq!(behind("M150"), Left::UnknownCode(because(3, 'M', 1500)));
    assert_eq!(behind("G61"), Left::ExactStop(g(610)));
    assert_eq!(behind("M99"), Left::NotReached);
    for line in ["M98 P5", "M72", "G65 P9000 A1"] {
        assert!(
            matches!(behind(line), Left::UnknownModes(b) if b.line == 3),
            "{line}"
        );
    }
    assert!(matches!(behind("$H"), Left::UnknownModes(_)));
    assert!(matches!(behind("o100 if [1]"), Left::ProgramFlow(b) if b.line == 3));
    assert!(matches!(
        behind("IF [#1 EQ 1] GOTO 5"),
        Left::ProgramFlow(_)
    ));
    assert!(matches!(behind("/G91"), Left::UnknownModes(b) if b.line == 3));
    assert!(matches!(behind("/G1 X5"), Left::UnknownPosition(Some(b)) if b.line == 3));
    assert_eq!(
        left("G18 F1500\nG0 Z20 X0\nG3 Z-20 X0 K-20\n"),
        Left::OtherPlane
    );
    let small = Options {
        max_offset_mm: 0.001,
        ..Options::default()
    };
    assert_eq!(
        run(&format!("{HEAD}{arc}"), &small).1,
        [Fate::Left(Left::OffsetTooLarge)]
    );
}

/// Arcs of other dialects are counted and keep their name; no byte changes.
#[test]
fn other_dialects_are_named() {
    for (line, name) in [
        ("12 C X+30 Y+10 DR+ F500", "a circle of Heidenhain"),
        ("CIRC {X 10, Y 5}, {X 20, Y 0}", "CIRC of KUKA"),
        ("9:C P[1]", "a circular motion of a Fanuc robot"),
        ("CIP X10 Y0 I1=AC(R1) J1=5", "CIP of Siemens"),
    ] {
        assert_eq!(left(&format!("{line}\n")), Left::Dialect(name));
        assert!(is_program(line.as_bytes()), "{line}");
        let behind = format!("{HEAD}{line}\nG3 X-20 Y0 I-20 J0\n");
        assert!(matches!(left(&behind), Left::UnknownModes(b) if b.line == 3));
    }
}

/// Comments, harmless codes and modes that have ended keep nothing from being corrected.
#[test]
fn nothing_is_left_without_need() {
    let arc = "G3 X-20 Y0 I-20 J0\n";
    for line in [
        "O1001 (IF WHILE)",
        "#1 = 5",
        "G15",
        "G8 P1",
        "G5.1 Q1",
        "G05 P10000",
        "G187 P1 E0.01",
        "G43.4 H1",
        "G68 X0 Y0 R30\nG69\nG0 X20 Y0",
        "G16\nG15\nG0 X20 Y0",
        "G51 X0 Y0 P2\nG50\nG0 X20 Y0",
        "G154 P1\nG0 X20 Y0",
        "G54 G0 X20 Y0",
        "G41 D1\nG40\nG0 X20 Y0",
        "G61\nG64 P0.01",
        "M6 T1\nG0 X20 Y0",
        "M98 P5\nG21 G17 G90 G94 G91.1\nF1500 G0 X20 Y0",
        "M70\nG20 G91\nM72",
        "G92 E0",
        "G4 P1",
        "/G4 P1",
        "G28 Z0\nG0 X20 Y0",
        "G81 Z-1 R1 F100\nG80\nF1500\nG0 X20 Y0",
    ] {
        let (_, fates) = run(&format!("{HEAD}{line}\n{arc}"), &Options::default());
        assert!(
            matches!(fates[..], [Fate::Corrected { .. }]),
            "{line}: {fates:?}"
        );
    }
    let harmless = Options {
        harmless: vec!["M150".parse().unwrap(), "G77".parse().unwrap()],
        ..Options::default()
    };
    let (_, fates) = run(&format!("{HEAD}M150\nG77\n{arc}"), &harmless);
    assert!(matches!(fates[..], [Fate::Corrected { .. }]), "{fates:?}");
}

/// Reads the program back with the same interpreter: every arc consistent, the path unbroken.
fn path(program: &str) -> Vec<Action> {
    let mut state = State::new(state::Reading::default());
    let lines = word::lines(program.as_bytes()).enumerate();
    let actions: Vec<Action> = lines.map(|(i, l)| state.step(i + 1, &l)).collect();
    for action in &actions {
        assert!(
            !matches!(action, Action::LostArc(_)),
            "{program}\n{action:?}"
        );
    }
    actions
}

fn arcs(program: &str) -> Vec<state::Arc> {
    path(program)
        .into_iter()
        .filter_map(|a| {
            if let Action::Arc(arc) = a {
                Some(arc)
            } else {
                None
            }
        })
        .collect()
}

/// Radius of the longest arc, its feed, and the end of the program.
fn main_arc(program: &str) -> (f64, f64) {
    let arcs = arcs(program);
    let longest = arcs
        .iter()
        .max_by(|a, b| a.length_mm().total_cmp(&b.length_mm()))
        .unwrap();
    (longest.radius_mm, longest.feed_mm_s)
}

#[test]
fn every_way_to_write_a_circle_gives_the_same_circle() {
    let inch = |mm: f64| format!("{:.6}", mm / 25.4);
    let programs = [
        format!("{HEAD}G3 X20 Y0 I-20 J0\n"),
        format!("{HEAD}G3 I-20\n"),
        format!("{HEAD}g03x20.y0i-20.\n"),
        format!("{HEAD}G90.1\nG3 X20 Y0 I0 J0\n"),
        format!("{HEAD}G91\nG3 X0 Y0 I-20 J0\n"),
        "G91 F1500\nG3 X0 Y0 I-20 J0\n".into(),
        format!(
            "{HEAD}G93\nG3 X20 Y0 I-20 J0 F{}\n",
            1500.0 / (40.0 * std::f64::consts::PI)
        ),
        format!(
            "G20 F{}\nG0 X{} Y0\nG3 I-{}\n",
            inch(1500.0),
            inch(20.0),
            inch(20.0)
        ),
        format!("{HEAD}N7 G2 (cw) X20 Y0 I-20 J0 ; end\n"),
        format!("{HEAD}G3 X-20 R20\n"),
        format!("{HEAD}G3 X-20 R-20\n"),
        format!("{HEAD}G3 X-20 CR=20\n"),
    ];
    for keep in [Keep::Feed, Keep::Omega] {
        let options = Options {
            keep,
            ..Options::default()
        };
        for program in &programs {
            let (text, fates) = run(program, &options);
            let [
                Fate::Corrected {
                    radius_mm,
                    feed_mm_s,
                    delta_mm,
                    ..
                },
            ] = fates[..]
            else {
                panic!("{program} {fates:?}")
            };
            assert!(
                (radius_mm - 20.0).abs() < 1e-4 && (feed_mm_s - 25.0).abs() < 1e-3,
                "{program}"
            );
            let omega = 1.25_f64;
            let gain = (1.0 + (omega / 43.3).powi(2)).powf(-0.5);
            let (radius, feed) = main_arc(&text);
            assert!((radius - 20.0 - delta_mm).abs() < 2e-5, "{program}{text}");
            match keep {
                Keep::Omega => {
                    assert!((radius - 20.0 / gain).abs() < 2e-5, "{text}");
                    assert!((feed - 25.0 / gain).abs() < 2e-4, "{text} {feed}");
                }
                Keep::Feed => {
                    let made = radius * (1.0 + (feed / radius / 43.3).powi(2)).powf(-0.5);
                    assert!(
                        (made - 20.0).abs() < 2e-5 && (feed - 25.0).abs() < 5e-2,
                        "{text} {feed}"
                    );
                }
            }
        }
    }
}

#[test]
fn line_arc_line_is_tangent_throughout() {
    let program = format!(
        "{HEAD}G1 X20 Y30\nG3 X0 Y50 I-20 J0 M8 (keep) ; me\nG1 X-30\nG3 X-50 Y30 R20\nG1 Y0 F900\n"
    );
    for keep in [Keep::Feed, Keep::Omega] {
        let (text, fates) = run(
            &program,
            &Options {
                keep,
                ..Options::default()
            },
        );
        assert!(
            fates.iter().all(|f| matches!(f, Fate::Corrected { .. })),
            "{fates:?}"
        );
        for kept in [
            "G1 X20 Y30\n",
            "M8 (keep) ; me\n",
            "\nG1 X-30\n",
            "\nG1 Y0 F900\n",
        ] {
            assert!(text.contains(kept), "{kept} in\n{text}");
        }
        assert_eq!(
            text.contains("F1500\nG1 X-30"),
            keep == Keep::Omega,
            "{text}"
        );
        let mut last: Option<([f64; 2], [f64; 2])> = None;
        for action in path(&text) {
            let (start, end, t0, t1) = match action {
                Action::Arc(a) => (a.start, a.end, a.tangent(false), a.tangent(true)),
                Action::Line(l) => {
                    let (s, e) = (
                        [l.start[0].unwrap(), l.start[1].unwrap()],
                        [l.end[0].unwrap(), l.end[1].unwrap()],
                    );
                    let n = (e[0] - s[0]).hypot(e[1] - s[1]);
                    let t = [(e[0] - s[0]) / n, (e[1] - s[1]) / n];
                    (s, e, t, t)
                }
                _ => continue,
            };
            if let Some((place, tangent)) = last {
                assert!(
                    (start[0] - place[0]).hypot(start[1] - place[1]) < 1e-9,
                    "unbroken: {text}"
                );
                let cross = tangent[0] * t0[1] - tangent[1] * t0[0];
                // Five decimals over blocks of a few tenths of a millimetre.
                assert!(cross.abs() < 2e-3, "corner of {cross} rad in\n{text}");
            }
            last = Some((end, t1));
        }
    }
}

#[test]
fn halves_of_a_circle_share_their_offset() {
    let program = format!("{HEAD}G3 X-20 Y0 I-20\nG3 X20 Y0 I20\n");
    let (text, fates) = run(&program, &Options::default());
    let [
        Fate::Corrected {
            delta_mm,
            blocks: 9,
            ..
        },
        Fate::Corrected { blocks: 8, .. },
    ] = fates[..]
    else {
        panic!("{fates:?}")
    };
    let first = &arcs(&text)[8];
    assert!((first.end[0] + 20.0 + delta_mm).abs() < 1e-5, "{text}");
    let last = arcs(&text).last().unwrap().end;
    assert_eq!(last, [20.0, 0.0]);
}

#[test]
fn helices_and_turns() {
    let program = format!("{HEAD}G0 Z0\nG3 X20 Y0 Z-6 I-20 J0 P3\n");
    let (text, _) = run(&program, &Options::default());
    let all = arcs(&text);
    let turned: f64 = all
        .iter()
        .filter(|a| a.radius_mm > 19.9 && a.length_mm() > 50.0)
        .map(|a| a.sweep_rad)
        .sum();
    assert!(
        turned > 2.8 * std::f64::consts::TAU && turned < 3.0 * std::f64::consts::TAU,
        "{turned} {text}"
    );
    let mut height = 0.0;
    for arc in &all {
        let [from, to] = arc.lift.unwrap();
        assert!((from - height).abs() < 1e-9 && to < from, "{text}");
        // One pitch throughout: lift goes with the angle about the programmed centre.
        height = to;
    }
    assert_eq!(height, -6.0);
    let steepest = all
        .iter()
        .map(|a| (a.lift.unwrap()[1] - a.lift.unwrap()[0]) / a.length_mm());
    let pitch = -6.0 / (3.0 * std::f64::consts::TAU * 20.0);
    assert!(
        steepest
            .map(|p| (p / pitch - 1.0).abs())
            .fold(0.0, f64::max)
            < 0.05,
        "{text}"
    );
    // Other planes, if asked for.
    let all_planes = Options {
        all_planes: true,
        ..Options::default()
    };
    let (text, _) = run(
        "G18 F1500\nG0 Z20 X0 Y0\nG3 Z20 X0 K-20\nG19\nG3 I0 Y0 Z20 J-20\n",
        &all_planes,
    );
    assert_eq!(
        arcs(&text).iter().filter(|a| a.length_mm() > 100.0).count(),
        2,
        "{text}"
    );
}

#[test]
fn modal_motion_is_kept_for_arcs_that_rely_on_it() {
    // The second arc is too flat to be corrected and has no G-word of its own.
    let program = format!("{HEAD}G1 X20 Y10\nG3 X0 Y30 I-20 J0\nX-20 Y29.95 J-4000\nG1 X-40\n");
    let (text, fates) = run(&program, &Options::default());
    assert!(
        matches!(
            fates[..],
            [Fate::Corrected { .. }, Fate::Left(Left::Negligible)]
        ),
        "{fates:?}"
    );
    assert!(arcs(&text).last().unwrap().sweep_rad > 0.0, "{text}");
    assert_eq!(arcs(&text).last().unwrap().end, [-20.0, 29.95]);
}

#[test]
fn line_ends_and_bytes_are_copied() {
    let program = b"%\r\nG21 F1500 (caf\xe9)\r\nG0 X20 Y0\r\nG3 I-20 (\xff)";
    let result = compensate(program, &lag(), &Options::default());
    assert!(
        result
            .program
            .starts_with(b"%\r\nG21 F1500 (caf\xe9)\r\nG0 X20 Y0\r\nG")
    );
    assert!(
        result.program.windows(4).any(|w| w == b"(\xff)\r"),
        "the comment stays with the first block"
    );
    assert!(!result.program.ends_with(b"\n"));
}

/// Words of a program, most of them sensible.
fn block() -> impl Strategy<Value = String> {
    let number = prop_oneof![
        (-50..50i32).prop_map(|v| v.to_string()),
        (-5e1..5e1f64).prop_map(|v| format!("{v:.3}"))
    ];
    let n = move || number.clone();
    prop_oneof![
        6 => (prop_oneof![Just("G2"), Just("G3"), Just("g03"), Just("")], n(), n(), n(), n())
            .prop_map(|(g, x, y, i, j)| format!("{g} X{x} Y{y} I{i} J{j}")),
        3 => (prop_oneof![Just("G2"), Just("G3")], n(), n()).prop_map(|(g, x, r)| format!("{g}X{x}R{r}")),
        2 => (n(), n()).prop_map(|(i, j)| format!("G3 I{i} J{j} P2 (turns)")),
        4 => (prop_oneof![Just("G0"), Just("G1"), Just("N5 G01")], n(), n()).prop_map(|(g, x, y)| format!("{g} X{x}  Y{y}")),
        3 => prop_oneof![
            Just("G90"), Just("G91"), Just("G20"), Just("G21"), Just("G17"), Just("G18"), Just("G93"), Just("G94"),
            Just("G90.1"), Just("G91.1"), Just("F1500"), Just("F20.5 S3000 M3"), Just("; note"), Just("(a) G4 P0.1"),
            Just("#5 = [1+2]"), Just("/G1 X1"), Just("M30"), Just("%"), Just(""), Just("O77"), Just("\t "), Just("G41 D1"),
        ].prop_map(str::to_owned),
        1 => "[ -~]{0,30}",
    ]
}

fn program() -> impl Strategy<Value = String> {
    let lines = prop::collection::vec((block(), prop_oneof![Just("\n"), Just("\r\n")]), 0..40);
    (lines, any::<bool>()).prop_map(|(lines, cut)| {
        let text: String = lines.into_iter().map(|(l, e)| l + e).collect();
        if cut {
            text.trim_end().to_owned()
        } else {
            text
        }
    })
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 500, ..ProptestConfig::default() })]

    #[test]
    fn zero_model_gives_identical_text(text in program()) {
        for keep in [Keep::Feed, Keep::Omega] {
            let options = Options { keep, all_planes: true, ..Options::default() };
            prop_assert_eq!(&compensate(text.as_bytes(), &zero(), &options).program, text.as_bytes());
        }
    }

    /// Whatever the program: lines that hold no corrected arc are there still, in order.
    #[test]
    fn untouched_lines_are_copied(text in program()) {
        let options = Options { all_planes: true, ..Options::default() };
        let result = compensate(text.as_bytes(), &lag(), &options);
        let out = String::from_utf8(result.program).unwrap();
        let mut rest = out.split_inclusive('\n');
        let touched = |i: usize| result.arcs.iter().any(|a| a.line == i + 1);
        for (i, line) in text.split_inclusive('\n').enumerate() {
            if !touched(i) && !line.trim().is_empty() {
                prop_assert!(rest.any(|l| l == line), "{:?} is missing in\n{}", line, out);
            }
        }
    }
}

#[test]
fn what_acts_between_an_arc_and_its_line_keeps_its_place() {
    let corrected = |between: &str, line: &str| {
        let head = "G21 G17 G90\nG0 X-20 Y0\nG1 X0 Y0 F6000\n";
        let program = format!("{head}G3 X50 Y50 I0 J50\n{between}{line}M2\n");
        run(&program, &Options::default()).0
    };
    // The last block before what acts ends where the arc did, or beyond it on the line.
    let ends_at_the_arc = |text: &str, mark: &str| {
        let before = text.split(mark).next().unwrap();
        before
            .trim_end()
            .lines()
            .last()
            .unwrap()
            .contains("X50 Y50 ")
    };
    let line = "G1 Y80\n";
    assert!(!ends_at_the_arc(&corrected("(here)\n", line), "(here)"));
    assert!(ends_at_the_arc(&corrected("(MSG, here)\n", line), "(MSG"));
    assert!(ends_at_the_arc(
        &corrected("( print, #1)\n", line),
        "( print"
    ));
    assert!(ends_at_the_arc(
        &corrected("", "G1 X50 N7 Y80\n"),
        "G1 X50 N7"
    ));
    // A feed mode said again takes the feed away.
    assert_eq!(
        left("G21 G17 G90 G94\nG1 X0 Y0 F3000\nG94\nG3 X50 Y50 I0 J50\nG1 Y80\nM2\n"),
        Left::UnknownFeed(Some(because(3, 'G', 940)))
    );
}
