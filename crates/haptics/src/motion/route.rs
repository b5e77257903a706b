//! Which way the board takes to its goal: straight, or by a place behind the surfaces.

use super::barrier::Barrier;
use super::goals::Goal;
use super::solver::{Place, Solver};
use crate::board::Board;
use crate::error::HapticsError;
use glam::{DMat3, DQuat};
use hwall_geometry::Pose;
use hwall_kinematics::{BranchPolicy, JointPositions};
use hwall_motion::ReferenceMotion;
use hwall_numeric::check::{non_negative, positive};

/// How the board stays behind the surfaces on its way.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ApproachConfig {
    /// How far corners and middle of the face may come in front of a surface on their way, m; default 0.003.
    pub allowed_m: f64,
    /// A way that comes in front of a surface is bent: half way it passes the middle between departure and goal, moved
    /// behind the surface by the first of these that serves, m; default 0 to 0.08.
    pub bends_m: [f64; 5],
    /// If no bend serves, places this far behind the goal, or behind the place that the board leaves, are tried as detours, the first that
    /// serves is taken, m; default 0.015 to 0.15. All zero: always straight to the goal.
    pub detours_m: [f64; 6],
    /// Half side of the square about goal and departure in which the plane of the touched surface counts, m; default 0.3.
    pub extent_m: f64,
    /// While the board is on a detour the straight way is tried again after this time, s; default 0.008.
    pub retry_s: f64,
}

impl Default for ApproachConfig {
    fn default() -> Self {
        Self {
            allowed_m: std::env::var("ALLOW")
                .ok()
                .and_then(|a| a.parse().ok())
                .unwrap_or(0.003),
            bends_m: [0.0, 0.015, 0.03, 0.05, 0.08],
            detours_m: [0.015, 0.03, 0.045, 0.065, 0.1, 0.15],
            extent_m: 0.3,
            retry_s: 0.008,
        }
    }
}

impl ApproachConfig {
    /// Rejects negative settings.
    ///
    /// # Errors
    /// The first setting outside its range; NaN is outside every range.
    pub fn validate(&self) -> Result<(), HapticsError> {
        non_negative("allowed_m", self.allowed_m)?;
        for bend in self.bends_m {
            non_negative("bends_m", bend)?;
        }
        for detour in self.detours_m {
            non_negative("detours_m", detour)?;
        }
        positive("extent_m", self.extent_m)?;
        positive("retry_s", self.retry_s)?;
        Ok(())
    }

    fn detours(&self) -> impl Iterator<Item = f64> {
        self.detours_m.into_iter().filter(|d| *d > 0.0)
    }
}

/// Instants at which a way is looked at.
const SAMPLES: usize = 12;
/// A surface that the goal itself lies in front of counts only further than this from the goal, m: a shelf stands out
/// of its wall.
const BESIDE_GOAL_M: f64 = 0.03;

/// Where the board is going, as far as its way is concerned.
#[derive(Debug, Clone, Copy)]
pub(super) enum Destination {
    /// A place on a surface, or behind it.
    Goal(Goal),
    /// A posture, wherever the board is then.
    Posture(JointPositions),
}

impl Destination {
    pub(super) const fn q(&self) -> &JointPositions {
        match self {
            Self::Goal(goal) => &goal.q,
            Self::Posture(q) => q,
        }
    }
}

/// What the board must stay behind, and whether it is on a detour.
#[derive(Debug, Clone)]
pub(super) struct Route {
    config: ApproachConfig,
    board: Option<Board>,
    barriers: Vec<Barrier>,
    /// The surface that the board served last.
    left: Option<(Barrier, Place)>,
    is_detour: bool,
    /// How far behind the goal the detour under way ends, m; infinite for one behind the departure.
    detour_m: f64,
    retry_in_s: f64,
}

/// A way that was looked at.
#[derive(Debug, Clone, Copy)]
struct Way {
    q: JointPositions,
    by_way_of: Option<JointPositions>,
    is_detour: bool,
    protrusion_m: f64,
}

impl Route {
    pub(super) const fn new(config: ApproachConfig, board: Option<Board>) -> Self {
        Self {
            config,
            board,
            barriers: Vec::new(),
            left: None,
            is_detour: false,
            detour_m: f64::INFINITY,
            retry_in_s: 0.0,
        }
    }

