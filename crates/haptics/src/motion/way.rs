//! A path of the board, checked before it is taken.

use super::barrier::tree::Barriers;
use super::barrier::{FacePoint, FacePoints, Footprint, Plane, corners_and_middle};
use super::between::Stretch;
use super::solver::Solver;
use crate::board::Board;
use crate::body::{PersonBody, Separation};
use crate::error::HapticsError;
use glam::DVec3;
use hwall_geometry::Pose;
use hwall_kinematics::{JointPositions, JointVelocities, MOST_JOINTS};
use hwall_motion::ReferenceMotion;

/// A path that exceeds the allowed distance in front of a surface by up to this is taken if there is none better, m; beyond it the board stands
/// still.
pub(super) const SPARE_M: f64 = 0.00175;
/// A board at rest in front of a surface may come further in front by this when it starts, m.
const HERE_M: f64 = 1e-3;
/// Samples of the first, coarse check of a path.
const SAMPLES: usize = 12;
/// How far a path that stays behind at the dense samples may come in front between them, m.
const BETWEEN_M: f64 = 2.5e-4;
/// Longest time between two dense samples, s.
const LONGEST_S: f64 = 0.03;
/// Between two dense samples the distance of a point of the face from a joint's axis grows by at most this, m: at most 2.5 m/s relative to the axis,
/// for half the time between the samples.
const LEVER_M: f64 = 0.075;
/// After this many stretches of the same length, longer ones are tried.
const CALM: usize = 3;
/// Most dense samples of a path, and the least time between two of them, s.
const MOST_DENSE_SAMPLES: usize = 400;
const CLOSEST_S: f64 = 1.25e-4;
/// Cost of a plan, in samples.
const SAMPLES_OF_PLAN: usize = 8;
/// Cost of a check of the whole arm, in samples of the board; near an obstacle each stretch is divided into so many parts.
const SAMPLES_OF_BODY: usize = 2;
const PARTS: usize = 4;
/// All samples of a path: its plan, the coarse check, the dense check, and from where there were too many dense ones to its end.
pub(super) const SAMPLES_OF_WAY: usize = SAMPLES_OF_PLAN
    + SAMPLES
    + SAMPLES_OF_BODY * (1 + PARTS * SAMPLES)
    + 2 * MOST_DENSE_SAMPLES
    + 2;
/// Most places besides the destination that count while the board is over them.
pub(super) const PLACES: usize = 8;

/// A path that was checked.
#[derive(Debug, Clone, Copy)]
pub(super) struct Way {
    pub(super) q: JointPositions,
    pub(super) by_way_of: Option<JointPositions>,
    /// See [`Route::detour_m`](super::route::Route).
    pub(super) detour_m: Option<f64>,
    pub(super) protrusion_m: f64,
    /// Time until the board reaches its goal, s.
    pub(super) duration_s: f64,
    /// Its worst point.
    pub(super) worst: Option<Worst>,
}

impl Way {
    /// Is another path better? One that stays behind wins; of two that do, the quicker; of two that do not, the one less far in front.
    pub(super) fn is_beaten_by(&self, other: &Self, allowed_m: f64) -> bool {
        let stays = |way: &Self| way.protrusion_m <= allowed_m;
        match (stays(self), stays(other)) {
            (true, true) => other.duration_s < self.duration_s,
            (false, false) => other.protrusion_m < self.protrusion_m,
            (_, other_stays) => other_stays,
        }
    }
}

/// Where a path comes furthest in front of a surface, or too close to an obstacle.
#[derive(Debug, Clone, Copy)]
pub(super) struct Worst {
    pub(super) q: JointPositions,
    /// By how much, m.
    pub(super) in_front_m: f64,
    /// The point of the face; `None`: some part of the arm is too close to an obstacle.
    pub(super) point: Option<FacePoint>,
}

/// What paths keep clear of besides the surfaces.
#[derive(Debug, Clone, Copy)]
pub(super) struct Clear<'a> {
    separation: &'a Separation,
    person: &'a PersonBody,
    /// Violation at the start, m: of the arm and the room, and of the person. An arm that is already too close comes no closer.
    here_m: [f64; 2],
}

