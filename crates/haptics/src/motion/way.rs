//! A way of the board, looked at before it is taken.

use super::barrier::{Barriers, FacePoint, FacePoints, Footprint, Plane};
use super::solver::Solver;
use crate::board::Board;
use crate::error::HapticsError;
use hwall_geometry::Pose;
use hwall_kinematics::JointPositions;
use hwall_motion::ReferenceMotion;

/// A way that comes in front of a surface by this much more than allowed is taken if there is none better, m; beyond it the
/// board stands.
pub(super) const SPARE_M: f64 = 0.00175;
/// A board at rest before a surface may begin its way by coming further before it by this, m.
const HERE_M: f64 = 1e-3;
/// Instants at which a way is looked at first.
const SAMPLES: usize = 12;
/// How far a way that stays behind where it is looked at closely may come in front in between, m.
const BETWEEN_M: f64 = 2.5e-4;
/// A path is longer than its chord by no more than this share; 20 ms of a joint at its largest acceleration are 1 %.
const CURVED: f64 = 1.05;
/// How often a way is looked at closely at most, and the least time between two looks, s.
const MOST_LOOKS: usize = 900;
const CLOSEST_S: f64 = 1.25e-4;
/// Places besides the destination that count while the board is over them.
pub(super) const PLACES: usize = 8;

/// A way that was looked at.
#[derive(Debug, Clone, Copy)]
pub(super) struct Way {
    pub(super) q: JointPositions,
    pub(super) by_way_of: Option<JointPositions>,
    /// See [`Route::detour_m`](super::route::Route).
    pub(super) detour_m: Option<f64>,
    pub(super) protrusion_m: f64,
    /// How long the board takes to its goal, s.
    pub(super) duration_s: f64,
    /// Where it is worst.
    pub(super) worst: Option<Worst>,
}

impl Way {
    /// The way that stays behind; of two such the quicker one, of none the one that comes less far in front.
    pub(super) fn or_better(self, other: Self, allowed_m: f64) -> Self {
        let stays = |way: &Self| way.protrusion_m <= allowed_m;
        let is_better = match (stays(&self), stays(&other)) {
            (true, true) => other.duration_s < self.duration_s,
            (false, false) => other.protrusion_m < self.protrusion_m,
            (_, other_stays) => other_stays,
        };
        if is_better { other } else { self }
    }
}

/// Where a way comes furthest in front of a surface.
#[derive(Debug, Clone, Copy)]
pub(super) struct Worst {
    pub(super) q: JointPositions,
    pub(super) point: FacePoint,
}

/// The face at an instant of a way.
#[derive(Debug, Clone, Copy)]
struct Look {
    t_s: f64,
    q: JointPositions,
    points: FacePoints,
}

impl Look {
    /// How far any of the points may be in front between two looks, m.
    fn most_between_m(&self, to: &Self) -> f64 {
        let pairs = self.points.iter().zip(&to.points);
        let most = pairs.map(|(a, b)| match (a, b) {
            (Some(a), Some(b)) => {
                let way_m = CURVED * a.point_m.distance(b.point_m);
                0.5 * (a.in_front_m + b.in_front_m + way_m)
            }
            (one, other) => one
                .or(*other)
                .map_or(f64::NEG_INFINITY, |point| point.in_front_m),
        });
        most.fold(f64::NEG_INFINITY, f64::max)
    }

    /// Takes it that the points were as far in front on the way from another look as they may have been.
    fn count_as_far_as(&mut self, from: &Self) {
        let most_m = from.most_between_m(self);
        for point in self.points.iter_mut().flatten() {
            point.in_front_m = point.in_front_m.max(most_m);
        }
    }

    fn make_worse(&self, worst: &mut Option<Worst>) {
        for point in self.points.into_iter().flatten() {
            if worst.is_none_or(|worst| point.in_front_m > worst.point.in_front_m) {
                *worst = Some(Worst { q: self.q, point });
            }
        }
    }
}

/// Everything that a way is checked against.
pub(super) struct Check<'a> {
    pub(super) board: &'a Board,
    pub(super) barriers: &'a Barriers,
    pub(super) footprints: [Option<Footprint>; PLACES + 3],
    pub(super) planes: [Option<Plane>; PLACES + 2],
}

