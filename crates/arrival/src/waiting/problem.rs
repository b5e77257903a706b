//! Evaluates a posture: the time to every target by the fastest configuration there.

use super::config::WaitingConfig;
use crate::board::BoardExtent;
use crate::error::ArrivalError;
use crate::length::{longest_m, turning};
use crate::passage::Passage;
use crate::presentation::{Holding, Presentation};
use crate::surfaces::Surfaces;
use crate::target::WeightedTarget;
use glam::DVec3;
use hwall_kinematics::{ArmKinematics, JointPositions, MOST_JOINTS};
use hwall_motion::MotionLimits;
use hwall_numeric::check::{all_finite, non_negative};
use hwall_reachability::{Target, WallPlane};
use std::cmp::Ordering;
use std::f64::consts::{PI, TAU};

/// Number of slower configurations tried in place of one without a clear path.
const DETOURS: usize = 4;

/// Price of missing distance, s/m.
const LACK_S_PER_M: f64 = 20.0;

/// Arrivals count a little even if none is late, which favours a central posture.
const SHARE_OF_MEAN: f64 = 0.05;

/// Inputs of the search for a waiting posture.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Task<'a> {
    pub(crate) passage: Passage<'a>,
    pub(crate) targets: &'a [WeightedTarget],
    pub(crate) limits: &'a MotionLimits,
    pub(crate) config: &'a WaitingConfig,
}

impl<'a> Task<'a> {
    /// Checks all inputs.
    pub(crate) fn new(
        arm: &'a dyn ArmKinematics,
        targets: &'a [WeightedTarget],
        surfaces: &'a Surfaces,
        board: BoardExtent,
        limits: &'a MotionLimits,
        config: &'a WaitingConfig,
    ) -> Result<Self, ArrivalError> {
        config.validate()?;
        board.validate()?;
        limits.validate()?;
        check_targets(targets)?;
        Ok(Self {
            passage: Passage::new(arm, board, surfaces, config.clearance),
            targets,
            limits,
            config,
        })
    }

    pub(crate) const fn out_of_reach(&self) -> ArrivalError {
        ArrivalError::OutOfReach {
            places: self.targets.len(),
        }
    }
}

/// The reachable targets with all configurations that present them.
#[derive(Debug, Clone)]
pub(crate) struct Problem<'a> {
    pub(super) passage: Passage<'a>,
    pub(super) limits: &'a MotionLimits,
    pub(super) config: &'a WaitingConfig,
    pub(super) shares: &'static [f64],
    places: Vec<Place>,
    /// Joints with a range of at least a full turn: they can reach an angle from either side.
    turns: Vec<usize>,
    /// Weight of all targets, reachable or not.
    pub(super) total_weight: f64,
}

/// One target within reach.
#[derive(Debug, Clone)]
pub(super) struct Place {
    /// Index in the list of targets.
    pub(super) index: usize,
    pub(super) weight: f64,
    pub(super) plane: WallPlane,
    pub(super) point_m: DVec3,
    ways: Vec<Way>,
}

#[derive(Debug, Clone, Copy)]
struct Way {
    q: JointPositions,
    /// Price of strain, s.
    strain_s: f64,
}

/// An arrival from a posture.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Arrival {
    /// Time of the straight joint motion, s.
    pub(super) time_s: f64,
    /// Its clearance violation, m.
    pub(super) excess_m: f64,
    /// Price of that, s.
    pub(super) blocked_s: f64,
}

impl Arrival {
    pub(super) fn is_clear(&self) -> bool {
        self.excess_m == 0.0
    }

    /// Time plus price, s.
    pub(super) fn priced_s(&self) -> f64 {
        self.time_s + self.blocked_s
    }
}