impl<'a> Clear<'a> {
    /// For paths that begin at a configuration.
    pub(super) fn of(
        separation: &'a Separation,
        person: &'a PersonBody,
        here: &JointPositions,
    ) -> Self {
        Self {
            separation,
            person,
            here_m: separation.short_of_m(here, person).map(|m| m.max(0.0)),
        }
    }

    /// By how much a configuration is too close, m.
    fn beyond_m(&self, q: &JointPositions) -> f64 {
        let [arm_m, person_m] = self.separation.short_of_m(q, self.person);
        let beyond_m = (arm_m - self.here_m[0]).max(person_m - self.here_m[1]);
        match arm_m.is_nan() || person_m.is_nan() {
            true => f64::INFINITY,
            false => beyond_m,
        }
    }

    /// Gradient of that with each joint, m/rad.
    pub(super) fn gradient(&self, q: &JointPositions) -> [f64; MOST_JOINTS] {
        /// Larger than the flat of a capsule's end, smaller than a link.
        const BY_RAD: f64 = 1e-3;
        std::array::from_fn(|joint| {
            let at = |by_rad: f64| {
                let mut q = *q;
                q[joint] += by_rad;
                self.beyond_m(&q)
            };
            (at(BY_RAD) - at(-BY_RAD)) / (2.0 * BY_RAD)
        })
    }
}

/// The face at a sample of a path.
#[derive(Debug, Clone, Copy)]
struct Sample {
    t_s: f64,
    q: JointPositions,
    points: FacePoints,
}

/// The same with its velocity.
#[derive(Debug, Clone, Copy)]
struct DenseSample {
    sample: Sample,
    at_m: [DVec3; 5],
    speed_m_per_s: [f64; 5],
    qd_rad_per_s: [f64; MOST_JOINTS],
    /// Largest distance of a point of the face from the axis of each joint, m.
    lever_m: [f64; MOST_JOINTS],
    /// Largest accelerations, rad/s².
    qdd_rad_per_s2: [f64; MOST_JOINTS],
}

impl DenseSample {
    /// Upper bounds of the path lengths of the points up to another sample, m.
    ///
    /// A point is no faster than at either end plus what its acceleration adds from there. The acceleration of a point of a chain is at most
    /// `Σ r_i (a_i + w_i (w_i + 2 Σ_{j<i} w_j))` for joints at distances `r`, with accelerations `a` and speeds `w`.
    fn ways_m(&self, to: &Self) -> [f64; 5] {
        let dt_s = to.sample.t_s - self.sample.t_s;
        let (mut most, mut before) = (0.0, 0.0);
        for i in 0..MOST_JOINTS {
            let lever_m = self.lever_m[i].max(to.lever_m[i]) + LEVER_M;
            let a = self.qdd_rad_per_s2[i].max(to.qdd_rad_per_s2[i]);
            let w = self.qd_rad_per_s[i].abs().max(to.qd_rad_per_s[i].abs()) + 0.5 * a * dt_s;
            most += lever_m * (a + w * (w + 2.0 * before));
            before += w;
        }
        std::array::from_fn(|i| {
            let mean = 0.5 * (self.speed_m_per_s[i] + to.speed_m_per_s[i]);
            dt_s * (mean + 0.25 * most * dt_s)
        })
    }
}

impl Sample {
    fn make_worse(&self, worst: &mut Option<Worst>) {
        for point in self.points.into_iter().flatten() {
            if worst.is_none_or(|worst| point.in_front_m > worst.in_front_m) {
                *worst = Some(Worst {
                    q: self.q,
                    in_front_m: point.in_front_m,
                    point: Some(point),
                });
            }
        }
    }
}

