//! The search: evaluates many positions quickly, a few closely.

use super::config::ArrivalPlacementConfig;
use crate::board::BoardExtent;
use crate::error::ArrivalError;
use crate::length::longest_m;
use crate::passage::Passage;
use crate::surfaces::Surfaces;
use crate::target::WeightedTarget;
use crate::waiting::{PostureArrivals, Quick, Task, WaitingConfig, check_targets, found, judged};
use glam::{DMat3, DVec3};
use hwall_geometry::Pose;
use hwall_kinematics::{JointPositions, SrsArm};
use hwall_motion::MotionLimits;
use hwall_reachability::{
    Interval, Monitor, PlacementConfig, PlacementScores, Progress, ReachabilityError, Target,
    WallFacet, place_base,
};
use std::ops::ControlFlow;

/// A base position and the arrival times from it.
#[derive(Debug, Clone, PartialEq)]
pub struct ArrivalPlacement {
    /// Pose of the base frame in the room.
    pub room_from_base: Pose,
    /// Rotation of the base about the vertical, rad.
    pub heading_rad: f64,
    /// Share of all targets, by weight, where the board is expected in time; unreachable ones are not.
    pub in_time_share: f64,
    /// The waiting posture, and its time to each target.
    pub arrivals: PostureArrivals,
}

/// The best places.
#[derive(Debug, Clone, PartialEq)]
pub struct ArrivalPlacements {
    /// By the share in time, best first.
    pub best: Vec<ArrivalPlacement>,
    /// Number of positions evaluated by arrival.
    pub judged: usize,
    /// Number of targets within reach, from behind, for each position and heading of the grid.
    pub coverage: PlacementScores,
}

/// Ranks positions by the share of targets reached in time from their own waiting posture.
///
/// `targets` and `facets` (with normals to the touched side) are in the room frame. The positions that reach the most targets are evaluated
/// quickly; around the best of them, intermediate positions and other headings are tried; the best overall are evaluated closely. Deterministic.
///
/// # Errors
/// As [`place_base`] and [`waiting_posture`](crate::waiting_posture).
pub fn place_base_by_arrival(
    arm: &SrsArm,
    targets: &[WeightedTarget],
    facets: &[WallFacet],
    board: BoardExtent,
    limits: &MotionLimits,
    config: &ArrivalPlacementConfig,
) -> Result<ArrivalPlacements, ArrivalError> {
    let go_on = |_: Progress| ControlFlow::Continue(());
    place_base_by_arrival_monitored(arm, targets, facets, board, limits, config, &go_on)
}

/// As [`place_base_by_arrival`], with progress reports; the monitor can cancel it.
///
/// # Errors
/// As [`place_base_by_arrival`]; [`ReachabilityError::Cancelled`] if the monitor cancels.
pub fn place_base_by_arrival_monitored(
    arm: &SrsArm,
    targets: &[WeightedTarget],
    facets: &[WallFacet],
    board: BoardExtent,
    limits: &MotionLimits,
    config: &ArrivalPlacementConfig,
    monitor: &Monitor,
) -> Result<ArrivalPlacements, ArrivalError> {
    config.validate()?;
    board.validate()?;
    limits.validate()?;
    check_targets(targets)?;
    let plain: Vec<Target> = targets.iter().map(|t| t.target).collect();
    let from_behind = PlacementConfig {
        least_behind_m: config.placement.least_behind_m.or(Some(0.0)),
        best: 1,
        ..config.placement.clone()
    };
    let coverage = place_base(arm, &plain, &from_behind)?;
    let room = Room {
        arm,
        targets,
        facets,
        board,
        limits,
        config,
        least_behind_m: from_behind.least_behind_m.unwrap_or(0.0),
    };
    let mut judged: Vec<Judged> = Vec::new();
    let places = most_covering(&room, &coverage, config.judged);
    let total = places.len() + config.refined * TRIED_AROUND + config.best;
    let tell = |done: usize| match monitor(Progress { done, total }) {
        ControlFlow::Continue(()) => Ok(()),
        ControlFlow::Break(()) => Err(ReachabilityError::Cancelled),
    };
    for (done, place) in places.iter().enumerate() {
        tell(done)?;
        let found = room.judge(*place, &judged)?;
        judged.extend(found);
    }
    if judged.is_empty() {
        return Err(ArrivalError::OutOfReach {
            places: targets.len(),
        });
    }
    let by_share = |a: &Judged, b: &Judged| b.share.total_cmp(&a.share);
    judged.sort_by(by_share);
    let spacing_m = from_behind.x.spacing_m().max(from_behind.y.spacing_m());
    for i in 0..config.refined.min(judged.len()) {
        tell(places.len() + i * TRIED_AROUND)?;
        let refined = room.refine(judged[i], spacing_m, &mut judged)?;
        judged.push(refined);
    }
    judged.sort_by(by_share);
    let mut best: Vec<ArrivalPlacement> = Vec::with_capacity(config.best);
    let mut taken: Vec<Place> = Vec::with_capacity(config.best);
    for candidate in &judged {
        let place = candidate.place;
        let near = |other: &Place| other.base_m.distance(place.base_m) < 0.5 * spacing_m;
        if taken.iter().any(near) {
            continue;
        }
        tell(total - config.best + taken.len())?;
        taken.push(place);
        best.push(room.judge_closely(candidate)?);
        if best.len() == config.best {
            break;
        }
    }
    best.sort_by(|a, b| b.in_time_share.total_cmp(&a.in_time_share));
    tell(total)?;
    Ok(ArrivalPlacements {
        best,
        judged: judged.len(),
        coverage,
    })
}

