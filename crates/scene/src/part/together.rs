//! Many rays through one hierarchy.
//!
//! A single ray must finish each box before it can start the next, and branch prediction often fails on whether a node or a leaf
//! comes next. Here rays take turns: first all rays at a node, then all rays at a leaf. Their data is prefetched; for a single ray
//! this is impossible, because its next node is known only when it is needed. Each ray takes the same path as it would alone, so its
//! hit is bit-identical.

use super::block::LANES;
use super::machine::{self, Machine, Task, distance};
use super::node::{BoxRay, CHILDREN, is_leaf, leaf_of};
use super::rigid_part::{Part, PartHit, PartRay};
use super::watertight::WatertightRay;

/// Number of rays that take turns: enough to hide latency, few enough for their stacks to stay in the L1 cache.
const TURNS: usize = 32;

/// Fewer rays are cast faster one by one.
const WORTHWHILE: usize = TURNS;

/// Stack size of a ray; deeper trees are searched one ray at a time.
const STACK: usize = 120;

/// Sentinel at the bottom of a stack. No tree has this many leaves.
const END: u32 = u32::MAX;

impl Part {
    /// The nearest hits of many rays. `rays` returns each ray and its end; `found` is called for each hit.
    pub(crate) fn ray_casts(
        &self,
        count: usize,
        rays: impl Fn(usize) -> (PartRay, f64),
        mut found: impl FnMut(usize, PartHit),
    ) {
        if count >= WORTHWHILE && self.tree.stack() <= STACK {
            machine::run(Together {
                part: self,
                count,
                rays,
                found,
            });
            return;
        }
        for ray in 0..count {
            let (part_ray, max_m) = rays(ray);
            if let Some(hit) = self.ray_cast(&part_ray, max_m) {
                found(ray, hit);
            }
        }
    }
}

/// Casts many rays. `rays` returns each ray and its end; `found` is called for each hit.
pub(super) struct Together<'a, R, F> {
    pub(super) part: &'a Part,
    pub(super) count: usize,
    pub(super) rays: R,
    pub(super) found: F,
}

impl<R: Fn(usize) -> (PartRay, f64), F: FnMut(usize, PartHit)> Task for Together<'_, R, F> {
    type Output = ();

    #[inline(always)]
    fn run<M: Machine>(mut self, machine: M) {
        let tree = &self.part.tree;
        let mut travellers: [Traveller; TURNS] = std::array::from_fn(|_| Traveller::new());
        let mut next_ray = 0;
        let mut now = Places::default();
        for (place, traveller) in travellers.iter_mut().enumerate() {
            next_ray = self.begin(next_ray, traveller);
            now.nodes.push_if(traveller.at != END, place);
        }
        while now.nodes.len + now.leaves.len > 0 {
            // Prefetch all data of this turn while its first rays are processed.
            for place in now.nodes.iter() {
                machine.fetch(tree.node(travellers[place].at));
            }
            for place in now.leaves.iter() {
                let leaf = leaf_of(travellers[place].at);
                machine.fetch(&self.part.blocks[leaf]);
            }
            let mut then = Places::default();
            for place in now.nodes.iter() {
                let t = &mut travellers[place];
                let next = tree.open(machine, &t.boxes, t.at, t.max);
                // Copies all of them: a branch on their number would be mispredicted half of the time.
                t.keys[t.top..t.top + CHILDREN].copy_from_slice(&next.keys);
                t.children[t.top..t.top + CHILDREN].copy_from_slice(&next.children);
                t.top += next.count;
                t.go_on();
                then.sort_in(t.at, place);
            }
            for place in now.leaves.iter() {
                let t = &mut travellers[place];
                t.look(machine, self.part);
                t.go_on();
                then.sort_in(t.at, place);
            }
            for place in then.ends.iter() {
                let t = &mut travellers[place];
                if let Some(triangle) = t.best {
                    let hit = PartHit {
                        triangle,
                        point_m: t.exact.point_on(&self.part.face(triangle).corners_m),
                        distance_m: t.skipped_m + t.best_m,
                    };
                    (self.found)(t.ray, hit);
                }
                next_ray = self.begin(next_ray, t);
                then.nodes.push_if(t.at != END, place);
            }
            now = then;
        }
    }
}

