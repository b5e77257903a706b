//! The search for a path to the goal: straight, bent, or through a place behind the surfaces.

use super::goal::Destination;
use super::solver::{Place, Solver};
use super::way::{Check, SAMPLES_OF_WAY, Way};
use crate::error::HapticsError;
use hwall_kinematics::{BranchPolicy, JointPositions};
use hwall_motion::ReferenceMotion;

/// Cost of an inverse-kinematics solution, in samples.
const SAMPLES_OF_SOLUTION: usize = 2;
/// Samples of the last path of a step, which is checked to its end.
pub(super) const SAMPLES_OF_LAST: usize = SAMPLES_OF_SOLUTION + SAMPLES_OF_WAY;
/// A bend within this share of the straight path's duration plus this time, s, is taken without further search.
const GOOD_ENOUGH: f64 = 1.15;
const GOOD_ENOUGH_S: f64 = 0.02;
/// Most corrections of a bend.
const MOST_BENDS: usize = 8;
/// A bend overshoots by this factor and this length, because the worst place moves with it.
const BEND_GAIN: f64 = 1.3;
/// The further the worst place is from the bend, the less a push moves it: after this many bends the gain grows, up to this.
const GENTLE_BENDS: usize = 4;
const HARDER: f64 = 2.0;
const MOST_GAIN: f64 = 8.0;
const BEND_MARGIN_M: f64 = 0.002;
/// Number of distances behind a place that are tried.
pub(super) const DETOURS: usize = 6;

/// A place that detours pass behind.
#[derive(Debug, Clone, Copy)]
pub(super) struct Behind {
    pub(super) place: Place,
    /// Detour configurations are close to this one.
    pub(super) near: JointPositions,
    /// Is it the goal, or the board's current place?
    pub(super) is_goal: bool,
}

/// The inputs of a search in a step.
pub(super) struct Surroundings<'a> {
    pub(super) check: Check<'a>,
    /// A step checks another path only if it has used fewer samples than this; the rest waits for the next step.
    pub(super) most_samples: usize,
    /// How far a path may come in front of a surface, m.
    pub(super) allowed_m: f64,
    pub(super) detours_m: [f64; DETOURS],
    /// Only detours at a smaller distance than this, m.
    pub(super) shorter_than_m: f64,
    pub(super) behind: [Option<Behind>; 2],
}

impl Surroundings<'_> {
    const fn stays_behind(&self, way: &Way) -> bool {
        way.protrusion_m <= self.allowed_m
    }
}

/// What is tried next.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Stage {
    Straight,
    /// Through the bend of the current motion.
    UnderWay,
    /// The straight path, bent this many times.
    Bend(usize),
    /// Through a place: two places passed, then the same two stopped at, each at [`DETOURS`] distances.
    Detour(usize),
    Over,
}

/// A search, over as many steps as it needs.
#[derive(Debug, Clone, Copy)]
pub(super) struct Search {
    pub(super) destination: Destination,
    /// Is it not a retry?
    pub(super) is_new: bool,
    /// Is only a shorter bend of the current path wanted?
    pub(super) bends_again: bool,
    stage: Stage,
    /// Duration of the straight path, s.
    straight_s: f64,
    bent: Option<Way>,
    gain: f64,
    best: Option<Way>,
    /// Was it found in this step, from the board's current place?
    is_from_here: bool,
    /// The best path was no longer valid, and the search began again.
    is_second: bool,
}

impl Search {
    pub(super) const fn new(destination: Destination, is_new: bool, bends_again: bool) -> Self {
        Self {
            destination,
            is_new,
            bends_again,
            stage: Stage::Straight,
            straight_s: 0.0,
            bent: None,
            gain: BEND_GAIN,
            best: None,
            is_from_here: false,
            is_second: false,
        }
    }

    /// Runs the search for a step. Returns the best path once the search is over; it may come in front of a surface.
    pub(super) fn go_on(
        &mut self,
        around: &mut Surroundings<'_>,
        reference: &mut ReferenceMotion,
        solver: &mut Solver,
    ) -> Result<Option<Way>, HapticsError> {
        self.is_from_here = false;
        let is_found = |search: &Self| search.stage == Stage::Over && search.is_from_here;
        while around.check.samples < around.most_samples || is_found(self) {
            self.stage = match self.stage {
                Stage::Straight => self.straight(around, reference, solver)?,
                Stage::UnderWay => self.under_way(around, reference, solver),
                Stage::Bend(number) => self.bend(number, around, reference, solver),
                Stage::Detour(number) => self.detour(number, around, reference, solver)?,
                Stage::Over => match self.best_from_here(around, reference, solver) {
                    Some(best) if self.begins_again(&best, around) => Stage::Bend(0),
                    best => return Ok(best),
                },
            };
        }
        Ok(None)
    }

