//! Builds an atlas.

use super::candidates::{self, Candidates, Pricing, Scratch};
use super::config::AtlasConfig;
use super::refine;
use super::sweep::{Grid, PairPrice};
use super::wall::{AtlasNode, AtlasWall};
use crate::board::BoardExtent;
use crate::error::ArrivalError;
use crate::length::longest_m;
use crate::passage::Passage;
use crate::presentation::{Holding, Presentation};
use crate::surfaces::Surfaces;
use glam::DVec3;
use hwall_kinematics::{ArmKinematics, JointPositions, SrsArm};
use hwall_motion::MotionLimits;
use hwall_numeric::check::all_finite;
use hwall_reachability::{
    Interval, LineIndex, ReachabilityMap, Steps, WallFacet, WallGrid, WallMaps, WallPlane,
    WallPoint,
};

/// More nodes are rejected before memory is allocated: a room has thousands.
pub(super) const MOST_NODES: u128 = 1 << 21;

/// The configuration for presenting each place of the walls, with its arrival time.
///
/// ```
/// use hwall_arrival::{Atlas, AtlasConfig, BoardExtent};
/// use hwall_arrival::glam::DVec3;
/// use hwall_arrival::kinematics::{JointPositions, SrsArm};
/// use hwall_arrival::motion::{MotionConfig, MotionLimits};
/// use hwall_arrival::reachability::{Interval, WallFacet, WallMaps, WallMapsConfig};
///
/// let wall = WallFacet {
///     point_m: DVec3::new(0.6, 0.0, 0.0),
///     normal: DVec3::X,
///     heights: Interval::new(0.2, 0.8),
///     outline_m: vec![DVec3::new(0.6, -0.4, 0.2), DVec3::new(0.6, 0.4, 0.8)],
/// };
/// let arm = SrsArm::iiwa7();
/// let limits = MotionLimits::of_arm(&arm, &MotionConfig::default())?;
/// let maps = WallMaps::build(&arm, &[wall], WallMapsConfig::default())?;
/// let waiting = JointPositions::from_deg([-6.0, 18.0, 0.0, -100.0, -13.0, -29.0, 101.0]);
/// let config = AtlasConfig { spacing_m: 0.1, ..AtlasConfig::default() };
/// let atlas = Atlas::build(&arm, &maps, BoardExtent::default(), &limits, &waiting, &config)?;
///
/// let point_m = DVec3::new(0.6, 0.1, 0.5);
/// let entry = atlas.look_up(point_m, DVec3::X).expect("within reach");
/// assert!(arm.forward(&entry.q).position_m().distance(point_m) < 0.02);
/// assert!(entry.arrival_s < 1.0);
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
#[derive(Debug, Clone, PartialEq)]
pub struct Atlas {
    /// `None` for an arm without a closed form.
    pub(super) arm: Option<SrsArm>,
    pub(super) limits: MotionLimits,
    pub(super) board: BoardExtent,
    pub(super) waiting: JointPositions,
    pub(super) rolls_rad: Vec<f64>,
    pub(super) walls: Vec<AtlasWall>,
    pub(super) off_m: f64,
    pub(super) least_cosine: f64,
    pub(super) tilt_rad: f64,
    pub(super) seam_rad: f64,
}

