//! Trials of a textured board on the simulated arm: time from a touch to the wanted speed.

use anyhow::Context;
use glam::{DVec2, DVec3};
use hwall::{Controller, TargetControl};
use hwall_haptics::{
    Arm, Board, BoardTarget, Follower, FollowerConfig, Phase, RendererConfig, Slide, surface_axes,
};
use hwall_kinematics::{
    ArmKinematics, BranchPolicy, JointPositions, NearestConfig, SrsArm, Wrench,
};
use hwall_sim::{ServoArm, ServoConfig};
use hwall_testkit::{ErrorStats, MarkdownTable, Sampler, titled};
use hwall_texton::{FingerState, Level, MotionLimits, ScanAngle, TextureMotion};

/// Control period, s.
const DT_S: f64 = 1e-3;
/// Time, s, and force, N, of the press; the force rises over 10 ms.
const PRESS_S: f64 = 0.2;
const PRESS_N: f64 = 8.0;
const RISE_S: f64 = 0.01;

/// Largest relative error at which the board counts as at its speed.
pub const SOON: f64 = 0.05;

/// One trial: place of the touch, motion of the finger, and wanted level.
#[derive(Debug, Clone, Copy)]
pub struct Trial {
    /// Place of the touch, m, robot base frame.
    pub point_m: DVec3,
    /// Outward normal of the surface there.
    pub normal: DVec3,
    /// Direction of the scan in the plane, rad.
    pub scan_rad: f64,
    /// Angle between the actual and the expected scan, rad.
    pub unexpected_rad: f64,
    /// The finger's own speed, m/s; 0: it rests, and the scan is the expected one.
    pub finger_m_per_s: f64,
    /// Orientation and speed of the texture.
    pub level: Level,
}

impl Trial {
    /// A random trial: on walls, ramps and tables in front of the arm.
    pub fn random(sampler: &mut Sampler, finger_m_per_s: f64, speed_mm_per_s: f64) -> Self {
        let [x, y, z, slope, side, scan_rad, deg] = sampler.array_within([
            (0.4, 0.6),
            (-0.25, 0.25),
            (0.35, 0.75),
            (0.0, std::f64::consts::FRAC_PI_2),
            (-0.5, 0.5),
            (-std::f64::consts::PI, std::f64::consts::PI),
            (0.0, 90.0),
        ]);
        let ahead = DVec3::new(side.cos(), side.sin(), 0.0);
        Self {
            point_m: DVec3::new(x, y, z),
            normal: ahead * slope.cos() + DVec3::Z * slope.sin(),
            scan_rad,
            unexpected_rad: 0.0,
            finger_m_per_s,
            level: Level {
                scan: ScanAngle::from_deg(deg).unwrap_or(ScanAngle::ALONG),
                speed_mm_per_s,
                magnitude: 0.0,
            },
        }
    }
}

/// Result of a trial.
#[derive(Debug, Clone, Default)]
pub struct Outcome {
    /// Speed of the level, m/s.
    pub wanted_m_per_s: f64,
    /// Acceleration against the scan that the joints allow at the place of the touch, m/s²; 0 if a joint reaches its limit on
    /// the way, because the slide ends before it.
    pub able_m_per_s2: f64,
    /// Time from the press until it was felt, s.
    pub felt_s: f64,
    /// Velocity over the texture minus the wanted one, relative to the wanted speed of the board, every millisecond from the moment the
    /// touch was felt.
    pub error: Vec<f64>,
    /// Largest displacement of the board along the normal, m.
    pub drift_m: f64,
    /// Deviation of the board from the texture's wanted orientation at the touch, rad.
    pub turned_rad: f64,
    /// Duration of the slide, s.
    pub slid_s: f64,
}