/// Everything that a path is checked against.
pub(super) struct Check<'a> {
    pub(super) board: &'a Board,
    pub(super) barriers: &'a Barriers,
    pub(super) footprints: [Option<Footprint>; PLACES + 3],
    pub(super) planes: [Option<Plane>; PLACES + 2],
    pub(super) clear: Option<Clear<'a>>,
    /// Number of samples checked.
    pub(super) samples: usize,
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

    /// How far a path may come in front of a surface because the board already is, or is about to be, there, m: never further than the current
    /// motion, so that repeated planning makes it no worse.
    pub(super) fn tolerated_m(
        &mut self,
        here: &Pose,
        reference: &ReferenceMotion,
        solver: &Solver,
    ) -> f64 {
        let here_m = self.protrusion_m(here);
        let left_s = reference.left_s();
        if left_s <= 0.0 {
            return here_m + HERE_M;
        }
        self.samples += SAMPLES;
        let ahead_m = |i: usize| {
            let q = reference.ahead(left_s * i as f64 / SAMPLES as f64).q;
            self.protrusion_m(&solver.arm().forward(&q))
        };
        (1..=SAMPLES).map(ahead_m).fold(here_m, f64::max)
    }

    /// Samples the considered motion.
    fn sample(&mut self, t_s: f64, reference: &ReferenceMotion, solver: &Solver) -> Sample {
        self.samples += 1;
        let q = reference.considered(t_s).q;
        let face = solver.arm().forward(&q);
        Sample {
            t_s,
            q,
            points: self
                .barriers
                .all_in_front(self.board, &face, &self.footprints, &self.planes),
        }
    }

    /// The considered motion where it brings the arm too close to an obstacle. It samples more densely where two samples leave that open.
    fn nearest(&mut self, duration_s: f64, reference: &ReferenceMotion) -> Option<Worst> {
        let clear = self.clear?;
        let mut worst: Option<Worst> = None;
        let mut samples = 0;
        let mut sample = |t_s: f64| {
            samples += SAMPLES_OF_BODY;
            let q = reference.considered(t_s).q;
            let in_front_m = clear.beyond_m(&q);
            if in_front_m > worst.map_or(0.0, |worst| worst.in_front_m) {
                worst = Some(Worst {
                    q,
                    in_front_m,
                    point: None,
                });
            }
            (t_s, q, in_front_m)
        };
        let mut before = sample(0.0);
        for i in 1..=SAMPLES {
            let after = sample(duration_s * i as f64 / SAMPLES as f64);
            let turned = JointVelocities(std::array::from_fn(|i| after.1[i] - before.1[i]));
            let way_m = clear.separation.body().most_m_per_s(&turned);
            // Two parts that approach each other both move.
            if before.2 + after.2 + 2.0 * way_m > 0.0 {
                for part in 1..PARTS {
                    let share = part as f64 / PARTS as f64;
                    sample(before.0 + share * (after.0 - before.0));
                }
            }
            before = after;
        }
        self.samples += samples;
        worst
    }

    /// The considered motion where it comes furthest in front of a surface.
    fn worst(
        &mut self,
        duration_s: f64,
        reference: &ReferenceMotion,
        solver: &Solver,
    ) -> Option<Worst> {
        let mut worst: Option<Worst> = None;
        for i in 1..=SAMPLES {
            let t_s = duration_s * i as f64 / SAMPLES as f64;
            self.sample(t_s, reference, solver).make_worse(&mut worst);
        }
        worst
    }

    /// Samples the considered motion with its velocity.
    fn dense_sample(
        &mut self,
        t_s: f64,
        reference: &ReferenceMotion,
        solver: &Solver,
    ) -> DenseSample {
        self.samples += 1;
        let state = reference.considered(t_s);
        let (face, jacobian) = solver.arm().forward_and_jacobian(&state.q);
        let twist = jacobian.twist(&state.qd);
        let at_m = corners_and_middle(self.board, &face);
        let corner_m = self.board.half_width_m.hypot(self.board.half_height_m);
        let limits = reference.limits();
        DenseSample {
            sample: Sample {
                t_s,
                q: state.q,
                points: self.barriers.all_in_front(
                    self.board,
                    &face,
                    &self.footprints,
                    &self.planes,
                ),
            },
            speed_m_per_s: at_m.map(|m| {
                let lever_m = m - face.position_m();
                (twist.linear_m_per_s + twist.angular_rad_per_s.cross(lever_m)).length()
            }),
            at_m,
            qd_rad_per_s: state.qd.0,
            lever_m: jacobian.linear.map(|v| v.length() + corner_m),
            qdd_rad_per_s2: std::array::from_fn(|i| {
                limits.acceleration_rad_per_s2[i].max(state.qdd_rad_per_s2[i].abs())
            }),
        }
    }

    /// How far each point of the face may come in front of a surface between two samples, m; `enough_m` where it stays within that.
    fn most_between_m(&self, from: &DenseSample, to: &DenseSample, enough_m: f64) -> [f64; 5] {
        let ways_m = from.ways_m(to);
        std::array::from_fn(|i| {
            let stretch = Stretch {
                from_m: from.at_m[i],
                to_m: to.at_m[i],
                way_m: ways_m[i],
            };
            self.barriers
                .most_between_m(&stretch, enough_m, &self.footprints, &self.planes)
        })
    }

    /// The same with dense samples: if those stay within `enough_m`, the path exceeds it by at most [`BETWEEN_M`] in between, see
    /// [`Barriers::most_between_m`]. Stretches are short where the board is fast and near a surface. If even the shortest stretches leave it open, or
    /// there are too many samples, the upper bound counts.
    fn worst_closely(
        &mut self,
        duration_s: f64,
        enough_m: f64,
        reference: &ReferenceMotion,
        solver: &Solver,
    ) -> Option<Worst> {
        let mut worst: Option<Worst> = None;
        let longest_s = longest_s(duration_s);
        let bound_m = enough_m.max(0.0) + BETWEEN_M;
        let mut dt_s = longest_s;
        let mut calm = 0;
        let mut from = self.dense_sample(0.0, reference, solver);
        for samples in 1.. {
            if from.sample.t_s >= duration_s {
                break;
            }
            let to_s = (from.sample.t_s + dt_s).min(duration_s);
            let mut to = self.dense_sample(to_s, reference, solver);
            let is_out = worst.is_some_and(|worst| worst.in_front_m > enough_m);
            if is_out {
                // One sample exceeds the limit: its worst value need not be exact.
                to.sample.make_worse(&mut worst);
                (dt_s, from) = (longest_s, to);
                continue;
            }
            let between_m = self.most_between_m(&from, &to, bound_m);
            let is_close = between_m.iter().all(|m| *m <= bound_m);
            let is_last = samples >= MOST_DENSE_SAMPLES;
            if !is_close && !is_last && dt_s > CLOSEST_S {
                (dt_s, calm) = (0.5 * dt_s, 0);
                continue;
            }
            if !is_close {
                for (point, most_m) in to.sample.points.iter_mut().zip(between_m) {
                    if let Some(point) = point.as_mut().filter(|_| most_m > bound_m) {
                        point.in_front_m = point.in_front_m.max(most_m);
                    }
                }
            }
            to.sample.make_worse(&mut worst);
            calm += 1;
            dt_s = match (is_last, calm >= CALM) {
                (true, _) => longest_s,
                // A longer stretch that has to be cut again costs a sample.
                (false, true) => (2.0 * dt_s).min(longest_s),
                (false, false) => dt_s,
            };
            from = to;
        }
        worst
    }

    /// A path to a configuration, checked densely only if the coarse check stays within `enough_m` or little more.
    pub(super) fn way(
        &mut self,
        q: JointPositions,
        by_way_of: Option<JointPositions>,
        detour_m: Option<f64>,
        enough_m: f64,
        reference: &mut ReferenceMotion,
        solver: &Solver,
    ) -> Result<Way, HapticsError> {
        self.samples += SAMPLES_OF_PLAN;
        let duration_s = reference.consider(&q, by_way_of.as_ref())?;
        let enough_m = enough_m + SPARE_M;
        let mut worst = self.worst(duration_s, reference, solver);
        if let Some(nearest) = self.nearest(duration_s, reference) {
            // Obstacles have no allowance and no spare.
            let in_front_m = enough_m + nearest.in_front_m;
            if worst.is_none_or(|worst| in_front_m > worst.in_front_m) {
                worst = Some(Worst {
                    in_front_m,
                    ..nearest
                });
            }
        }
        if worst.is_none_or(|worst| worst.in_front_m <= enough_m) {
            // The coarse check passed: check densely.
            worst = self
                .worst_closely(duration_s, enough_m, reference, solver)
                .or(worst);
        }
        let protrusion_m = worst.map_or(f64::NEG_INFINITY, |worst| worst.in_front_m);
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

/// Longest time between two dense samples of a path, s. A path slowed down near a person to more than 12 s is sampled less densely: unlimited samples
/// would stall the control loop.
fn longest_s(duration_s: f64) -> f64 {
    let nominal_s = (duration_s / SAMPLES as f64).min(LONGEST_S);
    nominal_s.max(duration_s / MOST_DENSE_SAMPLES as f64)
}

#[cfg(test)]
mod tests;
