//! The gaze filter: simulated fixations and saccades, noisy trackers with lost samples, and never NaN.

use glam::DVec3;
use hwall_hand::{Fixation, Gaze, GazeFilter, GazeFilterConfig, GazeRay};
use hwall_testkit::{ErrorStats, Sampler, minimum_jerk, refused};
use proptest::prelude::*;

const EYE: DVec3 = DVec3::new(0.0, 0.0, 1.6);
const PERIOD_S: f64 = 1.0 / 90.0;
const SACCADE_S: f64 = 0.06;

fn at(angle_deg: f64) -> DVec3 {
    let (sin, cos) = angle_deg.to_radians().sin_cos();
    DVec3::new(cos, sin, 0.0)
}

fn off_deg(a: DVec3, b: DVec3) -> f64 {
    a.cross(b).length().atan2(a.dot(b)).to_degrees()
}

fn noisy(sampler: &mut Sampler, direction: DVec3, noise_deg: f64) -> DVec3 {
    let (u, v) = direction.any_orthonormal_pair();
    let [a, b] = [sampler.normal(), sampler.normal()].map(|x| x * noise_deg.to_radians().tan());
    (direction + u * a + v * b).normalize()
}

fn ray(direction: DVec3) -> GazeRay {
    GazeRay {
        origin_m: EYE,
        direction,
    }
}

/// Angle of an eye that leaves 0 for `to_deg` at `leave_s`, with a minimum-jerk saccade.
fn angle_deg(t_s: f64, leave_s: f64, to_deg: f64) -> f64 {
    to_deg * minimum_jerk((t_s - leave_s) / SACCADE_S)
}

fn fixation(gaze: Gaze) -> Fixation {
    *gaze.fixation().unwrap_or_else(|| panic!("{gaze:?}"))
}

#[test]
fn the_error_of_a_resting_gaze_falls_with_the_root_of_the_samples() {
    for noise_deg in [0.5, 1.5] {
        let mut sampler = Sampler::new(3);
        let (mut off, mut stated_rad) = (Vec::new(), 0.0);
        for _ in 0..200 {
            let mut filter = GazeFilter::default();
            let mut gaze = Gaze::Lost;
            // Before the fixation, the eye is elsewhere, long enough to measure the noise.
            for i in -40..45 {
                let place = at(if i < 0 { 40.0 } else { 0.0 });
                let seen = ray(noisy(&mut sampler, place, noise_deg));
                gaze = filter.step(f64::from(i) * PERIOD_S, Some(&seen));
            }
            if let Gaze::Fixed(f) = gaze {
                off.push(off_deg(f.ray.direction, DVec3::X));
                stated_rad += f.noise_rad / 200.0;
            }
        }
        assert!(off.len() > 195, "{}", off.len());
        let stats = ErrorStats::from_errors(off);
        // The median over two directions is 1.18 standard deviations.
        let exact_deg = 1.18 * noise_deg / 45_f64.sqrt();
        assert!(stats.median < 1.3 * exact_deg, "{noise_deg}: {stats:?}");
        let stated_deg = stated_rad.to_degrees();
        let share = stated_deg / (noise_deg / 45_f64.sqrt());
        assert!((0.8..1.4).contains(&share), "{noise_deg}: {share}");
    }
}

#[test]
fn a_resting_gaze_stays_one_fixation() {
    for noise_deg in [0.0, 0.5, 1.5, 4.0] {
        let mut sampler = Sampler::new(5);
        let mut filter = GazeFilter::default();
        let mut outside = 0;
        let mut since = Vec::new();
        for i in 0..90 * 120 {
            let seen = ray(noisy(&mut sampler, DVec3::X, noise_deg));
            match filter.step(f64::from(i) * PERIOD_S, Some(&seen)) {
                // After half a second the noise has been measured.
                Gaze::Fixed(f) if i > 45 => since.push(f.since_s),
                Gaze::Fixed(_) => {}
                _ => outside += u32::from(i > 45),
            }
        }
        since.dedup();
        assert!(since.len() <= 3, "{noise_deg}: {since:?}");
        assert!(outside < 60, "{noise_deg}: {outside}");
    }
}

