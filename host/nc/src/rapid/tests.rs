//! RAPID modules: what is rewritten, what is not, and where the robot goes.
use super::super::tests::model;
use super::super::{Because, Code, Fate, Left, Options};
use super::read::Reader;
use super::*;
use giotto::model_file::Servo;
use std::f64::consts::TAU;

const POSE: &str = "[0,0,1,0],[0,0,0,0],[9E9,9E9,9E9,9E9,9E9,9E9]";

fn lag() -> ModelFile {
    model(Servo::Lag { kv_per_s: 43.3 })
}

fn zero() -> ModelFile {
    model(Servo::Beta {
        beta1_s2: 0.0,
        beta2_s4: 0.0,
        half_width95: [0.0; 2],
    })
}

/// A circle of 100 mm in two halves between tangents, as it is taught.
fn module() -> String {
    format!(
        "%%%\n  VERSION:1\n  LANGUAGE:ENGLISH\n%%%\nMODULE part\n  ! a circle! \"of\" 100\n  CONST robtarget p1 := [[-150,-100,5],{POSE}];\n  \
         CONST robtarget p2:=[[0, -100, 5],{POSE}];\n  CONST robtarget p3 := [[100,0,5],{POSE}];\n  LOCAL CONST robtarget p4 := [[0,100,5],{POSE}];\n  \
         CONST robtarget p5 := [[-100,0,5],{POSE}];\n  CONST robtarget p6 := [[150,-100,5],{POSE}];\n  CONST speeddata slow := [300, 500, 5000, 1000];\n  \
         PROC main()\n    ConfL \\Off;\n    MoveJ p1,v500,fine,tool0\\WObj:=wobj0;\n    MoveL p2, slow, z0, tool0\\WObj:=wobj0;\n    \
         MoveC p3, p4, v300, z0, tool0\\WObj:=wobj0; ! first half\r\n    MoveC p5,p2,v300,z0,tool0\\WObj:=wobj0;\n    \
         MoveL p6,v300,fine,tool0\\WObj:=wobj0;\n  ENDPROC\nENDMODULE\n"
    )
}

fn arcs(program: &[u8]) -> Vec<Arc> {
    let mut reader = Reader::default();
    let read = program
        .split_inclusive(|b| *b == b'\n')
        .map(|line| reader.step(line).action);
    read.filter_map(|a| {
        if let Action::Arc(arc) = a {
            Some(arc)
        } else {
            None
        }
    })
    .collect()
}

#[test]
fn a_taught_circle_is_corrected_and_the_rest_copied() {
    assert!(is_rapid(module().as_bytes()) && !is_rapid(b"%\n(MODULE)\nG1 X1\n"));
    let result = compensate(module().as_bytes(), &lag(), &Options::default());
    let text = String::from_utf8(result.program).unwrap();
    let [
        Fate::Corrected {
            delta_mm,
            radius_mm,
            feed_mm_s,
            ..
        },
        Fate::Corrected { .. },
    ] = [result.arcs[0].fate, result.arcs[1].fate]
    else {
        panic!("{:?}", result.arcs)
    };
    assert!((radius_mm - 100.0).abs() < 1e-9 && feed_mm_s == 300.0);
    // ω = 3 rad/s through a lag of 23 ms, feed kept.
    let programmed = 100.0 + delta_mm;
    let made = programmed / (1.0 + (300.0 / programmed / 43.3).powi(2)).sqrt();
    assert!((made - 100.0).abs() < 1e-9, "{delta_mm} {made}");
    for line in module()
        .split_inclusive('\n')
        .filter(|l| !l.contains("MoveC"))
    {
        assert!(text.contains(line), "{line} is missing in\n{text}");
    }
    assert!(text.contains("; ! first half\r\n"), "{text}");
    // Read back: an unbroken path of arcs, the long ones at the corrected radius, one turn in all.
    let back = arcs(text.as_bytes());
    let long: Vec<&Arc> = back.iter().filter(|a| a.length_mm() > 100.0).collect();
    assert_eq!(long.len(), 2);
    assert!(
        long.iter().all(|a| (a.radius_mm - programmed).abs() < 1e-4),
        "{long:?}"
    );
    // Every instruction is one that a robot takes, and each goes on where the one before ended, along its tangent.
    assert_eq!(check(text.as_bytes()), []);
    let mut reader = Reader::default();
    // A robot takes no MoveC of less than 4°: arcs flatter than that are chords, which leave their arc by 1 % of the
    // correction at most and so meet in corners of 8 bulges over their length. All other joints are tangent.
    let bulge_mm = (0.01 * delta_mm.abs()).max(5e-4);
    let mut last: Option<([f64; 2], [f64; 2], f64)> = None;
    let mut turned = 0.0;
    for action in text
        .split_inclusive('\n')
        .map(|l| reader.step(l.as_bytes()).action)
    {
        // How far a chord may turn from its arc at its ends, rad.
        let (start, end, t0, t1, chord) = match action {
            Action::Arc(a) => {
                turned += a.sweep_rad;
                (a.start, a.end, a.tangent(false), a.tangent(true), 0.0)
            }
            Action::Line(l) if l.start[0].is_some() => {
                let [s, e] = [l.start, l.end].map(|p| [p[0].unwrap(), p[1].unwrap()]);
                let n = (e[0] - s[0]).hypot(e[1] - s[1]);
                let t = [(e[0] - s[0]) / n, (e[1] - s[1]) / n];
                (s, e, t, t, 4.0 * bulge_mm / n)
            }
            _ => continue,
        };
        if let Some((place, tangent, before)) = last {
            assert_eq!(place, start, "unbroken: {text}");
            let cross = tangent[0] * t0[1] - tangent[1] * t0[0];
            assert!(
                cross.abs() < 2e-3 + before + chord,
                "a corner of {cross} rad in\n{text}"
            );
            turned += cross;
        }
        last = Some((end, t1, chord));
    }
    assert!((turned - TAU).abs() < 2e-2, "{turned}");
}

