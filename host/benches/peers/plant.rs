//! The simulated machine: `scipy.signal.lsim` and `scipy.integrate.solve_ivp` on the same differential equations.
use crate::Error;
use crate::python::Peers;
use crate::table::{Table, Times};
use crate::timing::timed;
use giotto::simulation::machine::{Machine, PositionLoop, SecondOrder};
use giotto::simulation::{CircleTest, circle};
use giotto_shared::Direction;
use serde_json::json;
use std::f64::consts::TAU;

const SIZES: [usize; 4] = [1_000, 10_000, 100_000, 1_000_000];
/// Above this the peers need more patience than the comparison is worth.
const LARGEST_FOR_PEERS: usize = 10_000;
const KV_PER_S: f64 = 40.0;
const OMEGA_N_RAD_S: f64 = 60.0;
const ZETA: f64 = 0.5;
const RADIUS_M: f64 = 0.1;
const FEED_M_S: f64 = 0.1;
/// The peers join their samples by lines (lsim) or stop at 1e-9 (solve_ivp); giotto's command is a cubic.
const SAME_M: f64 = 2e-6;

/// Runs the part.
pub(crate) fn run(peers: &mut Peers) -> Result<Table, Error> {
    let mut table = Table::new(
        "Plant: one lap in the steady state, two axes of three states each",
        "steps a lap",
        &["giotto", "lsim", "solve_ivp"],
        &["over lsim", "over solve_ivp"],
    );
    let machine = Machine {
        servo: [PositionLoop {
            kv_per_s: KV_PER_S,
            feed_forward: 0.0,
        }; 3],
        mechanics: [Some(SecondOrder {
            omega_n_rad_s: OMEGA_N_RAD_S,
            zeta: ZETA,
        }); 3],
        ..Machine::default()
    };
    let turn_s = TAU * RADIUS_M / FEED_M_S;
    let mut fastest: f64 = 0.0;
    for samples in SIZES {
        let test = CircleTest {
            samples: Some(samples),
            ..CircleTest::new(RADIUS_M, FEED_M_S, Direction::Ccw)
        };
        let data = json!({ "samples": samples, "radius": RADIUS_M, "feed": FEED_M_S, "kv": KV_PER_S,
                           "omega_n": OMEGA_N_RAD_S, "zeta": ZETA });
        let mut times = [Times::default(), Times::default(), Times::default()];
        for _ in 0..if samples > LARGEST_FOR_PEERS { 5 } else { 7 } {
            let (seconds, trace) = timed(|| circle(&machine, &test));
            times[0].push(seconds);
            if samples > LARGEST_FOR_PEERS {
                continue;
            }
            for (k, peer) in ["lsim", "solve_ivp"].into_iter().enumerate() {
                let (seconds, found) = peers.run(peer, &data)?;
                let mean = trace.mean_deviation_m();
                if (found[0] - mean).abs() > SAME_M {
                    return Err(format!(
                        "{peer} finds a mean deviation of {} m, giotto of {mean} m",
                        found[0]
                    )
                    .into());
                }
                times[1 + k].push(seconds);
            }
        }
        let median = times.each_ref().map(Times::median);
        fastest = fastest.max(2.0 * samples as f64 / median[0]);
        table.row(
            samples,
            &times.each_ref(),
            &[median[1] / median[0], median[2] / median[0]],
        );
        if samples == SIZES[0] {
            table.remark(format!(
                "machine-seconds simulated a second at {samples} steps a lap: giotto {:.0}, lsim {:.1}, solve_ivp {:.1} (a lap lasts \
                 {turn_s:.2} s; giotto starts in the steady state of its own steps, the peers get a run-in of 10 time constants)",
                turn_s / median[0], turn_s / median[1], turn_s / median[2]
            ));
        }
    }
    table.remark(format!(
        "{fastest:.2e} steps a second on one core, an axis a step; bars 50× and 1e7 steps/s"
    ));
    Ok(table)
}
