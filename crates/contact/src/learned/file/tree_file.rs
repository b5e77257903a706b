//! The correction by trees in the file of a model.

use super::length;
use crate::error::ContactError;
use crate::learned::regression::correction::Correction;
use crate::learned::regression::trees::{LEAF, Node, Trees};
use hwall_numeric::check::that;
use serde::{Deserialize, Serialize};

/// Trees: features (-1 for a leaf), next nodes and thresholds by node.
#[derive(Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct FileCorrection {
    squares_m2: Vec<f64>,
    roots: Vec<u32>,
    features: Vec<i64>,
    next: Vec<u32>,
    thresholds: Vec<f64>,
    values: Vec<[f64; 3]>,
}

impl FileCorrection {
    pub(super) fn of(correction: &Correction) -> Self {
        let Correction { trees, squares_m2 } = correction;
        let feature = |n: &Node| match n.feature {
            LEAF => -1,
            feature => i64::from(feature),
        };
        Self {
            squares_m2: squares_m2.clone(),
            roots: trees.roots.clone(),
            features: trees.nodes.iter().map(feature).collect(),
            next: trees.nodes.iter().map(|n| n.next).collect(),
            thresholds: trees.nodes.iter().map(|n| n.threshold).collect(),
            values: trees.values.clone(),
        }
    }

    /// Checks that every path from a root ends at a leaf with a value: nodes come after the one that refers to them.
    pub(super) fn validate(&self, regions: usize, width: usize) -> Result<(), ContactError> {
        let nodes = self.features.len();
        for (what, expected, got) in [
            ("squares of the correction", regions, self.squares_m2.len()),
            ("next nodes", nodes, self.next.len()),
            ("thresholds", nodes, self.thresholds.len()),
        ] {
            length(what, expected, got)?;
        }
        let within = |what, value: u32, below: usize| {
            that(
                (value as usize) < below,
                what,
                f64::from(value),
                "within its list",
            )
        };
        for root in &self.roots {
            within("root of a tree", *root, nodes)?;
        }
        for (k, (feature, next)) in self.features.iter().zip(&self.next).enumerate() {
            if *feature < 0 {
                within("value of a leaf", *next, self.values.len())?;
                continue;
            }
            let known = *feature < (width + Correction::ADDED) as i64;
            that(
                known,
                "feature of a tree",
                *feature as f64,
                "an existing feature",
            )?;
            within("node of a tree", *next, nodes.saturating_sub(1))?;
            that(
                *next as usize > k,
                "node of a tree",
                f64::from(*next),
                "after its parent",
            )?;
        }
        Ok(())
    }

    pub(super) fn into_correction(self) -> Correction {
        let nodes = self.features.iter().zip(&self.next).zip(&self.thresholds);
        let node = |((feature, next), threshold): ((&i64, &u32), &f64)| Node {
            feature: u32::try_from(*feature).unwrap_or(LEAF),
            next: *next,
            threshold: *threshold,
        };
        Correction {
            trees: Trees {
                nodes: nodes.map(node).collect(),
                roots: self.roots,
                values: self.values,
            },
            squares_m2: self.squares_m2,
        }
    }
}
