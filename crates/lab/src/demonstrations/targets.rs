//! Targets of simulated people: uniform over the reachable parts of panels, or in a box.

use anyhow::{Context, ensure};
use glam::DVec3;
use hwall_haptics::Board;
use hwall_kinematics::SrsArm;
use hwall_reachability::{ExactConfig, Interval, ReachabilityMap, Roll, WallGrid, WallLine};
use hwall_sim::TouchPlan;
use hwall_testkit::Sampler;

/// Spacing of the lines of a panel's map, m.
const SPACING_M: f64 = 0.025;
/// Largest number of draws for a reachable point near a reachable line.
const MOST_DRAWS: usize = 1000;

/// Targets, in the arm's base frame.
#[derive(Debug, Clone, PartialEq)]
pub enum Targets {
    /// An upright panel: uniform over the parts where the arm can present its board.
    Panel(Panel),
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
    /// The heights of the panel, m, its map, and the reachable stretches of the lines.
    Lines([f64; 2], Box<ReachabilityMap>, Vec<Stretch>),
    Box(TargetBox),
}

pub(super) struct Stretch {
    line: WallLine,
    span: Interval,
    /// Length of all stretches up to the end of this one, m.
    until_m: f64,
}

impl Places {
    pub(super) fn new(targets: &Targets, board: &Board) -> anyhow::Result<Self> {
        match targets {
            Targets::Panel(panel) => Self::reachable(panel, board),
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

    fn reachable(panel: &Panel, board: &Board) -> anyhow::Result<Self> {
        let arm = SrsArm::iiwa7().with_tool(board.flange_from_board_face()?);
        let config = ExactConfig {
            roll: Roll::quarter_turns(),
            ..ExactConfig::default()
        };
        let map = ReachabilityMap::build(&arm, &config, vec![wall(panel)?])?;
        let mut stretches = Vec::new();
        let mut until_m = 0.0;
        for index in map.lines() {
            let line = map.line(index).context("a line of the map")?;
            for interval in map.intervals(index) {
                until_m += interval.span.length_m();
                stretches.push(Stretch {
                    line,
                    span: interval.span,
                    until_m,
                });
            }
        }
        ensure!(until_m > 0.0, "the arm does not reach the panel");
        let (middle_m, half_m) = (panel.centre_m.z, panel.half_height_m);
        let heights_m = [middle_m - half_m, middle_m + half_m];
        Ok(Self::Lines(heights_m, Box::new(map), stretches))
    }

    /// Touches of one person.
    pub(super) fn plans(
        &self,
        count: usize,
        sampler: &mut Sampler,
    ) -> anyhow::Result<Vec<TouchPlan>> {
        let touch = |_| {
            let touch = self.draw(sampler)?;
            // These draws once decided on changes of mind; without them, published numbers would change.
            self.draw(sampler)?;
            sampler.uniform(0.0, 1.0);
            Ok(touch)
        };
        (0..count).map(touch).collect()
    }

    fn draw(&self, sampler: &mut Sampler) -> anyhow::Result<TouchPlan> {
        match self {
            Self::Box(within) => Ok(TouchPlan {
                target_m: sampler.point_in_box(within.low_m, within.high_m),
                normal: within.normal,
            }),
            Self::Lines(heights_m, map, stretches) => {
                let near = |_| near_a_line(*heights_m, map, stretches, sampler);
                let found = (0..MOST_DRAWS).find_map(near);
                found.context("found no reachable point beside the lines of the map")
            }
        }
    }
}

/// A uniformly drawn point near the reachable stretches; `None` if it is not reachable.
fn near_a_line(
    [low_m, high_m]: [f64; 2],
    map: &ReachabilityMap,
    stretches: &[Stretch],
    sampler: &mut Sampler,
) -> Option<TouchPlan> {
    let at_m = sampler.uniform(0.0, stretches.last()?.until_m);
    let stretch = stretches.get(stretches.partition_point(|s| s.until_m <= at_m))?;
    let s_m = sampler.uniform(stretch.span.lo_m, stretch.span.hi_m);
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
