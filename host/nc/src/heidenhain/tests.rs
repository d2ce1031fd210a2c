//! Klartext against the same part in RS-274, block by block, and what is left.
use crate::contour::contour;
use crate::path::{Kind, moves};
use crate::siemens_tests::made_up_arcs;
use crate::tests::lag;
use crate::{Fate, Left, Mark, Options, compensate, compensate_to, marked};

const HEAD: [&str; 3] = [
    "BEGIN PGM PART MM",
    "TOOL CALL 5 Z S3000",
    "L X-20 Y+0 R0 FMAX M3",
];
/// A quarter about (0, 50), a line, a half turn by its radius, and on.
const PART: [&str; 8] = [
    "L X+0 Y+0 F15000",
    "; a comment",
    "CC X+0 Y+50",
    "C X+50 Y+50 DR+ ; a (corner)",
    "L Y+120",
    "CR X-50 Y+120 R+50 DR+ R0",
    "L Y+0",
    "END PGM PART MM",
];

fn program(blocks: &[&str]) -> String {
    let numbered = HEAD.iter().chain(blocks).enumerate();
    numbered.map(|(n, text)| format!("{n} {text}\n")).collect()
}

fn corrected(text: &str) -> (String, Vec<Fate>) {
    let result = compensate(text.as_bytes(), &lag(), &Options::default());
    let fates = result.arcs.iter().map(|a| a.fate).collect();
    (String::from_utf8(result.program).unwrap(), fates)
}

/// Numbers and texts of blocks.
fn blocks(text: &str) -> Vec<(u64, &str)> {
    text.lines()
        .map(|line| {
            let (number, rest) = line.split_once(' ').unwrap();
            (number.parse().unwrap(), rest)
        })
        .collect()
}

#[test]
fn circles_become_those_of_the_same_part_in_rs_274() {
    let klartext = program(&PART);
    let (text, fates) = corrected(&klartext);
    assert!(
        matches!(fates[..], [Fate::Corrected { .. }, Fate::Corrected { .. }]),
        "{fates:?}"
    );
    let options = Options {
        slow_to_stops: false,
        ..Options::default()
    };
    let rs274 = "G21 G17 G90\nG0 X-20 Y0\nG1 X0 Y0 F15000\nG3 X50 Y50 J50\nG1 Y120\nG3 X-50 Y120 I-50\nG1 Y0\nM2\n";
    let other = compensate(rs274.as_bytes(), &lag(), &options).program;
    let ends = |text: &[u8]| -> Vec<[f64; 2]> {
        let list = moves(text, &options).into_iter();
        list.filter(|m| m.kind != Kind::Rapid)
            .map(|m| [m.to_mm[0].unwrap(), m.to_mm[1].unwrap()])
            .collect()
    };
    // The half turn is written in parts; every place of RS-274 is one of Klartext.
    let here = ends(text.as_bytes());
    for there in ends(&other) {
        let near = here
            .iter()
            .any(|p| (p[0] - there[0]).hypot(p[1] - there[1]) < 2e-4);
        assert!(near, "{there:?}\n{text}");
    }
    // And the machine makes of it what it makes of the other.
    let meant = moves(klartext.as_bytes(), &options);
    let most = |run: &str| -> f64 {
        let found = contour(&moves(run.as_bytes(), &options), &meant, &lag(), &options).unwrap();
        let arcs = meant.iter().zip(found.most_um);
        let arcs = arcs.filter(|(m, _)| matches!(m.kind, Kind::Arc { .. }));
        arcs.map(|(_, um)| um.unwrap()).fold(0.0, f64::max)
    };
    let (before, after) = (most(&klartext), most(&text));
    // What is left is what the plan says of its joints.
    let Fate::Corrected { joint_share, .. } = fates[0] else {
        unreachable!()
    };
    assert!(before > 300.0, "{before}");
    assert!(
        (after / before / joint_share - 1.0).abs() < 0.1,
        "{before} {after} {joint_share}"
    );
}

#[test]
fn every_other_block_is_kept_and_numbers_count_on() {
    let klartext = program(&PART);
    let (text, _) = corrected(&klartext);
    let (was, is) = (blocks(&klartext), blocks(&text));
    assert!(is.len() > was.len() + 4, "{text}");
    for (k, (number, _)) in is.iter().enumerate() {
        assert_eq!(*number, k as u64, "{text}");
    }
    let circle = |text: &&str| text.starts_with("C ") || text.starts_with("CR");
    let mut rest = is.iter().map(|b| b.1);
    for (_, kept) in was.iter().filter(|b| !circle(&b.1)) {
        assert!(rest.any(|text| text == *kept), "{kept} in\n{text}");
    }
    // The pole holds for the corrected circle as well, R0 and the comment stay with their block.
    assert!(
        text.contains("C X+") && text.contains("; a (corner)"),
        "{text}"
    );
    assert_eq!(
        text.matches(" R0").count(),
        klartext.matches(" R0").count(),
        "{text}"
    );
}

