//! The capsules that the supervisor uses.

use glam::DVec3;
use hwall::haptics::body::{BodyRegion, Capsule, PersonBody};
use hwall::kinematics::MOST_BODY_POINTS;

/// Most parts of arm, board and people: links between the points of the arm's body, three strips of the board, the parts of people.
pub const MOST_PARTS: usize = MOST_BODY_POINTS - 1 + 3 + PersonBody::MOST;

/// A part of the arm or of the person, base frame.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ViewPart {
    /// Its position.
    pub capsule: Capsule,
    /// Region of the person; `None` for a part of the arm or its board.
    pub region: Option<BodyRegion>,
}

impl ViewPart {
    /// Placeholder that decoding overwrites.
    pub(crate) const SPARE: Self = Self {
        capsule: Capsule {
            from_m: DVec3::ZERO,
            to_m: DVec3::ZERO,
            radius_m: 0.0,
        },
        region: None,
    };

    pub(crate) fn is_finite(&self) -> bool {
        let Capsule {
            from_m,
            to_m,
            radius_m,
        } = self.capsule;
        from_m.is_finite() && to_m.is_finite() && radius_m.is_finite()
    }
}