impl Atlas {
    /// Chooses a configuration for every node of the maps' walls, on the sides away from the base.
    ///
    /// The tool of `arm` is the face of the board. The price of a node is the least time from `waiting`, plus the prices of strain (limits,
    /// singular poses) and of paths that are not clear; neighbours pay for different configurations. Dynamic programming minimises the sum, row by
    /// row and column by column; then arm angles are refined. Deterministic to the last bit.
    ///
    /// # Errors
    /// A setting or limit outside its range, a waiting posture that is not finite or outside the limits, no walls in front of the arm, none within
    /// reach, too many nodes.
    pub fn build(
        arm: &SrsArm,
        maps: &WallMaps,
        board: BoardExtent,
        limits: &MotionLimits,
        waiting: &JointPositions,
        config: &AtlasConfig,
    ) -> Result<Self, ArrivalError> {
        config.validate()?;
        let map = maps.map().ok_or(ArrivalError::NoWalls)?;
        let surfaces = Surfaces::from_maps(maps, config.clearance.margin_m)?;
        let mut frames = Vec::new();
        let mut seen = 0;
        for (wall, grid) in map.walls().enumerate() {
            for plane in 0..grid.distances.count() {
                if config.both_sides || grid.distances.at(plane) >= 0.0 {
                    seen += 1;
                    frames.extend(Frame::of(map, wall, plane, grid, config.spacing_m)?);
                }
            }
        }
        if seen == 0 {
            return Err(ArrivalError::NoWalls);
        }
        let passage = Passage::new(arm, board, &surfaces, config.clearance);
        Self::of_frames(&frames, passage, limits, waiting, config)
    }

    /// The same for any arm, by numerical search, on the outer sides of facets in the base frame. A node without a solution is a hole.
    ///
    /// # Errors
    /// As [`build`](Self::build).
    pub fn search(
        arm: &dyn ArmKinematics,
        facets: &[WallFacet],
        board: BoardExtent,
        limits: &MotionLimits,
        waiting: &JointPositions,
        config: &AtlasConfig,
    ) -> Result<Self, ArrivalError> {
        config.validate()?;
        let surfaces = Surfaces::from_facets(facets, config.clearance.margin_m)?;
        let surfaces = surfaces.within_reach_of(arm);
        let longest_m = longest_m(arm);
        let mut frames = Vec::new();
        for facet in facets {
            frames.extend(Frame::of_facet(facet, longest_m, config.spacing_m)?);
        }
        if frames.is_empty() {
            return Err(ArrivalError::NoWalls);
        }
        let passage = Passage::new(arm, board, &surfaces, config.clearance);
        Self::of_frames(&frames, passage, limits, waiting, config)
    }

    fn of_frames(
        frames: &[Frame<'_>],
        passage: Passage<'_>,
        limits: &MotionLimits,
        waiting: &JointPositions,
        config: &AtlasConfig,
    ) -> Result<Self, ArrivalError> {
        let (arm, board) = (passage.arm, passage.board);
        board.validate()?;
        limits.validate()?;
        check_waiting(arm, waiting)?;
        let pricing = Pricing {
            passage,
            limits,
            waiting,
            config,
        };
        let holding = Holding::new(arm, &config.rolls_rad, config.arm_angle_step_rad);
        let places: u128 = frames.iter().map(|f| f.count() as u128).sum();
        if places > MOST_NODES {
            return Err(ArrivalError::TooMany {
                what: "nodes",
                count: places,
                limit: MOST_NODES,
            });
        }
        let walls: Vec<AtlasWall> = frames
            .iter()
            .map(|frame| frame.solve(&holding, &pricing))
            .filter(|wall| wall.nodes.iter().any(Option::is_some))
            .collect();
        if walls.is_empty() {
            return Err(ArrivalError::OutOfReach {
                places: places as usize,
            });
        }
        Ok(Self {
            arm: arm.closed_form().cloned(),
            limits: *limits,
            board,
            waiting: *waiting,
            rolls_rad: config.rolls_rad.clone(),
            walls,
            off_m: config.off_m,
            least_cosine: config.tilt_rad.cos(),
            tilt_rad: config.tilt_rad,
            seam_rad: config.seam_rad,
        })
    }

    /// The waiting posture, from which times are measured.
    #[must_use]
    pub const fn waiting(&self) -> &JointPositions {
        &self.waiting
    }

    /// The arm with its tool; `None` if it has no closed form.
    #[must_use]
    pub const fn arm(&self) -> Option<&SrsArm> {
        self.arm.as_ref()
    }

    /// The motion limits for its times.
    #[must_use]
    pub const fn limits(&self) -> &MotionLimits {
        &self.limits
    }

    /// The board face that is kept behind surfaces.
    #[must_use]
    pub const fn board(&self) -> BoardExtent {
        self.board
    }

    /// The walls with a place within reach.
    #[must_use]
    pub fn walls(&self) -> &[AtlasWall] {
        &self.walls
    }

    /// All nodes of all walls.
    pub fn nodes(&self) -> impl Iterator<Item = &AtlasNode> {
        self.walls
            .iter()
            .flat_map(|wall| wall.nodes.iter().flatten())
    }
}

/// Rejects a posture outside the limits.
pub(crate) fn check_waiting(
    arm: &dyn ArmKinematics,
    waiting: &JointPositions,
) -> Result<(), ArrivalError> {
    all_finite("waiting", &waiting.0)?;
    for (joint, (limit, &value_rad)) in arm.limits().iter().zip(&waiting.0).enumerate() {
        if !limit.contains(value_rad) {
            return Err(ArrivalError::WaitingOutsideLimits {
                joint,
                value_rad,
                min_rad: limit.min_rad,
                max_rad: limit.max_rad,
            });
        }
    }
    Ok(())
}

/// Rounding tolerance for nodes at the ends of an interval, m.
const END_M: f64 = 1e-9;

/// Grid of one plane: the part that contains reachable intervals.
struct Frame<'a> {
    plane: WallPlane,
    along: Steps,
    heights: Steps,
    /// Reachability from a map. `None`: no map, every node is tried.
    known: Option<Known<'a>>,
}

