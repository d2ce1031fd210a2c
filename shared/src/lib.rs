//! What host and controller share: the laws of giotto, without an operating system.
//!
//! | module | holds |
//! |---|---|
//! | [`Actuator`], [`Plane`], [`Frame`] | the drives of a machine, and where a circle lies in it |
//! | [`kinematics`] | arms: from joints to the place of the tool and back, with derivatives |
//! | [`circle`] | mergeable moments of a point set, algebraic and geometric circle, plane of 3-D points |
//! | [`model`] | the radius model ΔR = β1 f²/R + β2 f⁴/R³ (Eq. 15 of the source paper), cumulants, inverse |
//! | [`term`] | the profile terms that diagnosis fits, the table carries and the engine evaluates |
//! | [`path`] | time laws with limited jerk, circles, arcs, lines; derivatives in closed form |
//! | [`angle`], [`fixed`] | integer phases, sine and cosine, fixed-point products of the tick |
//! | [`bounds`] | what no table may ask for |
//! | [`law`] | the compensating operator p − (κ2/2) p″ + (κ2²/8 − κ4/24) p⁗ |
//! | [`encoding`] | values as bytes, CRC-32 |
//! | [`table`] | the correction table: layout, bounds, CRC |
//! | [`wire`] | messages and frames between host and controller |
//!
//! A servo's circle, and what undoes it:
//!
//! ```
//! use giotto_shared::law::{AngularMotion, Operator};
//! use giotto_shared::model::{Element, RadiusModel};
//!
//! let servo = Element::Lag { kv_per_s: 50.0_f64 };
//! let (radius_m, feed_m_s) = (0.1, 0.5);
//! // It draws the circle 496 µm too small …
//! let model = RadiusModel::from(servo.cumulants());
//! assert!((model.radius_error_m(radius_m, feed_m_s) + 496e-6).abs() < 1e-6);
//! // … unless the controller commands it larger by what the operator says.
//! let steady = AngularMotion { rate: feed_m_s / radius_m, ..Default::default() };
//! let commanded_m = radius_m * (1.0 + Operator::new(&servo.cumulants()).gain(&steady).radial);
//! assert!((commanded_m * servo.gain(feed_m_s / radius_m) - radius_m).abs() < 0.1e-6);
//! ```
//!
//! The source paper is Slamani, Nubiola, Bonev, "Effect of servo systems on the contouring errors in
//! industrial robots", Trans. CSME 36(1), 2012. SI units throughout unless a name says otherwise.
#![no_std]
#![forbid(unsafe_code)]
#![cfg_attr(not(test), warn(clippy::too_many_lines))]

#[cfg(any(test, feature = "std"))]
extern crate std;

mod actuator;
pub mod angle;
pub mod bounds;
pub mod circle;
pub mod direction;
pub mod encoding;
pub mod fixed;
mod frame;
pub mod kinematics;
pub mod law;
pub mod model;
pub mod path;
pub mod table;
pub mod term;
pub mod wire;

pub use actuator::Actuator;
pub use direction::Direction;
pub use frame::{Frame, Plane};
