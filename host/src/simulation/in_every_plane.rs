//! Signatures against the machine in motion: every cause, on every axis, pair and plane that it can have.
use super::{CircleTest, Machine, circle};
use crate::causes::{ALL, Cause, Effect, Evidence, RunView, Site};
use giotto_shared::{Direction, Frame, Plane};
use std::f64::consts::TAU;
use std::sync::Arc;

const SAMPLES: usize = 720;

/// A machine whose only fault is the effect; its loop is ideal, so that nothing is turned by a lag.
fn machine(effect: &Effect) -> Machine {
    let mut machine = Machine::default();
    effect.cause().model().apply(effect, &mut machine);
    machine
}

fn view(test: &CircleTest) -> RunView {
    let sign = f64::from(test.direction.sign());
    let angle = |i: usize| TAU * i as f64 / SAMPLES as f64;
    let omega_rad_s = test.feed_m_s / test.radius_m;
    let mut view = RunView {
        radius_m: test.radius_m,
        feed_m_s: test.feed_m_s,
        omega_rad_s,
        sign,
        frame: test.frame,
        centre_m: test.centre_m,
        elapsed: 0.0,
        campaign_s: 3600.0,
        largest_radius_m: test.radius_m,
        psi_rad: Arc::default(),
        direction: Arc::default(),
        strokes: Default::default(),
        time_s: (0..SAMPLES).map(|i| angle(i) / omega_rad_s).collect(),
        gain: 1.0,
        lag_rad: 0.0,
        arm: None,
    };
    view.place((0..SAMPLES).map(|i| sign * angle(i)).collect());
    view
}

/// An effect of some tens of micrometres, the shape of its signature, and the share of it that the closed form may miss.
fn example(cause: Cause, site: Site) -> Option<(Effect, Vec<f64>, f64)> {
    let (value, params, shape, share): (f64, Vec<(&str, f64)>, Vec<f64>, f64) = match cause {
        Cause::RadiusOffset => (0.03, vec![], vec![], 1e-3),
        Cause::ScaleError | Cause::ScaleMismatch | Cause::Squareness => {
            (200.0, vec![], vec![], 1e-2)
        }
        Cause::ServoMismatch => (2e-4, vec![("turned", 0.0)], vec![0.0], 2e-2),
        Cause::Backlash => (0.02, vec![], vec![0.02e-3], 5e-2),
        Cause::LateralPlay => (0.02, vec![], vec![], 5e-2),
        Cause::ReversalSpike => (
            15.0,
            vec![("decay_s", 0.03), ("rise_s", 0.004), ("presliding_m", 2e-5)],
            vec![0.03, 0.004, 2e-5],
            5e-2,
        ),
        Cause::CyclicError => (
            8.0,
            vec![("pitch_mm", 25.0), ("phase_rad", 0.7)],
            vec![0.025],
            1e-2,
        ),
        Cause::Straightness => (20.0, vec![("over_radius_mm", 100.0)], vec![], 1e-2),
        Cause::JointLagMismatch => (1e-4, vec![], vec![], 5e-2),
        // A loop without a lag has no bandwidth to split, and no fourth order.
        _ => return None,
    };
    let effect = Effect::new(cause, site, value, [value; 2], params).unwrap();
    Some((effect, shape, share))
}

#[test]
fn signatures_are_what_the_machine_does() {
    let tilted = Frame::across([0.5, -0.4, 0.7]).unwrap();
    let frames: Vec<Frame> = Plane::ALL
        .into_iter()
        .map(Frame::of)
        .chain([tilted])
        .collect();
    let mut seen = 0;
    for frame in frames {
        for direction in [Direction::Ccw, Direction::Cw] {
            let test = CircleTest {
                frame,
                samples: Some(SAMPLES),
                centre_m: [0.31, -0.12, 0.07],
                ..CircleTest::new(0.1, 0.15, direction)
            };
            let view = view(&test);
            for model in ALL
                .iter()
                .filter(|model| model.evidence() == Evidence::Signature)
            {
                for site in model.sites(std::slice::from_ref(&view)) {
                    let Some((effect, shape, share)) = example(model.cause(), site) else {
                        continue;
                    };
                    seen += 1;
                    let moved = circle(&machine(&effect), &test).deviation_m;
                    let mut columns = vec![vec![0.0; SAMPLES]; model.columns()];
                    for (at, column) in columns.iter_mut().enumerate() {
                        model.signature(site, &shape, at, &view, column);
                    }
                    // A free phase has its sine and its cosine column.
                    let amounts = match columns.len() {
                        2 => [effect.value() * 0.7f64.cos(), effect.value() * 0.7f64.sin()],
                        _ => [effect.value(), 0.0],
                    };
                    let stated = |i: usize| -> f64 {
                        columns.iter().zip(amounts).map(|(c, a)| a * c[i]).sum()
                    };
                    // A step at a reversal falls between two samples: which one has it is no matter.
                    let beside = |i: usize| {
                        let strokes = view.strokes.iter().filter_map(|strokes| strokes.get(i));
                        let half = 0.5 * SAMPLES as f64;
                        strokes
                            .map(|stroke| half * stroke.share.min(1.0 - stroke.share))
                            .any(|samples| samples < 1.5)
                    };
                    let energy = |f: &dyn Fn(usize) -> f64| {
                        let clear = (0..SAMPLES).filter(|i| !beside(*i));
                        (clear.map(|i| f(i).powi(2)).sum::<f64>() / SAMPLES as f64).sqrt()
                    };
                    let whole = energy(&stated);
                    let off = energy(&|i| moved[i] - stated(i));
                    assert!(
                        whole > 1e-7,
                        "{} at {site:?} in {frame:?} does nothing",
                        model.words().id
                    );
                    assert!(
                        off < share * whole + 2e-8,
                        "{} at {site:?} in {frame:?}, {direction:?}: {off:e} of {whole:e}",
                        model.words().id
                    );
                }
            }
        }
    }
    assert!(seen > 150, "{seen}");
}

/// What a campaign did not move it says nothing of.
#[test]
fn an_axis_that_stands_still_has_no_site() {
    let flat = [view(&CircleTest::new(0.1, 0.15, Direction::Ccw))];
    for model in ALL {
        for site in model.sites(&flat) {
            assert!(
                !site.actuators().contains(&giotto_shared::Actuator::Z),
                "{site:?}"
            );
        }
    }
    assert!(flat[0].strokes[2].is_empty());
}
