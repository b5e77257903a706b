//! Finds poses that a tracker repeats instead of measuring.

use crate::frame::HandFrame;
use glam::DVec3;
use hwall_numeric::ArgumentError;
use hwall_numeric::check::{non_negative, positive};

/// When a pose counts as frozen.
///
/// A tracker that loses the hand often keeps sending its last pose. Two signs show it, both with a
/// wide margin on recorded hands:
///
/// - **Still**: no point moves at all. A live hand at rest drifts 0.9 mm or more in 0.25 s;
///   a stream that is polled faster than it is measured repeats a pose for up to 42 ms.
/// - **Rigid**: the pose moves as a whole but its shape does not. A pose that is kept in the
///   headset's frame is carried around by the head, so it moves plausibly, up to several m/s;
///   yet the distances between palm and tips stay within 2.4e-6 m, where in live hands they
///   change by 1.3e-4 m or more in 0.25 s.
///
/// A simulated hand may be still or rigid by construction:
/// [`HandFilterConfig::simulated`](crate::HandFilterConfig::simulated) watches for neither.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct FreezeConfig {
    /// Time without any motion after which the pose is frozen, s. Default 0.1.
    pub still_after_s: f64,
    /// A point that moves less than this does not move, m. Default 1e-6, the last digit of most recordings.
    pub still_tolerance_m: f64,
    /// Time without any change of shape after which the pose is frozen, s. Default 0.25.
    pub rigid_after_s: f64,
    /// A distance between two points that changes less than this does not change, m. Default 2e-5.
    pub rigid_tolerance_m: f64,
}

impl Default for FreezeConfig {
    fn default() -> Self {
        Self {
            still_after_s: 0.1,
            still_tolerance_m: 1e-6,
            rigid_after_s: 0.25,
            rigid_tolerance_m: 2e-5,
        }
    }
}

impl FreezeConfig {
    pub(crate) fn validate(&self) -> Result<(), ArgumentError> {
        positive("still_after_s", self.still_after_s)?;
        non_negative("still_tolerance_m", self.still_tolerance_m)?;
        positive("rigid_after_s", self.rigid_after_s)?;
        non_negative("rigid_tolerance_m", self.rigid_tolerance_m)?;
        Ok(())
    }
}

/// Which sign of a frozen pose was found.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[non_exhaustive]
pub enum FreezeKind {
    /// No point moves.
    Still,
    /// The points move, their distances do not change.
    Rigid,
}

/// Points needed to judge a shape: with two, the only distance may stay the same by chance.
const SHAPE_POINTS: usize = 3;

type Points = [Option<DVec3>; 6];

/// A frozen pose.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Frozen {
    pub(crate) kind: FreezeKind,
    /// Since when the pose has been frozen, s.
    pub(crate) since_s: f64,
}

/// Watches a stream of samples for a frozen pose. Two reference poses, no allocation.
#[derive(Debug, Clone)]
pub(crate) struct FreezeWatch {
    config: FreezeConfig,
    still: Option<(f64, Points)>,
    shape: Option<(f64, Points)>,
}

impl FreezeWatch {
    pub(crate) fn new(config: FreezeConfig) -> Self {
        Self {
            config,
            still: None,
            shape: None,
        }
    }

    pub(crate) fn reset(&mut self) {
        self.still = None;
        self.shape = None;
    }

    /// Takes a sample; `None` unless the pose is frozen.
    pub(crate) fn update(&mut self, frame: &HandFrame) -> Option<Frozen> {
        let (t_s, points) = (frame.t_s, frame.points());
        let c = self.config;
        let rigid_since = hold(&mut self.shape, t_s, &points, |reference| {
            same_shape(reference, &points, c.rigid_tolerance_m)
        });
        let still_since = hold(&mut self.still, t_s, &points, |reference| {
            same_place(reference, &points, c.still_tolerance_m)
        });
        if t_s - still_since >= c.still_after_s {
            Some(Frozen {
                kind: FreezeKind::Still,
                since_s: still_since,
            })
        } else if t_s - rigid_since >= c.rigid_after_s {
            Some(Frozen {
                kind: FreezeKind::Rigid,
                since_s: rigid_since,
            })
        } else {
            None
        }
    }
}

/// Keeps the reference while the pose equals it, else takes the pose as the new reference;
/// returns the time of the reference, s.
fn hold(
    reference: &mut Option<(f64, Points)>,
    t_s: f64,
    points: &Points,
    same: impl FnOnce(&Points) -> bool,
) -> f64 {
    match reference {
        Some((since_s, kept)) if same(kept) => *since_s,
        _ => {
            *reference = Some((t_s, *points));
            t_s
        }
    }
}

/// Does every point that both poses hold stand still? At least one must be held by both.
fn same_place(a: &Points, b: &Points, tolerance_m: f64) -> bool {
    let mut both = a
        .iter()
        .zip(b)
        .filter_map(|(p, q)| Some(p.as_ref()?.distance(*q.as_ref()?)))
        .peekable();
    both.peek().is_some() && both.all(|moved_m| moved_m <= tolerance_m)
}

/// Do all distances between points that both poses hold agree?
fn same_shape(a: &Points, b: &Points, tolerance_m: f64) -> bool {
    let held = |i: usize| Some((a[i]?, b[i]?));
    if (0..6).filter(|&i| held(i).is_some()).count() < SHAPE_POINTS {
        return false;
    }
    (0..6).all(|i| {
        (0..i).all(|j| match (held(i), held(j)) {
            (Some((ai, bi)), Some((aj, bj))) => {
                (ai.distance(aj) - bi.distance(bj)).abs() <= tolerance_m
            }
            _ => true,
        })
    })
}