/// The map lines that correspond to the rows of a frame.
struct Known<'a> {
    map: &'a ReachabilityMap,
    wall: usize,
    plane: usize,
    heights: Vec<usize>,
}

impl Known<'_> {
    fn is_out_of_reach(&self, row: usize, s_m: f64) -> bool {
        let index = LineIndex {
            wall: self.wall,
            plane: self.plane,
            height: self.heights[row],
        };
        let mut reached = self.map.intervals(index).iter();
        !reached.any(|i| i.span.distance_m(s_m) <= END_M)
    }
}

impl<'a> Frame<'a> {
    /// `None` if no line of the plane is reachable anywhere.
    fn of(
        map: &'a ReachabilityMap,
        wall: usize,
        plane_index: usize,
        grid: &WallGrid,
        spacing_m: f64,
    ) -> Result<Option<Self>, ArrivalError> {
        let index = |height| LineIndex {
            wall,
            plane: plane_index,
            height,
        };
        let reached: Vec<usize> = (0..grid.heights.count())
            .filter(|&height| !map.intervals(index(height)).is_empty())
            .collect();
        let (Some(&low), Some(&high)) = (reached.first(), reached.last()) else {
            return Ok(None);
        };
        let stride = ((spacing_m / grid.heights.spacing_m() + 1e-9).floor() as usize).max(1);
        let lines: Vec<usize> = (low..=high).step_by(stride).collect();
        let first_m = grid.heights.at(low);
        let step_m = (grid.heights.at(low + 1) - first_m) * stride as f64;
        let heights = Steps::new(first_m, step_m, lines.len())?;
        let spans = reached
            .iter()
            .flat_map(|&height| map.intervals(index(height)));
        let (mut lo, mut hi) = (f64::INFINITY, f64::NEG_INFINITY);
        for interval in spans {
            lo = lo.min(interval.span.lo_m);
            hi = hi.max(interval.span.hi_m);
        }
        Ok(Some(Self {
            plane: grid.plane(plane_index)?,
            along: evenly(Interval::new(lo, hi), spacing_m)?,
            heights,
            known: Some(Known {
                map,
                wall,
                plane: plane_index,
                heights: lines,
            }),
        }))
    }

