//! Ways tried out before they are taken: how soon the board is where, going behind the surfaces.

use crate::error::SessionError;
use glam::DVec3;
use hwall_arrival::{StrainConfig, WaitingConfig, WeightedTarget};
use hwall_haptics::{
    ApproachConfig, Barrier, Board, Follower, FollowerConfig, MotionConfig, QUARTER_TURNS_RAD,
    board_pose, surface_axes,
};
use hwall_kinematics::{JointPositions, SrsArm};
use std::f64::consts::{PI, TAU};
use std::sync::Arc;

/// Arm angles that are tried for a place: 12 degrees apart.
const ARM_ANGLES: usize = 30;
/// Configurations whose ways are tried out for a place, the quickest by straight ways first ...
const TRIED: usize = 4;
/// ... and whose joints differ by this in at least one, rad: the ways to others are much the same.
const APART_RAD: f64 = 0.25;
/// A board on its way to a place goes on to one on the same wall at most this far away in the same manner ...
const BESIDE_M: f64 = 0.4;
/// ... if no joint then turns by more than this, rad.
const LIKE_RAD: f64 = 0.8;
/// A place this near to the last one is the same, m.
const SAME_M: f64 = 0.05;
const SAME_NORMAL_RAD: f64 = 0.01;

/// Tries out ways of the board behind the surfaces of a scene, with an arm that has a closed form.
#[derive(Debug, Clone)]
pub(crate) struct Rehearsal {
    arm: SrsArm,
    follower: Follower,
    strain: StrainConfig,
    candidates: Vec<Candidate>,
    last: Option<Last>,
}

/// One way to hold the board at a place.
#[derive(Debug, Clone, Copy)]
struct Candidate {
    q: JointPositions,
    point_m: DVec3,
    roll_rad: f64,
    /// By the straight way, with the price of strain, s.
    straight_s: f64,
}

/// What was answered last.
#[derive(Debug, Clone, Copy)]
struct Last {
    point_m: DVec3,
    normal: DVec3,
    roll_rad: Option<f64>,
    q: JointPositions,
}

impl Rehearsal {
    /// The tool of the arm is the face of the board.
    pub(crate) fn new(
        arm: &SrsArm,
        board: &Board,
        barriers: &[Barrier],
        motion: &MotionConfig,
    ) -> Result<Self, SessionError> {
        let config = FollowerConfig {
            motion: MotionConfig {
                speed_share: motion.speed_share * FollowerConfig::default().motion.speed_share,
                ..*motion
            },
            ..FollowerConfig::default()
        };
        let start = JointPositions(arm.limits().map(|limit| limit.middle_rad()));
        let mut follower = Follower::new(Arc::new(arm.clone()), config, &start)?
            .with_board(ApproachConfig::default(), *board);
        follower.set_barriers(barriers);
        Ok(Self {
            arm: arm.clone(),
            follower,
            strain: StrainConfig::default(),
            candidates: Vec::with_capacity(5 * 4 * 8 * ARM_ANGLES),
            last: None,
        })
    }

    /// The next question is about another touch.
    pub(crate) fn forget(&mut self) {
        self.last = None;
    }

    /// The configuration that presents a place soonest from a posture, or one like the last answer for a place near the last
    /// one: a board under way does not change the family of its configurations. `None` if no way is known.
    pub(crate) fn quickest(
        &mut self,
        from: &JointPositions,
        point_m: DVec3,
        normal: DVec3,
        roll_rad: Option<f64>,
    ) -> Option<JointPositions> {
        let beside = self.last.filter(|last| {
            last.roll_rad == roll_rad
                && last.normal.angle_between(normal) <= SAME_NORMAL_RAD
                && last.point_m.distance(point_m) <= BESIDE_M
        });
        if let Some(last) = beside.filter(|last| last.point_m.distance(point_m) <= SAME_M) {
            return Some(last.q);
        }
        self.present(&[point_m], normal, roll_rad);
        let like = beside.and_then(|last| {
            let away = |c: &Candidate| c.q.max_abs_difference(&last.q);
            let nearest = self
                .candidates
                .iter()
                .min_by(|a, b| away(a).total_cmp(&away(b)))?;
            (away(nearest) <= LIKE_RAD).then_some(nearest.q)
        });
        let q = match like {
            Some(q) => q,
            None => self.soonest(from, normal)?.0,
        };
        self.last = Some(Last {
            point_m,
            normal,
            roll_rad,
            q,
        });
        Some(q)
    }

    /// The time to a target from a posture with some slack, s; `None` if no way is known.
    fn arrival_s(&mut self, from: &JointPositions, places: &Places) -> Option<f64> {
        self.candidates.clear();
        self.candidates.extend_from_slice(&places.candidates);
        Some(self.soonest(from, places.normal)?.1)
    }

    /// All configurations that present one of some points of a plane.
    fn present(&mut self, points_m: &[DVec3], normal: DVec3, roll_rad: Option<f64>) {
        self.candidates.clear();
        let halves = [roll_rad.unwrap_or(0.0), roll_rad.unwrap_or(0.0) + PI];
        let rolls: &[f64] = match roll_rad {
            Some(_) => &halves,
            None => &QUARTER_TURNS_RAD,
        };
        for &point_m in points_m {
            for &roll_rad in rolls {
                let Ok(pose) = board_pose(point_m, normal, roll_rad) else {
                    continue;
                };
                for i in 0..ARM_ANGLES {
                    let arm_angle_rad = TAU * i as f64 / ARM_ANGLES as f64 - PI;
                    let found = self.arm.solutions(&pose, arm_angle_rad);
                    let candidates = found.into_iter().flatten().map(|q| Candidate {
                        q,
                        point_m,
                        roll_rad,
                        straight_s: f64::INFINITY,
                    });
                    self.candidates.extend(candidates);
                }
            }
        }
    }

