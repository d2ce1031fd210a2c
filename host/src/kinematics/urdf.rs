//! Lengths of an arm from a URDF: the description of robots that ROS uses.
//!
//! What is read is where the axes of the six joints lie when all stand at zero, whatever frames the links have. From that the seven
//! lengths of an arm with parallel second and third axis and a spherical wrist follow; another arm is refused with what it lacks.
//! Meshes, inertias and limits are not looked at. Angles are then counted as in `giotto_shared::kinematics`, not as in the file:
//! zeros and senses of the joints do not change a length.
use super::{Branch, Opw};
use nalgebra::{Isometry3, Point3, Translation3, Unit, UnitQuaternion, Vector3};
use quick_xml::events::{BytesStart, Event};
use quick_xml::reader::Reader;

/// How far axes may miss each other and still meet, m.
const MEETS_M: f64 = 1e-4;
/// How far directions may be from parallel or square, as a sine.
const SQUARE: f64 = 1e-3;
/// Names of the flange's frame, best first: ROS-Industrial's conventions.
const FLANGES: [&str; 3] = ["flange", "tool0", "tool"];

/// Why a URDF gives no lengths.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum UrdfError {
    /// It is no XML.
    #[error("line {line}: not XML: {reason}")]
    Xml {
        /// Where.
        line: usize,
        /// Why.
        reason: String,
    },
    /// A number, or a group of three, cannot be read.
    #[error("joint {joint:?}: {attribute} is {found:?}, expected three numbers")]
    Numbers {
        /// Name of the joint.
        joint: String,
        /// Of `origin` or `axis`.
        attribute: &'static str,
        /// What stands there.
        found: String,
    },
    /// Not six joints that turn, one behind the other.
    #[error("{found} joints turn one behind the other, expected 6")]
    Joints {
        /// How many.
        found: usize,
    },
    /// Axes lie otherwise than in an arm of this kind.
    #[error("this arm has no closed form here: {0}")]
    OtherArm(&'static str),
}

/// A joint as it is written.
#[derive(Clone, Debug, Default)]
struct Written {
    name: String,
    turns: bool,
    parent: String,
    child: String,
    xyz: [f64; 3],
    rpy: [f64; 3],
    axis: [f64; 3],
}

/// An axis at rest: a point on it and its direction, in the base.
#[derive(Clone, Copy, Debug)]
struct Axis {
    at: Point3<f64>,
    along: Vector3<f64>,
}

/// Reads the lengths; tool at the flange, pointing down, elbow up, until somebody says otherwise.
///
/// # Errors
/// [`UrdfError`].
///
/// ```
/// use giotto::kinematics::urdf;
///
/// let joint = |n: u8, xyz: &str, axis: &str| {
///     format!(
///         "<joint name='j{n}' type='revolute'><parent link='l{}'/><child link='l{n}'/><origin xyz='{xyz}'/><axis xyz='{axis}'/></joint>",
///         n - 1
///     )
/// };
/// let text = format!(
///     "<robot name='irb1600'>{}{}{}{}{}{}</robot>",
///     joint(1, "0 0 0.4865", "0 0 1"), joint(2, "0.15 0 0", "0 1 0"), joint(3, "0 0 0.7", "0 1 0"),
///     joint(4, "0.314 0 0", "1 0 0"), joint(5, "0.286 0 0", "0 1 0"), joint(6, "0.065 0 0", "1 0 0"),
/// );
/// let arm = urdf::read(&text)?;
/// assert_eq!([arm.a1_m, arm.c1_m, arm.c2_m, arm.c3_m, arm.c4_m], [0.15, 0.4865, 0.7, 0.6, 0.065]);
/// # Ok::<(), urdf::UrdfError>(())
/// ```
pub fn read(text: &str) -> Result<Opw, UrdfError> {
    let joints = joints(text)?;
    let (axes, flange) = at_rest(&joints)?;
    lengths(&axes, flange)
}

