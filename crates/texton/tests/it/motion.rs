//! The texture under a finger: turned to the scan, moved against it, within the limits, in hard cases.

use crate::common::bumps;
use glam::DVec2;
use hwall_testkit::{Sampler, refused};
use hwall_texton::{
    FingerState, Level, Limit, MotionLimits, MotionStep, ScanAngle, ScanConfig, ScanEstimator,
    Stroke, TextureMotion,
};
use std::f64::consts::{FRAC_PI_2, PI};

const DT_S: f64 = 1e-3;

fn level(deg: f64, speed_mm_per_s: f64) -> Level {
    bumps::level(deg, speed_mm_per_s, 0.0)
}

fn finger(point_m: DVec2, velocity_m_per_s: DVec2) -> Option<FingerState> {
    Some(FingerState {
        point_m,
        velocity_m_per_s,
    })
}

fn rest() -> Option<FingerState> {
    finger(DVec2::ZERO, DVec2::ZERO)
}

/// Runs a motion with a finger given over time; checks the limits at every step.
struct Run {
    motion: TextureMotion,
    t_s: f64,
    last: Option<MotionStep>,
}

impl Run {
    fn new() -> Self {
        Self::with(MotionLimits::default())
    }

    fn with(limits: MotionLimits) -> Self {
        Self::of(TextureMotion::new(limits).unwrap())
    }

    fn of(motion: TextureMotion) -> Self {
        Self {
            motion,
            t_s: 0.0,
            last: None,
        }
    }

    fn step(&mut self, finger: Option<FingerState>, level: &Level) -> MotionStep {
        let step = self.motion.step(self.t_s, finger, level).unwrap();
        let limits = *self.motion.limits();
        if let Some(last) = self.last {
            let change = (step.velocity_m_per_s - last.velocity_m_per_s).length();
            assert!(change <= limits.acceleration_m_per_s2 * DT_S * (1.0 + 1e-9));
            let moved = step.displacement_m - last.displacement_m;
            let mean = 0.5 * (step.velocity_m_per_s + last.velocity_m_per_s);
            // A ramp may end within the step.
            assert!((moved - mean * DT_S).length() <= 0.5 * change * DT_S + 1e-12);
            if finger.is_some() && last.relative_speed_m_per_s > 0.0 {
                let turn = (step.roll_rad - last.roll_rad).abs();
                assert!(turn <= limits.turn_rad_per_s * DT_S * (1.0 + 1e-9));
                let change = (step.roll_rad_per_s - last.roll_rad_per_s).abs();
                assert!(change <= limits.turn_rad_per_s2 * DT_S * (1.0 + 1e-9));
            }
        }
        assert!(
            step.displacement_m.length() <= limits.stroke_m + 1e-9,
            "{step:?} {limits:?}"
        );
        self.last = Some(step);
        self.t_s += DT_S;
        step
    }

    /// Runs `n` steps with a finger as a function of time since the first; returns the last step.
    fn run(
        &mut self,
        steps: usize,
        level: &Level,
        finger: impl Fn(f64) -> Option<FingerState>,
    ) -> MotionStep {
        let from_s = self.t_s;
        (0..steps)
            .map(|_| self.step(finger(self.t_s - from_s), level))
            .last()
            .unwrap()
    }
}

#[test]
fn a_resting_finger_feels_the_speed_of_the_level_after_the_ramp() {
    for speed in [10.0, 40.0, 80.0] {
        let mut run = Run::new();
        // Number of steps of the ramp at 4 m/s², from the first step.
        let ramp = (speed / 4.0_f64).ceil() as usize + 1;
        let step = run.run(ramp + 1, &level(45.0, speed), |_| rest());
        assert_eq!(step.limited, None, "{step:?}");
        assert!((step.relative_speed_m_per_s - speed * 1e-3).abs() < 1e-12);
        // Against a scan along x.
        assert!((step.velocity_m_per_s - DVec2::new(-speed * 1e-3, 0.0)).length() < 1e-12);
        assert!((step.roll_rad - PI / 4.0).abs() < 1e-12);
    }
}