#[test]
fn a_saccade_gives_no_line_of_sight_until_it_has_landed() {
    for (noise_deg, rates_hz) in [
        (0.0, [60.0, 90.0, 250.0, 1000.0]),
        (0.5, [60.0, 72.0, 90.0, 120.0]),
    ] {
        for rate_hz in rates_hz {
            for to_deg in [8.0, 15.0, 40.0, 90.0_f64] {
                let name = format!("{rate_hz} Hz, {to_deg} degrees");
                let mut sampler = Sampler::new(7);
                for phase in 0..20 {
                    let mut filter = GazeFilter::default();
                    let leave_s = 0.6 + 0.05 * f64::from(phase) / rate_hz;
                    let mut landed_s = None;
                    let samples = (1.0 * rate_hz) as usize;
                    for i in 0..samples {
                        let t_s = i as f64 / rate_hz;
                        let direction = at(angle_deg(t_s, leave_s, to_deg));
                        let seen = ray(noisy(&mut sampler, direction, noise_deg));
                        let gaze = filter.step(t_s, Some(&seen));
                        let Some(f) = gaze.fixation() else {
                            continue;
                        };
                        let from_deg = off_deg(f.ray.direction, DVec3::X);
                        let left_deg = off_deg(f.ray.direction, at(to_deg));
                        // The line of sight is never in between.
                        let near = 1.0 + 2.0 * noise_deg + 0.03 * to_deg;
                        let is_near = from_deg.min(left_deg) < near;
                        assert!(is_near || t_s < 0.05, "{name}: {left_deg} at {t_s}");
                        if left_deg < near && landed_s.is_none() {
                            landed_s = Some(t_s);
                            let early_s = leave_s + SACCADE_S - f.since_s;
                            assert!(early_s.abs() < 0.02 + 1.0 / rate_hz, "{name}: {early_s}");
                        }
                    }
                    let late_s = landed_s.unwrap() - (leave_s + SACCADE_S);
                    assert!(late_s < 0.02 + 2.0 / rate_hz, "{name}: {late_s}");
                }
            }
        }
    }
}

#[test]
fn a_small_shift_is_another_fixation() {
    let mut sampler = Sampler::new(11);
    for to_deg in [2.0, 3.0, 5.0] {
        let mut late_s = Vec::new();
        for _ in 0..50 {
            let mut filter = GazeFilter::default();
            let mut found_s = None;
            for i in 0..100 {
                let t_s = f64::from(i) * PERIOD_S;
                let direction = at(if t_s < 0.5 { 0.0 } else { to_deg });
                let seen = ray(noisy(&mut sampler, direction, 0.5));
                let gaze = filter.step(t_s, Some(&seen));
                if gaze.fixation().is_some_and(|f| f.since_s > 0.45) {
                    found_s.get_or_insert(t_s);
                }
            }
            late_s.push(found_s.expect("found at all") - 0.5);
        }
        let stats = ErrorStats::from_errors(late_s);
        assert!(stats.median < 0.06, "{to_deg}: {stats:?}");
    }
}

#[test]
fn the_mean_line_passes_the_point_while_the_head_moves() {
    let point_m = DVec3::new(0.7, 0.2, 1.3);
    let mut filter = GazeFilter::default();
    let mut sampler = Sampler::new(13);
    let mut last = Gaze::Lost;
    for i in 0..55 {
        let t_s = f64::from(i) * PERIOD_S;
        // The head moves six centimetres to the side, as people lean towards their hand.
        let origin_m = EYE + DVec3::Y * (0.06 * t_s / 0.6);
        let direction = noisy(&mut sampler, (point_m - origin_m).normalize(), 0.5);
        let seen = GazeRay {
            origin_m,
            direction,
        };
        last = filter.step(t_s, Some(&seen));
    }
    let f = fixation(last);
    assert!(f.since_s < 0.05, "one fixation: {f:?}");
    let way = point_m - f.ray.origin_m;
    let off_m = way.cross(f.ray.direction).length();
    assert!(off_m < 0.004, "{off_m}");
}

#[test]
fn lost_samples_are_bridged_and_a_blink_does_not_end_a_look() {
    let mut sampler = Sampler::new(17);
    let mut filter = GazeFilter::default();
    let mut since_s = None;
    for i in 0..300 {
        let t_s = f64::from(i) * PERIOD_S;
        // Three of ten samples are lost, and all of them from 1 to 1.25 s.
        let lost = sampler.uniform(0.0, 1.0) < 0.3 || (1.0..1.25).contains(&t_s);
        let seen = ray(noisy(&mut sampler, DVec3::X, 0.5));
        let gaze = filter.step(t_s, (!lost).then_some(&seen));
        if (1.12..1.24).contains(&t_s) {
            assert_eq!(gaze, Gaze::Lost, "{t_s}");
        }
        if (0.3..0.95).contains(&t_s) || t_s > 1.4 {
            let f = fixation(gaze);
            assert_eq!(*since_s.get_or_insert(f.since_s), f.since_s, "{t_s}");
            assert!(f.age_s(t_s) > 0.2);
        }
    }
}