impl Outcome {
    /// Do the joints allow the wanted speed within 25 ms? With the arm's delay of 22 ms and the smoothing of the motion this leaves a
    /// margin within 60 ms. Below 1 m/s² the place is near a singularity, and a millimetre further the limit may be even
    /// lower.
    pub fn is_able(&self) -> bool {
        self.able_m_per_s2 >= f64::max(1.0, self.wanted_m_per_s / 0.025)
    }

    /// Largest relative error of the speed from 60 ms after the touch was felt; `None` if the trial is shorter,
    /// or if an error is NaN because no speed was wanted.
    pub fn late(&self) -> Option<f64> {
        let late = self.error.get(60..).filter(|late| !late.is_empty())?;
        let numbers = late.iter().all(|error| error.is_finite());
        numbers.then(|| late.iter().copied().fold(0.0, f64::max))
    }

    /// Is the board within [`SOON`] of its speed from 60 ms after the touch was felt?
    pub fn is_soon(&self) -> bool {
        self.late().is_some_and(|late| late <= SOON)
    }
}

/// Do all joints stay within their limits on a displacement of the board, m, at their initial rates?
fn keeps_off_limits(
    arm: &dyn ArmKinematics,
    q: &JointPositions,
    way: DVec3,
) -> anyhow::Result<bool> {
    const PREVIEW_M: f64 = 1e-3;
    // Include the braking distance.
    let steps = (way.length() + 0.01) / PREVIEW_M;
    let here = arm.forward(q);
    let there = here.at(here.position_m() + way.normalize_or_zero() * PREVIEW_M);
    let config = NearestConfig {
        weights: arm.max_velocity_rad_per_s().map(|speed| speed.powi(-2)),
        policy: BranchPolicy::Keep,
        ..NearestConfig::default()
    };
    let next = arm.nearest(&there, q, &config, &mut arm.scratch())?;
    // At a limit other joints compensate, so the joint's own rate is meaningless.
    const MARGIN_RAD: f64 = 0.01;
    Ok((0..arm.joint_count()).all(|i| {
        let limit = arm.limits()[i];
        let room = (limit.max_rad - q[i]).min(q[i] - limit.min_rad);
        room >= MARGIN_RAD && limit.contains(q[i] + steps * (next.q[i] - q[i]))
    }))
}