#[test]
fn a_moving_finger_feels_its_own_speed_and_the_level() {
    for direction in [0.0, 0.7, FRAC_PI_2, 3.0, -2.0] {
        let velocity = 0.1 * DVec2::from_angle(direction);
        let mut run = Run::new();
        run.motion.scan_mut().expect(direction).unwrap();
        let step = run.run(100, &level(0.0, 60.0), |t| finger(velocity * t, velocity));
        let off = step.relative_speed_m_per_s - 0.16;
        assert!(off.abs() < 1e-9, "{step:?}");
        assert!((step.velocity_m_per_s + 0.6 * velocity).length() < 1e-9);
    }
}

#[test]
fn the_roll_is_the_scan_plus_the_orientation_modulo_half_a_turn() {
    let mut motion = TextureMotion::new(MotionLimits::default()).unwrap();
    for (scan_deg, theta_deg, roll_deg) in [
        (0.0, 0.0, 0.0),
        (0.0, 90.0, 90.0),
        (180.0, 0.0, 0.0),
        (90.0, 45.0, -45.0),
        (-30.0, 63.43, 33.43),
        (150.0, 63.43, 33.43),
    ] {
        motion.scan_mut().expect(f64::to_radians(scan_deg)).unwrap();
        let roll = motion.roll_for(&level(theta_deg, 0.0)).to_degrees();
        // Both ends of the half turn are equal.
        let off = (roll - roll_deg).rem_euclid(180.0);
        assert!(
            off.min(180.0 - off) < 1e-9,
            "{scan_deg} {theta_deg}: {roll}"
        );
        assert!(roll.abs() <= 90.0 + 1e-9);
        // The angle that the finger then feels.
        let felt = ScanAngle::from_deg(scan_deg - roll).unwrap();
        assert!((felt.deg() - theta_deg).abs() < 1e-9);
    }
}

#[test]
fn a_board_that_stands_elsewhere_turns_from_there() {
    let mut run = Run::new();
    let level = level(60.0, 20.0);
    run.step(None, &level);
    let rolls = |run: &mut Run, steps: usize, roll_rad: f64, most: f64| {
        let step = run.run(steps, &level, |_| rest());
        assert!((step.roll_rad - roll_rad).abs() < most, "{step:?}");
    };
    run.motion.stands_at(1.2).unwrap();
    rolls(&mut run, 1, 1.2, 1e-3);
    rolls(&mut run, 2000, 60.0_f64.to_radians(), 1e-6);
    // Set once, it applies to one touch.
    run.step(None, &level);
    rolls(&mut run, 1, 60.0_f64.to_radians(), 1e-6);
    assert!(run.motion.stands_at(f64::NAN).is_err());
}

#[test]
fn the_stroke_ends_in_a_stop_and_a_finger_that_turns_round_gives_it_back() {
    let limits = MotionLimits {
        stroke_m: 0.03,
        ..MotionLimits::default()
    };
    let mut run = Run::with(limits);
    let fast = level(0.0, 80.0);
    let step = run.run(1000, &fast, |_| rest());
    let off = step.displacement_m.length() - 0.03;
    assert!(off.abs() < 1e-6, "{step:?}");
    assert!(step.velocity_m_per_s.length() < 1e-3);
    assert_eq!(step.limited, Some(Limit::Stroke));
    // Reversed finger: the board reverses its motion at once, without turning.
    let back = DVec2::new(-0.05, 0.0);
    let step = run.run(150, &fast, |t| finger(back * t, back));
    let off = step.velocity_m_per_s - DVec2::new(0.08, 0.0);
    assert!(off.length() < 1e-9, "{step:?}");
    assert_eq!(step.limited, None);
    assert!(step.roll_rad.abs() < 1e-9);
}

#[test]
fn the_board_stops_before_the_finger_runs_off_its_face() {
    let mut run = Run::new();
    // Touched 15 mm from the edge that the finger will come to, 5 of which it may use.
    let at = DVec2::new(0.085, 0.0);
    let step = run.run(1000, &level(0.0, 80.0), |_| finger(at, DVec2::ZERO));
    assert_eq!(step.limited, Some(Limit::Face));
    let on_board = at - step.displacement_m;
    assert!((on_board.x - 0.09).abs() < 1e-5, "{on_board}");
    // Turned board: the edge is at another place.
    let mut run = Run::new();
    let corner = DVec2::new(0.12, 0.0);
    let step = run.run(1000, &level(45.0, 20.0), |_| finger(corner, DVec2::ZERO));
    let on_board = DVec2::from_angle(-step.roll_rad).rotate(corner - step.displacement_m);
    let off = on_board.abs().max_element() - 0.09;
    assert!(off.abs() < 1e-4, "{on_board}");
}