/// Candidates around a position: six neighbours, at two distances.
const TRIED_AROUND: usize = 12;

/// A base position and heading.
#[derive(Debug, Clone, Copy, PartialEq)]
struct Place {
    base_m: DVec3,
    heading_rad: f64,
}

#[derive(Debug, Clone, Copy, PartialEq)]
struct Judged {
    place: Place,
    /// Share of the targets expected in time.
    share: f64,
    /// Its waiting posture.
    q: JointPositions,
}

/// Number of postures of other positions that a search also starts from: a posture that is good at one position is nearly as good at the next, and
/// a few own starts may miss it.
const BORROWED: usize = 3;

/// The postures of the best positions so far.
fn postures_of_best(judged: &[Judged]) -> Vec<JointPositions> {
    let mut order: Vec<&Judged> = judged.iter().collect();
    order.sort_by(|a, b| b.share.total_cmp(&a.share));
    order.iter().take(BORROWED).map(|j| j.q).collect()
}

/// The grid positions that reach the most targets, each at the best heading; among equals the heading most aligned with the normals of the targets
/// nearby.
fn most_covering(room: &Room, coverage: &PlacementScores, count: usize) -> Vec<Place> {
    let config = coverage.config();
    let mut found = Vec::new();
    for (iy, y) in config.y.iter().enumerate() {
        for (ix, x) in config.x.iter().enumerate() {
            let base_m = DVec3::new(x, y, config.z_m);
            let reached = coverage.cell(ix, iy).map_or(0, |cell| cell.reachable);
            if reached > 0 && room.has_space_at(base_m) {
                found.push((reached, base_m, [ix, iy]));
            }
        }
    }
    found.sort_by_key(|(reached, ..)| std::cmp::Reverse(*reached));
    found.truncate(count);
    let with_heading = |(reached, base_m, [ix, iy]): (usize, DVec3, [usize; 2])| {
        let towards = room.normals_near(base_m);
        let ahead =
            |heading_rad: f64| DVec3::new(heading_rad.cos(), heading_rad.sin(), 0.0).dot(towards);
        let headings = config.headings_rad.iter().enumerate();
        let best = headings
            .filter(|(i, _)| coverage.reachable(ix, iy, *i) == Some(reached))
            .map(|(_, heading_rad)| *heading_rad)
            .max_by(|a, b| ahead(*a).total_cmp(&ahead(*b)));
        best.map(|heading_rad| Place {
            base_m,
            heading_rad,
        })
    };
    found.into_iter().filter_map(with_heading).collect()
}

/// Common inputs of all positions.
struct Room<'a> {
    arm: &'a SrsArm,
    targets: &'a [WeightedTarget],
    facets: &'a [WallFacet],
    board: BoardExtent,
    limits: &'a MotionLimits,
    config: &'a ArrivalPlacementConfig,
    least_behind_m: f64,
}

/// The room in the frame of a base.
struct FromBase {
    room_from_base: Pose,
    targets: Vec<WeightedTarget>,
    surfaces: Surfaces,
}

