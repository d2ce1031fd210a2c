//! The shape of the step that brings a correction in or out at a joint.
//!
//! A step is written as pairs of arcs (biarcs), which are, beside a path that is nearly straight, two parabolas with a common
//! tangent half-way between two nodes. The shape is these parabolas and nothing smoother, so that what is worked out for it
//! holds for the blocks that are run.

/// Nodes between the ends of a step at most.
pub(super) const MOST_NODES: usize = 5;

/// A step from 0 to 1 over a length, flat at both ends, through nodes.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Transition {
    nodes: [Node; MOST_NODES],
    count: usize,
}

/// A node of a step.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(super) struct Node {
    /// Share of the length, above that of the node before.
    pub(super) place: f64,
    pub(super) value: f64,
    /// Per length.
    pub(super) slope: f64,
}

/// Where every step begins and ends.
const START: Node = Node {
    place: 0.0,
    value: 0.0,
    slope: 0.0,
};
const END: Node = Node {
    place: 1.0,
    value: 1.0,
    slope: 0.0,
};

impl Transition {
    /// The smooth step 2u², 1 − 2(1 − u)².
    pub(super) const SMOOTH: Self = Self {
        nodes: [Node {
            place: 0.5,
            value: 0.5,
            slope: 2.0,
        }; MOST_NODES],
        count: 1,
    };

    /// All nodes at 0, at these places between 0 and 1.
    pub(super) fn blank(places: &[f64]) -> Self {
        let mut nodes = [Node::default(); MOST_NODES];
        for (node, place) in nodes.iter_mut().zip(places) {
            node.place = *place;
        }
        Self {
            nodes,
            count: places.len().min(MOST_NODES),
        }
    }

    /// Values that may be chosen: those and the slopes of the nodes.
    pub(super) fn unknowns(&self) -> usize {
        2 * self.count
    }

    /// The same places with one value after the other from `values`.
    pub(super) fn with(mut self, values: &[f64]) -> Self {
        let count = self.count;
        for (node, pair) in self.nodes[..count].iter_mut().zip(values.chunks(2)) {
            (node.value, node.slope) = (pair[0], pair.get(1).copied().unwrap_or(0.0));
        }
        self
    }

    /// The nodes behind the start, the end among them.
    pub(super) fn nodes(self) -> impl Iterator<Item = Node> {
        (0..self.count)
            .map(move |i| self.nodes[i])
            .chain(std::iter::once(END))
    }

    /// Largest |g″|·L²: what it adds to the curvature, in Δ/L².
    pub(super) fn curvature(self) -> f64 {
        let mut before = START;
        let mut most = 0.0;
        for node in self.nodes() {
            let half = 0.5 * (node.place - before.place);
            let middle = middle_slope(before, node);
            for bend in [middle - before.slope, node.slope - middle] {
                most = f64::max(most, (bend / half).abs());
            }
            before = node;
        }
        most
    }

    /// Value at a share of the length.
    pub(super) fn at(&self, u: f64) -> f64 {
        if u <= 0.0 {
            return 0.0;
        }
        let mut before = START;
        for node in self.nodes() {
            if u < node.place {
                return between(before, node, u);
            }
            before = node;
        }
        1.0
    }
}

/// Slope where the two parabolas between two nodes meet.
fn middle_slope(a: Node, b: Node) -> f64 {
    2.0 * (b.value - a.value) / (b.place - a.place) - 0.5 * (a.slope + b.slope)
}

fn between(a: Node, b: Node, u: f64) -> f64 {
    let width = b.place - a.place;
    let middle = middle_slope(a, b);
    let (from_a, to_b) = (u - a.place, b.place - u);
    if from_a < to_b {
        a.value + from_a * (a.slope + from_a * (middle - a.slope) / width)
    } else {
        b.value - to_b * (b.slope - to_b * (b.slope - middle) / width)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn shape() -> Transition {
        Transition::blank(&[0.2, 0.55]).with(&[0.3, 1.9, 0.8, -0.4])
    }

    /// Differences, as an independent measure of slope and curvature.
    #[test]
    fn a_curve_without_corners_and_its_curvature() {
        for t in [shape(), Transition::SMOOTH] {
            let h = 1e-5;
            let slope = |u: f64| (t.at(u + h) - t.at(u - h)) / (2.0 * h);
            let mut most = 0.0;
            for k in 1..1000 {
                let u = f64::from(k) * 1e-3 + 3e-4;
                let bend = (slope(u + 2e-4) - slope(u - 2e-4)) / 4e-4;
                most = f64::max(most, bend.abs());
            }
            assert!((most / t.curvature() - 1.0).abs() < 1e-3, "{most} {t:?}");
            assert_eq!((t.at(-1.0), t.at(0.0), t.at(1.0)), (0.0, 0.0, 1.0));
        }
        for node in shape().nodes() {
            assert!((shape().at(node.place) - node.value).abs() < 1e-12);
        }
        assert!((shape().at(0.2 - 1e-9) - shape().at(0.2 + 1e-9)).abs() < 1e-7);
    }
}