    /// The part of a facet within a distance of the base; `None` for a facet that is too far or faces the base.
    fn of_facet(
        facet: &WallFacet,
        longest_m: f64,
        spacing_m: f64,
    ) -> Result<Option<Self>, ArrivalError> {
        let plane = WallPlane::through(facet.point_m, facet.normal)?;
        let off_m = plane.distance_m();
        if off_m < 0.0 || off_m >= longest_m {
            return Ok(None);
        }
        let half_m = (longest_m * longest_m - off_m * off_m).sqrt();
        let within = |low: f64, high: f64| Interval::new(low.max(-half_m), high.min(half_m));
        let corners_m = || {
            facet
                .outline_m
                .iter()
                .map(|corner| plane.along().dot(*corner))
        };
        let along = within(
            corners_m().fold(f64::INFINITY, f64::min),
            corners_m().fold(f64::NEG_INFINITY, f64::max),
        );
        let heights = within(facet.heights.lo_m, facet.heights.hi_m);
        if along.length_m() < 0.0 || heights.length_m() < 0.0 {
            return Ok(None);
        }
        Ok(Some(Self {
            plane,
            along: evenly(along, spacing_m)?,
            heights: evenly(heights, spacing_m)?,
            known: None,
        }))
    }

    fn count(&self) -> usize {
        self.along.count() * self.heights.count()
    }

    fn solve(&self, holding: &Holding<'_>, pricing: &Pricing) -> AtlasWall {
        let (columns, rows) = (self.along.count(), self.heights.count());
        let mut scratch = Scratch::default();
        let mut ways: Vec<Vec<Presentation>> = Vec::with_capacity(self.count());
        let mut choices = Vec::with_capacity(self.count());
        let mut points_m: Vec<DVec3> = Vec::with_capacity(self.count());
        for row in 0..rows {
            for s_m in self.along.iter() {
                let at = WallPoint::new(s_m, self.heights.at(row));
                let point_m = self.plane.point_m(at);
                let known = self.known.as_ref();
                let found = match known.is_some_and(|known| known.is_out_of_reach(row, s_m)) {
                    true => Candidates::default(),
                    false => {
                        candidates::of_node(holding, pricing, &self.plane, point_m, &mut scratch)
                    }
                };
                points_m.push(point_m);
                ways.push(found.ways);
                choices.push(found.choices);
            }
        }
        let grid = Grid {
            columns,
            rows,
            choices: &choices,
            pair: PairPrice {
                seam_rad: pricing.config.seam_rad,
                seam_price_s: pricing.config.seam_price_s,
            },
        };
        let mut chosen = refine::chosen(&ways, &grid, &grid.choose());
        if let Some(presenter) = holding.exact() {
            refine::arm_angles(
                presenter,
                pricing,
                &grid,
                &self.plane,
                &points_m,
                &mut chosen,
            );
        }
        let nodes = chosen
            .iter()
            .map(|found| found.map(|(way, _)| finished(&way, holding, pricing)));
        AtlasWall {
            plane: self.plane,
            along: self.along,
            heights: self.heights,
            nodes: nodes.collect(),
            seam_rad: pricing.config.seam_rad,
        }
    }
}

/// The node of a configuration; checks its path closely.
fn finished(way: &Presentation, holding: &Holding<'_>, pricing: &Pricing) -> AtlasNode {
    /// Number of intervals at which the path is checked.
    const LOOKS: u32 = 40;
    let shares = (1..LOOKS).map(|i| f64::from(i) / f64::from(LOOKS));
    let excess_m = pricing.passage.excess_m(pricing.waiting, &way.q, shares);
    AtlasNode {
        q: way.q,
        roll_rad: holding.rolls_rad()[usize::from(way.roll)],
        arrival_s: pricing.limits.travel_time_s(pricing.waiting, &way.q),
        clear: excess_m == 0.0,
        excess_m,
        overhang_m: pricing.passage.standing(&way.q).face_m.max(0.0),
    }
}

/// Places from end to end, at most one spacing apart.
fn evenly(span: Interval, spacing_m: f64) -> Result<Steps, ArrivalError> {
    let length = span.length_m();
    let steps = (length / spacing_m - 1e-9).ceil().max(0.0);
    if steps >= MOST_NODES as f64 {
        return Err(ArrivalError::TooMany {
            what: "nodes",
            count: steps as u128,
            limit: MOST_NODES,
        });
    }
    if steps == 0.0 {
        return Ok(Steps::single(span.lo_m, 0.5 * spacing_m)?);
    }
    Ok(Steps::new(span.lo_m, length / steps, steps as usize + 1)?)
}