/// All joints of the file.
fn joints(text: &str) -> Result<Vec<Written>, UrdfError> {
    let mut reader = Reader::from_str(text);
    let mut joints = Vec::new();
    let mut open: Option<Written> = None;
    loop {
        let event = reader.read_event().map_err(|error| {
            let before = usize::try_from(reader.error_position()).unwrap_or(usize::MAX);
            UrdfError::Xml {
                line: 1 + text.bytes().take(before).filter(|b| *b == b'\n').count(),
                reason: error.to_string(),
            }
        })?;
        match &event {
            Event::Start(element) | Event::Empty(element) => {
                let name = element.name();
                match (name.as_ref(), &mut open) {
                    ("joint", None) => {
                        let turns = ["revolute", "continuous"];
                        open = Some(Written {
                            name: attribute(element, "name").unwrap_or_default(),
                            turns: attribute(element, "type")
                                .is_some_and(|kind| turns.contains(&kind.as_str())),
                            axis: [1.0, 0.0, 0.0],
                            ..Written::default()
                        });
                    }
                    ("parent", Some(joint)) => {
                        joint.parent = attribute(element, "link").unwrap_or_default();
                    }
                    ("child", Some(joint)) => {
                        joint.child = attribute(element, "link").unwrap_or_default();
                    }
                    ("origin", Some(joint)) => {
                        joint.xyz = three(element, joint, "xyz", joint.xyz)?;
                        joint.rpy = three(element, joint, "rpy", joint.rpy)?;
                    }
                    ("axis", Some(joint)) => {
                        joint.axis = three(element, joint, "xyz", joint.axis)?;
                    }
                    _ => {}
                }
            }
            Event::End(element) if element.name().as_ref() == "joint" => {
                // A transmission names joints as well: those have no links.
                joints.extend(open.take().filter(|joint| !joint.child.is_empty()));
            }
            Event::Eof => return Ok(joints),
            _ => {}
        }
    }
}

fn attribute(element: &BytesStart<'_>, name: &str) -> Option<String> {
    let mut all = element.attributes().filter_map(Result::ok);
    let found = all.find(|attribute| {
        let key: &str = attribute.key.as_ref();
        key == name
    })?;
    Some(found.value.into_owned())
}

fn three(
    element: &BytesStart<'_>,
    joint: &Written,
    name: &'static str,
    otherwise: [f64; 3],
) -> Result<[f64; 3], UrdfError> {
    let Some(text) = attribute(element, name) else {
        return Ok(otherwise);
    };
    let numbers: Vec<f64> = text
        .split_ascii_whitespace()
        .filter_map(|word| word.parse().ok())
        .filter(|number: &f64| number.is_finite())
        .collect();
    match numbers.try_into() {
        Ok(three) if text.split_ascii_whitespace().count() == 3 => Ok(three),
        _ => Err(UrdfError::Numbers {
            joint: joint.name.clone(),
            attribute: name,
            found: text,
        }),
    }
}

/// The axes of the six joints that turn, one behind the other, and the place of the flange, all joints at zero.
fn at_rest(joints: &[Written]) -> Result<([Axis; 6], Point3<f64>), UrdfError> {
    let is_child = |link: &str| joints.iter().any(|joint| joint.child == link);
    let roots = joints.iter().filter(|joint| !is_child(&joint.parent));
    let mut longest: Vec<Axis> = Vec::new();
    let mut best: Option<([Axis; 6], Point3<f64>, usize)> = None;
    // From each root along every branch; a robot's file has a few dozen joints.
    let mut open: Vec<(String, Isometry3<f64>, Vec<Axis>)> = roots
        .map(|joint| (joint.parent.clone(), Isometry3::identity(), Vec::new()))
        .collect();
    let mut steps = 0;
    while let Some((link, frame, axes)) = open.pop() {
        steps += 1;
        if steps > 10_000 {
            break;
        }
        if let Ok(six) = <[Axis; 6]>::try_from(axes.as_slice()) {
            let rank = FLANGES.iter().position(|name| *name == link);
            let rank = rank.unwrap_or(FLANGES.len());
            let at = Point3::from(frame.translation.vector);
            if best.as_ref().is_none_or(|(_, _, kept)| rank < *kept) {
                best = Some((six, at, rank));
            }
        }
        if axes.len() > longest.len() {
            longest.clone_from(&axes);
        }
        for joint in joints.iter().filter(|joint| joint.parent == link) {
            let [x, y, z] = joint.xyz;
            let [roll, pitch, yaw] = joint.rpy;
            let turn = UnitQuaternion::from_euler_angles(roll, pitch, yaw);
            let frame = frame * Isometry3::from_parts(Translation3::new(x, y, z), turn);
            let mut axes = axes.clone();
            if joint.turns {
                let along = Unit::try_new(Vector3::from(joint.axis), 1e-9);
                let along = along.ok_or(UrdfError::OtherArm("an axis has no direction"))?;
                axes.push(Axis {
                    at: Point3::from(frame.translation.vector),
                    along: frame.rotation * along.into_inner(),
                });
            }
            open.push((joint.child.clone(), frame, axes));
        }
    }
    let found = longest.len();
    best.map(|(six, flange, _)| (six, flange))
        .ok_or(UrdfError::Joints { found })
}

