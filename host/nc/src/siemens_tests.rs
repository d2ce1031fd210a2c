//! Programs of Siemens against the same part in plain RS-274: the same circles, and nothing else touched.
use super::path::{Kind, Move, moves};
use super::tests::lag;
use super::{Because, Code, Fate, Left, Mark, Options, compensate, compensate_to, marked};

const HEAD: &str = "G71 G17 G90 G94 F15000\nG0 X-20 Y0\nG1 X0 Y0\n";
const TAIL: &str = "G1 Y80\nM30\n";

fn corrected(program: &str) -> (String, Vec<Fate>) {
    let result = compensate(program.as_bytes(), &lag(), &Options::default());
    let fates = result.arcs.iter().map(|a| a.fate).collect();
    (String::from_utf8(result.program).unwrap(), fates)
}

fn left(arc: &str) -> Left {
    let program = format!("MSG(\"a\")\n{HEAD}{arc}\n{TAIL}");
    let (text, fates) = corrected(&program);
    assert_eq!(text, program, "{arc}");
    match fates[..] {
        [Fate::Left(left)] => left,
        _ => panic!("{arc}: {fates:?}"),
    }
}

fn same_way(a: &str, b: &str) {
    let list = |text: &str| -> Vec<Move> {
        let all = moves(text.as_bytes(), &Options::default());
        all.into_iter().filter(|m| m.kind != Kind::Rapid).collect()
    };
    let (a, b) = (list(a), list(b));
    assert_eq!(a.len(), b.len());
    for (a, b) in a.iter().zip(&b) {
        for axis in 0..2 {
            let (p, q) = (a.to_mm[axis].unwrap(), b.to_mm[axis].unwrap());
            assert!((p - q).abs() < 2e-5, "{a:?} {b:?}");
        }
        match (a.kind, b.kind) {
            (Kind::Arc { sweep_rad: p, .. }, Kind::Arc { sweep_rad: q, .. }) => {
                assert!((p - q).abs() < 1e-3, "{a:?} {b:?}");
            }
            (a, b) => assert_eq!(a, b),
        }
    }
}

/// A quarter of a circle of 50 mm about (0, 50) in every form.
#[test]
fn every_form_of_an_arc_becomes_the_same_way() {
    let plain = format!("MSG(\"a\")\n{HEAD}G3 X50 Y50 I0 J50\n{TAIL}");
    let (reference, fates) = corrected(&plain);
    assert!(matches!(fates[..], [Fate::Corrected { .. }]), "{fates:?}");
    for arc in [
        "G3 X50 Y50 I=AC(0) J=AC(50)",
        "G3 X50 Y50 I=IC(0) J=AC(50)",
        "G3 X=AC(50) Y=IC(50) J=IC(50)",
        "N10 G3 X=50 Y=50 J = AC( 50 )",
        "G3 X50 Y50 CR=50",
        "G3 X50 Y50 CR=+50.0",
        "CIP X50 Y50 I1=35.35533906 J1=14.64466094",
        "N10 CIP X=AC(50) Y50 J1=AC(14.64466094) I1=35.35533906",
        "G91 G3 X50 Y50 J50\nG90",
        "G91 G3 X=AC(50) Y50 J=AC(50)\nG90",
    ] {
        let program = format!("MSG(\"a\")\n{HEAD}{arc}\n{TAIL}");
        let (text, fates) = corrected(&program);
        assert!(
            matches!(fates[..], [Fate::Corrected { .. }]),
            "{arc}: {fates:?}"
        );
        if !arc.contains("G91") {
            same_way(&text, &reference);
        }
        // Nothing of the old form is left behind, but an end that is kept to the letter.
        for gone in ["IC(", "I1=", "J1=", "CR=", "CIP", "I=", "J="] {
            assert!(!text.contains(gone), "{arc}:\n{text}");
        }
        assert!(text.starts_with(&format!("MSG(\"a\")\n{HEAD}")) && text.ends_with(TAIL));
    }
}