#[test]
fn out_of_contact_the_board_returns_and_only_then() {
    let mut run = Run::new();
    let slow = level(30.0, 40.0);
    let away = run.run(500, &slow, |_| rest()).displacement_m;
    assert!(away.length() > 0.015);
    let step = run.run(2, &slow, |_| None);
    assert!(step.displacement_m.length() > 0.015, "no leap");
    let step = run.run(400, &slow, |_| None);
    assert_eq!(step.displacement_m, DVec2::ZERO);
    assert_eq!(step.velocity_m_per_s, DVec2::ZERO);
    assert_eq!(step.relative_speed_m_per_s, 0.0);
    assert_eq!(step.limited, None);
    // In contact with a level of zero speed it stays where it is.
    let away = run.run(500, &slow, |_| rest()).displacement_m;
    let step = run.run(500, &level(30.0, 0.0), |_| rest());
    assert!(step.displacement_m.length() >= away.length() && step.velocity_m_per_s == DVec2::ZERO);
    // So does a board that never moved.
    let step = Run::new().run(200, &level(90.0, 0.0), |_| rest());
    assert_eq!((step.displacement_m, step.limited), (DVec2::ZERO, None));
    assert_eq!(step.relative_speed_m_per_s, 0.0);
}

#[test]
fn a_curved_scan_is_followed() {
    // A circle of 40 mm about a place beside the middle, once in 2.5 s: 0.1 m/s.
    let omega = 2.0 * PI / 2.5;
    let circle = |t: f64| {
        let at = DVec2::from_angle(omega * t - FRAC_PI_2) * 0.04 + DVec2::new(0.0, 0.04);
        finger(at, DVec2::from_angle(omega * t) * 0.04 * omega)
    };
    let limits = MotionLimits {
        turn_rad_per_s: 4.0,
        turn_rad_per_s2: 200.0,
        ..MotionLimits::default()
    };
    let mut run = Run::with(limits);
    for cycle in 0..2500 {
        let t_s = run.t_s;
        let step = run.step(circle(t_s), &level(70.0, 40.0));
        if cycle < 200 {
            continue;
        }
        // The low pass lags by its time constant: 3 degrees.
        let felt = ScanAngle::from_rad(omega * t_s - step.roll_rad).unwrap();
        assert!((felt.deg() - 70.0).abs() < 4.0, "{felt:?}");
        // The board's turn adds up to 4 rad/s times the finger's distance from the middle.
        assert!(step.relative_speed_m_per_s > 0.0, "{step:?}");
        assert_eq!(step.limited, None);
    }
}

#[test]
fn random_fingers_never_break_a_limit() {
    let mut s = Sampler::new(3);
    for _ in 0..50 {
        let mut run = Run::with(MotionLimits {
            stroke_m: s.uniform(0.01, 0.1),
            acceleration_m_per_s2: s.uniform(0.5, 6.0),
            ..MotionLimits::default()
        });
        let mut velocity = DVec2::ZERO;
        let mut at = DVec2::ZERO;
        let mut now = level(0.0, 80.0);
        let mut touching = true;
        for _ in 0..2000 {
            if s.uniform(0.0, 1.0) < 0.01 {
                velocity = DVec2::from_angle(s.uniform(-PI, PI)) * s.uniform(0.0, 0.3);
                now = level(s.uniform(0.0, 90.0), s.uniform(0.0, 120.0));
                touching = s.uniform(0.0, 1.0) < 0.8;
            }
            at += velocity * DT_S;
            run.step(finger(at, velocity).filter(|_| touching), &now);
        }
    }
}

#[test]
fn a_level_faster_than_the_board_is_presented_at_its_limit() {
    let mut run = Run::new();
    let step = run.run(60, &level(0.0, 500.0), |_| rest());
    assert!((step.velocity_m_per_s.length() - 0.1).abs() < 1e-12);
    assert_eq!(step.limited, Some(Limit::Speed));
}

