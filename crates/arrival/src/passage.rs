//! Clearance of straight joint motions from surfaces.

use crate::board::BoardExtent;
use crate::error::ArrivalError;
use crate::surfaces::Surfaces;
use glam::DVec3;
use hwall_kinematics::{ArmKinematics, JointPositions, MOST_JOINTS, SrsArm};
use hwall_numeric::check::non_negative;

/// Clearances of the board and the arm.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ClearanceConfig {
    /// Along the path the face may be in front of a surface by this much, m, in addition to its overhang at the end (near an outer corner of a room
    /// the board overhangs); default 0.002.
    pub tolerance_m: f64,
    /// Extension of each surface beyond its border, m; default 0.05.
    pub margin_m: f64,
    /// Distance of elbow and wrist behind surfaces, m; default 0.07, about the radius of the iiwa's links.
    pub link_radius_m: f64,
    /// Least distance of the board's corners and middle from the axes of the base column and the upper arm, m; default 0.12. Self-collision is not
    /// checked otherwise.
    pub own_body_m: f64,
}

impl Default for ClearanceConfig {
    fn default() -> Self {
        Self {
            tolerance_m: 0.002,
            margin_m: 0.05,
            link_radius_m: 0.07,
            own_body_m: 0.12,
        }
    }
}

impl ClearanceConfig {
    /// Rejects negative distances.
    ///
    /// # Errors
    /// The first that is negative, NaN or infinite.
    pub fn validate(&self) -> Result<(), ArrivalError> {
        non_negative("tolerance_m", self.tolerance_m)?;
        non_negative("margin_m", self.margin_m)?;
        non_negative("link_radius_m", self.link_radius_m)?;
        non_negative("own_body_m", self.own_body_m)?;
        Ok(())
    }
}

/// Extra time of a path that must be bent, per metre of clearance violation of the straight joint motion, s/m.
///
/// Source: 1,900 paths of `hwall`'s board from its waiting posture to the touches of 100 simulated people in the built-in room. Paths whose face
/// would come 4 to 6 cm in front of a surface took 0.04 to 0.10 s longer in the median, those with 10 to 13 cm 0.19 to 0.25 s, those with 16 to 20
/// cm 0.33 to 0.38 s; below 2 cm 0.01 s.
pub const BLOCKED_S_PER_M: f64 = 2.2;

/// Shares of a path at which it is checked in a search: few.
pub(crate) const COARSE: &[f64] = &[0.88, 0.7, 0.97, 0.4];
/// The same for a choice; denser towards the end, where the face approaches the surface.
pub(crate) const MEDIUM: &[f64] = &[0.87, 0.7, 0.58, 0.93, 0.97, 0.45, 0.8, 0.3, 0.15];

/// Inputs for checking paths.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Passage<'a> {
    pub(crate) arm: &'a dyn ArmKinematics,
    pub(crate) board: BoardExtent,
    pub(crate) surfaces: &'a Surfaces,
    pub(crate) clearance: ClearanceConfig,
}

/// Clearances of a configuration.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Standing {
    /// Distance of the face in front of a surface, m; negative behind.
    pub(crate) face_m: f64,
    /// The same for elbow and wrist with their radius, m.
    pub(crate) links_m: f64,
    /// Distance of the face from the arm's own column and upper arm, m.
    pub(crate) own_body_m: f64,
}

impl<'a> Passage<'a> {
    pub(crate) const fn new(
        arm: &'a dyn ArmKinematics,
        board: BoardExtent,
        surfaces: &'a Surfaces,
        clearance: ClearanceConfig,
    ) -> Self {
        Self {
            arm,
            board,
            surfaces,
            clearance,
        }
    }

    pub(crate) fn standing(&self, q: &JointPositions) -> Standing {
        match self.arm.closed_form() {
            Some(arm) => self.standing_of_srs(arm, q),
            None => self.standing_of_any(q),
        }
    }