/// Presses a board that waits in place, and records it for `duration_s` from the moment the touch is felt;
/// `None` if the arm cannot hold the board there with the wanted roll, or not over a stroke of 30 mm.
///
/// # Errors
/// A setting outside its range.
pub fn run(
    trial: &Trial,
    limits: MotionLimits,
    servo: ServoConfig,
    duration_s: f64,
) -> anyhow::Result<Option<Outcome>> {
    let board = Board::default();
    let mut control = TargetControl::new(&SrsArm::iiwa7(), &board, RendererConfig::default())?;
    let arm = control.renderer().arm().clone();
    let axes = surface_axes(trial.normal)?;
    let lift = |p: DVec2| axes[0] * p.x + axes[1] * p.y;
    let flat = |v: DVec3| DVec2::new(v.dot(axes[0]), v.dot(axes[1]));
    let mut motion = TextureMotion::new(limits)?;
    motion
        .scan_mut()
        .expect(trial.scan_rad + trial.unexpected_rad)?;
    let target = |place: DVec2, roll_rad: f64, now_s: f64| BoardTarget {
        roll_rad: Some(roll_rad),
        ..BoardTarget::new(trial.point_m + lift(place), trial.normal, now_s)
    };
    let roll_rad = motion.roll_for(&trial.level);
    // Elbow bent and up, as in a real set-up.
    let start = JointPositions::from_deg([0.0, 30.0, 0.0, -90.0, 0.0, 60.0, 0.0]);
    let mut follower = Follower::new(arm.clone(), FollowerConfig::default(), &start)?;
    if follower.aim(&target(DVec2::ZERO, roll_rad, 0.0))?.is_some() {
        return Ok(None);
    }
    let goal = follower.goal().context("a goal")?;
    let scan = lift(DVec2::from_angle(trial.scan_rad));
    let way = -scan * trial.level.speed_mm_per_s * 1e-3 * duration_s;
    let able_m_per_s2 = match keeps_off_limits(&*arm, &goal, way)? {
        true => follower.acceleration_along_m_per_s2(-scan),
        false => None,
    };
    let mut probe = Follower::new(arm.clone(), FollowerConfig::default(), &goal)?;
    let reach = motion.limit_stroke(&trial.level, |place, roll_rad| {
        matches!(probe.aim(&target(place, roll_rad, 0.0)), Ok(None))
    });
    if reach.against_m < 0.03 {
        return Ok(None);
    }
    let mut servo = ServoArm::new(arm, goal, servo)?;
    let rest = servo.pose();
    let waiting = target(DVec2::ZERO, roll_rad, 0.0);
    let finger_m_per_s = DVec2::from_angle(trial.scan_rad) * trial.finger_m_per_s;
    let wanted = -scan * trial.level.speed_mm_per_s * 1e-3;
    let over_m_per_s = trial.finger_m_per_s + wanted.length();
    let mut outcome = Outcome {
        wanted_m_per_s: wanted.length(),
        able_m_per_s2: able_m_per_s2.unwrap_or(0.0),
        felt_s: f64::NAN,
        ..Outcome::default()
    };
    // When the touch was felt, and when the trial ends.
    let (mut felt_s, mut end_s) = (None, PRESS_S + 1.0);
    while servo.t_s() < end_s {
        let now_s = servo.t_s();
        let press_n = PRESS_N * ((now_s - PRESS_S) / RISE_S).clamp(0.0, 1.0);
        servo.apply_wrench(Wrench {
            force_n: -trial.normal * press_n,
            ..Wrench::default()
        })?;
        let finger = felt_s.map(|felt_s| FingerState {
            point_m: finger_m_per_s * (now_s - felt_s),
            velocity_m_per_s: finger_m_per_s,
        });
        let step = motion.step(now_s, finger, &trial.level)?;
        control.slide = Some(Slide {
            velocity_m_per_s: lift(step.velocity_m_per_s),
            turn_rad_per_s: step.roll_rad_per_s,
        });
        control.target = Some(BoardTarget {
            stamp_s: now_s,
            ..waiting
        });
        let command = control.step(now_s, &servo.state()?);
        let step = control.last_step();
        servo.command(command)?;
        if felt_s.is_none() && step.is_some_and(|s| matches!(s.phase, Phase::Contact { .. })) {
            felt_s = Some(now_s);
            (outcome.felt_s, end_s) = (now_s - PRESS_S, now_s + duration_s);
        }
        if felt_s.is_some() {
            // Over the texture, in whichever of the four directions that have the level's angle to the bumps is nearest.
            let over = finger_m_per_s - flat(servo.twist().linear_m_per_s);
            let long = flat(servo.pose().rotation().x_axis);
            let [left, right] = [1.0, -1.0]
                .map(|side| long.rotate(DVec2::from_angle(side * trial.level.scan.rad())));
            let ways = [left, -left, right, -right];
            let off = ways.map(|way| (over - way * over_m_per_s).length());
            let off = off.into_iter().fold(f64::INFINITY, f64::min);
            outcome.error.push(off / wanted.length());
            outcome.slid_s += if step.is_some_and(|s| s.sliding) {
                DT_S
            } else {
                0.0
            };
        }
        control.plan();
        servo.advance(DT_S)?;
        let moved = servo.pose().position_m() - rest.position_m();
        let drift_m = moved.dot(trial.normal.normalize()).abs();
        outcome.drift_m = outcome.drift_m.max(drift_m);
        let turned = servo.pose().distance(&rest);
        outcome.turned_rad = outcome.turned_rad.max(turned.angle_rad);
    }
    Ok(Some(outcome))
}

