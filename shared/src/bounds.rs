//! What no table may ask for, whatever its own limits say: the harder bounds of the image. Each says where
//! it comes from; a table that exceeds one is refused before it touches the flash. Bounds of one term alone are in the
//! term's file.

/// Largest correction, m. A position loop of kv = 10/s at the hardest circle of the tests (R = 100 mm,
/// f = 300 mm/s) asks for ½ω²R/kv² = 4.5 mm; anything beyond is a wrong unit, not a correction.
pub const OFFSET_MAX_M: f32 = 5.0e-3;

/// Largest rate of change of the correction, m/s: [`OFFSET_MAX_M`] turned once a second, 2π·5 mm/s ≈ 31 mm/s,
/// with a factor of three for ovals (2ω) and ramps.
pub const SLEW_MAX_M_S: f32 = 0.1;

/// Smallest radius of a circle or zone, m.
pub const RADIUS_MIN_M: f32 = 1.0e-3;

/// Largest radius of a circle or zone, m: above 1 m the spacing of single precision (119 nm) is wider than
/// the 0.1 µm that set-points promise.
pub const RADIUS_MAX_M: f32 = 1.0;

/// Smallest feed, m/s.
pub const FEED_MIN_M_S: f32 = 1.0e-4;

/// Largest feed, m/s: twice and more what the robot of the source paper reaches (0.7 m/s).
pub const FEED_MAX_M_S: f32 = 2.0;

/// Largest |κ2|, s²: a lag of 100 ms, κ2 = 1/kv² with kv = 10/s.
pub const KAPPA2_MAX_S2: f32 = 1.0e-2;

/// Largest |κ4|, s⁴: 6/kv⁴ of the same lag is 6e-4; resonant mechanics (12(8ζ⁴−8ζ²+1)/ωn⁴) reach it at
/// ωn = 10.5 rad/s.
pub const KAPPA4_MAX_S4: f32 = 1.0e-3;

/// Farthest machine coordinate, m.
pub const PLACE_MAX_M: f32 = 100.0;

const _: () = assert!(RADIUS_MIN_M < RADIUS_MAX_M && FEED_MIN_M_S < FEED_MAX_M_S);