    /// For links, all bends outside the base column count. For self-collision, the links before the forearm count, which is the last long link
    /// before the tool.
    fn standing_of_any(&self, q: &JointPositions) -> Standing {
        let body = self.arm.body_points(q);
        let points_m = body.points_m();
        let radius_m = self.clearance.link_radius_m;
        let before_tool = &points_m[..points_m.len().saturating_sub(1)];
        let is_long = |link: &[DVec3]| link[0].distance(link[1]) > 2.0 * radius_m;
        let forearm = before_tool.windows(2).rposition(is_long).unwrap_or(0);
        let mut standing = Standing {
            face_m: f64::NEG_INFINITY,
            links_m: f64::NEG_INFINITY,
            own_body_m: f64::INFINITY,
        };
        for point in self.board.points_m(body.base_from_tool()) {
            standing.face_m = standing.face_m.max(self.surfaces.intrusion_m(point));
            for link in points_m.windows(2).take(forearm) {
                let distance_m = segment_distance_m(point, link[0], link[1]);
                standing.own_body_m = standing.own_body_m.min(distance_m);
            }
        }
        let moves = |bend: &&DVec3| bend.truncate().length() > radius_m;
        for bend in before_tool.iter().filter(moves) {
            let off_m = self.surfaces.intrusion_m(*bend) + radius_m;
            standing.links_m = standing.links_m.max(off_m);
        }
        standing
    }

    fn standing_of_srs(&self, arm: &SrsArm, q: &JointPositions) -> Standing {
        let g = arm.geometry();
        let pose = arm.forward(q);
        let shoulder = DVec3::Z * g.d_bs_m;
        let ((s1, c1), (s2, c2)) = (q[0].sin_cos(), q[1].sin_cos());
        let elbow = shoulder + DVec3::new(c1 * s2, s1 * s2, c2) * g.d_se_m;
        let wrist = shoulder + arm.wrist_from_shoulder_m(&pose);
        let mut face_m = f64::NEG_INFINITY;
        let mut own_body_m = f64::INFINITY;
        for point in self.board.points_m(&pose) {
            face_m = face_m.max(self.surfaces.intrusion_m(point));
            own_body_m = own_body_m
                .min(segment_distance_m(point, DVec3::ZERO, shoulder))
                .min(segment_distance_m(point, shoulder, elbow));
        }
        let link = |middle_m| self.surfaces.intrusion_m(middle_m) + self.clearance.link_radius_m;
        Standing {
            face_m,
            links_m: link(elbow).max(link(wrist)),
            own_body_m,
        }
    }

    /// Clearance violation, m, if the face may be in front of surfaces by `allowed_m`.
    fn excess_of_m(&self, standing: Standing, allowed_m: f64) -> f64 {
        (standing.face_m - allowed_m)
            .max(standing.links_m)
            .max(self.clearance.own_body_m - standing.own_body_m)
    }

    /// How far the face may be in front of surfaces on a path with this end, m.
    fn allowed_m(&self, end: Standing) -> f64 {
        end.face_m.max(0.0) + self.clearance.tolerance_m
    }

    /// Largest clearance violation of a straight joint motion, m, at these shares of it and at its end; zero if it keeps all clearances.
    pub(crate) fn excess_m(
        &self,
        from: &JointPositions,
        to: &JointPositions,
        shares: impl IntoIterator<Item = f64>,
    ) -> f64 {
        self.excess_within_m(from, to, shares, f64::INFINITY)
            .unwrap_or(f64::INFINITY)
    }

    /// The same; `None` as soon as it exceeds `most_m`.
    pub(crate) fn excess_within_m(
        &self,
        from: &JointPositions,
        to: &JointPositions,
        shares: impl IntoIterator<Item = f64>,
        most_m: f64,
    ) -> Option<f64> {
        let end = self.standing(to);
        let allowed_m = self.allowed_m(end);
        let mut excess_m = self.excess_of_m(end, allowed_m).max(0.0);
        for share in shares {
            if excess_m > most_m {
                return None;
            }
            let standing = self.standing(&between(from, to, share));
            excess_m = excess_m.max(self.excess_of_m(standing, allowed_m));
        }
        (excess_m <= most_m).then_some(excess_m)
    }
}

/// The configuration at a share of the straight joint path.
pub(crate) fn between(from: &JointPositions, to: &JointPositions, share: f64) -> JointPositions {
    let mut q = *from;
    for joint in 0..MOST_JOINTS {
        q[joint] += share * (to[joint] - from[joint]);
    }
    q
}

fn segment_distance_m(point: DVec3, from: DVec3, to: DVec3) -> f64 {
    let way = to - from;
    let square = way.length_squared();
    let share = if square > 0.0 {
        ((point - from).dot(way) / square).clamp(0.0, 1.0)
    } else {
        0.0
    };
    point.distance(from + way * share)
}