#[test]
fn the_stroke_is_shortened_to_what_is_reachable() {
    let mut motion = TextureMotion::new(MotionLimits::default()).unwrap();
    motion.scan_mut().expect(FRAC_PI_2).unwrap();
    let one = level(0.0, 80.0);
    // Limited to -22 mm on one side, unlimited on the other; the checked roll is the one in use.
    let reach = motion.limit_stroke(&one, |place, roll| {
        assert!((roll.abs() - FRAC_PI_2).abs() < 1e-12);
        place.y > -0.022
    });
    assert!((reach.against_m - 0.02).abs() < 1e-12, "{reach:?}");
    assert!((reach.along_m - 0.08).abs() < 1e-12, "{reach:?}");
    let mut run = Run::of(motion);
    let step = run.run(1000, &one, |_| rest());
    assert!((step.displacement_m.y + 0.02).abs() < 1e-6, "{step:?}");
    assert_eq!(step.limited, Some(Limit::Stroke));
    // Nothing is reachable: it stays.
    let mut motion = TextureMotion::new(MotionLimits::default()).unwrap();
    let none = Stroke {
        against_m: 0.0,
        along_m: 0.0,
    };
    assert_eq!(motion.limit_stroke(&one, |_, _| false), none);
    for i in 0..100 {
        let step = motion.step(f64::from(i) * DT_S, rest(), &one).unwrap();
        assert!(step.displacement_m.length() < 1e-9);
    }
}

#[test]
fn bad_input_changes_nothing_and_clocks_that_stand_or_run_back_move_nothing() {
    let mut run = Run::new();
    let one = level(0.0, 40.0);
    let before = run.run(50, &one, |_| rest());
    let now = run.t_s;
    let nan = DVec2::new(f64::NAN, 0.0);
    for (t_s, finger, level) in [
        (f64::NAN, rest(), one),
        (now, finger(nan, DVec2::ZERO), one),
        (now, finger(DVec2::ZERO, nan), one),
        (now, rest(), level(0.0, f64::NAN)),
        (now, rest(), level(0.0, -1.0)),
    ] {
        assert!(run.motion.step(t_s, finger, &level).is_err());
    }
    for t_s in [now - DT_S, now - DT_S, now - 10.0] {
        let step = run.motion.step(t_s, rest(), &one).unwrap();
        assert_eq!(step.displacement_m, before.displacement_m);
    }
    // A stall moves it on by no more than the longest step.
    let step = run.motion.step(now + 100.0, rest(), &one).unwrap();
    assert!((step.displacement_m - before.displacement_m).length() <= 0.05 * 0.04 + 1e-12);
}

#[test]
fn settings_outside_their_ranges_are_named() {
    refused!(MotionLimits::default(), TextureMotion::new, {
        speed_m_per_s = 0.0;
        acceleration_m_per_s2 = f64::NAN;
        stroke_m = -1.0;
        margin_m = 0.1, f64::NAN => "half_face_m less margin_m";
        margin_m = -0.1;
        half_face_m = [0.1, 0.0];
        turn_rad_per_s = f64::INFINITY;
        return_speed_m_per_s = 0.0;
        max_step_s = 0.0;
        scan.time_constant_s = 0.0;
    });
}

#[test]
fn a_finger_at_rest_keeps_the_direction_and_one_bad_sample_turns_nothing() {
    let mut scan = ScanEstimator::new(ScanConfig::default(), 0.3).unwrap();
    for _ in 0..100 {
        assert_eq!(scan.step(DT_S, DVec2::ZERO).unwrap(), 0.3);
    }
    let along = DVec2::from_angle(0.3) * 0.1;
    for _ in 0..100 {
        scan.step(DT_S, along).unwrap();
    }
    scan.step(DT_S, DVec2::from_angle(1.8) * 0.5).unwrap();
    assert!((scan.direction_rad() - 0.3).abs() < 0.01);
    // No faster than it may, even for a clear corner.
    for _ in 0..10 {
        scan.step(DT_S, DVec2::from_angle(1.6) * 0.5).unwrap();
    }
    assert!(scan.direction_rad() < 0.3 + 6.0 * 0.011 + 1e-9);
    assert!(scan.step(f64::NAN, along).is_err() && scan.step(-1.0, along).is_err());
    assert!(scan.expect(f64::NAN).is_err());
    // An approach straight at the surface says nothing; a slanted one does.
    scan.expect(0.0).unwrap();
    scan.expect_from_approach(DVec2::new(0.0, 0.001)).unwrap();
    assert_eq!(scan.direction_rad(), 0.0);
    scan.expect_from_approach(DVec2::new(0.0, 0.2)).unwrap();
    assert!((scan.direction_rad() - FRAC_PI_2).abs() < 1e-12);
    let nan = DVec2::new(f64::NAN, 0.0);
    assert!(scan.expect_from_approach(nan).is_err());
}