#[test]
fn blocks_without_numbers_get_none() {
    let klartext: String = HEAD
        .iter()
        .chain(&PART)
        .map(|b| format!("{b}\r\n"))
        .collect();
    let (text, fates) = corrected(&klartext);
    assert!(matches!(fates[0], Fate::Corrected { .. }), "{fates:?}");
    assert!(
        text.lines()
            .all(|l| !l.starts_with(|c: char| c.is_ascii_digit()))
    );
    assert_eq!(text.matches("\r\n").count(), text.matches('\n').count());
}

#[test]
fn what_is_not_plain_is_left_to_the_byte() {
    let line = "L X+0 Y+0 F15000";
    for (put, why) in [
        (
            vec![line, "CC X+0 Y+50", "C X+50 Y+50 Z-1 DR+"],
            "a helix of Heidenhain",
        ),
        (
            vec![line, "CC X+0 Y+50", "CP IPA+90 IZ-1 DR+"],
            "CP of Heidenhain",
        ),
        (vec![line, "CT X+50 Y+50"], "CT of Heidenhain"),
        (
            vec![line, "L X+50", "RND R5", "L Y+50"],
            "RND of Heidenhain",
        ),
        (
            vec![line, "CC X+0 Y+50", "C X+50 Y+50 DR+ M8"],
            "M8 in the block",
        ),
        (
            vec![line, "CC X+0 Y+50", "C X+50 Y+Q5 DR+"],
            "parameters or expressions",
        ),
        (
            vec![line, "CC X+0 Y+49", "C X+50 Y+50 DR+"],
            "centre, radius and ends",
        ),
        (vec![line, "C X+50 Y+50 DR+"], "a pole that is not known"),
        (
            vec![line, "L X+1 RL", "CC X+1 Y+50", "C X+50 Y+51 DR+"],
            "cutter radius compensation is on since RL or RR in line 5",
        ),
        (
            vec![line, "LBL 1", "CR X+50 Y+50 R+50 DR+"],
            "where it starts is not known since LBL in line 5",
        ),
        (
            vec![line, "CYCL CALL M3", "CR X+50 Y+50 R+50 DR+"],
            "since CYCL CALL in line 5",
        ),
        (
            vec![line, "CYCL DEF 7.0 DATUM SHIFT", "CR X+50 Y+50 R+50 DR+"],
            "since CYCL DEF of a datum in line 5",
        ),
        (
            vec![line, "CR X+50 Y+50 R+50 DR+", "CYCL DEF 10.0 ROTATION"],
            "a cycle that turns, mirrors or scales in line 6",
        ),
        (
            vec![
                line,
                "CR X+50 Y+50 R+50 DR+",
                "PLANE SPATIAL SPA+0 SPB+45 SPC+0",
            ],
            "PLANE in line 6",
        ),
        (
            vec![line, "CR X+50 Y+50 R+50 DR+", "L Z+5 R0 FMAX M128"],
            "an M-function that changes",
        ),
        (
            vec![line, "CR X+50 Y+50 R+50 DR+", "CHF 2", "L Y+90"],
            "beside RND or CHF",
        ),
        (
            vec!["L X+0 Y+0 FQ1", "CR X+50 Y+50 R+50 DR+"],
            "where it starts is not known",
        ),
        (
            vec!["L X+0 Y+0", "CR X+50 Y+50 R+50 DR+"],
            "its feed is not known since TOOL CALL in line 2",
        ),
    ] {
        let text = program(&put);
        let (output, fates) = corrected(&text);
        assert_eq!(output, text);
        let [Fate::Left(left)] = fates[..] else {
            panic!("{put:?}: {fates:?}")
        };
        assert!(left.to_string().contains(why), "{put:?}: {left}");
    }
}

/// Numbers that do not count up by one may be meant for somebody; a control would number anew.
#[test]
fn odd_numbers_are_left() {
    let text = program(&PART).replace("\n7 ", "\n70 ");
    let (output, fates) = corrected(&text);
    assert_eq!(output, text);
    let why = "a circle of Heidenhain between block numbers that do not count by one";
    assert_eq!(fates[0], Fate::Left(Left::Dialect(why)));
}