#[test]
fn what_is_not_sure_is_left() {
    use Left::Dialect;
    for (arc, why) in [
        (
            "G3 X50 Y50 AR=90",
            Dialect("an arc with AC(), AR= or TURN= of Siemens"),
        ),
        (
            "G3 X50 Y50 I=AC(R1) J=AC(50)",
            Dialect("an arc with AC(), AR= or TURN= of Siemens"),
        ),
        ("CT X50 Y50", Dialect("CT of Siemens")),
        ("CIP X50 Y50 Z1 I1=35.3 J1=14.6 K1=0.5", Left::OtherPlane),
        (
            "CIP X50 Y50 I1=35.3",
            Dialect("CIP of Siemens without all of its points in G90"),
        ),
        (
            "CIP X50 Y50 I1=IC(35.3) J1=14.6",
            Dialect("CIP of Siemens without all of its points in G90"),
        ),
        ("CIP X50 Y50 I1=25 J1=25", Left::Geometry),
        ("G3 X50 Y50 I=AC(0) J=AC(49)", Left::Geometry),
        (
            "CIP X50 Y50 I1=35.35533906 J1=14.64466094\nX60 Y90 I1=55 J1=70",
            Dialect("CIP of Siemens that stays in force"),
        ),
    ] {
        if arc.contains("X60") {
            let program = format!("{HEAD}{arc}\n{TAIL}");
            let (text, fates) = corrected(&program);
            assert_eq!(text, program);
            assert_eq!(fates[0], Fate::Left(why), "{arc}");
        } else {
            assert_eq!(left(arc), why, "{arc}");
        }
    }
}

/// Words that mean something else to Siemens than to the others.
#[test]
fn siemens_has_its_own_meanings() {
    // `G4 F2` waits, and F stays.
    let program = format!("{HEAD}G4 F2\nG3 X50 Y50 CR=50\n{TAIL}");
    let (_, fates) = corrected(&program);
    assert!(
        matches!(
            fates[..],
            [Fate::Corrected { feed_mm_s, .. }] if (feed_mm_s - 250.0).abs() < 1e-9
        ),
        "{fates:?}"
    );
    let lost = |words: &str, line: usize, code: Code| {
        let program = format!("{HEAD}{words}\nG3 X50 Y50 CR=50\n{TAIL}");
        let (text, fates) = corrected(&program);
        assert_eq!(text, program);
        let because = Because { line, code };
        let known = [
            Left::UnknownPosition(Some(because)),
            Left::UnknownModes(because),
            Left::UnknownCode(because),
            Left::ExactStop(because),
            Left::Coordinates(because),
        ];
        let [Fate::Left(left)] = fates[..] else {
            panic!("{words}: {fates:?}")
        };
        assert!(known.contains(&left), "{words}: {left:?}");
    };
    lost("L100", 4, Code::Named("a subprogram"));
    lost("D2", 4, Code::Named("D with its offsets"));
    lost(
        "T=\"MILL (10)\" M6",
        4,
        Code::Named("a tool with its offsets"),
    );
    lost("M17", 4, Code::Word('M', 170));
    lost("G60", 4, Code::Word('G', 600));
    lost("G507", 4, Code::Word('G', 5070));
    lost("G70", 4, Code::Word('G', 700));
    lost("TRANS X5", 4, Code::Named("what stands there"));
    // What stays in force is not taken back by saying the modes again.
    let again = "\nG71 G17 G90 G94 F15000\nG0 X0 Y0";
    for (words, name) in [
        ("CYCLE800(1,\"\",0)", "CYCLE800"),
        ("SCALE X2 Y2", "SCALE"),
        ("DIAMON", "DIAMON"),
    ] {
        lost(&format!("{words}{again}"), 4, Code::Named(name));
    }
}

/// As a post writes it: the tool by its name, a message, the mark behind a semicolon.
#[test]
fn a_whole_program() {
    let program = format!(
        "%_N_PART_MPF\nN10 G71 G17 G90 G94 G64\nN20 T=\"MILL\" D1\nN30 MSG(\"corner (R50)\")\n{HEAD}G3 X50 Y50 I=AC(0) J=AC(50) ; corner\n{TAIL}"
    );
    let mark = Mark {
        version: "1".into(),
        model: "2".into(),
        options: "3".into(),
    };
    let mut out = Vec::new();
    let options = Options::default();
    let arcs = compensate_to(program.as_bytes(), &lag(), &options, Some(&mark), &mut out).unwrap();
    assert!(matches!(arcs[0].fate, Fate::Corrected { .. }), "{arcs:?}");
    let text = String::from_utf8(out).unwrap();
    assert!(text.contains("\n; giotto compensate 1 "), "{text}");
    assert!(marked(text.as_bytes()).is_some());
}

