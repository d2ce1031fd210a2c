use super::*;
use crate::kinematics::{ROBOTS, Robot};

/// Joints of a robot, turned frames and all: origin, roll-pitch-yaw, axis.
fn robot(joints: &[(&str, &str, &str)], flange: &str) -> String {
    let mut text = "<?xml version=\"1.0\"?>\n<robot name=\"test\">\n".to_owned();
    for (n, (xyz, rpy, axis)) in joints.iter().enumerate() {
        text += &format!(
            "<link name=\"l{n}\"/>\n<joint name=\"joint_{}\" type=\"revolute\">\n<origin xyz=\"{xyz}\" rpy=\"{rpy}\"/>\n\
             <parent link=\"l{n}\"/><child link=\"l{}\"/>\n<axis xyz=\"{axis}\"/>\n<limit effort=\"0\" lower=\"-3\" upper=\"3\" velocity=\"3\"/></joint>\n",
            n + 1,
            n + 1
        );
    }
    text + &format!(
        "<joint name=\"fixed\" type=\"fixed\"><parent link=\"l{}\"/><child link=\"tool0\"/>{flange}</joint>\n\
         <transmission name=\"t\"><joint name=\"joint_1\"><hardwareInterface>P</hardwareInterface></joint></transmission></robot>\n",
        joints.len()
    )
}

fn of(arm: &Opw) -> [f64; 7] {
    [
        arm.a1_m, arm.a2_m, arm.b_m, arm.c1_m, arm.c2_m, arm.c3_m, arm.c4_m,
    ]
}

fn known(name: &str) -> [f64; 7] {
    let robot = Robot::named(name).unwrap();
    of(&robot.with([0.0; 3], [1.0, 0.0, 0.0, 0.0], Branch::ElbowUp))
}

/// As ROS-Industrial has it: frames unturned, the forearm along X.
const IRB2400: [(&str, &str, &str); 6] = [
    ("0 0 0", "0 0 0", "0 0 1"),
    ("0.1 0 0.615", "0 0 0", "0 1 0"),
    ("0 0 0.705", "0 0 0", "0 1 0"),
    ("0.258 0 0.135", "0 0 0", "1 0 0"),
    ("0.497 0 0", "0 0 0", "0 1 0"),
    ("0.085 0 0", "0 0 0", "1 0 0"),
];

#[test]
fn a_robot_drawn_with_straight_frames_has_its_lengths() {
    let arm = read(&robot(&IRB2400, "")).unwrap();
    assert_eq!(of(&arm), known("abb-irb2400-10"));
}

/// KUKA draws with axes that point down and the arm stretched forward; Stäubli has its arm beside the base.
#[test]
fn robots_drawn_otherwise_have_theirs() {
    let kuka = [
        ("0 0 0.4", "0 0 0", "0 0 -1"),
        ("0.025 0 0", "0 0 0", "0 1 0"),
        ("0.315 0 0", "0 0 0", "0 1 0"),
        ("0 0 0.035", "0 0 0", "-1 0 0"),
        ("0.365 0 0", "0 0 0", "0 1 0"),
        ("0.08 0 0", "0 0 0", "-1 0 0"),
    ];
    let arm = read(&robot(
        &kuka,
        "<origin xyz=\"0 0 0\" rpy=\"0 1.5707963267948966 0\"/>",
    ))
    .unwrap();
    assert_eq!(of(&arm), known("kuka-kr6-r700"));
    let staubli = [
        ("0 0 0.32", "0 0 0", "0 0 1"),
        ("0 0.035 0", "0 0 0", "0 1 0"),
        ("0 0 0.225", "0 0 0", "0 1 0"),
        ("0 0 0", "0 0 0", "0 0 1"),
        ("0 0 0.225", "0 0 0", "0 1 0"),
        ("0 0 0.065", "0 0 0", "0 0 1"),
    ];
    let arm = read(&robot(&staubli, "")).unwrap();
    assert_eq!(of(&arm), known("staubli-tx40"));
    assert_eq!(ROBOTS.len(), 9);
}

#[test]
fn turned_frames_change_no_length() {
    let turned = [
        ("0 0 0.615", "0 0 0.4", "0 0 1"),
        ("0.1 0 0", "-1.5707963267948966 0 0", "0 0 1"),
        ("0 -0.705 0", "0 0 0.9", "0 0 1"),
        ("0.258 -0.135 0", "0 1.5707963267948966 0", "0 0 1"),
        ("0 0 0.497", "0 -1.5707963267948966 0", "0 0 1"),
        ("0.085 0 0", "0 1.5707963267948966 0", "0 0 1"),
    ];
    let arm = read(&robot(&turned, "")).unwrap();
    assert_eq!(of(&arm), known("abb-irb2400-10"));
}

#[test]
fn other_arms_and_broken_files_are_refused_with_what_they_lack() {
    let reason = |text: &str| read(text).unwrap_err().to_string();
    assert!(reason("<robot><joint name='a'").contains("line 1"));
    assert!(reason("<robot/>").contains("0 joints"));
    let mut five = IRB2400.to_vec();
    five.pop();
    assert!(reason(&robot(&five, "")).contains("5 joints"));
    let mut offset = IRB2400;
    offset[5] = ("0.085 0.05 0", "0 0 0", "1 0 0");
    assert!(reason(&robot(&offset, "")).contains("spherical wrist"));
    let mut crossed = IRB2400;
    crossed[2].2 = "1 0 0";
    assert!(reason(&robot(&crossed, "")).contains("2 and 3"));
    let mut words = IRB2400;
    words[1].0 = "0.1 zero 0.615";
    let said = reason(&robot(&words, ""));
    assert!(said.contains("joint_2") && said.contains("zero"), "{said}");
}