/// Start times of the detected fixations while the eyes are at these angles, degrees; `None` while they are closed.
fn begun_s(samples: u32, angle_deg: impl Fn(f64) -> Option<f64>) -> Vec<f64> {
    let mut filter = GazeFilter::default();
    let mut since = Vec::new();
    for i in 0..samples {
        let t_s = f64::from(i) * 0.011;
        let seen = angle_deg(t_s).map(|a| ray(at(a)));
        if let Gaze::Fixed(f) = filter.step(t_s, seen.as_ref()) {
            since.push(f.since_s);
        }
    }
    since.dedup();
    since
}

#[test]
fn other_places_are_fixations_of_their_own_and_a_single_sample_far_away_is_noise() {
    // Another place after a blink.
    let blink = begun_s(80, |t_s| match t_s {
        0.0..0.435 => Some(0.0),
        0.435..0.655 => None,
        _ => Some(5.0),
    });
    let moved_s = (blink[1] - 0.66).abs();
    assert!(blink[0] < 0.03 && moved_s < 0.02, "{blink:?}");
    // A glance and the return.
    let glance = |t_s: f64| Some(if (0.4..0.6).contains(&t_s) { 20.0 } else { 0.0 });
    assert_eq!(begun_s(100, glance).len(), 3);
    let is_stray = |t_s: f64| (0.545..0.555).contains(&t_s);
    let stray = |t_s: f64| Some(if is_stray(t_s) { 25.0 } else { 0.0 });
    assert_eq!(begun_s(100, stray), [0.0]);
}

#[test]
fn bad_samples_and_clocks_do_no_harm() {
    let mut filter = GazeFilter::default();
    assert_eq!(filter.step(f64::NAN, Some(&ray(DVec3::X))), Gaze::Lost);
    for bad in [DVec3::ZERO, DVec3::NAN, DVec3::INFINITY] {
        assert_eq!(filter.step(0.0, Some(&ray(bad))), Gaze::Lost);
        let origin = GazeRay {
            origin_m: bad / DVec3::ZERO,
            direction: DVec3::X,
        };
        assert_eq!(filter.step(0.0, Some(&origin)), Gaze::Lost);
    }
    for i in 1..50 {
        filter.step(f64::from(i) * 0.011, Some(&ray(DVec3::X)));
    }
    let before = filter.step(49.0 * 0.011, None);
    // A repeated time gets the same answer.
    assert!(before.fixation().is_some());
    // A clock reset restarts the filter.
    let anew = filter.step(0.1, Some(&ray(DVec3::Y)));
    assert_eq!(anew, Gaze::InFlight { since_s: 0.1 });
    refused!(GazeFilterConfig::default(), GazeFilter::new, {
        saccade_rad_per_s = f64::NAN, f64::INFINITY, -1.0;
        least_shift_rad = f64::NAN, f64::INFINITY, -1.0;
        noise_rad = f64::NAN, f64::INFINITY, -1.0;
        max_gap_s = f64::NAN, f64::INFINITY, -1.0;
    });
}

proptest! {
    #[test]
    fn whatever_comes_in_what_comes_out_is_usable(
        steps in prop::collection::vec(
            (-0.01..0.3_f64, prop::option::of((-1.0..1.0_f64, -1.0..1.0_f64, prop::num::f64::ANY))), 1..200)
    ) {
        let mut filter = GazeFilter::default();
        let mut t_s = 0.0;
        for (step_s, sight) in steps {
            t_s += step_s;
            let seen = sight.map(|(x, y, z)| ray(DVec3::new(x, y, z)));
            let gaze = filter.step(t_s, seen.as_ref());
            if let Gaze::Fixed(f) = gaze {
                prop_assert!(f.is_usable() && f.since_s <= f.until_s && f.until_s <= t_s);
                prop_assert!(f.noise_rad >= 0.0 && f.samples > 0);
            }
            prop_assert_eq!(filter.step(t_s, None), gaze);
        }
    }
}
