//! Time and error of a fused prediction by the number of rays: `cargo bench -p hwall-contact`.
//!
//! The estimator has an error of 8, 5 and 2 cm, states it correctly, and takes no time.

#[path = "../tests/it/common/mod.rs"]
mod common;

use common::{
    ELSEWHERE, ELSEWHERE_RAD, Fused, blurred, error, following_the_motion, gaze_at, room, scene,
    target,
};
use glam::DVec3;
use hwall_contact::FusedConfig;
use hwall_testkit::{ErrorStats, Machine, Sampler, SpeedErrorTable, Timing};
use std::time::Instant;

const EYE: DVec3 = DVec3::new(-0.25, 0.1, 1.6);
const REACHES: usize = 5000;

fn main() {
    println!("{}", Machine::detect(7));
    let mut table = SpeedErrorTable::new("Fused prediction", "rays a hypothesis");
    for surfaces in [1, 6, 12] {
        let quads = room(surfaces);
        let scene = scene(&quads, None);
        for rays in [7, 13, 19, 37, 75] {
            let config = FusedConfig {
                rays,
                ..following_the_motion()
            };
            let mut sampler = Sampler::new(7);
            let (mut times_ns, mut errors_m, mut right) = (Vec::new(), Vec::new(), 0);
            let mut surprise = 0.0;
            for _ in 0..REACHES {
                let hand_m = DVec3::new(0.0, 0.0, 1.2) + sampler.unit_vector() * 0.1;
                let (surface, contact_m) = target(&mut sampler, &scene, &quads, hand_m);
                let (off_m, covariance) = error(&mut sampler, DVec3::new(0.08, 0.05, 0.02));
                let mut gaze = gaze_at(EYE, contact_m);
                let elsewhere = sampler.uniform(0.0, 1.0) < ELSEWHERE;
                let spread_rad = if elsewhere {
                    ELSEWHERE_RAD
                } else {
                    config.evidence.on_target_sd_rad
                };
                gaze.direction = blurred(&mut sampler, gaze.direction, spread_rad);
                let straight = (contact_m - hand_m).normalize();
                let velocity = blurred(&mut sampler, straight, 0.25);
                let mut fused = Fused::new(config.clone());
                let began = Instant::now();
                let answers = fused.see(
                    &scene,
                    (hand_m, velocity),
                    Some((contact_m + off_m, covariance)),
                    Some(gaze),
                );
                times_ns.push(began.elapsed().as_secs_f64() * 1e9);
                right += usize::from(answers[0].surface == surface);
                errors_m.push(answers[0].point_m.distance(contact_m));
                let stated = answers.iter().find(|a| a.surface == surface);
                surprise -= stated.map_or(1e-3, |a| a.probability).ln() / REACHES as f64;
            }
            table.row(
                format!("{surfaces} surfaces"),
                rays.to_string(),
                Timing::from_samples_ns(times_ns),
                (ErrorStats::from_errors(errors_m), "m"),
                format!(
                    "right surface {:.1} %, log score {surprise:.3}",
                    100.0 * right as f64 / REACHES as f64
                ),
            );
        }
    }
    println!("{}", table.to_markdown());
}
