//! The exact reachability verdict: a witness, or the reason why there is none.

use crate::joints::JointPositions;
use crate::srs::branch::Branch;
use crate::srs::circle::{BaseSolution, CROSS_TOLERANCE, Direction, ElbowCircle, Triangle};
use crate::srs::model::SrsArm;
use crate::unreachable::Unreachable;
use glam::DVec3;
use hwall_geometry::Pose;

/// Whether a pose can be held, with proof either way.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Verdict {
    /// The witness holds the pose within all limits.
    Reachable(Witness),
    /// No configuration within the limits holds the pose.
    Unreachable(Unreachable),
}

impl Verdict {
    /// True if there is a witness.
    #[must_use]
    pub const fn is_reachable(&self) -> bool {
        matches!(self, Self::Reachable(_))
    }

    /// The witness, if there is one.
    #[must_use]
    pub const fn witness(&self) -> Option<&Witness> {
        match self {
            Self::Reachable(witness) => Some(witness),
            Self::Unreachable(_) => None,
        }
    }
}

/// A configuration that holds the pose.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Witness {
    /// Joint angles within all limits, rad.
    pub q: JointPositions,
    /// Branch of `q`.
    pub branch: Branch,
    /// Arm angle of `q`, rad.
    pub arm_angle_rad: f64,
}

/// A feasible arm angle found by the search.
pub(in crate::srs) struct Place {
    pub(in crate::srs) circle: ElbowCircle,
    psi: Direction,
    mask: u8,
}

impl SrsArm {
    /// Whether the arm can hold the tool at `base_from_tool` within its closed limits.
    ///
    /// Exact: a nonempty feasible set of arm angles contains a limit's root or is the whole circle, so
    /// testing every root decides it. Singular configurations, which no sample of the arm angle hits,
    /// are tested separately. A pose beyond a limit by less than about 1e-13 counts as reachable, and
    /// its witness is moved onto the limit (pose error below 1e-12 m and rad). Double precision fails
    /// if locked joints (limits of zero width, or reached exactly) confine the solution to a single
    /// arm angle, and in addition the elbow, shoulder or wrist is within about 1e-3 rad of straight.
    /// Rounding of the pose alone then moves joints past their limits. This affects 2 in 10,000 random
    /// sets of limits with many locked joints (tests/it/srs_hard_cases.rs); limits with nonzero width
    /// are not affected.
    ///
    /// Method: [Shimizu 2008], [Faria 2018]; notes in docs/NOTATION.md.
    #[must_use]
    pub fn verdict(&self, base_from_tool: &Pose) -> Verdict {
        let flange_pose = self.flange_pose(base_from_tool);
        match self.find_place(&flange_pose) {
            Ok(place) => {
                let base = BaseSolution::new(&place.circle, place.psi);
                let found = Branch::in_mask(place.mask).find_map(|branch| {
                    let q = base.on_branch(self.limits(), branch, &JointPositions::default())?;
                    Some(Witness {
                        q,
                        branch,
                        arm_angle_rad: place.psi.angle(),
                    })
                });
                match found {
                    Some(witness) => Verdict::Reachable(witness),
                    // The direction test passed within its tolerance, but the angles are outside the limits.
                    None => Verdict::Unreachable(Unreachable::ArmAngleConflict),
                }
            }
            Err(reason) => Verdict::Unreachable(reason),
        }
    }

    /// Whether [`verdict`](Self::verdict) finds a witness, without computing its joint angles.
    #[must_use]
    pub fn is_reachable(&self, base_from_tool: &Pose) -> bool {
        self.find_place(&self.flange_pose(base_from_tool)).is_ok()
    }

    #[inline]
    pub(in crate::srs) fn find_place(&self, flange_pose: &Pose) -> Result<Place, Unreachable> {
        let circle = self
            .elbow_circle(flange_pose)
            .map_err(|length| self.length_reason(length))?;
        let mut search = Search::new(self, &circle);
        match search.run() {
            Some((psi, mask)) => Ok(Place { circle, psi, mask }),
            None => {
                let reason = search.reason();
                self.singular_place(flange_pose, circle.elbow_mask)
                    .ok_or(reason)
            }
        }
    }

