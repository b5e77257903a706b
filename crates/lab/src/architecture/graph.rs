//! Crates, and who uses whom.

use std::collections::BTreeMap;

/// What a crate is for.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum CrateKind {
    /// A library that stands alone.
    Published,
    /// The library that composes the others.
    Product,
    /// Serves the project only.
    Unpublished,
    /// Unpublished, and used by tests and reports everywhere: drawn without arrows.
    TestKit,
}

/// A crate of the workspace.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct CrateNode {
    /// Its name without the prefix of the workspace.
    pub name: String,
    /// What it is, in a few words.
    pub about: String,
    /// What it is for.
    pub kind: CrateKind,
}

/// One crate uses another; both are indices.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub struct Use {
    /// Who uses.
    pub from: usize,
    /// What is used.
    pub to: usize,
    /// Only behind a feature.
    pub optional: bool,
}

/// All of them.
#[derive(Debug, Clone, PartialEq, Eq, Default)]
pub struct CrateGraph {
    /// The crates, by name.
    pub nodes: Vec<CrateNode>,
    /// In order.
    pub uses: Vec<Use>,
}

impl CrateGraph {
    /// The same without the arrows for which a longer way says the same: a way without options, unless the arrow is one.
    pub fn reduced(&self) -> Self {
        let says_more = |arrow: &&Use| {
            let others = self.uses.iter().filter(|other| {
                (other.from, other.to) != (arrow.from, arrow.to)
                    && (arrow.optional || !other.optional)
            });
            let mut after: BTreeMap<usize, Vec<usize>> = BTreeMap::new();
            for other in others {
                after.entry(other.from).or_default().push(other.to);
            }
            let (mut seen, mut open) = (vec![false; self.nodes.len()], vec![arrow.from]);
            while let Some(node) = open.pop() {
                for &next in after.get(&node).into_iter().flatten() {
                    if !std::mem::replace(&mut seen[next], true) {
                        open.push(next);
                    }
                }
            }
            !seen[arrow.to]
        };
        Self {
            nodes: self.nodes.clone(),
            uses: self.uses.iter().filter(says_more).copied().collect(),
        }
    }

    /// The layer of each crate, from 0 for those that use nothing: one above the highest that it uses. `None` for a circle.
    pub fn layers(&self) -> Option<Vec<usize>> {
        let count = self.nodes.len();
        let mut layers = vec![0; count];
        for _ in 0..=count {
            let mut settled = true;
            for arrow in &self.uses {
                let least = layers[arrow.to] + 1;
                settled &= layers[arrow.from] >= least;
                layers[arrow.from] = layers[arrow.from].max(least);
            }
            if settled {
                return Some(layers);
            }
        }
        None
    }
}
