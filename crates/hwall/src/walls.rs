//! The walls of a scene, as maps of where the arm can present its board.

use crate::error::SessionError;
use glam::DVec3;
use hwall_haptics::{Barrier, surface_axes};
use hwall_kinematics::{ArmKinematics, JointPositions, SrsArm};
use hwall_numeric::check::{all_finite, that};
use hwall_reachability::{Interval, WallFacet, WallMaps, WallMapsConfig};
use hwall_scene::Scene;

/// Maps of the vertical surfaces of a scene in the arm's base frame: only their planes and their heights, and only of
/// surfaces within the arm's length. The tool of the arm is the face of the board; any quarter turn of the board counts.
///
/// # Errors
/// As for [`WallMaps::build`].
pub fn maps_of(scene: &Scene, arm: &SrsArm) -> Result<WallMaps, SessionError> {
    let facets: Vec<WallFacet> = scene
        .vertical_facets()
        .into_iter()
        .map(|facet| WallFacet {
            point_m: facet.point_m,
            normal: facet.normal,
            heights: Interval::new(facet.lowest_m, facet.highest_m),
            outline_m: facet.outline_m,
        })
        .collect();
    Ok(WallMaps::build(arm, &facets, WallMapsConfig::default())?)
}

/// What is known of the walls of a scene beforehand, for one arm.
#[derive(Debug, Clone, Default)]
pub struct Walls {
    /// Where the arm can present them.
    pub maps: WallMaps,
    /// Where the arm waits while nothing is about to be touched, rad; `None`: where it is.
    pub waiting: Option<JointPositions>,
    /// TEMPORARY
    pub arm: Option<SrsArm>,
}

impl Walls {
    /// A configuration from which the arm presents a place well; `None` where none is known.
    pub(crate) fn near(&self, point_m: DVec3, normal: DVec3) -> Option<JointPositions> {
        let (arm, waiting) = (self.arm.as_ref()?, self.waiting?);
        let limits =
            hwall_haptics::MotionLimits::of_arm(arm, &hwall_haptics::MotionConfig::default())
                .ok()?;
        let mut best = None;
        let mut best_s = f64::INFINITY;
        for roll in hwall_haptics::QUARTER_TURNS_RAD {
            let pose = hwall_haptics::board_pose(point_m, normal, roll).ok()?;
            for i in 0..90 {
                let psi = -std::f64::consts::PI + std::f64::consts::TAU * i as f64 / 90.0;
                for q in arm.solutions(&pose, psi).into_iter().flatten() {
                    let t = limits.travel_time_s(&waiting, &q);
                    if t < best_s {
                        best_s = t;
                        best = Some(q);
                    }
                }
            }
        }
        best
    }

    pub(crate) fn validate(&self, arm: &dyn ArmKinematics) -> Result<(), SessionError> {
        let Some(q) = &self.waiting else {
            return Ok(());
        };
        all_finite("waiting", &q.0)?;
        for (q, limit) in q.0.iter().zip(arm.limits()) {
            let inside = limit.contains(*q);
            that(inside, "waiting", *q, "within the joint limits")?;
        }
        Ok(())
    }
}

impl From<WallMaps> for Walls {
    fn from(maps: WallMaps) -> Self {
        Self {
            maps,
            ..Self::default()
        }
    }
}

/// Surfaces whose plane passes the base at less than this are no barriers, m.
const LEAST_BARRIER_M: f64 = 0.3;

/// Surfaces that the board stays behind: the vertical ones of the scene, seen from the base of the arm.
pub(crate) fn barriers_of(scene: &Scene) -> Result<Vec<Barrier>, SessionError> {
    let mut barriers = Vec::new();
    for facet in scene.vertical_facets() {
        let distance_m = facet.normal.dot(facet.point_m);
        // A plane that passes close to the base has no side that is clearly the arm's.
        if distance_m.abs() < LEAST_BARRIER_M {
            continue;
        }
        let outwards = facet.normal * distance_m.signum();
        let [x, y] = surface_axes(outwards)?;
        let along = |axis: DVec3| {
            let at = facet.outline_m.iter().map(|corner| corner.dot(axis));
            let (least, most) = at.fold((f64::INFINITY, f64::NEG_INFINITY), |(a, b), s| {
                (a.min(s), b.max(s))
            });
            (0.5 * (least + most), 0.5 * (most - least))
        };
        let ((at_x, half_x), (at_y, half_y)) = (along(x), along(y));
        let middle_m = x * at_x + y * at_y + outwards * facet.point_m.dot(outwards);
        // A facet without extent cannot be met.
        if half_x > 0.0 && half_y > 0.0 {
            barriers.push(Barrier::new(middle_m, outwards, [half_x, half_y])?);
        }
    }
    Ok(barriers)
}
