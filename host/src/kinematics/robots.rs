//! Lengths of known robots, m, in the terms of [`Opw`].
//!
//! Sources: the URDF of ROS-Industrial's `abb_irb1600_support` (IRB 1600), and the parameters that `rs-opw-kinematics` 3.0.0
//! (BSD-3) and ROS-Industrial's `opw_kinematics` publish for the others, themselves from the makers' drawings.
use super::{Branch, Opw};

/// A robot by name.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Robot {
    /// Name in files.
    pub name: &'static str,
    /// a1, a2, b, c1, c2, c3, c4, m.
    lengths_m: [f64; 7],
}

impl Robot {
    /// The robot of this name in files.
    pub fn named(name: &str) -> Option<Self> {
        ROBOTS.into_iter().find(|robot| robot.name == name)
    }

    /// With its tool and orientation.
    pub fn with(&self, tool_m: [f64; 3], orientation: [f64; 4], branch: Branch) -> Opw {
        let [a1_m, a2_m, b_m, c1_m, c2_m, c3_m, c4_m] = self.lengths_m;
        Opw {
            a1_m,
            a2_m,
            b_m,
            c1_m,
            c2_m,
            c3_m,
            c4_m,
            tool_m,
            orientation,
            branch,
        }
    }
}

const IRB1600: [f64; 7] = {
    let arm = giotto_shared::kinematics::IRB1600;
    [
        arm.a1_m, arm.a2_m, arm.b_m, arm.c1_m, arm.c2_m, arm.c3_m, arm.c4_m,
    ]
};

/// All robots that are known by name.
pub const ROBOTS: [Robot; 9] = [
    Robot {
        name: "abb-irb1600-6-1.45",
        lengths_m: IRB1600,
    },
    Robot {
        name: "abb-irb1600-10-1.45",
        lengths_m: IRB1600,
    },
    Robot {
        name: "abb-irb2400-10",
        lengths_m: [0.100, -0.135, 0.0, 0.615, 0.705, 0.755, 0.085],
    },
    Robot {
        name: "fanuc-r2000ib-200r",
        lengths_m: [0.720, -0.225, 0.0, 0.600, 1.075, 1.280, 0.235],
    },
    Robot {
        name: "kuka-kr6-r700",
        lengths_m: [0.025, -0.035, 0.0, 0.400, 0.315, 0.365, 0.080],
    },
    Robot {
        name: "staubli-tx40",
        lengths_m: [0.0, 0.0, 0.035, 0.320, 0.225, 0.225, 0.065],
    },
    Robot {
        name: "staubli-tx2-140",
        lengths_m: [0.150, 0.0, 0.0, 0.550, 0.625, 0.625, 0.110],
    },
    Robot {
        name: "staubli-tx2-160",
        lengths_m: [0.150, 0.0, 0.0, 0.550, 0.825, 0.625, 0.110],
    },
    Robot {
        name: "staubli-tx2-160l",
        lengths_m: [0.150, 0.0, 0.0, 0.550, 0.825, 0.925, 0.110],
    },
];