/// Without a word that is Siemens' alone the reader is the one of the others: G71 is a cycle of lathes there.
#[test]
fn g71_is_metric_to_siemens_only() {
    let program = format!("{HEAD}G3 X50 Y50 I0 J50\n{TAIL}");
    let (text, fates) = corrected(&program);
    assert!(matches!(fates[..], [Fate::Left(_)]), "{fates:?}");
    assert_eq!(text, program);
}

/// Arcs of every size and sweep, either way round, in every form: the output is that of the plain one.
#[test]
fn made_up_arcs_in_every_form() {
    for arc in made_up_arcs(60) {
        let [[x, y], [i, j], [u, v]] = [arc.end, arc.centre, arc.via];
        let [[sx, sy], [bx, by], [ax, ay]] = [arc.start, arc.before, arc.after];
        let code = if arc.ccw { "G3" } else { "G2" };
        let (di, dj) = (i - sx, j - sy);
        let cr = if arc.sweep > std::f64::consts::PI {
            -arc.radius
        } else {
            arc.radius
        };
        let head = format!(
            "MSG(\"\")\nG71 G17 G90 G94 F6000\nG0 X{bx:.8} Y{by:.8}\nG1 X{sx:.8} Y{sy:.8}\n"
        );
        let whole = |block: &str| format!("{head}{block}\nG1 X{ax:.8} Y{ay:.8}\nM30\n");
        let plain = whole(&format!("{code} X{x:.8} Y{y:.8} I{di:.8} J{dj:.8}"));
        let (reference, fates) = corrected(&plain);
        assert!(
            matches!(fates[..], [Fate::Corrected { .. }]),
            "{plain}{fates:?}"
        );
        for block in [
            format!("{code} X{x:.8} Y{y:.8} I=AC({i:.8}) J=AC({j:.8})"),
            format!(
                "{code} X=IC({:.8}) Y=AC({y:.8}) I=IC({di:.8}) J=AC({j:.8})",
                x - sx
            ),
            format!("{code} X{x:.8} Y{y:.8} CR={cr:.8}"),
            format!("CIP X{x:.8} Y{y:.8} I1={u:.8} J1={v:.8}"),
        ] {
            let (text, fates) = corrected(&whole(&block));
            assert!(
                matches!(fates[..], [Fate::Corrected { .. }]),
                "{block}: {fates:?}"
            );
            same_way(&text, &reference);
        }
    }
}

/// An arc between two lines that touch it.
pub(super) struct MadeUp {
    pub(super) start: [f64; 2],
    pub(super) end: [f64; 2],
    pub(super) centre: [f64; 2],
    pub(super) via: [f64; 2],
    pub(super) before: [f64; 2],
    pub(super) after: [f64; 2],
    pub(super) radius: f64,
    pub(super) sweep: f64,
    pub(super) ccw: bool,
}

/// The same ones each time.
pub(super) fn made_up_arcs(count: usize) -> Vec<MadeUp> {
    let mut state = 88_172_645_463_325_252_u64;
    let mut between = move |low: f64, high: f64| {
        state ^= state << 13;
        state ^= state >> 7;
        state ^= state << 17;
        low + (high - low) * (state >> 11) as f64 / (1_u64 << 53) as f64
    };
    let mut arcs = Vec::new();
    while arcs.len() < count {
        let radius = between(12.0, 80.0);
        let sweep = between(1.2, 5.6);
        // The radius of a half turn says nothing about its centre.
        if (sweep - std::f64::consts::PI).abs() < 0.2 {
            continue;
        }
        let centre = [between(-200.0, 200.0), between(-200.0, 200.0)];
        let (begin, ccw) = (between(-3.0, 3.0), between(0.0, 1.0) < 0.5);
        let side = if ccw { 1.0 } else { -1.0 };
        let at = |swept: f64, aside: f64| {
            let (sin, cos) = (begin + side * swept).sin_cos();
            [
                centre[0] + radius * cos - side * aside * sin,
                centre[1] + radius * sin + side * aside * cos,
            ]
        };
        arcs.push(MadeUp {
            start: at(0.0, 0.0),
            end: at(sweep, 0.0),
            centre,
            via: at(0.45 * sweep, 0.0),
            before: at(0.0, -40.0),
            after: at(sweep, 40.0),
            radius,
            sweep,
            ccw,
        });
    }
    arcs
}
