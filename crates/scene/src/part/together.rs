//! Many rays through one hierarchy.
//!
//! A ray alone waits at every box for the one before it, and the processor often guesses wrong whether a node or a leaf
//! comes next. Here rays take turns: first all that stand at a node, then all that stand at a leaf. What they need is brought
//! into the nearest cache before, which a ray alone, that learns where it goes only on arrival, cannot ask for. Each goes the very
//! way that it would go alone, so its hit is the same to the last bit.

use super::block::LANES;
use super::machine::{self, Machine, Task, distance};
use super::node::{BoxRay, CHILDREN, is_leaf, leaf_of};
use super::rigid_part::{Part, PartHit, PartRay};
use super::watertight::WatertightRay;

/// Rays that take turns: enough to wait for none of them, few enough for their stacks to stay in the nearest cache.
const TURNS: usize = 32;

/// Fewer rays are faster one by one.
const WORTHWHILE: usize = TURNS;

/// Children that a ray can leave for later; deeper trees are searched by one ray after the other.
const STACK: usize = 120;

/// What lies below all children on a stack. No tree has so many leaves.
const END: u32 = u32::MAX;

impl Part {
    /// The nearest hits of many rays. `rays` tells each and where it ends, `found` is told of those that meet something.
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

/// Casts many rays. `rays` tells each and where it ends, `found` is told of those that meet something.
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
            // All that this turn looks at comes in while its first rays are served.
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
                // Always all: a branch on their number would be mispredicted half of the time.
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
    /// Sends a traveller along the next ray that meets the box of the part; returns which comes after it.
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

/// A ray under way.
struct Traveller {
    /// Which of the rays it is.
    ray: usize,
    boxes: BoxRay,
    exact: WatertightRay,
    /// From the origin of the ray to where it enters the box of the part, m.
    skipped_m: f64,
    /// From there to the nearest hit so far, or to the end of the ray, m.
    best_m: f64,
    /// The same for boxes.
    max: f32,
    /// The triangle of that hit.
    best: Option<usize>,
    /// Node or leaf.
    at: u32,
    /// What is left for later.
    keys: [u32; STACK],
    children: [u32; STACK],
    top: usize,
}

impl Traveller {
    /// At its end.
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

    /// Looks for a nearer hit in a leaf.
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

    /// To the nearest child that still matters, else to the end, also where rounding has put the bound before the origin.
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

/// Which travellers stand where.
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
    /// Without a branch. No traveller is in a queue twice, so what is beyond the last place is never pushed.
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