    /// The two singular configurations that exist only at a single arm angle, built from their
    /// exact elbow position: on the base axis (q2 = 0) and on the tool axis (q6 = 0).
    ///
    /// Near a straight elbow the triangle's angles are accurate only to 1e-8, too coarse to detect
    /// that the elbow is on an axis; the elbow's position is accurate to 1e-16.
    #[cold]
    fn singular_place(&self, flange_pose: &Pose, elbow_mask: u8) -> Option<Place> {
        let (a, b) = (self.distances.upper, self.distances.fore);
        let w = self.wrist_from_shoulder(flange_pose);
        let length = w.length();
        let n = flange_pose.rotation().z_axis;
        let on_base_axis = DVec3::Z * a;
        let on_tool_axis = w - n * b;
        [
            (on_base_axis, (w - on_base_axis).length() - b),
            (on_tool_axis, on_tool_axis.length() - a),
        ]
        .into_iter()
        .filter(|(_, misfit)| misfit.abs() <= self.distances.tolerance)
        .find_map(|(elbow, _)| {
            let beta = w.cross(elbow).length().atan2(w.dot(elbow));
            let forearm = w - elbow;
            let eta = w.cross(forearm).length().atan2(w.dot(forearm));
            let triangle = Triangle::from_angles(length, beta, eta);
            let circle = ElbowCircle::new(w, triangle, elbow_mask, &flange_pose.rotation());
            Search::new(self, &circle)
                .run()
                .map(|(psi, mask)| Place { circle, psi, mask })
        })
    }

    pub(in crate::srs) fn length_reason(&self, length: f64) -> Unreachable {
        let d = &self.distances;
        let gap = |side: [f64; 2]| (side[0] - length).max(length - side[1]);
        let elbow_gap_m = d.sides.map(gap).into_iter().fold(f64::INFINITY, f64::min);
        if length > d.longest() + d.tolerance {
            Unreachable::TooFar {
                gap_m: length - d.longest(),
            }
        } else if length >= d.shortest() - d.tolerance && elbow_gap_m > d.tolerance {
            Unreachable::ElbowLimit { gap_m: elbow_gap_m }
        } else {
            Unreachable::TooNear {
                gap_m: (d.shortest() - length).max(0.0),
            }
        }
    }
}

/// Tests arm angles one by one and records which limits could be satisfied.
struct Search<'a> {
    arm: &'a SrsArm,
    circle: &'a ElbowCircle,
    shoulder: u8,
    wrist: u8,
}

impl<'a> Search<'a> {
    const fn new(arm: &'a SrsArm, circle: &'a ElbowCircle) -> Self {
        Self {
            arm,
            circle,
            shoulder: 0,
            wrist: 0,
        }
    }

    /// Tests the extremes first: they decide most poses without a root.
    #[inline(always)]
    fn run(&mut self) -> Option<(Direction, u8)> {
        let (arm, circle) = (self.arm, self.circle);
        let mut found = circle.extremes().into_iter().find_map(|psi| self.test(psi));
        if found.is_some() {
            return found;
        }
        // In most unreachable poses joint 2 or 6 tilts too far at every arm angle: skip the roots.
        if arm.windows.tilting[0].is_beyond(circle.tilting[0].at(Direction::ZERO)) {
            self.shoulder = 0;
            return None;
        }
        if arm.windows.tilting[1].is_beyond(circle.tilting[1].at(circle.straightest_wrist)) {
            // The wrist alone rules out the pose; the shoulder was not tested.
            (self.shoulder, self.wrist) = (0xFF, 0);
            return None;
        }
        let mut visit = |psi| {
            if found.is_none() {
                found = self.test(psi);
            }
        };
        circle.limit_roots(&arm.windows, CROSS_TOLERANCE, &mut visit);
        circle.coupled_roots(arm.limits(), &mut visit);
        found
    }

    #[inline(always)]
    fn test(&mut self, psi: Direction) -> Option<(Direction, u8)> {
        let v = self.circle.verdicts(&self.arm.windows, psi);
        self.shoulder |= v.shoulder;
        self.wrist |= v.wrist;
        let mask = v.shoulder & v.wrist;
        if mask == 0 {
            return None;
        }
        let mask = if v.near_singular {
            self.circle
                .confirmed(&self.arm.windows, self.arm.limits(), psi, mask)
        } else {
            mask
        };
        (mask != 0).then_some((psi, mask))
    }

    fn reason(&self) -> Unreachable {
        if self.shoulder == 0 {
            Unreachable::ShoulderLimit
        } else if self.wrist == 0 {
            Unreachable::WristLimit
        } else {
            Unreachable::ArmAngleConflict
        }
    }
}
