//! Identity of the data: what was programmed and measured, bit by bit.
use giotto::campaign::{Campaign, Direction};
use sha2::{Digest, Sha256};

/// SHA-256, in hexadecimal, of everything the diagnosis reads of a campaign, in run order: radius, feed,
/// start angle, start (NaN where unknown) and the samples (angle, deviation, time) as little-endian f64 in
/// SI, a byte for the direction, texts with a zero behind them.
pub fn of(campaign: &Campaign) -> String {
    let mut hash = Sha256::new();
    let text = |hash: &mut Sha256, text: &str| {
        hash.update(text.as_bytes());
        hash.update([0]);
    };
    text(&mut hash, &campaign.name);
    text(&mut hash, &campaign.machine);
    let mut bytes = Vec::new();
    for run in &campaign.runs {
        text(&mut hash, &run.file);
        hash.update([u8::from(run.direction == Direction::Ccw)]);
        let empty = Vec::new();
        let samples = &run.samples;
        let head = [
            run.radius_m,
            run.feed_m_s,
            run.start_angle_rad,
            run.started_s.unwrap_or(f64::NAN),
        ];
        bytes.clear();
        for values in [
            &head[..],
            &samples.angle_rad,
            &samples.deviation_m,
            samples.time_s.as_ref().unwrap_or(&empty),
        ] {
            bytes.extend((values.len() as u64).to_le_bytes());
            bytes.extend(values.iter().flat_map(|v| v.to_le_bytes()));
        }
        hash.update(&bytes);
    }
    hash.finalize()
        .iter()
        .map(|byte| format!("{byte:02x}"))
        .collect()
}