impl Room<'_> {
    /// Is the base column clear of the walls?
    fn has_space_at(&self, base_m: DVec3) -> bool {
        let radius_m = self.config.base_radius_m;
        let upper_m = self.arm.geometry().d_bs_m.max(0.0);
        self.facets.iter().all(|facet| {
            let along = DVec3::Z.cross(facet.normal).normalize_or_zero();
            let off_m = facet.normal.normalize_or_zero().dot(base_m - facet.point_m);
            let s_m = facet.outline_m.iter().map(|p| along.dot(*p - base_m));
            let (lo, hi) = s_m.fold((f64::INFINITY, f64::NEG_INFINITY), |(lo, hi), s| {
                (lo.min(s), hi.max(s))
            });
            let apart = off_m.abs() >= radius_m || lo >= radius_m || hi <= -radius_m;
            let (low_m, high_m) = (facet.heights.lo_m - base_m.z, facet.heights.hi_m - base_m.z);
            apart || low_m >= upper_m || high_m <= 0.0
        })
    }

    /// Sum of the normals of the targets roughly within reach.
    fn normals_near(&self, base_m: DVec3) -> DVec3 {
        let longest_m = longest_m(self.arm);
        let near = self.targets.iter().filter(|t| {
            let way_m = t.target.point_m - base_m;
            let normal = t.target.normal.normalize_or_zero();
            way_m.length() <= longest_m && normal.dot(way_m) >= self.least_behind_m
        });
        near.map(|t| t.target.normal.normalize_or_zero() * t.weight)
            .sum()
    }

    fn seen_from(&self, place: Place) -> Result<FromBase, ArrivalError> {
        let rotation = DMat3::from_rotation_z(place.heading_rad);
        let room_from_base = Pose::new(rotation, place.base_m)?;
        let base_from_room = room_from_base.inverse();
        let turned = |v: DVec3| base_from_room.rotation() * v;
        let seen = |p: DVec3| turned(p) + base_from_room.position_m();
        let targets = self.targets.iter().map(|t| {
            let point_m = seen(t.target.point_m);
            let normal = turned(t.target.normal);
            let behind = normal.normalize_or_zero().dot(point_m) >= self.least_behind_m;
            WeightedTarget {
                // A target that the base must not serve is moved out of reach, so that it still counts.
                target: Target {
                    point_m: if behind { point_m } else { DVec3::Z * 1e3 },
                    normal,
                },
                ..*t
            }
        });
        let facets: Vec<WallFacet> = self
            .facets
            .iter()
            .map(|facet| WallFacet {
                point_m: seen(facet.point_m),
                normal: turned(facet.normal),
                heights: Interval::new(
                    facet.heights.lo_m - place.base_m.z,
                    facet.heights.hi_m - place.base_m.z,
                ),
                outline_m: facet.outline_m.iter().map(|&p| seen(p)).collect(),
            })
            .collect();
        let margin_m = self.config.waiting.clearance.margin_m;
        let surfaces = Surfaces::from_facets(&facets, margin_m)?;
        Ok(FromBase {
            room_from_base,
            targets: targets.collect(),
            surfaces: surfaces.within_reach_of(self.arm),
        })
    }

    /// Quick evaluation; `None` if nothing is within reach.
    fn judge(&self, place: Place, before: &[Judged]) -> Result<Option<Judged>, ArrivalError> {
        /// Number of starts per position.
        const STARTS: usize = 2;
        if !self.has_space_at(place.base_m) {
            return Ok(None);
        }
        let seen = self.seen_from(place)?;
        let waiting = &self.starting_from(postures_of_best(before));
        let quick = Quick::new(&self.task(&seen, waiting))?;
        match quick.descents(STARTS + waiting.start_from.len()) {
            Ok(ends) => {
                let best = ends.first().map(|(q, _)| Judged {
                    place,
                    share: quick.in_time_share(q),
                    q: *q,
                });
                Ok(best)
            }
            Err(ArrivalError::OutOfReach { .. }) => Ok(None),
            Err(error) => Err(error),
        }
    }

    /// The best of a position and its surroundings, with halved steps.
    fn refine(
        &self,
        from: Judged,
        spacing_m: f64,
        judged: &mut Vec<Judged>,
    ) -> Result<Judged, ArrivalError> {
        let mut best = from;
        let mut step = 0.5;
        while step > 0.2 {
            let turn_rad = step * 0.5;
            let moves = [
                (DVec3::X * spacing_m * step, 0.0),
                (DVec3::NEG_X * spacing_m * step, 0.0),
                (DVec3::Y * spacing_m * step, 0.0),
                (DVec3::NEG_Y * spacing_m * step, 0.0),
                (DVec3::ZERO, turn_rad),
                (DVec3::ZERO, -turn_rad),
            ];
            let centre = best.place;
            for (shift, turn) in moves {
                let place = Place {
                    base_m: centre.base_m + shift,
                    heading_rad: centre.heading_rad + turn,
                };
                if let Some(found) = self.judge(place, judged)? {
                    judged.push(found);
                    if found.share > best.share {
                        best = found;
                    }
                }
            }
            step *= 0.5;
        }
        Ok(best)
    }

    /// The settings of the waiting posture with additional initial postures.
    fn starting_from(&self, postures: Vec<JointPositions>) -> WaitingConfig {
        let mut waiting = self.config.waiting.clone();
        waiting.start_from.extend(postures);
        waiting
    }

    /// The task from a base; its parts were checked when the search began.
    fn task<'a>(&'a self, seen: &'a FromBase, config: &'a WaitingConfig) -> Task<'a> {
        Task {
            passage: Passage::new(self.arm, self.board, &seen.surfaces, config.clearance),
            targets: &seen.targets,
            limits: self.limits,
            config,
        }
    }

    fn judge_closely(&self, candidate: &Judged) -> Result<ArrivalPlacement, ArrivalError> {
        let place = candidate.place;
        let seen = self.seen_from(place)?;
        let waiting = &self.starting_from(vec![candidate.q]);
        let task = self.task(&seen, waiting);
        let arrivals = judged(&task, &found(&task)?)?;
        Ok(ArrivalPlacement {
            room_from_base: seen.room_from_base,
            heading_rad: place.heading_rad,
            in_time_share: arrivals.posture.in_time_share,
            arrivals,
        })
    }
}
