//! Finds and evaluates waiting postures.

use super::config::WaitingConfig;
use super::problem::{Problem, Task};
use super::search::{self, StepRange};
use crate::board::BoardExtent;
use crate::error::ArrivalError;
use crate::passage::{COARSE, MEDIUM};
use crate::presentation::Holding;
use crate::surfaces::Surfaces;
use crate::target::{TouchRange, WeightedTarget, targets_of_maps};
use hwall_kinematics::{ArmKinematics, JointPositions};
use hwall_motion::MotionLimits;
use hwall_reachability::WallMaps;

/// A waiting posture and its quality.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct WaitingPosture {
    /// Joint positions within the limits, rad.
    pub q: JointPositions,
    /// Mean time to the targets within reach, by weight, s.
    pub mean_arrival_s: f64,
    /// Share of the reachable targets, by weight, whose time exceeds the budget.
    pub late_share: f64,
    /// Mean excess of the times over the budget, s.
    pub expected_lateness_s: f64,
    /// Share of all targets, by weight, where the board is expected in time under the distribution of budgets; unreachable ones are not, and paths
    /// that are not clear take longer.
    pub in_time_share: f64,
    /// Share of the reachable targets, by weight, with a clear path.
    pub clear_share: f64,
    /// Share of all targets, by weight, within reach.
    pub reached_share: f64,
    /// Distance of the board behind the surfaces in front of it, m: less than configured only if the scene leaves no more. Infinite without
    /// surfaces.
    pub standoff_m: f64,
}

/// The time to every target from a posture.
#[derive(Debug, Clone, PartialEq)]
pub struct PostureArrivals {
    /// Summary.
    pub posture: WaitingPosture,
    /// Least time to each target, s, preferring clear paths; `None` out of reach.
    pub arrivals_s: Vec<Option<f64>>,
    /// Weights of the targets.
    pub weights: Vec<f64>,
}

impl PostureArrivals {
    /// Share of the reachable targets, by weight, reached within a time (s); 0 for NaN.
    #[must_use]
    pub fn share_within(&self, time_s: f64) -> f64 {
        let (mut within, mut all) = (0.0, 0.0);
        for (arrival, weight) in self.arrivals_s.iter().zip(&self.weights) {
            if let Some(arrival_s) = arrival {
                all += weight;
                within += if *arrival_s <= time_s { *weight } else { 0.0 };
            }
        }
        if all > 0.0 { within / all } else { 0.0 }
    }

    /// The time within which a share (0 to 1) of the reachable targets, by weight, is reached, s.
    #[must_use]
    pub fn quantile_s(&self, share: f64) -> f64 {
        let reached = self.arrivals_s.iter().zip(&self.weights);
        let mut sorted: Vec<(f64, f64)> = reached
            .filter_map(|(arrival, weight)| Some(((*arrival)?, *weight)))
            .collect();
        sorted.sort_by(|a, b| a.0.total_cmp(&b.0));
        let all: f64 = sorted.iter().map(|(_, weight)| weight).sum();
        let mut sum = 0.0;
        for (arrival_s, weight) in &sorted {
            sum += weight;
            if sum >= share * all * (1.0 - 1e-12) {
                return *arrival_s;
            }
        }
        sorted.last().map_or(f64::NAN, |last| last.0)
    }
}

/// The posture with the fewest expected late touches of a distribution.
///
/// `targets` and `surfaces` are in the arm's base frame; the tool of `arm` is the face of the board. For arms without a closed form, configurations
/// are searched, and the search may miss a reachable target. The loss of a posture is the share of the targets that the fastest clear path reaches
/// late, under the distribution of budgets; the board must stand behind the surfaces by a standoff. Starts are made from the targets and improved
/// by a descent. Deterministic.
///
/// # Errors
/// An invalid setting, limit or target, no targets, none within reach.
pub fn waiting_posture(
    arm: &dyn ArmKinematics,
    targets: &[WeightedTarget],
    surfaces: &Surfaces,
    board: BoardExtent,
    limits: &MotionLimits,
    config: &WaitingConfig,
) -> Result<WaitingPosture, ArrivalError> {
    let task = Task::new(arm, targets, surfaces, board, limits, config)?;
    Ok(judged(&task, &found(&task)?)?.posture)
}

