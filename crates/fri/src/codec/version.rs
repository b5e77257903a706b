//! The versions of the interface and their differences on the wire.

use std::fmt;

/// A version of the interface. Within a major version the messages differ only as listed here.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[non_exhaustive]
pub enum FriVersion {
    /// 1.x: the state holds the commanded joint positions, and no Cartesian pose.
    V1_15,
    /// 2.0 to 2.5: Cartesian pose and redundancy instead of commanded positions.
    V2_5,
    /// 2.7: as 2.5, with external forces, each datagram framed by a length and a checksum.
    V2_7,
}

impl FriVersion {
    /// All versions.
    pub const ALL: [Self; 3] = [Self::V1_15, Self::V2_5, Self::V2_7];

    /// Does a datagram consist of length, message and checksum?
    #[must_use]
    pub const fn is_framed(self) -> bool {
        matches!(self, Self::V2_7)
    }

    /// Does the state contain the commanded joint positions?
    #[must_use]
    pub const fn has_commanded_position(self) -> bool {
        matches!(self, Self::V1_15)
    }

    /// Are there Cartesian poses and redundancies?
    #[must_use]
    pub const fn has_cartesian_pose(self) -> bool {
        !matches!(self, Self::V1_15)
    }

    /// Does the state contain external forces?
    #[must_use]
    pub const fn has_external_force(self) -> bool {
        matches!(self, Self::V2_7)
    }
}

impl fmt::Display for FriVersion {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            Self::V1_15 => "1.15",
            Self::V2_5 => "2.5",
            Self::V2_7 => "2.7",
        })
    }
}
