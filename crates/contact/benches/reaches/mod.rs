//! Simulated reaches of a hand with six points, for benches and the allocation test.

use glam::DVec3;
use hwall_hand::{HandFrame, HandPoint, LabelledReach};
use hwall_testkit::{Sampler, minimum_jerk};

/// Noise of the tracker in each coordinate, m.
const NOISE_M: f64 = 7e-4;

/// Reaches of about half a metre to a wall at x = 0 by people who differ in speed, curvature, hand size and how late they open the hand. Minimum
/// jerk at 90 Hz; the index tip touches.
pub(crate) fn reaches(seed: u64, people: usize, count: usize) -> Vec<LabelledReach> {
    let mut sampler = Sampler::new(seed);
    let mut all = Vec::with_capacity(count);
    for person in 0..people {
        let factor = sampler.uniform(0.8, 1.2);
        let bow_m = DVec3::Z * (0.03 + 0.02 * sampler.normal());
        let hand_m = sampler.uniform(0.16, 0.20);
        let opens = sampler.uniform(0.3, 0.7);
        for trial in (person..count).step_by(people) {
            let from = DVec3::new(0.6, 0.1, 0.1) + 0.03 * sampler.normal_vector();
            let to = DVec3::new(0.0, sampler.uniform(-0.3, 0.3), sampler.uniform(0.0, 0.5));
            let duration_s = factor * sampler.uniform(0.7, 0.9);
            let samples = (duration_s * 90.0) as usize;
            let frames = (0..=samples).map(|k| {
                let tau = k as f64 / samples as f64;
                let tip_m =
                    from.lerp(to, minimum_jerk(tau)) + 16.0 * (tau * (1.0 - tau)).powi(2) * bow_m;
                let open = ((tau - opens) / 0.2).clamp(0.0, 1.0);
                frame(&mut sampler, tau * duration_s, tip_m, hand_m, open)
            });
            all.push(LabelledReach {
                person: Some(format!("person {person}")),
                trial: Some(format!("{trial}")),
                point: HandPoint::Index,
                frames: frames.collect(),
                contact_m: to,
                contact_s: duration_s,
                normal: Some(DVec3::X),
            });
        }
    }
    all
}

/// Palm, five tips and the head; `open`: from 0, a fist, to 1, straight fingers.
fn frame(sampler: &mut Sampler, t_s: f64, tip_m: DVec3, hand_m: f64, open: f64) -> HandFrame {
    let mut frame = HandFrame::empty(t_s);
    frame.head_m = Some(DVec3::new(0.9, 0.0, 0.6) + NOISE_M * sampler.normal_vector());
    let palm_m = tip_m + DVec3::new((0.4 + 0.2 * open) * hand_m, 0.0, -0.01);
    for (k, point) in HandPoint::ALL.into_iter().enumerate() {
        let place_m = match point {
            HandPoint::Index => tip_m,
            HandPoint::Palm => palm_m,
            _ => palm_m + DVec3::new(-0.5 * open * hand_m, 0.02 * (k as f64 - 3.0), 0.0),
        };
        frame.set_point(point, Some(place_m + NOISE_M * sampler.normal_vector()));
    }
    frame
}