impl Check<'_> {
    /// How far the board comes in front of a surface, m; negative if it stays behind all.
    pub(super) fn protrusion_m(&self, face: &Pose) -> f64 {
        self.most_in_front(face)
            .map_or(f64::NEG_INFINITY, |point| point.in_front_m)
    }

    /// The point of the face that comes furthest in front of a surface.
    pub(super) fn most_in_front(&self, face: &Pose) -> Option<FacePoint> {
        self.barriers
            .most_in_front(self.board, face, &self.footprints, &self.planes)
    }

    /// How far a way may come in front of a surface because the board is there, or is about to be, already, m: never further than
    /// the motion in force comes, so that however often ways are planned anew, none makes it worse.
    pub(super) fn tolerated_m(
        &self,
        here: &Pose,
        reference: &ReferenceMotion,
        solver: &Solver,
    ) -> f64 {
        let here_m = self.protrusion_m(here);
        let left_s = reference.left_s();
        if left_s <= 0.0 {
            return here_m + HERE_M;
        }
        let ahead_m = |i: usize| {
            let q = reference.ahead(left_s * i as f64 / SAMPLES as f64).q;
            self.protrusion_m(&solver.arm().forward(&q))
        };
        (1..=SAMPLES).map(ahead_m).fold(here_m, f64::max)
    }

    /// The considered motion at an instant.
    fn look(&self, t_s: f64, reference: &ReferenceMotion, solver: &Solver) -> Look {
        let q = reference.considered(t_s).q;
        let face = solver.arm().forward(&q);
        Look {
            t_s,
            q,
            points: self
                .barriers
                .all_in_front(self.board, &face, &self.footprints, &self.planes),
        }
    }

    /// The considered motion where it comes furthest in front of a surface.
    fn worst(
        &self,
        duration_s: f64,
        reference: &ReferenceMotion,
        solver: &Solver,
    ) -> Option<Worst> {
        let mut worst: Option<Worst> = None;
        for i in 1..=SAMPLES {
            let t_s = duration_s * i as f64 / SAMPLES as f64;
            self.look(t_s, reference, solver).make_worse(&mut worst);
        }
        worst
    }

    /// The same, looked at so closely that if it stays within `enough_m` it stays within [`BETWEEN_M`] more in between.
    ///
    /// How far a point is in front changes no faster than the point moves: on a stretch of length s, no point is further in front
    /// than the mean of the ends of the stretch and s / 2. So stretches are short where the board is fast and near a surface. A
    /// way that needs too many looks counts as far in front as it might be.
    fn worst_closely(
        &self,
        duration_s: f64,
        enough_m: f64,
        reference: &ReferenceMotion,
        solver: &Solver,
    ) -> Option<Worst> {
        let mut worst: Option<Worst> = None;
        let longest_s = duration_s / SAMPLES as f64;
        let mut dt_s = longest_s;
        let mut from = self.look(0.0, reference, solver);
        for looks in 1.. {
            if from.t_s >= duration_s {
                break;
            }
            let to_s = (from.t_s + dt_s).min(duration_s);
            let mut to = self.look(to_s, reference, solver);
            let is_out = worst.is_some_and(|worst| worst.point.in_front_m > enough_m);
            let is_close = from.most_between_m(&to) <= enough_m + BETWEEN_M;
            let is_last = looks >= MOST_LOOKS;
            if !is_close && !is_out && !is_last && dt_s > CLOSEST_S {
                dt_s *= 0.5;
                continue;
            }
            if is_last && !is_close {
                to.count_as_far_as(&from);
            }
            to.make_worse(&mut worst);
            dt_s = if is_last || is_out {
                longest_s
            } else {
                (2.0 * dt_s).min(longest_s)
            };
            from = to;
        }
        worst
    }

    /// A way to a configuration, looked at closely only if it seems to stay within `enough_m` or little more.
    pub(super) fn way(
        &self,
        q: JointPositions,
        by_way_of: Option<JointPositions>,
        detour_m: Option<f64>,
        enough_m: f64,
        reference: &mut ReferenceMotion,
        solver: &Solver,
    ) -> Result<Way, HapticsError> {
        let duration_s = reference.consider(&q, by_way_of.as_ref())?;
        let enough_m = enough_m + SPARE_M;
        let mut worst = self.worst(duration_s, reference, solver);
        if worst.is_none_or(|worst| worst.point.in_front_m <= enough_m) {
            // Good as far as was seen: looked at closely.
            worst = self
                .worst_closely(duration_s, enough_m, reference, solver)
                .or(worst);
        }
        let protrusion_m = worst.map_or(f64::NEG_INFINITY, |worst| worst.point.in_front_m);
        Ok(Way {
            q,
            by_way_of,
            detour_m,
            protrusion_m,
            duration_s,
            worst,
        })
    }
}