/// Where two lines are nearest to each other, on the first, and their distance, m.
fn nearest(a: &Axis, b: &Axis) -> (Point3<f64>, f64) {
    let across = a.along.cross(&b.along);
    let square = across.norm_squared();
    let way = b.at - a.at;
    if square < SQUARE * SQUARE {
        let along = way.dot(&a.along);
        return (a.at + along * a.along, (way - along * a.along).norm());
    }
    let along = way.cross(&b.along).dot(&across) / square;
    (
        a.at + along * a.along,
        (way.dot(&across) / square.sqrt()).abs(),
    )
}

fn lengths(axes: &[Axis; 6], flange: Point3<f64>) -> Result<Opw, UrdfError> {
    let [base, shoulder, elbow, roll, pitch, last] = axes;
    let parallel = |a: &Axis, b: &Axis| a.along.cross(&b.along).norm() < SQUARE;
    let square = |a: &Axis, b: &Axis| a.along.dot(&b.along).abs() < SQUARE;
    let other = |reason| Err(UrdfError::OtherArm(reason));
    if !square(base, shoulder) {
        return other("axes 1 and 2 are not square");
    }
    if !parallel(shoulder, elbow) {
        return other("axes 2 and 3 are not parallel");
    }
    if !square(elbow, roll) || !square(roll, pitch) || !square(pitch, last) {
        return other("axes 3 to 6 are not square to each other");
    }
    let (wrist, miss) = nearest(roll, pitch);
    let (_, missed) = nearest(last, &Axis { at: wrist, ..*last });
    if miss > MEETS_M || missed > MEETS_M {
        return other("axes 4, 5 and 6 do not meet: it has no spherical wrist");
    }
    // The base's frame: up along axis 1, across along axis 2, forward from the one to the other.
    let up = if base.along.z < 0.0 {
        -base.along
    } else {
        base.along
    };
    let (foot, a1_m) = nearest(base, shoulder);
    let mut across = shoulder.along;
    let forward = across.cross(&up);
    let (on_shoulder, _) = nearest(shoulder, base);
    let mut ahead = (on_shoulder - foot).dot(&forward);
    // An arm that leans on its axis: forward is where the wrist is.
    if a1_m < MEETS_M {
        ahead = (wrist - foot).dot(&forward);
    }
    if ahead < 0.0 {
        across = -across;
    }
    let forward = across.cross(&up);
    let within = |v: Vector3<f64>| v - v.dot(&across) * across;
    let upper = within(elbow.at - shoulder.at);
    let fore = within(wrist - elbow.at);
    let c3_m = fore.dot(&roll.along).abs();
    // Along the forearm away from the elbow; square to it, as `across` turns, is in front at zero.
    let out = if fore.dot(&roll.along) < 0.0 {
        -roll.along
    } else {
        roll.along
    };
    Ok(Opw {
        a1_m: digits((on_shoulder - foot).dot(&forward)),
        a2_m: digits(fore.dot(&across.cross(&out))),
        b_m: digits((wrist - foot).dot(&across)),
        c1_m: digits(foot.coords.dot(&up)),
        c2_m: digits(upper.norm()),
        c3_m: digits(c3_m),
        c4_m: digits((flange - wrist).dot(&last.along).abs()),
        tool_m: [0.0; 3],
        orientation: [0.0, 0.0, 1.0, 0.0],
        branch: Branch::ElbowUp,
    })
}

/// To the micrometre: what sums of decimal fractions leave behind it is no length.
fn digits(length_m: f64) -> f64 {
    // Not −0.
    (length_m * 1e6).round() / 1e6 + 0.0
}

#[cfg(test)]
mod tests;
