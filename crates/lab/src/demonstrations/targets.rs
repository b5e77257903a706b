//! Targets of simulated people: uniform over the reachable parts of panels, or in a box.

use anyhow::{Context, ensure};
use glam::DVec3;
use hwall_haptics::Board;
use hwall_kinematics::SrsArm;
use hwall_reachability::{ExactConfig, Interval, ReachabilityMap, Roll, WallGrid, WallLine};
use hwall_sim::{ReachPlan, TouchPlan};
use hwall_testkit::Sampler;

/// Spacing of the lines of a panel's map, m.
const SPACING_M: f64 = 0.025;
/// Largest number of draws for a reachable point near a reachable line.
const MOST_DRAWS: usize = 1000;

/// Targets, in the arm's base frame.
#[derive(Debug, Clone, PartialEq)]
pub enum Targets {
    /// Upright panels: uniform over the parts where the arm can present its board.
    Panels(Vec<Panel>),
    /// Uniform in a box, reachable or not.
    Box(TargetBox),
}

/// A box between two corners.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct TargetBox {
    /// Lowest corner, m.
    pub low_m: DVec3,
    /// Highest corner, m.
    pub high_m: DVec3,
    /// Normal of the surfaces touched, towards the person.
    pub normal: DVec3,
}

/// An upright rectangle.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Panel {
    /// Its middle, m.
    pub centre_m: DVec3,
    /// Horizontal normal, towards the person.
    pub normal: DVec3,
    /// Half its width, m.
    pub half_width_m: f64,
    /// Half its height, m.
    pub half_height_m: f64,
}

/// The set from which targets are drawn.
pub(super) enum Places {
    /// A map and the reachable stretches of its lines.
    Lines(Box<ReachabilityMap>, Vec<Stretch>),
    Box(TargetBox),
}

pub(super) struct Stretch {
    line: WallLine,
    span: Interval,
    /// The panel's heights, m.
    heights_m: [f64; 2],
    /// Length of all stretches up to the end of this one, m.
    until_m: f64,
}

impl Places {
    pub(super) fn new(targets: &Targets, board: &Board) -> anyhow::Result<Self> {
        match targets {
            Targets::Panels(panels) => Self::reachable(panels, board),
            Targets::Box(within) => {
                let (low_m, high_m) = (within.low_m, within.high_m);
                ensure!(
                    low_m.is_finite() && high_m.is_finite() && low_m.cmple(high_m).all(),
                    "the box from {low_m} to {high_m} m is empty or not finite"
                );
                Ok(Self::Box(*within))
            }
        }
    }

    fn reachable(panels: &[Panel], board: &Board) -> anyhow::Result<Self> {
        let arm = SrsArm::iiwa7().with_tool(board.flange_from_board_face()?);
        let walls: Vec<WallGrid> = panels.iter().map(wall).collect::<anyhow::Result<_>>()?;
        let config = ExactConfig {
            roll: Roll::quarter_turns(),
            ..ExactConfig::default()
        };
        let map = ReachabilityMap::build(&arm, &config, walls)?;
        let mut stretches = Vec::new();
        let mut until_m = 0.0;
        for index in map.lines() {
            let line = map.line(index).context("a line of the map")?;
            let panel = &panels[index.wall];
            let (middle_m, half_m) = (panel.centre_m.z, panel.half_height_m);
            for interval in map.intervals(index) {
                until_m += interval.span.length_m();
                stretches.push(Stretch {
                    line,
                    span: interval.span,
                    heights_m: [middle_m - half_m, middle_m + half_m],
                    until_m,
                });
            }
        }
        ensure!(until_m > 0.0, "the arm reaches none of the panels");
        Ok(Self::Lines(Box::new(map), stretches))
    }

    /// Reaches of one person; some of them start towards another target.
    pub(super) fn plans(
        &self,
        count: usize,
        changes_of_mind: f64,
        sampler: &mut Sampler,
    ) -> anyhow::Result<Vec<ReachPlan>> {
        let mut plans = Vec::with_capacity(count);
        for _ in 0..count {
            let (touch, other) = (self.draw(sampler)?, self.draw(sampler)?);
            let changes = sampler.uniform(0.0, 1.0) < changes_of_mind;
            plans.push(ReachPlan {
                touch,
                meant_first: changes.then_some(other),
            });
        }
        Ok(plans)
    }

    fn draw(&self, sampler: &mut Sampler) -> anyhow::Result<TouchPlan> {
        match self {
            Self::Box(within) => Ok(TouchPlan {
                target_m: sampler.point_in_box(within.low_m, within.high_m),
                normal: within.normal,
            }),
            Self::Lines(map, stretches) => {
                let found = (0..MOST_DRAWS).find_map(|_| near_a_line(map, stretches, sampler));
                found.context("found no reachable point beside the lines of the maps")
            }
        }
    }
}

/// A uniformly drawn point near the reachable stretches; `None` if it is not reachable.
fn near_a_line(
    map: &ReachabilityMap,
    stretches: &[Stretch],
    sampler: &mut Sampler,
) -> Option<TouchPlan> {
    let at_m = sampler.uniform(0.0, stretches.last()?.until_m);
    let stretch = stretches.get(stretches.partition_point(|s| s.until_m <= at_m))?;
    let s_m = sampler.uniform(stretch.span.lo_m, stretch.span.hi_m);
    let [low_m, high_m] = stretch.heights_m;
    let mut target_m = stretch.line.point_m(s_m);
    target_m.z += sampler.uniform(-0.5 * SPACING_M, 0.5 * SPACING_M);
    let normal = stretch.line.plane.normal();
    let inside = low_m <= target_m.z && target_m.z <= high_m;
    let reachable = inside && map.is_reachable(target_m, normal).unwrap_or(false);
    reachable.then_some(TouchPlan { target_m, normal })
}

fn wall(panel: &Panel) -> anyhow::Result<WallGrid> {
    let Panel {
        centre_m,
        normal,
        half_width_m,
        half_height_m,
    } = *panel;
    ensure!(
        half_width_m > 0.0 && half_height_m > 0.0,
        "a panel of {} by {} m",
        2.0 * half_width_m,
        2.0 * half_height_m
    );
    let heights = Interval::new(centre_m.z - half_height_m, centre_m.z + half_height_m);
    let aside_m = DVec3::Z.cross(normal).normalize_or_zero() * half_width_m;
    let wall = WallGrid::for_wall(centre_m, normal, heights, SPACING_M)?;
    Ok(wall.within([centre_m - aside_m, centre_m + aside_m])?)
}
