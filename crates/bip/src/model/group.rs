//! Degrees of freedom that belong together.

use crate::basis::Basis;

/// Role of the degrees of freedom of a group.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[cfg_attr(feature = "serde", serde(rename_all = "snake_case"))]
pub enum Role {
    /// Measured while filtering, e.g. a hand.
    Observed,
    /// Inferred while filtering, e.g. the arm that responds to the hand.
    Controlled,
    /// Measured in some frames, inferred in others.
    Either,
}

/// Neighbouring degrees of freedom that share a basis and a role.
#[derive(Debug, Clone, PartialEq)]
pub struct Group {
    /// Name for reports.
    pub name: String,
    /// Number of degrees of freedom; those of the next group follow.
    pub dofs: usize,
    /// Basis of each of them.
    pub basis: Basis,
    /// Their role.
    pub role: Role,
}

impl Group {
    /// A group that is measured while filtering.
    #[must_use]
    pub fn observed(name: &str, dofs: usize, basis: Basis) -> Self {
        Self {
            name: name.to_owned(),
            dofs,
            basis,
            role: Role::Observed,
        }
    }

    /// A group that is inferred while filtering.
    #[must_use]
    pub fn controlled(name: &str, dofs: usize, basis: Basis) -> Self {
        Self {
            role: Role::Controlled,
            ..Self::observed(name, dofs, basis)
        }
    }
}