/// A corner that is rounded belongs to nobody's entry.
#[test]
fn no_run_out_into_a_line_that_is_cut() {
    let cut = [
        "L X+0 Y+0 F15000",
        "CC X+0 Y+50",
        "C X+50 Y+50 DR+",
        "L Y+120",
        "RND R5",
        "L X+0",
    ];
    let whole = [cut[0], cut[1], cut[2], cut[3], cut[5]];
    let blocks_of = |list: &[&str]| {
        let (text, fates) = corrected(&program(list));
        let Fate::Corrected { .. } = fates[0] else {
            panic!("{fates:?}")
        };
        // Where the last block of the circle ends.
        let lines: Vec<String> = text.lines().map(str::to_owned).collect();
        let line = lines.iter().position(|l| l.ends_with("L Y+120")).unwrap();
        lines[line - 1].clone()
    };
    assert!(
        blocks_of(&cut).contains("X+50 Y+50 "),
        "{}",
        blocks_of(&cut)
    );
    assert!(
        !blocks_of(&whole).contains("Y+50 "),
        "{}",
        blocks_of(&whole)
    );
}

/// The mark is a block of its own, and known again behind its number.
#[test]
fn a_corrected_program_is_marked() {
    let mark = Mark {
        version: "1".into(),
        model: "2".into(),
        options: "3".into(),
    };
    let mut out = Vec::new();
    let text = program(&PART);
    compensate_to(
        text.as_bytes(),
        &lag(),
        &Options::default(),
        Some(&mark),
        &mut out,
    )
    .unwrap();
    let text = String::from_utf8(out).unwrap();
    assert!(
        text.starts_with("0 BEGIN PGM PART MM\n1 ; giotto compensate 1 "),
        "{text}"
    );
    let (line, _) = marked(text.as_bytes()).unwrap();
    assert_eq!(line, 2);
}

/// Programs of robots are known by their circles, and left.
#[test]
fn programs_of_robots_are_left_by_name() {
    for (text, name) in [
        (
            "&ACCESS RVP\nDEF part()\n$VEL.CP=0.25\nLIN {X 0,Y 0,Z 0,A 0,B 0,C 0} C_DIS\nCIRC {X 35.36,Y 14.64,Z 0}, {X 50,Y 50,Z 0} C_DIS\nEND\n",
            "CIRC of KUKA",
        ),
        (
            "/PROG PART\n/MN\n   1:L P[1] 250mm/sec CNT100 ;\n   2:C P[2]\n    P[3] 250mm/sec CNT100 ;\n/POS\n/END\n",
            "a circular motion of a Fanuc robot",
        ),
    ] {
        let (output, fates) = corrected(text);
        assert_eq!(output, text);
        assert_eq!(fates, [Fate::Left(Left::Dialect(name))]);
    }
}

/// Arcs of every size and sweep, either way round, in both forms: every place of the output of RS-274 is one of Klartext's.
#[test]
fn made_up_circles_in_both_forms() {
    let options = Options {
        slow_to_stops: false,
        ..Options::default()
    };
    let ends = |text: &[u8]| -> Vec<[f64; 2]> {
        let list = moves(text, &options).into_iter();
        list.filter(|m| m.kind != Kind::Rapid)
            .map(|m| [m.to_mm[0].unwrap(), m.to_mm[1].unwrap()])
            .collect()
    };
    for arc in made_up_arcs(60) {
        let [[x, y], [i, j]] = [arc.end, arc.centre];
        let [[sx, sy], [bx, by], [ax, ay]] = [arc.start, arc.before, arc.after];
        let (code, turn) = if arc.ccw {
            ("G3", "DR+")
        } else {
            ("G2", "DR-")
        };
        let rs274 = format!(
            "G21 G17 G90 F6000\nG0 X{bx:.6} Y{by:.6}\nG1 X{sx:.6} Y{sy:.6}\n{code} X{x:.6} Y{y:.6} I{:.6} J{:.6}\nG1 X{ax:.6} Y{ay:.6}\n",
            i - sx,
            j - sy
        );
        let reference = ends(&compensate(rs274.as_bytes(), &lag(), &options).program);
        assert!(reference.len() > 6, "{rs274}");
        let r = if arc.sweep > std::f64::consts::PI {
            -arc.radius
        } else {
            arc.radius
        };
        let pole = format!("CC X{i:+.6} Y{j:+.6}");
        for block in [
            format!("C X{x:+.6} Y{y:+.6} {turn}"),
            format!("CR X{x:+.6} Y{y:+.6} R{r:+.6} {turn}"),
        ] {
            let (text, fates) = corrected(&program(&[
                &format!("L X{bx:+.6} Y{by:+.6} FMAX"),
                &format!("L X{sx:+.6} Y{sy:+.6} F6000"),
                &pole,
                &block,
                &format!("L X{ax:+.6} Y{ay:+.6}"),
            ]));
            assert!(
                matches!(fates[..], [Fate::Corrected { .. }]),
                "{block}: {fates:?}"
            );
            assert!(!text.contains("R+0 ") && !text.contains("R-0 "), "{text}");
            let here = ends(text.as_bytes());
            for there in &reference {
                let near = here
                    .iter()
                    .any(|p| (p[0] - there[0]).hypot(p[1] - there[1]) < 3e-4);
                assert!(near, "{there:?}\n{text}");
            }
        }
    }
}