/// Random trials within the arm's reach: time from the press until it was felt, and relative errors of the
/// speed from then on: medians at 20, 30, 40, 50 and 100 ms, and the largest from 60 ms on.
///
/// # Errors
/// As [`run`].
pub fn table(seed: u64, touches: usize) -> anyhow::Result<MarkdownTable> {
    let mut table = titled(
        "wanted speed | finger | touches | from press to felt, median, largest | median error at 20 ms | 30 ms | 40 ms | 50 ms \
         | 100 ms | within 5 % from 60 ms on, joints able | joints not able | largest from 60 ms on | drift along the normal",
    );
    for (speed_mm_per_s, finger_m_per_s, unexpected_deg) in [
        (10.0, 0.0, 0.0),
        (20.0, 0.0, 0.0),
        (40.0, 0.0, 0.0),
        (60.0, 0.0, 0.0),
        (80.0, 0.0, 0.0),
        (80.0, 0.1, 20.0),
    ] {
        let mut sampler = Sampler::new(seed);
        let mut outcomes = Vec::new();
        let mut tries = 0;
        while outcomes.len() < touches && tries < 50 * touches {
            tries += 1;
            let trial = Trial {
                unexpected_rad: f64::to_radians(unexpected_deg),
                ..Trial::random(&mut sampler, finger_m_per_s, speed_mm_per_s)
            };
            let servo = ServoConfig {
                seed: tries as u64,
                ..ServoConfig::default()
            };
            outcomes.extend(run(&trial, MotionLimits::default(), servo, 0.25)?);
        }
        let percent = |value: f64| format!("{:.2} %", 100.0 * value);
        let at = |ms: usize| {
            let errors = outcomes.iter().map(|o| o.error.get(ms).copied());
            ErrorStats::from_errors(errors.map(|error| error.unwrap_or(f64::NAN)))
        };
        let late: Option<Vec<f64>> = outcomes.iter().map(Outcome::late).collect();
        let late = late.map(ErrorStats::from_errors);
        let felt = ErrorStats::from_errors(outcomes.iter().map(|o| o.felt_s));
        let soon = |able: bool| {
            let of: Vec<_> = outcomes.iter().filter(|o| o.is_able() == able).collect();
            let soon = of.iter().filter(|o| o.is_soon()).count();
            format!("{soon} of {}", of.len())
        };
        let drift = outcomes.iter().map(|o| o.drift_m).fold(0.0, f64::max);
        let finger = format!("{} mm/s", 1e3 * finger_m_per_s);
        let [median_ms, most_ms] = [1e3 * felt.median, 1e3 * felt.max];
        let mut row = vec![
            format!("{speed_mm_per_s} mm/s"),
            match unexpected_deg {
                0.0 => finger,
                off => format!("{finger}, {off} degrees off"),
            },
            outcomes.len().to_string(),
            format!("{median_ms:.0} ms, {most_ms:.0} ms"),
        ];
        row.extend([20, 30, 40, 50, 100].map(|ms| percent(at(ms).median)));
        row.push(soon(true));
        row.push(soon(false));
        row.push(late.map_or("unknown".to_owned(), |late| percent(late.max)));
        row.push(format!("{:.3} mm", 1e3 * drift));
        table.row(row);
    }
    Ok(table)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn too_few_samples_and_nan_do_not_pass() {
        let late = |error: Vec<f64>| {
            let outcome = Outcome {
                wanted_m_per_s: 0.04,
                able_m_per_s2: 10.0,
                felt_s: 0.01,
                error,
                ..Outcome::default()
            };
            assert_eq!(outcome.is_soon(), outcome.late().is_some_and(|l| l <= SOON));
            outcome.late()
        };
        assert_eq!(late(Vec::new()), None);
        assert_eq!(late(vec![0.0; 60]), None);
        assert_eq!(late(vec![0.01; 61]), Some(0.01));
        let mut broken = vec![0.01; 100];
        broken[70] = f64::NAN;
        assert_eq!(late(broken), None);
    }
}
