//! Layout of the weights by degree of freedom.

use super::group::{Group, Role};
use crate::basis::OrthonormalBasis;
use crate::error::BipError;
use hwall_numeric::check;
use std::ops::Range;

/// Groups with their bases, and the weights of each degree of freedom: all weights of degree of freedom 0 first.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct WeightLayout {
    groups: Vec<Group>,
    /// One for each group.
    bases: Vec<OrthonormalBasis>,
    dofs: Vec<Place>,
    weights: usize,
}

/// Location of one degree of freedom.
#[derive(Debug, Clone, Copy, PartialEq)]
struct Place {
    group: usize,
    first_weight: usize,
}

impl WeightLayout {
    /// Makes the bases of these groups orthonormal.
    pub(crate) fn new(groups: &[Group]) -> Result<Self, BipError> {
        let bases = groups
            .iter()
            .map(|g| OrthonormalBasis::new(g.basis))
            .collect::<Result<_, _>>()?;
        Self::from_bases(groups.to_vec(), bases)
    }

    /// With bases that are already orthonormal.
    pub(super) fn from_bases(
        groups: Vec<Group>,
        bases: Vec<OrthonormalBasis>,
    ) -> Result<Self, BipError> {
        let mut dofs = Vec::new();
        let mut weights = 0;
        for (group, (g, basis)) in groups.iter().zip(&bases).enumerate() {
            for _ in 0..g.dofs {
                dofs.push(Place {
                    group,
                    first_weight: weights,
                });
                weights += basis.size();
            }
        }
        check::that(!dofs.is_empty(), "degrees of freedom", 0.0, "at least 1")?;
        Ok(Self {
            groups,
            bases,
            dofs,
            weights,
        })
    }

    pub(crate) fn groups(&self) -> &[Group] {
        &self.groups
    }

    pub(crate) fn bases(&self) -> &[OrthonormalBasis] {
        &self.bases
    }

    /// Degrees of freedom of all groups.
    pub(crate) fn dofs(&self) -> usize {
        self.dofs.len()
    }

    /// Weights of all degrees of freedom.
    pub(crate) fn weights(&self) -> usize {
        self.weights
    }

    /// Group of a degree of freedom.
    pub(crate) fn group(&self, dof: usize) -> usize {
        self.dofs[dof].group
    }

    pub(crate) fn role(&self, dof: usize) -> Role {
        self.groups[self.group(dof)].role
    }

    pub(crate) fn basis(&self, dof: usize) -> &OrthonormalBasis {
        &self.bases[self.group(dof)]
    }

    /// Weights of a degree of freedom.
    #[inline]
    pub(crate) fn range(&self, dof: usize) -> Range<usize> {
        let Place {
            group,
            first_weight,
        } = self.dofs[dof];
        first_weight..first_weight + self.bases[group].size()
    }
}
