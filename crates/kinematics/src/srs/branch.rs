//! The eight branches of the closed form.

use crate::joints::JointPositions;

/// The signs of joints 2, 4 and 6: at one arm angle each combination gives one configuration.
///
/// The order of [`Branch::ALL`] is the order of every array of eight in this crate.
/// Source: the global configuration parameters GC2, GC4, GC6 of [Faria 2018].
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct Branch {
    /// `q2 < 0`.
    pub shoulder_negative: bool,
    /// `q4 > 0`: the elbow bends the other way.
    pub elbow_positive: bool,
    /// `q6 < 0`.
    pub wrist_negative: bool,
}

impl Branch {
    /// All eight, by ascending `index()`.
    pub const ALL: [Self; 8] = {
        let mut all = [Self::from_index(0); 8];
        let mut i = 1;
        while i < 8 {
            all[i] = Self::from_index(i);
            i += 1;
        }
        all
    };

    // Branches that use a joint's direction as it is, and branches that use it rotated by half a turn.
    pub(super) const SHOULDER: [u8; 2] = [0x55, 0xAA];
    pub(super) const SHOULDER_ELBOW: [u8; 2] = [0x99, 0x66];
    pub(super) const ELBOW_WRIST: [u8; 2] = [0xC3, 0x3C];
    pub(super) const WRIST: [u8; 2] = [0x0F, 0xF0];
    pub(super) const TURNING: [[u8; 2]; 4] = [
        Self::SHOULDER,
        Self::SHOULDER_ELBOW,
        Self::ELBOW_WRIST,
        Self::WRIST,
    ];
    pub(super) const ELBOW: [u8; 2] = [0x33, 0xCC];

    /// Branch of a configuration. A shoulder or wrist at exactly zero counts as non-negative, an
    /// elbow at zero as non-positive.
    #[must_use]
    pub fn of(q: &JointPositions) -> Self {
        Self {
            shoulder_negative: q[1] < 0.0,
            elbow_positive: q[3] > 0.0,
            wrist_negative: q[5] < 0.0,
        }
    }

    /// Index in [`Branch::ALL`], 0 to 7.
    #[must_use]
    pub const fn index(self) -> usize {
        self.shoulder_negative as usize
            | (self.elbow_positive as usize) << 1
            | (self.wrist_negative as usize) << 2
    }

    const fn from_index(index: usize) -> Self {
        Self {
            shoulder_negative: index & 1 != 0,
            elbow_positive: index & 2 != 0,
            wrist_negative: index & 4 != 0,
        }
    }

    /// This branch alone, as a bit mask.
    pub(super) const fn bit(self) -> u8 {
        1 << self.index()
    }

    /// The branches in a bit mask.
    pub(super) fn in_mask(mask: u8) -> impl Iterator<Item = Self> {
        Self::ALL.into_iter().filter(move |b| mask & b.bit() != 0)
    }
}

/// A set of branches.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Default)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct BranchSet(u8);

impl BranchSet {
    /// The empty set.
    pub const EMPTY: Self = Self(0);

    /// From bits, branch `i` of [`Branch::ALL`] at bit `i`.
    #[must_use]
    pub const fn from_bits(bits: u8) -> Self {
        Self(bits)
    }

    /// The bits, branch `i` of [`Branch::ALL`] at bit `i`.
    #[must_use]
    pub const fn bits(self) -> u8 {
        self.0
    }

    /// True if the set is empty.
    #[must_use]
    pub const fn is_empty(self) -> bool {
        self.0 == 0
    }

    /// Number of branches.
    #[must_use]
    pub const fn len(self) -> usize {
        self.0.count_ones() as usize
    }

    /// True if the set contains the branch.
    #[must_use]
    pub const fn contains(self, branch: Branch) -> bool {
        self.0 & branch.bit() != 0
    }

    /// The branches in both sets.
    #[must_use]
    pub const fn intersection(self, other: Self) -> Self {
        Self(self.0 & other.0)
    }

    /// The branches in either set.
    #[must_use]
    pub const fn union(self, other: Self) -> Self {
        Self(self.0 | other.0)
    }

    /// The branches, by ascending `index()`.
    pub fn iter(self) -> impl Iterator<Item = Branch> {
        Branch::in_mask(self.0)
    }
}