/// As [`waiting_posture`], but the result of a descent from a given posture: mostly near it, so that the arm is soon there.
///
/// # Errors
/// As [`waiting_posture`], and a posture outside the limits.
pub fn waiting_posture_from(
    from: &JointPositions,
    arm: &dyn ArmKinematics,
    targets: &[WeightedTarget],
    surfaces: &Surfaces,
    board: BoardExtent,
    limits: &MotionLimits,
    config: &WaitingConfig,
) -> Result<WaitingPosture, ArrivalError> {
    let task = Task::new(arm, targets, surfaces, board, limits, config)?;
    crate::atlas::check_waiting(arm, from)?;
    let near = Quick::new(&task)?.descent(from)?;
    Ok(judged(&task, &refined(&task, &[near])?)?.posture)
}

/// As [`waiting_posture`], for the walls of a room and the touched heights.
///
/// # Errors
/// As [`waiting_posture`] and [`targets_of_maps`].
pub fn waiting_posture_of_maps(
    arm: &dyn ArmKinematics,
    maps: &WallMaps,
    range: &TouchRange,
    board: BoardExtent,
    limits: &MotionLimits,
    config: &WaitingConfig,
) -> Result<WaitingPosture, ArrivalError> {
    config.validate()?;
    let targets = targets_of_maps(maps, range)?;
    let surfaces = Surfaces::from_maps(maps, config.clearance.margin_m)?;
    waiting_posture(arm, &targets, &surfaces, board, limits, config)
}

/// The time to every target from a given posture.
///
/// # Errors
/// As [`waiting_posture`], and a posture outside the limits.
pub fn judge_posture(
    q: &JointPositions,
    arm: &dyn ArmKinematics,
    targets: &[WeightedTarget],
    surfaces: &Surfaces,
    board: BoardExtent,
    limits: &MotionLimits,
    config: &WaitingConfig,
) -> Result<PostureArrivals, ArrivalError> {
    judged(
        &Task::new(arm, targets, surfaces, board, limits, config)?,
        q,
    )
}

/// As [`judge_posture`].
pub(crate) fn judged(task: &Task<'_>, q: &JointPositions) -> Result<PostureArrivals, ArrivalError> {
    let Task {
        targets, config, ..
    } = *task;
    crate::atlas::check_waiting(task.passage.arm, q)?;
    let step_rad = config.arm_angle_step_rad;
    let problem = Problem::new(task, targets.len(), step_rad, MEDIUM)?;
    if problem.places().is_empty() {
        return Err(task.out_of_reach());
    }
    let mut arrivals_s = vec![None; targets.len()];
    let [
        mut weight,
        mut mean_s,
        mut late,
        mut lateness_s,
        mut clear,
        mut in_time,
    ] = [0.0; 6];
    for place in problem.places() {
        let arrival = problem.arrival(place, q);
        arrivals_s[place.index] = Some(arrival.time_s);
        let beyond_s = (arrival.time_s - config.budget_s).max(0.0);
        weight += place.weight;
        mean_s += place.weight * arrival.time_s;
        late += if beyond_s > 0.0 { place.weight } else { 0.0 };
        lateness_s += place.weight * beyond_s;
        in_time += place.weight * problem.in_time(&arrival);
        clear += if arrival.is_clear() {
            place.weight
        } else {
            0.0
        };
    }
    Ok(PostureArrivals {
        posture: WaitingPosture {
            q: *q,
            mean_arrival_s: mean_s / weight,
            late_share: late / weight,
            expected_lateness_s: lateness_s / weight,
            in_time_share: in_time / problem.total_weight,
            clear_share: clear / weight,
            reached_share: weight / problem.total_weight,
            standoff_m: problem.standoff_m(q),
        },
        arrivals_s,
        weights: targets.iter().map(|t| t.weight).collect(),
    })
}