impl<R: Fn(usize) -> (PartRay, f64), F> Together<'_, R, F> {
    /// Starts a traveller on the next ray that meets the box of the part; returns the index of the ray after it.
    #[inline(always)]
    fn begin(&self, mut ray: usize, traveller: &mut Traveller) -> usize {
        while ray < self.count {
            let (part_ray, max_m) = (self.rays)(ray);
            ray += 1;
            if let Some(clipped) = self.part.clip(&part_ray, max_m) {
                let best_m = max_m - clipped.skipped_m;
                traveller.ray = ray - 1;
                traveller.boxes =
                    BoxRay::new(clipped.start_m * self.part.per_unit, clipped.inverse);
                traveller.exact =
                    WatertightRay::new(clipped.start_m, part_ray.direction, clipped.inverse);
                traveller.skipped_m = clipped.skipped_m;
                traveller.best_m = best_m;
                traveller.max = self.part.bound(best_m);
                traveller.best = None;
                traveller.at = 0;
                traveller.top = 1;
                break;
            }
        }
        ray
    }
}

/// A ray in progress.
struct Traveller {
    /// Index of the ray.
    ray: usize,
    boxes: BoxRay,
    exact: WatertightRay,
    /// Distance from the origin of the ray to its entry into the box of the part, m.
    skipped_m: f64,
    /// Distance from there to the nearest hit so far, or to the end of the ray, m.
    best_m: f64,
    /// `best_m` as a bound for box distances.
    max: f32,
    /// The triangle of that hit.
    best: Option<usize>,
    /// Node or leaf.
    at: u32,
    /// Stack of pending children.
    keys: [u32; STACK],
    children: [u32; STACK],
    top: usize,
}

impl Traveller {
    /// A traveller without a ray.
    #[inline(always)]
    fn new() -> Self {
        Self {
            ray: 0,
            boxes: BoxRay::default(),
            exact: WatertightRay::default(),
            skipped_m: 0.0,
            best_m: 0.0,
            max: 0.0,
            best: None,
            at: END,
            keys: [0; STACK],
            children: [END; STACK],
            top: 1,
        }
    }

    /// Searches a leaf for a nearer hit.
    #[inline(always)]
    fn look<M: Machine>(&mut self, machine: M, part: &Part) {
        let leaf = leaf_of(self.at);
        let met = part.blocks.get(leaf).and_then(
            #[inline(always)]
            |block| {
                self.exact
                    .intersect_block(machine.simd(), block, -self.skipped_m, self.best_m)
            },
        );
        if let Some((lane, distance_m)) = met {
            self.best_m = distance_m;
            self.best = Some(LANES * leaf + lane);
            self.max = part.bound(distance_m);
        }
    }

    /// Moves to the nearest relevant child, or to the end if there is none, even if rounding puts the bound before the origin.
    #[inline(always)]
    fn go_on(&mut self) {
        loop {
            self.top -= 1;
            let child = self.children[self.top];
            if child == END || distance(self.keys[self.top]) <= self.max {
                self.at = child;
                return;
            }
        }
    }
}

/// Queues of travellers at nodes and at leaves.
#[derive(Default)]
struct Places {
    nodes: Queue,
    leaves: Queue,
    ends: Queue,
}

impl Places {
    #[inline(always)]
    fn sort_in(&mut self, at: u32, place: usize) {
        self.nodes.push_if(!is_leaf(at), place);
        self.leaves.push_if(is_leaf(at) & (at != END), place);
        self.ends.push_if(at == END, place);
    }
}

#[derive(Default)]
struct Queue {
    places: [u8; TURNS],
    len: usize,
}

impl Queue {
    /// Branch-free push. No traveller is in a queue twice, so the queue cannot overflow.
    #[inline(always)]
    fn push_if(&mut self, condition: bool, place: usize) {
        self.places[self.len % TURNS] = place as u8;
        self.len += usize::from(condition);
    }

    #[inline(always)]
    fn iter(&self) -> impl Iterator<Item = usize> + '_ {
        let places = self.places.iter().take(self.len);
        places.map(|&place| usize::from(place) % TURNS)
    }
}
