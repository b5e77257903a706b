//! A hierarchy that halves the triangles, for meshes whose boxes overlap so much that the default builder takes
//! quadratic time (41 s for a polygon of 40,000 corners cut as a fan).

use obvhs::aabb::Aabb;
use obvhs::bvh2::Bvh2;
use obvhs::bvh2::node::Bvh2Node;

/// Boxes per neighbourhood. For this many boxes, quadratic time is a few milliseconds in the default builder.
const NEIGHBOURHOOD: usize = 2048;
/// Threshold of the mean area of a box over that of its neighbourhood. For triangles that tile a surface the ratio is
/// one over their number, for parallel slats a little more.
const OVERLAP: f32 = 0.02;

/// True if boxes somewhere overlap so much that pairing the nearest ones is slow.
pub(super) fn is_crowded(boxes: &[Aabb]) -> bool {
    if boxes.len() <= NEIGHBOURHOOD {
        return false;
    }
    let mut order: Vec<u32> = (0..boxes.len() as u32).collect();
    let mut open = vec![(0, order.len())];
    while let Some((first, end)) = open.pop() {
        let part = &mut order[first..end];
        if part.len() > NEIGHBOURHOOD {
            let middle = halve(boxes, part);
            open.push((first, first + middle));
            open.push((first + middle, end));
            continue;
        }
        let areas: f32 = part.iter().map(|&i| boxes[i as usize].half_area()).sum();
        if areas > OVERLAP * part.len() as f32 * union(boxes, part).half_area() {
            return true;
        }
    }
    false
}

/// Builds the hierarchy, one triangle per leaf.
pub(super) fn build(boxes: &[Aabb]) -> Bvh2 {
    let mut order: Vec<u32> = (0..boxes.len() as u32).collect();
    let mut nodes = vec![Bvh2Node::new(union(boxes, &order), 0, 0)];
    let mut open = vec![(0_usize, 0..order.len())];
    while let Some((node, range)) = open.pop() {
        if range.len() == 1 {
            nodes[node] = Bvh2Node::new(boxes[order[range.start] as usize], 1, range.start as u32);
            continue;
        }
        let middle = range.start + halve(boxes, &mut order[range.clone()]);
        let first = nodes.len();
        nodes[node].first_index = first as u32;
        for (child, half) in [range.start..middle, middle..range.end]
            .into_iter()
            .enumerate()
        {
            nodes.push(Bvh2Node::new(union(boxes, &order[half.clone()]), 0, 0));
            open.push((first + child, half));
        }
    }
    Bvh2 {
        nodes,
        primitive_indices: order,
        children_are_ordered_after_parents: true,
        ..Bvh2::default()
    }
}

/// Partitions at the median along the axis on which the middles differ most.
fn halve(boxes: &[Aabb], part: &mut [u32]) -> usize {
    let mut middles = Aabb::empty();
    for &i in part.iter() {
        middles.extend(boxes[i as usize].center());
    }
    let axis = middles.largest_axis();
    let half = part.len() / 2;
    let middle = |i: &u32| boxes[*i as usize].center()[axis];
    part.select_nth_unstable_by(half, |a, b| middle(a).total_cmp(&middle(b)).then(a.cmp(b)));
    half
}

fn union(boxes: &[Aabb], part: &[u32]) -> Aabb {
    part.iter()
        .fold(Aabb::empty(), |all, &i| all.union(&boxes[i as usize]))
}