    fn straight(
        &mut self,
        around: &mut Surroundings<'_>,
        reference: &mut ReferenceMotion,
        solver: &Solver,
    ) -> Result<Stage, HapticsError> {
        let q = *self.destination.q();
        let way = around
            .check
            .way(q, None, None, around.allowed_m, reference, solver)?;
        self.straight_s = way.duration_s;
        self.bent = Some(way);
        self.keep_better(way, around);
        Ok(match (around.stays_behind(&way), self.bends_again) {
            (true, _) => Stage::Over,
            (false, true) => Stage::Bend(0),
            (false, false) => Stage::UnderWay,
        })
    }

    /// The remaining bend of the current path also serves a goal near the last one.
    fn under_way(
        &mut self,
        around: &mut Surroundings<'_>,
        reference: &mut ReferenceMotion,
        solver: &Solver,
    ) -> Stage {
        let next = Stage::Bend(0);
        let Some(by_way_of) = reference.by_way_of().copied() else {
            return next;
        };
        match self.by_way_of(by_way_of, around, reference, solver) {
            Some(_) => self.unless_good(next, around),
            None => next,
        }
    }

    /// A bend costs next to nothing: at its worst point the path passes the nearest configuration that stays behind.
    fn bend(
        &mut self,
        number: usize,
        around: &mut Surroundings<'_>,
        reference: &mut ReferenceMotion,
        solver: &Solver,
    ) -> Stage {
        let pushed = self
            .bent
            .and_then(|bent| pushed_behind(&bent, around, self.gain, reference, solver));
        let bent = pushed.and_then(|q| self.by_way_of(q, around, reference, solver));
        match bent {
            Some(way) if !around.stays_behind(&way) && number + 1 < MOST_BENDS => {
                if number + 1 >= GENTLE_BENDS {
                    self.gain = (HARDER * self.gain).min(MOST_GAIN);
                }
                self.bent = Some(way);
                Stage::Bend(number + 1)
            }
            // A detour would not be quicker than the current path.
            _ if self.bends_again => Stage::Over,
            _ => self.unless_good(Stage::Detour(0), around),
        }
    }

    /// Through a place behind the surfaces. Passing it takes less time than stopping there.
    fn detour(
        &mut self,
        number: usize,
        around: &mut Surroundings<'_>,
        reference: &mut ReferenceMotion,
        solver: &mut Solver,
    ) -> Result<Stage, HapticsError> {
        let (row, column) = (number / DETOURS, number % DETOURS);
        let places = around.behind.len();
        if row >= 2 * places {
            return Ok(Stage::Over);
        }
        let (stops, behind) = (row >= places, around.behind[row % places]);
        let Some(behind) = behind else {
            return Ok(Stage::Detour((row + 1) * DETOURS));
        };
        let next = Stage::Detour(number + 1);
        let behind_m = around.detours_m[column];
        if !(behind_m > 0.0 && behind_m < around.shorter_than_m) {
            return Ok(next);
        }
        let place = Place {
            point_m: behind.place.point_m - behind.place.normal * behind_m,
            ..behind.place
        };
        around.check.samples += SAMPLES_OF_SOLUTION;
        let Ok(found) = solver.on_place(&place, &behind.near, BranchPolicy::Keep)? else {
            return Ok(next);
        };
        let way = if stops {
            let detour_m = if behind.is_goal {
                behind_m
            } else {
                f64::INFINITY
            };
            self.stopping_at(found.q, detour_m, around, reference, solver)
        } else {
            self.by_way_of(found.q, around, reference, solver)
        };
        Ok(match way {
            // A place further behind only takes longer.
            Some(way) if around.stays_behind(&way) => Stage::Detour((row + 1) * DETOURS),
            _ => next,
        })
    }

    /// Checks the path to the destination through a configuration; `None` if there is no such motion.
    fn by_way_of(
        &mut self,
        by_way_of: JointPositions,
        around: &mut Surroundings<'_>,
        reference: &mut ReferenceMotion,
        solver: &Solver,
    ) -> Option<Way> {
        let q = *self.destination.q();
        let (check, allowed_m) = (&mut around.check, around.allowed_m);
        let way = check.way(q, Some(by_way_of), None, allowed_m, reference, solver);
        let way = way.ok()?;
        self.keep_better(way, around);
        Some(way)
    }