/// The best posture over all starts.
pub(crate) fn found(task: &Task<'_>) -> Result<JointPositions, ArrivalError> {
    let ends = Quick::new(task)?.descents(task.config.starts)?;
    let best: Vec<JointPositions> = ends.iter().take(2).map(|(q, _)| *q).collect();
    refined(task, &best)
}

/// The best of some postures after a final descent with more targets and arm angles.
fn refined(task: &Task<'_>, candidates: &[JointPositions]) -> Result<JointPositions, ArrivalError> {
    let step_rad = task.config.arm_angle_step_rad;
    let most = task.config.most_targets.saturating_mul(3);
    let fine = Problem::new(task, most, step_rad, MEDIUM)?;
    let last = StepRange {
        first_rad: 0.06,
        last_rad: 0.005,
    };
    let mut best: Option<(JointPositions, f64)> = None;
    for q in candidates {
        let found = search::descend(&fine, *q, last);
        if best.is_none_or(|(_, least)| found.1 < least) {
            best = Some(found);
        }
    }
    best.map(|(q, _)| q).ok_or_else(|| task.out_of_reach())
}

/// A search with few targets and arm angles.
pub(crate) struct Quick<'a> {
    problem: Problem<'a>,
    holding: Holding<'a>,
    targets: usize,
}

impl<'a> Quick<'a> {
    /// The settings and targets must be valid.
    pub(crate) fn new(task: &Task<'a>) -> Result<Self, ArrivalError> {
        let Task {
            passage, config, ..
        } = *task;
        let step_rad = 2.0 * config.arm_angle_step_rad;
        let problem = Problem::new(task, config.most_targets, step_rad, COARSE)?;
        let holding = Holding::new(passage.arm, &config.rolls_rad, search::START_ANGLE_STEP_RAD);
        Ok(Self {
            problem,
            holding,
            targets: task.targets.len(),
        })
    }

    /// Steps of a descent: large ones, then small ones.
    const STEPS: [StepRange; 2] = [
        StepRange {
            first_rad: 0.2,
            last_rad: 0.1,
        },
        StepRange {
            first_rad: 0.05,
            last_rad: 0.025,
        },
    ];

    /// The result of the descent from a posture.
    fn descent(&self, from: &JointPositions) -> Result<JointPositions, ArrivalError> {
        self.check()?;
        let descend = |q, steps| search::descend(&self.problem, q, steps).0;
        Ok(Self::STEPS.into_iter().fold(*from, descend))
    }

    fn check(&self) -> Result<(), ArrivalError> {
        if self.problem.places().is_empty() {
            return Err(ArrivalError::OutOfReach {
                places: self.targets,
            });
        }
        Ok(())
    }

    /// The results of the descents from the best starts with their losses, best first.
    pub(crate) fn descents(
        &self,
        starts: usize,
    ) -> Result<Vec<(JointPositions, f64)>, ArrivalError> {
        self.check()?;
        let starts = search::starts(&self.problem, &self.holding, starts);
        let mut ends: Vec<(JointPositions, f64)> = starts.into_iter().map(|q| (q, 0.0)).collect();
        // Large steps for all, small ones for the best after that.
        for steps in Self::STEPS {
            for end in &mut ends {
                *end = search::descend(&self.problem, end.0, steps);
            }
            ends.sort_by(|a, b| a.1.total_cmp(&b.1));
            ends.truncate(ends.len().div_ceil(4));
        }
        Ok(ends)
    }

    /// Share of all targets, by weight, expected in time.
    pub(crate) fn in_time_share(&self, q: &JointPositions) -> f64 {
        self.problem.in_time_share(q)
    }
}