    pub(super) fn set_barriers(&mut self, barriers: &[Barrier]) {
        self.barriers.clear();
        self.barriers.extend_from_slice(barriers);
    }

    pub(super) const fn is_detour(&self) -> bool {
        self.is_detour
    }

    pub(super) const fn forget(&mut self) {
        (self.left, self.is_detour) = (None, false);
    }

    /// Time passes; is the straight way due to be tried again?
    pub(super) fn is_retry_due(&mut self, dt_s: f64) -> bool {
        self.retry_in_s -= dt_s;
        self.is_detour && self.retry_in_s <= 0.0
    }

    /// The surface of a goal is left behind for another destination.
    pub(super) fn leave(&mut self, goal: &Goal) {
        let extent_m = [self.config.extent_m; 2];
        // The goal was accepted, so its plane is one.
        self.left = Barrier::new(goal.point_m, goal.normal, extent_m)
            .ok()
            .map(|barrier| (barrier, goal.place(0.0)));
    }

    /// Begins the motion to the destination, or to a detour on the way there; `is_new`: not the destination of the last call.
    pub(super) fn head_for(
        &mut self,
        destination: &Destination,
        is_new: bool,
        reference: &mut ReferenceMotion,
        solver: &mut Solver,
    ) -> Result<(), HapticsError> {
        let config = self.config;
        self.retry_in_s = config.retry_s;
        let Some(board) = self.board else {
            self.is_detour = false;
            reference.set_goal(destination.q())?;
            return Ok(());
        };
        let goal = match destination {
            Destination::Goal(goal) => Some(goal),
            Destination::Posture(_) => None,
        };
        let extent_m = [self.config.extent_m; 2];
        let ahead = match goal {
            Some(goal) => Some(Barrier::new(goal.point_m, goal.normal, extent_m)?),
            None => None,
        };
        let goal_pose = solver.arm().forward(destination.q());
        let check = Check {
            board: &board,
            barriers: &self.barriers,
            near: [ahead, self.left.map(|(barrier, _)| barrier)],
            goal: goal_pose,
            passes: passes(&self.barriers, &board, &goal_pose, self.config.allowed_m),
        };
        let here = solver.arm().forward(&reference.state().q);
        let allowed_m = self.config.allowed_m.max(check.protrusion_m(&here) + 1e-3);
        let straight = check.way(*destination.q(), None, false, reference, solver)?;
        if straight.protrusion_m <= allowed_m {
            return self.take(straight, reference);
        }
        let mut best = straight;
        // A bend costs next to nothing.
        for bend in self.bends(&here, &goal_pose, goal).into_iter().flatten() {
            let middle = between(&reference.state().q, destination.q());
            let Ok(found) = solver.beside_pose(&bend, &middle) else {
                continue;
            };
            let q = *destination.q();
            let Ok(way) = check.way(q, Some(found), false, reference, solver) else {
                continue;
            };
            if way.protrusion_m <= allowed_m {
                return self.take(way, reference);
            }
            if way.protrusion_m < best.protrusion_m {
                best = way;
            }
        }
        // A detour under way is only exchanged for a shorter one.
        let keeps = !is_new && self.is_detour && reference.left_s() > config.retry_s;
        let shorter_than_m = if keeps { self.detour_m } else { f64::INFINITY };
        let before_goal = goal.map(|goal| (goal.place(0.0), goal.q, true));
        let behind_here = self.left.filter(|_| !keeps).map(|(_, left)| {
            let point_m = here.position_m();
            (Place { point_m, ..left }, reference.state().q, false)
        });
        for (place, near, is_before_goal) in before_goal.into_iter().chain(behind_here) {
            for behind_m in config.detours().filter(|m| *m < shorter_than_m) {
                let place = Place {
                    point_m: place.point_m - place.normal * behind_m,
                    ..place
                };
                let Ok(found) = solver.on_place(&place, &near, BranchPolicy::Keep)? else {
                    continue;
                };
                let Ok(way) = check.way(found.q, None, true, reference, solver) else {
                    continue;
                };
                let detour_m = if is_before_goal {
                    behind_m
                } else {
                    f64::INFINITY
                };
                if way.protrusion_m <= allowed_m {
                    self.detour_m = detour_m;
                    return self.take(way, reference);
                }
                if way.protrusion_m < best.protrusion_m {
                    (best, self.detour_m) = (way, detour_m);
                }
            }
        }
        if keeps {
            return Ok(());
        }
        self.take(best, reference)
    }