    /// Checks the path to a configuration from which the motion continues to the destination.
    fn stopping_at(
        &mut self,
        q: JointPositions,
        detour_m: f64,
        around: &mut Surroundings<'_>,
        reference: &mut ReferenceMotion,
        solver: &Solver,
    ) -> Option<Way> {
        let (check, allowed_m) = (&mut around.check, around.allowed_m);
        let way = check.way(q, None, Some(detour_m), allowed_m, reference, solver);
        let mut way = way.ok()?;
        way.duration_s += reference.limits().travel_time_s(&q, self.destination.q());
        self.keep_better(way, around);
        Some(way)
    }

    fn keep_better(&mut self, way: Way, around: &Surroundings<'_>) {
        if self
            .best
            .is_none_or(|best| best.is_beaten_by(&way, around.allowed_m))
        {
            (self.best, self.is_from_here) = (Some(way), true);
        }
    }

    /// The next stage, unless the best path is good enough.
    fn unless_good(&self, next: Stage, around: &Surroundings<'_>) -> Stage {
        let good_s = self.straight_s * GOOD_ENOUGH + GOOD_ENOUGH_S;
        let is_good = |best: Way| around.stays_behind(&best) && best.duration_s <= good_s;
        if self.best.is_some_and(is_good) {
            Stage::Over
        } else {
            next
        }
    }

    /// If the best path is no longer valid from the board's current place, tries bends and detours once more.
    fn begins_again(&mut self, best: &Way, around: &Surroundings<'_>) -> bool {
        let served = self.best.is_some_and(|best| around.stays_behind(&best));
        if self.is_from_here || self.is_second || !served || around.stays_behind(best) {
            return false;
        }
        (self.best, self.bent, self.gain) = (Some(*best), Some(*best), BEND_GAIN);
        (self.is_from_here, self.is_second) = (true, true);
        true
    }

    /// The best path. One found in an earlier step is checked again: the board has moved, and the surfaces may have.
    fn best_from_here(
        &self,
        around: &mut Surroundings<'_>,
        reference: &mut ReferenceMotion,
        solver: &Solver,
    ) -> Option<Way> {
        let Some(best) = self.best.filter(|_| !self.is_from_here) else {
            return self.best;
        };
        let (check, allowed_m) = (&mut around.check, around.allowed_m);
        let Way {
            q,
            by_way_of,
            detour_m,
            ..
        } = best;
        let way = check.way(q, by_way_of, detour_m, allowed_m, reference, solver);
        // From here there may be no such motion any more.
        Some(way.unwrap_or(Way {
            protrusion_m: f64::INFINITY,
            worst: None,
            ..best
        }))
    }
}

/// The configuration that a path must pass to stay behind and clear at its worst point: the smallest change of the configuration that it passes now,
/// weighted by the time that each joint needs.
fn pushed_behind(
    way: &Way,
    around: &Surroundings<'_>,
    gain: f64,
    reference: &ReferenceMotion,
    solver: &Solver,
) -> Option<JointPositions> {
    let worst = way.worst?;
    let arm = solver.arm();
    // Gradient of the worst violation with each joint, m/rad.
    let gradient = match worst.point {
        Some(point) => {
            let (face, jacobian) = arm.forward_and_jacobian(&worst.q);
            let lever = point.point_m - face.position_m();
            std::array::from_fn(|joint| {
                let velocity = jacobian.linear[joint] + jacobian.angular[joint].cross(lever);
                point.normal.dot(velocity)
            })
        }
        None => around.check.clear.as_ref()?.gradient(&worst.q),
    };
    let speeds = &reference.limits().velocity_rad_per_s;
    let squares = gradient.iter().zip(speeds).map(|(g, speed)| g * speed);
    let square: f64 = squares.map(|g| g * g).sum();
    if square.is_nan() || square < 1e-12 {
        return None;
    }
    let back_m = gain * (worst.in_front_m - around.allowed_m) + BEND_MARGIN_M;
    let mut q = way.by_way_of.unwrap_or(worst.q);
    for (joint, limit) in arm.limits().iter().enumerate() {
        let change = back_m * gradient[joint] * speeds[joint].powi(2) / square;
        q[joint] = (q[joint] - change).clamp(limit.min_rad, limit.max_rad);
    }
    Some(q)
}
