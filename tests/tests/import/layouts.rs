//! One measured path in the layouts of real instruments.
use std::f64::consts::TAU;
use std::fmt::Write as _;

/// A measured circular path in space: 80 µm too large, 30 µm oval, 4 µm noise, seen at 100 Hz; lead-in and lead-out
/// along the tangent, standing still before and after.
pub struct Path3 {
    pub radius_mm: f64,
    pub feed_mm_s: f64,
    pub sign: f64,
    pub turns: f64,
    pub tilt: f64,
    pub centre_mm: [f64; 3],
    pub lead_mm: f64,
    pub dwell: usize,
}

pub const SIZE_MM: f64 = 0.08;

impl Default for Path3 {
    fn default() -> Self {
        let centre_mm = [1832.4, -977.1, 611.8];
        Self {
            radius_mm: 100.0,
            feed_mm_s: 60.0,
            sign: 1.0,
            turns: 1.0,
            tilt: 0.02,
            centre_mm,
            lead_mm: 0.0,
            dwell: 0,
        }
    }
}

impl Path3 {
    /// Time (s), measured and wanted position (mm).
    pub fn points(&self) -> Vec<(f64, [f64; 3], [f64; 3])> {
        let step = self.feed_mm_s / 100.0;
        let lead = (self.lead_mm / step).round() as i64;
        let around = (self.turns * TAU * self.radius_mm / step).round() as i64;
        let place = |s: i64, radius: f64| {
            let on = s.clamp(0, around) as f64 * step / self.radius_mm;
            let beyond = (s - s.clamp(0, around)) as f64 * step;
            let a = self.sign * on;
            let (sin, cos) = a.sin_cos();
            [
                radius * cos - self.sign * sin * beyond,
                radius * sin + self.sign * cos * beyond,
            ]
        };
        let lift = |[u, v]: [f64; 2]| {
            let (sin, cos) = self.tilt.sin_cos();
            let [x, y, z] = self.centre_mm;
            [x + u * cos, y + v, z - u * sin]
        };
        let stand = self.dwell as i64;
        (-lead - stand..around + lead + stand)
            .enumerate()
            .map(|(k, s)| {
                let s = s.clamp(-lead, around + lead - 1);
                let noise = |m: u64| {
                    ((k as u64 * 2_654_435_761 + m * 40_503).wrapping_mul(0x9E37_79B9) >> 20
                        & 0xFFF) as f64
                };
                let bump = |m| (noise(m) / 4095.0 - 0.5) * 0.0138;
                let a = s as f64 * step / self.radius_mm;
                let [u, v] = place(s, self.radius_mm + SIZE_MM + 0.015 * (2.0 * a).cos());
                let measured = lift([u + bump(1), v + bump(2)]);
                (k as f64 / 100.0, measured, lift(place(s, self.radius_mm)))
            })
            .collect()
    }
}

pub fn leica(path: &Path3) -> Vec<u8> {
    let mut text =
        "X  [mm],Y  [mm],Z  [mm],U(95)  [mm],Temperatur [°C],Time Stamp,Name\r\n".to_owned();
    for (t, [x, y, z], _) in path.points() {
        let (minute, second) = (58 + (t / 60.0) as u32, t % 60.0);
        let (hour, minute) = (23 + minute / 60, minute % 60);
        let (day, hour) = (8 + hour / 24, hour % 24); // over midnight
        writeln!(
            text,
            "{x:.4},{y:.4},{z:.4},0.0152,20.1,'{day:02}.11.2022 {hour:02}:{minute:02}:{second:06.3},P\r"
        )
        .unwrap();
    }
    text.chars()
        .map(|c| u8::try_from(u32::from(c)).unwrap())
        .collect() // Latin-1
}

pub fn spatial_analyzer(path: &Path3) -> Vec<u8> {
    let mut text = "// Exported from SpatialAnalyzer\n// Units: mm\n// Group, Name\n".to_owned();
    for (k, (t, [x, y, z], _)) in path.points().iter().enumerate() {
        let (minute, second) = (2 + (t / 60.0) as u32, (t % 60.0) as u32);
        writeln!(
            text,
            "Circle,  p{k},  {k},  {x:.4},  {y:.4},  {z:.4},  11/08/22 16:{minute:02}:{second:02}"
        )
        .unwrap();
    }
    text.into_bytes()
}

pub fn rtde(path: &Path3) -> Vec<u8> {
    let names = |who: &str| {
        (0..6)
            .map(|k| format!("{who}_TCP_pose_{k}"))
            .collect::<Vec<_>>()
            .join(" ")
    };
    let mut text = format!("timestamp {} {}\n", names("target"), names("actual"));
    for (t, is, want) in path.points() {
        let pose = |p: [f64; 3]| {
            format!(
                "{:.7} {:.7} {:.7} 0.01 -3.14 0.02",
                p[0] / 1e3,
                p[1] / 1e3,
                p[2] / 1e3
            )
        };
        writeln!(text, "{:.3} {} {}", 81_234.5 + t, pose(want), pose(is)).unwrap();
    }
    text.into_bytes()
}

pub fn kflop(path: &Path3) -> Vec<u8> {
    let mut text = "time,pos0,pos1,pos2,dest0,dest1,dest2\n".to_owned();
    for (t, [x, y, z], [a, b, c]) in path.points() {
        writeln!(text, "{t:.4},{x:.5},{y:.5},{z:.5},{a:.5},{b:.5},{c:.5}").unwrap();
    }
    text.into_bytes()
}

pub fn german(path: &Path3) -> Vec<u8> {
    let mut text = "\u{feff}Zeit [s];X [mm];Y [mm];Z [mm];Bemerkung\r\n".to_owned();
    for (t, [x, y, z], _) in path.points() {
        text += &format!("{t:.3};{x:.4};{y:.4};{z:.4};\r\n").replace('.', ",");
    }
    text.into_bytes()
}

pub fn bare(path: &Path3) -> Vec<u8> {
    let mut text = "some controller\nexport 7\n".to_owned();
    for (t, [x, y, _], _) in path.points() {
        writeln!(text, "{:.1}\t-1\t{:.6}\t{:.6}", t * 1e3, x / 1e3, y / 1e3).unwrap();
    }
    text.into_bytes()
}

pub type Maker = fn(&Path3) -> Vec<u8>;
pub const LAYOUTS: &[(&str, Maker, &str, &[&str])] = &[
    ("leica.csv", leica, "Leica tracker CSV", &[]),
    ("sa.txt", spatial_analyzer, "SpatialAnalyzer text", &[]),
    ("rtde.csv", rtde, "UR RTDE recording", &[]),
    ("kflop.csv", kflop, "KFLOP log", &[]),
    ("german.csv", german, "CSV with decimal commas", &[]),
    (
        "bare.txt",
        bare,
        "columns as given",
        &["--columns", "time_ms,-,x_m,y_m"],
    ),
];