impl<'a> Problem<'a> {
    /// Targets with a weight and near enough, at most `most` of them, evenly selected.
    pub(crate) fn new(
        task: &Task<'a>,
        most: usize,
        arm_angle_step_rad: f64,
        shares: &'static [f64],
    ) -> Result<Self, ArrivalError> {
        let Task {
            passage,
            targets,
            limits,
            config,
        } = *task;
        let holding = Holding::new(passage.arm, &config.rolls_rad, arm_angle_step_rad);
        // Holdings for targets that need their own roll.
        let mut rolled: Vec<(f64, Holding<'_>)> = Vec::new();
        let longest_m = longest_m(passage.arm) + config.slack_m;
        let mut possible: Vec<usize> = (0..targets.len())
            .filter(|&i| targets[i].target.point_m.length() <= longest_m && targets[i].weight > 0.0)
            .collect();
        if possible.len() > most {
            // Sort by wall and place, so that every part of every wall is sampled in proportion, whatever the order of the list.
            possible.sort_by(|a, b| {
                let (a, b) = (
                    wall_order(&targets[*a].target),
                    wall_order(&targets[*b].target),
                );
                let unlike = a.iter().zip(&b).map(|(a, b)| a.total_cmp(b));
                unlike.fold(Ordering::Equal, Ordering::then)
            });
        }
        let stride = (possible.len() as f64 / most as f64).max(1.0);
        let count = (possible.len() as f64 / stride).round() as usize;
        let mut places = Vec::with_capacity(count);
        let mut found: Vec<Presentation> = Vec::new();
        let near = JointPositions(passage.arm.limits().map(|l| l.middle_rad()));
        let mut sampled_weight = 0.0;
        for i in 0..count {
            let index = possible[(((i as f64 + 0.5) * stride) as usize).min(possible.len() - 1)];
            let WeightedTarget {
                target,
                weight,
                roll_rad,
            } = targets[index];
            let holding = match roll_rad {
                None => &holding,
                Some(roll_rad) => {
                    let known = rolled.iter().position(|(roll, _)| *roll == roll_rad);
                    let at = known.unwrap_or_else(|| {
                        let rolls_rad = [roll_rad, roll_rad + PI];
                        let new = Holding::new(passage.arm, &rolls_rad, arm_angle_step_rad);
                        rolled.push((roll_rad, new));
                        rolled.len() - 1
                    });
                    &rolled[at].1
                }
            };
            sampled_weight += weight;
            let plane = WallPlane::through(target.point_m, target.normal)?;
            found.clear();
            let (across, up) = (plane.along() * config.slack_m, DVec3::Z * config.slack_m);
            holding.present(&plane, target.point_m, &near, &mut found);
            if config.slack_m > 0.0 && (found.is_empty() || holding.exact().is_some()) {
                for shift in [across, -across, up, -up] {
                    holding.present(&plane, target.point_m + shift, &near, &mut found);
                }
            }
            if found.is_empty() {
                continue;
            }
            let ways = found.iter().map(|way| Way {
                q: way.q,
                strain_s: config.strain.price_of_s(passage.arm, &way.q),
            });
            places.push(Place {
                index,
                weight,
                plane,
                point_m: target.point_m,
                ways: ways.collect(),
            });
        }
        // The sampled targets represent the others.
        let possible_weight: f64 = possible.iter().map(|&i| targets[i].weight).sum();
        for place in &mut places {
            place.weight *= possible_weight / sampled_weight;
        }
        let (limits_rad, turning) = (passage.arm.limits(), turning(passage.arm));
        let has_room = |&joint: &usize| {
            turning[joint] && limits_rad[joint].max_rad - limits_rad[joint].min_rad >= TAU
        };
        Ok(Self {
            passage,
            limits,
            config,
            shares,
            places,
            turns: (0..MOST_JOINTS).filter(has_room).collect(),
            total_weight: targets.iter().map(|t| t.weight).sum(),
        })
    }

    pub(super) fn places(&self) -> &[Place] {
        &self.places
    }

    /// Keeps only the configurations that may be the fastest from postures near `q`: at most `more_s` slower than the fastest.
    pub(super) fn near(&self, q: &JointPositions, more_s: f64) -> Self {
        let near = |place: &Place| {
            let least_s = self
                .fastest(place, q, &[])
                .map_or(0.0, |(way, time_s)| time_s + place.ways[way].strain_s);
            let reach_rad = self.limits.farthest_rad(least_s + more_s);
            let within =
                |way: &Way| (0..MOST_JOINTS).all(|j| (way.q[j] - q[j]).abs() <= reach_rad[j]);
            let turned = place.ways.iter().map(|way| Way {
                q: self.turned(way, q),
                ..*way
            });
            let mut ways: Vec<Way> = turned.filter(within).collect();
            // Fastest first: that one then rules out most others.
            let time_s = |way: &Way| self.limits.travel_time_s(q, &way.q) + way.strain_s;
            // Positive numbers are in the order of their bits.
            ways.sort_by_cached_key(|way| time_s(way).to_bits());
            Place { ways, ..*place }
        };
        Self {
            places: self.places.iter().map(near).collect(),
            turns: self.turns.clone(),
            ..*self
        }
    }

    /// The time to a place from a posture: of the fastest configurations, the one that arrives first with its price.
    pub(super) fn arrival(&self, place: &Place, q: &JointPositions) -> Arrival {
        let mut refused = [usize::MAX; DETOURS + 1];
        let mut best = Arrival {
            time_s: f64::INFINITY,
            excess_m: f64::INFINITY,
            blocked_s: 0.0,
        };
        for attempt in 0..=DETOURS {
            let Some((way, time_s)) = self.fastest(place, q, &refused) else {
                break;
            };
            if time_s >= best.priced_s() {
                break;
            }
            let shares = self.shares.iter().copied();
            // Stop checking a path that costs more than the best so far.
            let most_m = (best.priced_s() - time_s) / self.config.blocked_s_per_m;
            let to = self.turned(&place.ways[way], q);
            refused[attempt] = way;
            let Some(excess_m) = self.passage.excess_within_m(q, &to, shares, most_m) else {
                continue;
            };
            let arrival = Arrival {
                time_s,
                excess_m,
                blocked_s: self.config.blocked_s_per_m * excess_m,
            };
            if arrival.priced_s() < best.priced_s() {
                best = arrival;
            }
        }
        best
    }

    /// The target configuration, with full turns towards a posture for joints that have the range.
    fn turned(&self, way: &Way, q: &JointPositions) -> JointPositions {
        let mut turned = way.q;
        for &joint in &self.turns {
            turned[joint] = self.passage.arm.limits()[joint].nearest_turn(turned[joint], q[joint]);
        }
        turned
    }

    /// The configuration with the least time plus strain, and its time. Most are skipped by comparing joint distances with those reachable in the
    /// best time so far.
    fn fastest(
        &self,
        place: &Place,
        q: &JointPositions,
        refused: &[usize],
    ) -> Option<(usize, f64)> {
        let mut best: Option<(usize, f64)> = None;
        let mut least_s = f64::INFINITY;
        let mut reach_rad = [f64::INFINITY; MOST_JOINTS];
        for (index, way) in place.ways.iter().enumerate() {
            let to = self.turned(way, q);
            let beyond = (0..MOST_JOINTS).any(|j| (to[j] - q[j]).abs() > reach_rad[j]);
            if beyond || refused.contains(&index) {
                continue;
            }
            let time_s = self.limits.travel_time_s(q, &to);
            if time_s + way.strain_s < least_s {
                least_s = time_s + way.strain_s;
                best = Some((index, time_s));
                reach_rad = self.limits.farthest_rad(least_s);
            }
        }
        best
    }

    /// Mean probability of being late over the reachable targets, as a time, plus the deficits of the posture itself; s. Infinite outside the
    /// limits.
    pub(super) fn loss_s(&self, q: &JointPositions) -> f64 {
        let lack_s = self.lack_s(q);
        if !lack_s.is_finite() {
            return f64::INFINITY;
        }
        lack_s + self.mean_cost_s(|place| self.arrival(place, q).priced_s())
    }

    /// Mean over the places of what an arrival costs.
    fn mean_cost_s(&self, time_s: impl Fn(&Place) -> f64) -> f64 {
        let (mut sum_s, mut weight) = (0.0, 0.0);
        for place in &self.places {
            let time_s = time_s(place);
            sum_s += place.weight * (self.soft_lateness_s(time_s) + SHARE_OF_MEAN * time_s);
            weight += place.weight;
        }
        sum_s / weight
    }

    /// As [`loss_s`](Self::loss_s), assuming clear paths and without the deficits of the posture: cheaper.
    pub(super) fn unblocked_s(&self, q: &JointPositions) -> f64 {
        self.mean_cost_s(|place| {
            let fastest = self.fastest(place, q, &[]);
            fastest.map_or(f64::INFINITY, |(_, time_s)| time_s)
        })
    }

    /// Price of the posture's own deficits: distance to surfaces, to its own body, to limits, s.
    pub(super) fn lack_s(&self, q: &JointPositions) -> f64 {
        let arm = self.passage.arm;
        if !arm.limits().iter().zip(q.0).all(|(l, q)| l.contains(q)) {
            return f64::INFINITY;
        }
        let standing = self.passage.standing(q);
        let lack_m = (standing.face_m + self.config.standoff_m).max(0.0)
            + standing.links_m.max(0.0)
            + (self.passage.clearance.own_body_m - standing.own_body_m).max(0.0);
        LACK_S_PER_M * lack_m + self.config.strain.price_of_s(arm, q)
    }

    /// Probability of being late, as a time: `4 τ / (1 + exp((budget - t) / τ))`, with slope 1 at the budget. Hopeless targets then count no more
    /// than those just too late, whereas mean lateness would favour the hopeless ones.
    fn soft_lateness_s(&self, time_s: f64) -> f64 {
        let softness_s = self.config.softness_s;
        4.0 * softness_s / (1.0 + ((self.config.budget_s - time_s) / softness_s).exp())
    }

    /// Share of all targets, by weight, where the board is expected in time: the probability that the budget exceeds the time, including the price
    /// of paths that are not clear.
    pub(super) fn in_time_share(&self, q: &JointPositions) -> f64 {
        let of_place = |place: &Place| place.weight * self.in_time(&self.arrival(place, q));
        self.places.iter().map(of_place).sum::<f64>() / self.total_weight
    }

    /// Probability that an arrival is in time.
    pub(super) fn in_time(&self, arrival: &Arrival) -> f64 {
        let beyond_s = arrival.priced_s() - self.config.budget_s;
        1.0 / (1.0 + (beyond_s / self.config.softness_s).exp())
    }

    /// Distance of the board behind the surfaces in front of it, m.
    pub(super) fn standoff_m(&self, q: &JointPositions) -> f64 {
        -self.passage.standing(q).face_m
    }
}

/// Sort key of targets: direction and distance of the wall, then columns of a hand's breadth, then height.
fn wall_order(target: &Target) -> [f64; 4] {
    const COLUMN_M: f64 = 0.1;
    let normal = target.normal.normalize_or_zero();
    let along = DVec3::Z.cross(normal).dot(target.point_m);
    let rounded = |value: f64, step: f64| (value / step).round() * step;
    [
        rounded(normal.y.atan2(normal.x), 1e-3),
        rounded(normal.dot(target.point_m), 1e-3),
        (along / COLUMN_M).floor(),
        target.point_m.z,
    ]
}

/// Rejects invalid targets.
pub(crate) fn check_targets(targets: &[WeightedTarget]) -> Result<(), ArrivalError> {
    if targets.is_empty() {
        return Err(ArrivalError::Empty { what: "targets" });
    }
    let mut total = 0.0;
    for WeightedTarget {
        target,
        weight,
        roll_rad,
    } in targets
    {
        all_finite("target", &target.point_m.to_array())?;
        all_finite("roll_rad", roll_rad.as_slice())?;
        total += non_negative("weight of a target", *weight)?;
    }
    if total <= 0.0 || !total.is_finite() {
        return Err(ArrivalError::Empty {
            what: "targets with a weight",
        });
    }
    Ok(())
}
