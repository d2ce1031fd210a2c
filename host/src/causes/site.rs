//! Where an effect sits in the machine.
use super::RunView;
use giotto_shared::{Actuator, Plane};

/// Where an effect sits.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub enum Site {
    /// In the machine as a whole.
    Machine,
    /// On one actuator.
    One(Actuator),
    /// Between the two slides of a plane.
    Pair(Plane),
    /// On the first slide, whose motion shifts the second.
    Across(Actuator, Actuator),
}

/// What kind of site a cause can have.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Seat {
    /// [`Site::Machine`].
    Machine,
    /// [`Site::One`].
    One,
    /// [`Site::Machine`], or [`Site::One`] where circles in several planes can tell the slides apart.
    MachineOrOne,
    /// [`Site::Pair`].
    Pair,
    /// [`Site::Across`].
    Across,
    /// [`Site::One`] on a joint: needs kinematics.
    Joint,
    /// [`Site::One`] on a joint where the kinematics are known, else [`Site::Machine`].
    MachineOrJoint,
    /// [`Site::One`] on a joint where the kinematics are known, else [`Site::Pair`].
    PairOrJoint,
}

impl Site {
    /// The actuator it is named by, if it is one.
    pub const fn axis(self) -> Option<Actuator> {
        match self {
            Self::One(axis) | Self::Across(axis, _) => Some(axis),
            Self::Machine | Self::Pair(_) => None,
        }
    }

    /// All actuators it concerns: none for the machine as a whole, one, or the two of a pair.
    pub fn actuators(self) -> Vec<Actuator> {
        match self {
            Self::Machine => Vec::new(),
            Self::One(axis) => vec![axis],
            Self::Pair(plane) => plane.axes().to_vec(),
            Self::Across(axis, other) => vec![axis, other],
        }
    }
}

impl Seat {
    /// Whether a site is of this kind.
    pub fn takes(self, site: Site) -> bool {
        match self {
            Self::Machine => site == Site::Machine,
            Self::One => is_slide(site),
            Self::MachineOrOne => site == Site::Machine || is_slide(site),
            Self::Pair => matches!(site, Site::Pair(_)),
            Self::Across => matches!(site, Site::Across(..)),
            Self::Joint => is_joint(site),
            Self::MachineOrJoint => site == Site::Machine || is_joint(site),
            Self::PairOrJoint => matches!(site, Site::Pair(_)) || is_joint(site),
        }
    }

    /// The sites that these runs can say anything about: what they did not move is not among them.
    pub fn sites(self, views: &[RunView]) -> Vec<Site> {
        let arm = views.iter().find_map(|view| view.arm.as_ref());
        match (self, arm) {
            (Self::Joint, None) => return Vec::new(),
            (Self::MachineOrJoint, None) => return vec![Site::Machine],
            (Self::PairOrJoint, None) => return Self::Pair.sites(views),
            // Of two joints each is what the other is not: what all do alike is no mismatch.
            (Self::MachineOrJoint | Self::PairOrJoint, Some(arm)) if arm.joints() == 2 => {
                return vec![Site::One(Actuator::Joint1)];
            }
            (Self::Joint | Self::MachineOrJoint | Self::PairOrJoint, Some(_)) => {
                let moves = |joint: &Actuator| {
                    let mut arms = views.iter().filter_map(|view| view.arm.as_ref());
                    arms.any(|arm| arm.moving().any(|moving| moving == *joint))
                };
                let joints = Actuator::JOINTS.into_iter().filter(moves);
                return joints.map(Site::One).collect();
            }
            _ => {}
        }
        let slides = || {
            Actuator::SLIDES
                .into_iter()
                .filter(|slide| views.iter().any(|view| view.moves(*slide)))
        };
        let together = |a: Actuator, b: Actuator| {
            a != b && views.iter().any(|view| view.moves(a) && view.moves(b))
        };
        match self {
            Self::Machine => vec![Site::Machine],
            Self::One => slides().map(Site::One).collect(),
            Self::MachineOrOne if in_one_plane(views) => vec![Site::Machine],
            Self::MachineOrOne => std::iter::once(Site::Machine)
                .chain(slides().map(Site::One))
                .collect(),
            Self::Pair => Plane::ALL
                .into_iter()
                .filter(|plane| {
                    let [first, second] = plane.axes();
                    together(first, second)
                })
                .map(Site::Pair)
                .collect(),
            Self::Across => slides()
                .flat_map(|a| slides().map(move |b| (a, b)))
                .filter(|(a, b)| together(*a, *b))
                .map(|(a, b)| Site::Across(a, b))
                .collect(),
            Self::Joint | Self::MachineOrJoint | Self::PairOrJoint => Vec::new(),
        }
    }
}

/// Whether it is on a slide.
const fn is_slide(site: Site) -> bool {
    matches!(site, Site::One(actuator) if actuator.is_slide())
}

/// Whether it is on a joint.
const fn is_joint(site: Site) -> bool {
    matches!(site, Site::One(actuator) if !actuator.is_slide())
}

/// Whether all circles move the same slides.
pub(super) fn in_one_plane(views: &[RunView]) -> bool {
    let moved = |view: &RunView| Actuator::SLIDES.map(|slide| view.moves(slide));
    views
        .windows(2)
        .all(|pair| moved(&pair[0]) == moved(&pair[1]))
}