#[test]
fn a_zero_model_changes_no_byte_and_omega_may_be_kept() {
    let program = module();
    let same = compensate(program.as_bytes(), &zero(), &Options::default());
    assert_eq!(same.program, program.as_bytes());
    let options = Options {
        keep: super::super::Keep::Omega,
        ..Options::default()
    };
    let text = String::from_utf8(compensate(program.as_bytes(), &lag(), &options).program).unwrap();
    let back = arcs(text.as_bytes());
    let longest = back
        .iter()
        .max_by(|a, b| a.length_mm().total_cmp(&b.length_mm()))
        .unwrap();
    assert!(
        (longest.feed_mm_s / longest.radius_mm - 3.0).abs() < 1e-6,
        "{text}"
    );
    assert!(text.contains(",500,5000,1000],z0,tool0"), "{text}");
}

fn left(change: impl Fn(String) -> String) -> Left {
    let program = change(module());
    assert_ne!(program, module(), "the case changes nothing");
    let result = compensate(program.as_bytes(), &lag(), &Options::default());
    match result.arcs[0].fate {
        Fate::Left(left) => left,
        Fate::Corrected { .. } => panic!("corrected:\n{program}"),
    }
}

fn named(line: usize, name: &'static str) -> Option<Because> {
    Some(Because {
        line,
        code: Code::Named(name),
    })
}

#[test]
fn reasons_to_leave_an_arc() {
    assert_eq!(
        left(|m| m.replace("CONST robtarget p3", "VAR robtarget p3")),
        Left::Expression
    );
    assert_eq!(
        left(|m| m.replace("MoveC p3,", "MoveC Offs(p3,0,0,x),")),
        Left::Expression
    );
    assert_eq!(
        left(|m| m.replace("MoveC p3", "MoveCDO p3")),
        Left::Dialect("MoveC with a signal or a call")
    );
    assert_eq!(
        left(|m| m.replace("    MoveC p3", "    ELSE\n    MoveC p3")),
        Left::UnknownPosition(named(18, "a branch or loop"))
    );
    assert_eq!(
        left(|m| m.replace("    MoveL p2", "    VelSet 50,800;\n    MoveL p2")),
        Left::UnknownFeed(named(17, "VelSet"))
    );
    assert_eq!(
        left(|m| m.replace("MoveC p3", "ArcC p3")),
        Left::Dialect("ArcC, whose speed stands in its weld data")
    );
    assert_eq!(
        left(|m| m.replace("v300, z0", "vmax, z0")),
        Left::UnknownFeed(named(18, "a speed that only the controller knows"))
    );
    assert_eq!(
        left(|m| m.replace("v300, z0", "v300\\T:=5, z0")),
        Left::UnknownFeed(named(18, "a speed that only the controller knows"))
    );
    assert_eq!(
        left(|m| m.replace("    MoveC p3", "    grip;\n    MoveC p3")),
        Left::UnknownPosition(named(18, "a call or an instruction that is not known"))
    );
    assert_eq!(
        left(|m| m.replace("v300, z0, tool0", "v300, z0, tool1")),
        Left::UnknownPosition(named(18, "another tool or frame"))
    );
    assert_eq!(
        left(|m| m.replace("[[100,0,5]", "[[100,0,9]")),
        Left::OtherPlane
    );
    assert_eq!(
        left(|m| m.replace("[[100,0,5]", "[[0,0,5]")),
        Left::Geometry
    );
    assert_eq!(
        left(|m| m.replacen("[[0,100,5],[0,0,1,0]", "[[0,100,5],[1,0,0,0]", 1)),
        Left::Orientation
    );
    assert_eq!(left(|m| m.replace("v300, z0", "v10, z0")), Left::Negligible);
    assert_eq!(
        left(|m| m.replace("v300, z0", "[nan,1,1,1], z0")),
        Left::UnknownFeed(named(18, "a speed that only the controller knows"))
    );
}

/// The circle through three points, against its parametric form.
#[test]
fn both_ways_round() {
    for sense in [1.0, -1.0] {
        let at = |a: f64| {
            format!(
                "[[{},{},0],{POSE}]",
                7.0 + 20.0 * (sense * a).cos(),
                20.0 * (sense * a).sin()
            )
        };
        let text = format!(
            "PROC p()\nMoveL {},v100,z1,t;\nMoveC {},{},v100,z1,t;\nENDPROC",
            at(0.2),
            at(2.0),
            at(3.7)
        );
        let found = arcs(text.as_bytes());
        assert_eq!(found.len(), 1, "{text}");
        assert!((found[0].sweep_rad - sense * 3.5).abs() < 1e-9, "{found:?}");
        assert!(
            (found[0].radius_mm - 20.0).abs() < 1e-9 && (found[0].centre[0] - 7.0).abs() < 1e-9
        );
    }
}
