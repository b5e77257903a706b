//! The stated uncertainty of the fused predictor is right: an estimator with a known error in rooms of 1, 3, 6 and 12 surfaces.

use crate::common::{
    ELSEWHERE, ELSEWHERE_RAD, EYE, Fused, blurred, error, following_the_motion, gaze_at,
    plain_scene, room, target,
};
use glam::DVec3;
use hwall_testkit::Sampler;

const HAND: DVec3 = DVec3::new(0.0, 0.0, 1.2);

/// Sums over many reaches.
#[derive(Debug, Default)]
struct Tally {
    right: f64,
    /// Sums of stated probability, of hits, and counts, by tenths of the stated probability.
    bins: [[f64; 3]; 10],
    /// Numbers of contacts in the 90 % region and of contacts on the first surface.
    inside: f64,
    raw_m: Vec<f64>,
    fused_m: Vec<f64>,
}

fn tally(surfaces: usize, sd_m: DVec3, with_gaze: bool, reaches: usize) -> Tally {
    let quads = room(surfaces);
    let scene = plain_scene(&quads);
    let mut sampler = Sampler::new(100 + surfaces as u64);
    let config = following_the_motion();
    let model = config.evidence;
    let mut tally = Tally::default();
    for _ in 0..reaches {
        let hand_m = HAND + sampler.unit_vector() * sampler.uniform(0.0, 0.15);
        let (surface, contact_m) = target(&mut sampler, &scene, &quads, hand_m);
        let (off_m, covariance) = error(&mut sampler, sd_m);
        let mut gaze = gaze_at(EYE, contact_m);
        let spread_rad = match sampler.uniform(0.0, 1.0) < ELSEWHERE {
            true => ELSEWHERE_RAD,
            false => model.on_target_sd_rad,
        };
        gaze.direction = blurred(&mut sampler, gaze.direction, spread_rad);
        // The registration of the tracker to the scene has an error, which shifts everything.
        let shift_m = sampler.normal_vector() * config.registration_sd_m;
        gaze.origin_m += shift_m;
        let mut fused = Fused::new(config.clone());
        let straight = (contact_m - hand_m).normalize();
        let velocity = blurred(&mut sampler, straight, 0.25);
        let answers = fused.see(
            &scene,
            (hand_m + shift_m, velocity),
            Some((contact_m + off_m + shift_m, covariance)),
            with_gaze.then_some(gaze),
        );
        let sum: f64 = answers.iter().map(|a| a.probability).sum();
        assert!((sum - 1.0).abs() < 1e-9);
        for answer in answers {
            let bin = &mut tally.bins[((answer.probability * 10.0) as usize).min(9)];
            bin[0] += answer.probability;
            bin[1] += f64::from(answer.surface == surface);
            bin[2] += 1.0;
        }
        let first = &answers[0];
        if first.surface == surface {
            tally.right += 1.0;
            let squared = first.squared_deviations(contact_m).unwrap();
            // 90 % of a normal distribution in two dimensions.
            tally.inside += f64::from(squared <= 2.0 * 10_f64.ln());
            tally.fused_m.push(contact_m.distance(first.point_m));
            tally.raw_m.push((off_m + shift_m).length());
        }
    }
    tally
}

fn mean(values: &[f64]) -> f64 {
    values.iter().sum::<f64>() / values.len() as f64
}

#[test]
fn stated_probabilities_are_frequencies_and_regions_hold_what_they_say() {
    for sd in [
        DVec3::splat(0.10),
        DVec3::new(0.08, 0.05, 0.02),
        DVec3::splat(0.02),
    ] {
        for with_gaze in [false, true] {
            for surfaces in [1, 3, 6, 12] {
                let t = tally(surfaces, sd, with_gaze, 1500);
                // The distance of a fixation from the motion is only roughly accounted for.
                let most = if with_gaze { 0.98 } else { 0.93 };
                let inside = t.inside / t.right;
                let (raw, fused) = (mean(&t.raw_m), mean(&t.fused_m));
                // Surfaces with a small part of the Gaussian are met by few rays, hence the tolerance in addition to three standard deviations of
                // the count.
                for [stated, hits, count] in t.bins.into_iter().filter(|b| b[2] >= 50.0) {
                    let (p, f) = (stated / count, hits / count);
                    let allowed = 3.0 * (p * (1.0 - p) / count).sqrt() + 0.08;
                    assert!((p - f).abs() <= allowed, "{p:.3} was {f:.3} of {count}");
                }
                assert!((0.87..=most).contains(&inside), "{inside}");
                assert!(fused < 0.85 * raw);
            }
        }
    }
}
