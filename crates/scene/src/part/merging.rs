//! Chooses which nodes of a binary hierarchy become nodes of eight children, to minimise the search cost.
//!
//! The probability that a ray hits a box is proportional to its area. The optimum is computed from the leaves up
//! [Ylitie 2017, section 3.1].

use super::node::CHILDREN;
use obvhs::bvh2::Bvh2;

pub(super) struct Merging<'a> {
    bvh: &'a Bvh2,
    /// For each binary node the expected cost of its subtree, if it may fill up to 1, 2, ... slots of its parent.
    prices: Vec<[f32; CHILDREN]>,
}

impl<'a> Merging<'a> {
    pub(super) fn new(bvh: &'a Bvh2) -> Self {
        let mut order = vec![0];
        let mut next = 0;
        while let Some(&index) = order.get(next) {
            let node = &bvh.nodes[index as usize];
            if !node.is_leaf() {
                order.extend([node.first_index, node.first_index + 1]);
            }
            next += 1;
        }
        let mut merging = Self {
            bvh,
            prices: vec![[0.0; CHILDREN]; bvh.nodes.len()],
        };
        // Children come after their parents.
        for index in order.into_iter().rev() {
            let node = &bvh.nodes[index as usize];
            // The cost of the leaves does not depend on the nodes above.
            if node.is_leaf() {
                continue;
            }
            let as_node = node.aabb().half_area() + merging.shared(index, CHILDREN).0;
            let mut prices = [as_node; CHILDREN];
            for places in 2..=CHILDREN {
                let shared = merging.shared(index, places).0;
                prices[places - 1] = prices[places - 2].min(shared);
            }
            merging.prices[index as usize] = prices;
        }
        merging
    }

    /// The minimum cost if the two halves of a node share `places` slots, and the number of slots that the first half fills.
    fn shared(&self, index: u32, places: usize) -> (f32, usize) {
        let first = self.bvh.nodes[index as usize].first_index as usize;
        let [a, b] = [&self.prices[first], &self.prices[first + 1]];
        let all = (1..places).map(|k| (a[k - 1] + b[places - k - 1], k));
        all.min_by(|a, b| a.0.total_cmp(&b.0))
            .unwrap_or((f32::INFINITY, 1))
    }

    /// The up to eight binary nodes that become the children of a node. A root without children is its own child.
    pub(super) fn children_of(&self, index: u32) -> [Option<u32>; CHILDREN] {
        let mut found = [None; CHILDREN];
        let mut count = 0;
        let mut open = vec![(index, CHILDREN, true)];
        while let Some((index, places, divide)) = open.pop() {
            let node = &self.bvh.nodes[index as usize];
            let prices = &self.prices[index as usize];
            if !node.is_leaf() && (divide || prices[places - 1] < prices[0]) {
                let k = self.shared(index, places).1;
                open.push((node.first_index + 1, places - k, false));
                open.push((node.first_index, k, false));
            } else {
                found[count] = Some(index);
                count += 1;
            }
        }
        found
    }
}