    /// Poses half way, further and further behind the surfaces.
    fn bends(&self, here: &Pose, there: &Pose, goal: Option<&Goal>) -> [Option<Pose>; 5] {
        let normal = goal
            .map(|goal| goal.normal)
            .or(self.left.map(|(_, place)| place.normal))
            .unwrap_or(there.rotation().z_axis);
        let half_m = 0.5 * (here.position_m() + there.position_m());
        let [from, to] = [here, there].map(|pose| DQuat::from_mat3(&pose.rotation()));
        let rotation = DMat3::from_quat(from.slerp(to, 0.5));
        self.config
            .bends_m
            .map(|behind_m| Pose::new(rotation, half_m - normal * behind_m).ok())
    }

    fn take(&mut self, way: Way, reference: &mut ReferenceMotion) -> Result<(), HapticsError> {
        if std::env::var_os("WAYS").is_some() { eprintln!("way {} {} {}", if way.is_detour {"detour"} else if way.by_way_of.is_some() {"bend"} else {"straight"}, if way.protrusion_m > 0.006 {"bad"} else {"ok"}, (way.protrusion_m*1e3).round()); }
        // At the end of a detour with no better way the goal is next.
        self.is_detour = way.is_detour;
        if reference.goal() != Some(&way.q) || way.by_way_of.is_some() {
            reference.consider(&way.q, way.by_way_of.as_ref())?;
            reference.accept();
        }
        Ok(())
    }
}

/// Half way between two configurations.
fn between(from: &JointPositions, to: &JointPositions) -> JointPositions {
    JointPositions(std::array::from_fn(|i| 0.5 * (from[i] + to[i])))
}

/// One bit for each barrier that the goal itself lies in front of.
fn passes(barriers: &[Barrier], board: &Board, goal: &Pose, allowed_m: f64) -> u64 {
    barriers
        .iter()
        .take(64)
        .enumerate()
        .filter(|(_, b)| b.protrusion_m(board, goal).is_some_and(|m| m > allowed_m))
        .fold(0, |bits, (i, _)| bits | 1 << i)
}

/// Everything that a way is checked against.
struct Check<'a> {
    board: &'a Board,
    barriers: &'a [Barrier],
    near: [Option<Barrier>; 2],
    goal: Pose,
    passes: u64,
}

impl Check<'_> {
    /// How far the board comes in front of a barrier, m; negative if it stays behind all.
    fn protrusion_m(&self, pose: &Pose) -> f64 {
        let mut most = f64::NEG_INFINITY;
        for barrier in self.near.iter().flatten() {
            most = most.max(barrier.protrusion_m(self.board, pose).unwrap_or(most));
        }
        let to_goal = pose.position_m() - self.goal.position_m();
        let beside_m = to_goal
            .reject_from_normalized(self.goal.rotation().z_axis)
            .length();
        for (i, barrier) in self.barriers.iter().enumerate() {
            let passed = i < 64 && self.passes >> i & 1 == 1;
            if !(passed && beside_m <= BESIDE_GOAL_M) {
                most = most.max(barrier.protrusion_m(self.board, pose).unwrap_or(most));
            }
        }
        most
    }

    fn way(
        &self,
        q: JointPositions,
        by_way_of: Option<JointPositions>,
        is_detour: bool,
        reference: &mut ReferenceMotion,
        solver: &Solver,
    ) -> Result<Way, HapticsError> {
        let duration_s = reference.consider(&q, by_way_of.as_ref())?;
        let mut protrusion_m = f64::NEG_INFINITY;
        for i in 1..=SAMPLES {
            let t_s = duration_s * i as f64 / SAMPLES as f64;
            let pose = solver.arm().forward(&reference.considered(t_s).q);
            protrusion_m = protrusion_m.max(self.protrusion_m(&pose));
        }
        Ok(Way {
            q,
            by_way_of,
            is_detour,
            protrusion_m,
        })
    }
}
