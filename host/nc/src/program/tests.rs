//! Programs as segments, and what cannot be run.
use super::*;

fn running() -> Running {
    Running {
        start_mm: [0.0; 3],
        rapid_mm_s: 200.0,
        tolerance_mm: 0.0,
        tool_loaded: false,
    }
}

fn read(program: &str) -> Result<Vec<Block>, NotRunnable> {
    blocks(program.as_bytes(), &running())
}

/// Where the machine is after each block, µm.
fn ends_um(blocks: &[Block]) -> Vec<[f64; 3]> {
    let mut at = [0; 3];
    let mut ends = Vec::new();
    for block in blocks {
        at = block.step.segment.exact(at).unwrap().end_nm(at);
        ends.push(at.map(|nm| (f64::from(nm) * 1e-3 * 100.0).round() / 100.0));
    }
    ends
}

#[test]
fn lines_arcs_helices_and_dwells() {
    let program = "%\nG21 G90 G17 F600\nG0 X10\nG1 Y5 (feed) F1200\nG3 X5 Y10 I-5\nG2 X5 Y10 I5 J0 Z-2 P2\nG4 P0.25\n\
                   G18 G3 X9 Z-2 I2 K0\nG91 G1 X1 Z2\nM3 S1000\nM30\nG1 X99\n";
    let blocks = read(program).unwrap();
    let lines: Vec<usize> = blocks.iter().map(|block| block.line).collect();
    assert_eq!(lines, [3, 4, 5, 6, 7, 8, 9]);
    let feeds: Vec<f64> = blocks
        .iter()
        .map(|block| match block.step.segment {
            Segment::Line { feed_m_s, .. } | Segment::Arc { feed_m_s, .. } => feed_m_s,
            Segment::Dwell { time_s } => time_s,
        })
        .collect();
    assert_eq!((feeds[0], feeds[1], feeds[4]), (0.2, 0.02, 0.25));
    let expected = [
        [10e3, 0.0, 0.0],
        [10e3, 5e3, 0.0],
        [5e3, 10e3, 0.0],
        [5e3, 10e3, -2e3],
        [5e3, 10e3, -2e3],
        [9e3, 10e3, -2e3],
        [10e3, 10e3, 0.0],
    ];
    assert_eq!(ends_um(&blocks), expected);
    // Two turns, the other way; G18's first axis is Z, its normal +Y.
    let Segment::Arc {
        sweep_rad, rise_m, ..
    } = blocks[3].step.segment
    else {
        panic!()
    };
    assert!((sweep_rad + 2.0 * TAU).abs() < 1e-9 && rise_m == -2e-3);
    let Segment::Arc {
        sweep_rad, normal, ..
    } = blocks[5].step.segment
    else {
        panic!()
    };
    assert!(
        (sweep_rad.abs() - PI).abs() < 1e-9 && normal == [0.0, 1.0, 0.0],
        "{sweep_rad}"
    );
}

#[test]
fn an_arc_whose_radii_differ_by_rounding_ends_where_it_says() {
    let mut program = String::from("F600\n");
    for n in 1..=12 {
        let (s, c) = (f64::from(n) * 0.5).sin_cos();
        let (bs, bc) = (f64::from(n - 1) * 0.5).sin_cos();
        let place = |c: f64, s: f64| {
            (
                (20.0 * c * 1e3).round() / 1e3 - 20.0,
                (20.0 * s * 1e3).round() / 1e3,
            )
        };
        let ((x, y), (bx, by)) = (place(c, s), place(bc, bs));
        program.push_str(&format!(
            "G3 X{x:.3} Y{y:.3} I{:.3} J{:.3}\n",
            -20.0 - bx,
            -by
        ));
    }
    let blocks = read(&program).unwrap();
    let ends = ends_um(&blocks);
    for (block, end) in program.lines().skip(1).zip(ends) {
        let word = |letter: char| {
            let rest = &block[block.find(letter).unwrap() + 1..];
            rest.split(' ').next().unwrap().parse::<f64>().unwrap() * 1e3
        };
        assert!(
            (end[0] - word('X')).abs() < 0.02 && (end[1] - word('Y')).abs() < 0.02,
            "{block}: {end:?}"
        );
    }
}

#[test]
fn path_control_is_exact_stop_or_a_tolerance() {
    let program = "F600\nG1 X1\nG64 P0.02\nG1 Y1\nG61\nG1 X0\nG64\nG1 Y0\nG20 G64 P0.001 G1 X1\n";
    let running = Running {
        tolerance_mm: 0.005,
        ..running()
    };
    let blocks = blocks(program.as_bytes(), &running).unwrap();
    let tolerances: Vec<f64> = blocks
        .iter()
        .map(|block| block.step.tolerance_m * 1e6)
        .collect();
    for (got, expected) in tolerances.iter().zip([5.0, 20.0, 0.0, 5.0, 25.4]) {
        assert!((got - expected).abs() < 1e-9, "{tolerances:?}");
    }
}

#[test]
fn what_cannot_be_run_is_named_with_its_place() {
    let cases = [
        ("G1 X1", "1:1: no feed"),
        ("F600\nG1 X1 A3", "2:7: another axis"),
        ("F600\n/G1 X1", "2:1: an optional block"),
        ("F600 G1 X#1", "1:9: parameters"),
        ("o100 if [1]", "1:1: O-words"),
        ("G92 X0", "1:1: G92 cannot"),
        ("G28", "1:1: G28 cannot"),
        ("G1 F600 X1\nM0", "2:1: M0 waits"),
        ("F600\nX1e9", "2:3: a word E"),
        ("T1 M6", "1:4: M6 changes a tool"),
        ("G1 F600 X1\nM66", "2:1: M66 cannot"),
        ("G4", "1:1: G4 without P"),
        ("G4 P-1", "1:4: a dwell"),
        ("G4 P1 X1", "1:7: words"),
        ("G64 P-1", "1:5: a tolerance"),
        ("F600\nG3 X1 Y1 I5", "2:1: centre, radius"),
        ("G95 F1", "1:1: G95 cannot"),
        ("G80 X1", "1:1: a motion"),
    ];
    for (program, words) in cases {
        let error = read(program).unwrap_err().to_string();
        assert!(error.starts_with(words), "{program:?}: {error}");
    }
    // G54 is the machine's own coordinates here; comments, line numbers, spindle and coolant are nothing to a path.
    let loaded = Running {
        tool_loaded: true,
        ..running()
    };
    assert_eq!(blocks(b"T1 M6\n", &loaded).unwrap(), []);
    assert_eq!(read("N10 G54 G17 (part) M8 T1 S500\n").unwrap(), []);
}
