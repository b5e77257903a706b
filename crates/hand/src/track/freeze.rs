//! Detects poses that a tracker repeats instead of measuring.

use super::value_steps::ValueSteps;
use crate::frame::HandFrame;
use glam::DVec3;
use hwall_numeric::ArgumentError;
use hwall_numeric::check::{non_negative, positive};

/// Criteria for a frozen pose.
///
/// A tracker that loses the hand often keeps sending its last pose. Two tests detect this, both with a wide margin on recorded hands:
///
/// - **Still**: no point moves at all. A live hand at rest drifts 0.9 mm or more in 0.25 s;
///   a stream that is polled faster than it is measured repeats a pose for up to 42 ms.
/// - **Rigid**: the pose moves as a whole, but its shape does not change. A pose kept in the headset's frame moves with the head, so it moves
///   plausibly, up to several m/s; but the distances between palm and tips stay within 2.4e-6 m, while in live hands they change by 1.3e-4 m or
///   more in 0.25 s.
///
/// Values on a grid (e.g. positions with two decimals) may rest longer, by the time a live hand needs to leave a grid step. The step is found from
/// the stream. Repeats of each pose, because the tracker is slower than the stream, do not count as freezing.
///
/// A simulated hand may be still or rigid by construction: [`HandFilterConfig::simulated`](crate::HandFilterConfig::simulated) disables both tests.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct FreezeConfig {
    /// Time without any motion after which the pose is frozen, s. Default 0.1.
    pub still_after_s: f64,
    /// Time without any change of shape after which the pose is frozen, s. Default 0.25.
    pub rigid_after_s: f64,
    /// Grid step of the values if known, m; see [`Recording::value_step_m`](crate::Recording::value_step_m). Default 0: found from the stream.
    pub value_step_m: f64,
}

impl Default for FreezeConfig {
    fn default() -> Self {
        Self {
            still_after_s: 0.1,
            rigid_after_s: 0.25,
            value_step_m: 0.0,
        }
    }
}

impl FreezeConfig {
    pub(crate) fn validate(&self) -> Result<(), ArgumentError> {
        positive("still_after_s", self.still_after_s)?;
        positive("rigid_after_s", self.rigid_after_s)?;
        non_negative("value_step_m", self.value_step_m)?;
        Ok(())
    }
}

/// Kind of frozen pose.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[non_exhaustive]
pub enum FreezeKind {
    /// No point moves.
    Still,
    /// The points move, but their distances do not change.
    Rigid,
}

/// A smaller motion of a point counts as no motion, m: the last digit of most recordings.
pub(super) const STILL_TOLERANCE_M: f64 = 1e-6;
/// Timing tolerance between tracker and recorder: a position may repeat up to this many times as long as the shortest repeats.
pub(crate) const LATE: f64 = 1.5;
/// A smaller change of a distance between two points counts as no change, m.
const RIGID_TOLERANCE_M: f64 = 2e-5;
/// Points needed to test a shape: with two, the only distance may stay the same by chance.
const SHAPE_POINTS: usize = 3;

/// The slowest drift of a live hand at rest, and of the distances between its points, m/s: see [`FreezeConfig`].
const DRIFT_M_PER_S: f64 = 9e-4 / 0.25;
const SHAPE_DRIFT_M_PER_S: f64 = 1.3e-4 / 0.25;

type Points = [Option<DVec3>; 6];

/// A frozen pose.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Frozen {
    pub(crate) kind: FreezeKind,
    /// Start of the freeze, s.
    pub(crate) since_s: f64,
}

/// Detects a frozen pose in a stream of samples. Allocation-free.
#[derive(Debug, Clone)]
pub(crate) struct FreezeWatch {
    config: FreezeConfig,
    still: Option<(f64, Points)>,
    shape: Option<(f64, Points)>,
    steps: ValueSteps,
    /// Time of the last sample, s.
    same_s: f64,
    /// Durations of the last repeated poses, s.
    repeats_s: [f64; 3],
}

impl FreezeWatch {
    pub(crate) fn new(config: FreezeConfig) -> Self {
        Self {
            config,
            still: None,
            shape: None,
            steps: ValueSteps::default(),
            same_s: 0.0,
            repeats_s: [0.0; 3],
        }
    }

    /// Shortest of the last repeat durations, s: 0 unless the stream is faster than its tracker.
    pub(crate) fn repeat_s(&self) -> f64 {
        let least_s = self.repeats_s.into_iter().fold(f64::INFINITY, f64::min);
        least_s.min(self.config.still_after_s)
    }

    pub(crate) fn reset(&mut self) {
        self.still = None;
        self.shape = None;
    }

    /// Takes a sample; `None` unless the pose is frozen.
    pub(crate) fn update(&mut self, frame: &HandFrame) -> Option<Frozen> {
        let (t_s, points) = (frame.t_s, frame.points());
        let c = self.config;
        self.steps.update(&points);
        let step_m = c.value_step_m.max(self.steps.step_m());
        let before_s = self.still.map_or(t_s, |(since_s, _)| since_s);
        let rigid_since = hold(&mut self.shape, t_s, &points, same_shape);
        let still_since = hold(&mut self.still, t_s, &points, same_place);
        if still_since > before_s {
            self.repeats_s.rotate_left(1);
            self.repeats_s[2] = self.same_s - before_s;
        }
        self.same_s = t_s;
        let repeat_s = self.repeat_s();
        if t_s - still_since >= c.still_after_s + repeat_s + step_m / DRIFT_M_PER_S {
            Some(Frozen {
                kind: FreezeKind::Still,
                since_s: still_since,
            })
        } else if t_s - rigid_since >= c.rigid_after_s + repeat_s + step_m / SHAPE_DRIFT_M_PER_S {
            Some(Frozen {
                kind: FreezeKind::Rigid,
                since_s: rigid_since,
            })
        } else {
            None
        }
    }
}

/// Keeps the reference while the pose matches it; otherwise takes the pose as the new reference; returns the time of the reference, s.
fn hold(
    reference: &mut Option<(f64, Points)>,
    t_s: f64,
    points: &Points,
    same: fn(&Points, &Points) -> bool,
) -> f64 {
    match reference {
        Some((since_s, kept)) if same(kept, points) => *since_s,
        _ => {
            *reference = Some((t_s, *points));
            t_s
        }
    }
}

/// Are all points that both poses contain unmoved? At least one must be in both.
fn same_place(a: &Points, b: &Points) -> bool {
    let mut both = a
        .iter()
        .zip(b)
        .filter_map(|(p, q)| Some(p.as_ref()?.distance(*q.as_ref()?)))
        .peekable();
    both.peek().is_some() && both.all(|moved_m| moved_m <= STILL_TOLERANCE_M)
}

/// Do all distances between points that both poses contain agree?
fn same_shape(a: &Points, b: &Points) -> bool {
    let held = |i: usize| Some((a[i]?, b[i]?));
    if (0..6).filter(|&i| held(i).is_some()).count() < SHAPE_POINTS {
        return false;
    }
    (0..6).all(|i| {
        (0..i).all(|j| match (held(i), held(j)) {
            (Some((ai, bi)), Some((aj, bj))) => {
                (ai.distance(aj) - bi.distance(bj)).abs() <= RIGID_TOLERANCE_M
            }
            _ => true,
        })
    })
}