    /// The quickest of the present candidates by the ways that the board would take.
    fn soonest(&mut self, from: &JointPositions, normal: DVec3) -> Option<(JointPositions, f64)> {
        for candidate in &mut self.candidates {
            let straight_s = self.follower.limits().travel_time_s(from, &candidate.q);
            candidate.straight_s = straight_s + self.strain.price_of_s(&self.arm, &candidate.q);
        }
        self.candidates
            .sort_unstable_by(|a, b| a.straight_s.total_cmp(&b.straight_s));
        let mut tried = [JointPositions::default(); TRIED];
        let mut count = 0;
        let mut best: Option<(JointPositions, f64)> = None;
        for i in 0..self.candidates.len() {
            let candidate = self.candidates[i];
            let least_s = best.map_or(f64::INFINITY, |(_, s)| s);
            if count == TRIED || candidate.straight_s >= least_s {
                break;
            }
            let is_like = |other: &JointPositions| {
                (0..6).all(|j| (other[j] - candidate.q[j]).abs() < APART_RAD)
            };
            if tried[..count].iter().any(is_like) {
                continue;
            }
            tried[count] = candidate.q;
            count += 1;
            let strain_s = self.strain.price_of_s(&self.arm, &candidate.q);
            let way = self.follower.rehearse(
                from,
                &candidate.q,
                candidate.point_m,
                normal,
                candidate.roll_rad,
            );
            if let Ok(Some(time_s)) = way
                && time_s + strain_s < least_s
            {
                best = Some((candidate.q, time_s + strain_s));
            }
        }
        best
    }
}

/// A target within reach, and all ways to present it.
struct Places {
    weight: f64,
    normal: DVec3,
    candidates: Vec<Candidate>,
}

/// Targets looked at: more cost seconds and change little.
const MOST_TARGETS: usize = 48;
/// Steps of the descent, rad.
const STEPS_RAD: [f64; 4] = [0.2, 0.1, 0.1, 0.05];
/// What a posture that stands less far behind the surfaces costs, s/m.
const LACK_S_PER_M: f64 = 20.0;
/// What a target costs to which no way leads, s.
const NO_WAY_S: f64 = 2.0;

/// A posture near `from` from which fewer touches are expected late by the ways that the board would take; `from` itself
/// if there is none. Costs about two seconds.
pub(crate) fn better_posture(
    rehearsal: &mut Rehearsal,
    from: JointPositions,
    targets: &[WeightedTarget],
    config: &WaitingConfig,
) -> Result<JointPositions, SessionError> {
    let mut all: Vec<Places> = Vec::new();
    let stride = targets.len().div_ceil(MOST_TARGETS).max(1);
    for target in targets.iter().step_by(stride) {
        let (point_m, normal) = (target.target.point_m, target.target.normal);
        let [x, y] = surface_axes(normal)?;
        let slack_m = config.slack_m;
        let points_m = [DVec3::ZERO, x, -x, y, -y].map(|way| point_m + way * slack_m);
        rehearsal.present(&points_m, normal, target.roll_rad);
        if !rehearsal.candidates.is_empty() {
            all.push(Places {
                weight: target.weight,
                normal,
                candidates: rehearsal.candidates.clone(),
            });
        }
    }
    let mut best = from;
    let mut least_s = loss_s(rehearsal, &from, &all, config, f64::INFINITY);
    for step_rad in STEPS_RAD {
        for joints in [
            &[0][..],
            &[1],
            &[2],
            &[3],
            &[4],
            &[5],
            &[6],
            &[0, 2],
            &[2, 4],
            &[1, 3],
            &[3, 5],
        ] {
            for signs in [[1.0, -1.0], [-1.0, 1.0], [1.0, 1.0], [-1.0, -1.0]] {
                if joints.len() == 1 && signs[0] == signs[1] {
                    continue;
                }
                let mut moved = best;
                for (joint, sign) in joints.iter().zip(signs) {
                    moved[*joint] += sign * step_rad;
                }
                let loss_s = loss_s(rehearsal, &moved, &all, config, least_s);
                if loss_s < least_s {
                    (best, least_s) = (moved, loss_s);
                }
            }
        }
    }
    Ok(best)
}

/// How likely a touch is to be late, as a time, plus what the posture itself lacks, s; given up beyond `most_s`.
fn loss_s(
    rehearsal: &mut Rehearsal,
    q: &JointPositions,
    all: &[Places],
    config: &WaitingConfig,
    most_s: f64,
) -> f64 {
    let limits = rehearsal.arm.limits();
    if !limits.iter().zip(q.0).all(|(limit, q)| limit.contains(q)) {
        return f64::INFINITY;
    }
    let behind_m = rehearsal
        .follower
        .protrusion_at_m(q)
        .map_or(f64::INFINITY, |m| -m);
    let weight: f64 = all.iter().map(|places| places.weight).sum();
    let mut sum_s = LACK_S_PER_M * (config.standoff_m - behind_m).max(0.0)
        + rehearsal.strain.price_of_s(&rehearsal.arm, q);
    for places in all {
        let time_s = rehearsal.arrival_s(q, places).unwrap_or(NO_WAY_S);
        sum_s += places.weight / weight * config.soft_lateness_s(time_s);
        if sum_s >= most_s {
            break;
        }
    }
    sum_s
}