#[test]
fn an_unexpected_scan_feels_right_at_once_and_turns_the_board_slowly() {
    let velocity = 0.1 * DVec2::from_angle(0.35);
    let mut run = Run::new();
    let first = run.step(None, &level(45.0, 80.0));
    let step = run.run(60, &level(45.0, 80.0), |t| finger(velocity * t, velocity));
    // Before it has turned, the board moves aside as far as the finger lacks of the angle to the bumps.
    let over = velocity - step.velocity_m_per_s;
    let wanted = 0.18 * DVec2::from_angle(step.roll_rad - PI / 4.0);
    assert!((over - wanted).length() < 1e-3, "{step:?}");
    assert_eq!(step.limited, Some(Limit::Turn));
    assert!((step.roll_rad - first.roll_rad) <= 0.5 * 0.061);
    run.run(700, &level(45.0, 80.0), |t| finger(velocity * t, velocity));
    let step = run.run(500, &level(45.0, 80.0), |_| rest());
    assert!((step.roll_rad - (0.35 + PI / 4.0)).abs() < 1e-4, "{step:?}");
}

/// The other side of the bumps feels the same, and may be nearer.
#[test]
fn a_scan_across_the_expected_one_needs_no_turn_at_45_degrees() {
    let velocity = 0.1 * DVec2::Y;
    let mut run = Run::new();
    let first = run.step(None, &level(45.0, 40.0));
    let step = run.run(100, &level(45.0, 40.0), |t| finger(velocity * t, velocity));
    assert!((step.roll_rad - first.roll_rad).abs() < 1e-9, "{step:?}");
    assert!((step.velocity_m_per_s + 0.4 * velocity).length() < 1e-9);
    assert_eq!(step.limited, None);
}

/// A circle turns faster than the board can; the finger still crosses the bumps at the angle of the level.
#[test]
fn a_circle_faster_than_the_board_turns_keeps_the_angle() {
    let (radius_m, rad_per_s) = (0.03, 3.0);
    let mut run = Run::new();
    run.step(None, &level(60.0, 40.0));
    let (mut worst_rad, mut judged) = (0.0_f64, 0);
    for cycle in 0..1500 {
        let phase = rad_per_s * f64::from(cycle) * DT_S;
        let velocity = radius_m * rad_per_s * DVec2::from_angle(phase);
        let at_m = radius_m * DVec2::from_angle(phase - FRAC_PI_2);
        let step = run.step(finger(at_m, velocity), &level(60.0, 40.0));
        let over = velocity - step.velocity_m_per_s;
        let met = ScanAngle::from_rad(over.to_angle() - step.roll_rad).unwrap();
        let settled = cycle > 100 && step.limited != Some(Limit::Acceleration);
        if settled && step.limited != Some(Limit::Stroke) {
            worst_rad = worst_rad.max((met.rad() - PI / 3.0).abs());
            judged += 1;
        }
    }
    assert!(
        worst_rad < 0.15 && judged > 700,
        "{worst_rad}, {judged} cycles"
    );
}

/// Where both sides of the bumps are equally near, noise does not make the board shake.
#[test]
fn a_scan_between_both_sides_turns_the_board_to_one_of_them() {
    let mut run = Run::new();
    run.step(None, &level(30.0, 40.0));
    let mut sampler = Sampler::new(1);
    let mut turned = Vec::new();
    let mut last = 0.0;
    for cycle in 0..1000 {
        // Against the bumps of the expected roll the scan lies in the middle.
        let velocity = 0.05 * DVec2::from_angle(PI / 6.0 + sampler.uniform(-0.035, 0.035));
        let at_m = 0.02 * DVec2::from_angle(0.01 * f64::from(cycle));
        let step = run.step(finger(at_m, velocity), &level(30.0, 40.0));
        if cycle > 50 && step.roll_rad_per_s.abs() > 0.05 {
            turned.push(step.roll_rad_per_s > 0.0);
        }
        last = step.roll_rad_per_s;
    }
    let changes = turned.windows(2).filter(|w| w[0] != w[1]).count();
    assert!(changes <= 2, "{changes} changes, {last}");
}
