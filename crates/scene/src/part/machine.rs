//! Vectorised operations of a traversal on the eight boxes of a node. Every instruction set gives the same
//! numbers, so results do not depend on it.

use super::node::{BoxRay, CHILDREN, Node};
use pulp::Simd;

/// Sort keys of boxes by distance: the bits of a non-negative distance, with the lane in the lowest three. They sort as integers.
pub(super) type Keys = [u32; CHILDREN];

/// The key of an excluded box: above all others, and negative as a signed integer.
pub(super) const LEFT_OUT: u32 = u32::MAX;

const LANE_BITS: u32 = CHILDREN as u32 - 1;
/// Mask without the lane bits and the sign bit (of a negative zero).
const DISTANCE_BITS: u32 = !LANE_BITS & (u32::MAX >> 1);

/// Key of a box at a distance.
#[inline(always)]
pub(super) fn key(distance: f32, lane: usize) -> u32 {
    distance.to_bits() & DISTANCE_BITS | lane as u32
}

/// Lower bound of the distance of a box, too low by at most seven units in the last place, so that no relevant box is excluded.
#[inline(always)]
pub(super) fn distance(key: u32) -> f32 {
    f32::from_bits(key & DISTANCE_BITS)
}

/// The boxes of a node that a traversal visits.
pub(super) struct Next {
    pub(super) count: usize,
    /// The child whose box is nearest, if any.
    pub(super) nearest: u32,
    /// Farthest first, then excluded boxes.
    pub(super) keys: Keys,
    pub(super) children: [u32; CHILDREN],
}

/// A vector instruction set.
pub(super) trait Machine: Copy {
    /// Its vectors for arithmetic.
    type Simd: Simd;
    fn simd(self) -> Self::Simd;

    /// Keys of the boxes that a ray enters at a distance in `[0, max]`.
    fn along(self, ray: &BoxRay, node: &Node, max: f32) -> Keys;

    /// Keys of the boxes within a distance of a point, by the squared distance.
    fn near(self, p: &[f32; 3], node: &Node, max_squared: f32) -> Keys;

    /// Order in which to visit the boxes of these keys.
    fn next(self, keys: Keys, children: &[u32; CHILDREN]) -> Next;

    /// Prefetches data into the L1 cache without waiting.
    fn fetch<T>(self, soon: &T);
}

/// A task that runs on an instruction set.
pub(super) trait Task {
    type Output;
    fn run<M: Machine>(self, machine: M) -> Self::Output;
}

/// Runs a task with the widest vectors available.
#[inline(always)]
pub(super) fn run<T: Task>(task: T) -> T::Output {
    #[cfg(target_arch = "x86_64")]
    if let Some(machine) = pulp::x86::V3::try_new() {
        return machine.vectorize(x86::On { machine, task });
    }
    task.run(Portable)
}

/// Portable scalar code, which the compiler may vectorise.
#[derive(Debug, Clone, Copy)]
pub(super) struct Portable;

impl Machine for Portable {
    type Simd = pulp::Scalar;

    #[inline(always)]
    fn simd(self) -> Self::Simd {
        pulp::Scalar::new()
    }

    #[inline(always)]
    fn along(self, ray: &BoxRay, node: &Node, max: f32) -> Keys {
        let (mut enter, mut leave) = ([0.0; CHILDREN], [max; CHILDREN]);
        for axis in 0..3 {
            let (origin, inverse) = (ray.origin[axis], ray.inverse[axis]);
            let side = ray.entered[axis] & 1;
            let (near, far) = (&node.planes[side][axis], &node.planes[1 - side][axis]);
            for lane in 0..CHILDREN {
                enter[lane] = larger((near[lane] - origin) * inverse, enter[lane]);
                leave[lane] = smaller((far[lane] - origin) * inverse, leave[lane]);
            }
        }
        let mut keys = [LEFT_OUT; CHILDREN];
        for lane in 0..CHILDREN {
            if enter[lane] <= leave[lane] {
                keys[lane] = key(enter[lane], lane);
            }
        }
        keys
    }

    #[inline(always)]
    fn near(self, p: &[f32; 3], node: &Node, max_squared: f32) -> Keys {
        let mut squared = [0.0; CHILDREN];
        for (axis, p) in p.iter().enumerate() {
            let (low, high) = (&node.planes[0][axis], &node.planes[1][axis]);
            for lane in 0..CHILDREN {
                let outside = larger(larger(low[lane] - p, p - high[lane]), 0.0);
                squared[lane] += outside * outside;
            }
        }
        let mut keys = [LEFT_OUT; CHILDREN];
        for lane in 0..CHILDREN {
            if squared[lane] <= max_squared {
                keys[lane] = key(squared[lane], lane);
            }
        }
        keys
    }

    #[inline(always)]
    fn next(self, mut keys: Keys, children: &[u32; CHILDREN]) -> Next {
        keys.sort_unstable_by_key(|key| std::cmp::Reverse(*key as i32));
        let child = |key: u32| children[(key & LANE_BITS) as usize];
        let count = keys.iter().filter(|key| **key != LEFT_OUT).count();
        Next {
            count,
            nearest: child(keys[count.saturating_sub(1)]),
            keys,
            children: keys.map(child),
        }
    }

    /// Portable code cannot prefetch.
    #[inline(always)]
    fn fetch<T>(self, _: &T) {}
}

/// Same semantics as the vector instruction.
#[inline(always)]
fn larger(a: f32, b: f32) -> f32 {
    if a > b { a } else { b }
}

#[inline(always)]
fn smaller(a: f32, b: f32) -> f32 {
    if a < b { a } else { b }
}

#[cfg(target_arch = "x86_64")]
mod x86 {
    use super::{
        BoxRay, CHILDREN, DISTANCE_BITS, Keys, LANE_BITS, LEFT_OUT, Machine, Next, Node, Task,
    };
    use pulp::x86::V3;
    use pulp::{cast, f32x8, u32x8};

    pub(super) struct On<T> {
        pub(super) machine: V3,
        pub(super) task: T,
    }

    impl<T: Task> pulp::NullaryFnOnce for On<T> {
        type Output = T::Output;

        #[inline(always)]
        fn call(self) -> T::Output {
            self.task.run(self.machine)
        }
    }

    /// Bytes.
    const CACHE_LINE: usize = 64;
    const NEAREST_CACHE: i32 = std::arch::x86_64::_MM_HINT_T0;

    const LANES: Keys = [0, 1, 2, 3, 4, 5, 6, 7];

    #[inline(always)]
    fn keys(m: V3, distances: f32x8, within: pulp::m32x8) -> Keys {
        let bits = m.and_u32x8(cast(distances), m.splat_u32x8(DISTANCE_BITS));
        let keys = m.or_u32x8(bits, cast(LANES));
        cast(m.select_u32x8(within, keys, m.splat_u32x8(LEFT_OUT)))
    }

    /// Where a ray meets the nearer and the farther planes of an axis.
    #[inline(always)]
    fn slab(m: V3, ray: &BoxRay, node: &Node, axis: usize) -> (f32x8, f32x8) {
        let side = ray.entered[axis] & 1;
        let origin = m.splat_f32x8(ray.origin[axis]);
        let inverse = m.splat_f32x8(ray.inverse[axis]);
        let near = m.sub_f32x8(cast(node.planes[side][axis]), origin);
        let far = m.sub_f32x8(cast(node.planes[1 - side][axis]), origin);
        (m.mul_f32x8(near, inverse), m.mul_f32x8(far, inverse))
    }

    /// Squared distance of a point outside the boxes along an axis.
    #[inline(always)]
    fn outside_squared(m: V3, p: &[f32; 3], node: &Node, axis: usize) -> f32x8 {
        let p = m.splat_f32x8(p[axis]);
        let below = m.sub_f32x8(cast(node.planes[0][axis]), p);
        let above = m.sub_f32x8(p, cast(node.planes[1][axis]));
        let outside = m.max_f32x8(m.max_f32x8(below, above), m.splat_f32x8(0.0));
        m.mul_f32x8(outside, outside)
    }

    /// A stage of a sorting network: compares each lane with that of `$swapped`; `$second` marks the lanes that keep the lower one.
    macro_rules! stage {
        ($m:ident, $keys:ident, $swapped:expr, $second:literal) => {{
            let swapped = $swapped;
            let high = $m.avx2._mm256_max_epi32($keys, swapped);
            let low = $m.avx2._mm256_min_epi32($keys, swapped);
            $m.avx2._mm256_blend_epi32::<$second>(high, low)
        }};
    }

    impl Machine for V3 {
        type Simd = V3;

        #[inline(always)]
        fn simd(self) -> V3 {
            self
        }

        #[inline(always)]
        fn along(self, ray: &BoxRay, node: &Node, max: f32) -> Keys {
            let (x, y, z) = (
                slab(self, ray, node, 0),
                slab(self, ray, node, 1),
                slab(self, ray, node, 2),
            );
            let enter = self.max_f32x8(
                self.max_f32x8(x.0, y.0),
                self.max_f32x8(z.0, self.splat_f32x8(0.0)),
            );
            let leave = self.min_f32x8(
                self.min_f32x8(x.1, y.1),
                self.min_f32x8(z.1, self.splat_f32x8(max)),
            );
            keys(self, enter, self.cmp_le_f32x8(enter, leave))
        }

        #[inline(always)]
        fn near(self, p: &[f32; 3], node: &Node, max_squared: f32) -> Keys {
            let (x, y, z) = (
                outside_squared(self, p, node, 0),
                outside_squared(self, p, node, 1),
                outside_squared(self, p, node, 2),
            );
            let squared = self.add_f32x8(self.add_f32x8(x, y), z);
            let within = self.cmp_le_f32x8(squared, self.splat_f32x8(max_squared));
            keys(self, squared, within)
        }

        #[inline(always)]
        fn next(self, keys: Keys, children: &[u32; CHILDREN]) -> Next {
            let m = self;
            let keys: u32x8 = cast(keys);
            // Find the nearest before sorting, because the next node depends on it.
            let k = cast(keys);
            let low = m
                .avx2
                ._mm256_min_epu32(k, m.avx2._mm256_permute2x128_si256::<1>(k, k));
            let low = m
                .avx2
                ._mm256_min_epu32(low, m.avx2._mm256_shuffle_epi32::<0b01_00_11_10>(low));
            let low = m
                .avx2
                ._mm256_min_epu32(low, m.avx2._mm256_shuffle_epi32::<0b10_11_00_01>(low));
            let low: u32x8 = cast(low);
            let left_out = m.avx._mm256_movemask_ps(cast(keys)) as u32;
            // Batcher's network.
            let crossed: Keys = [0, 1, 4, 5, 2, 3, 6, 7];
            let paired: Keys = [0, 2, 1, 4, 3, 6, 5, 7];
            let k = stage!(
                m,
                k,
                m.avx2._mm256_shuffle_epi32::<0b10_11_00_01>(k),
                0b1010_1010
            );
            let k = stage!(
                m,
                k,
                m.avx2._mm256_shuffle_epi32::<0b01_00_11_10>(k),
                0b1100_1100
            );
            let k = stage!(
                m,
                k,
                m.avx2._mm256_shuffle_epi32::<0b11_01_10_00>(k),
                0b0100_0100
            );
            let k = stage!(
                m,
                k,
                m.avx2._mm256_permute2x128_si256::<1>(k, k),
                0b1111_0000
            );
            let k = stage!(
                m,
                k,
                m.avx2._mm256_permutevar8x32_epi32(k, cast(crossed)),
                0b0011_0000
            );
            let k = stage!(
                m,
                k,
                m.avx2._mm256_permutevar8x32_epi32(k, cast(paired)),
                0b0101_0100
            );
            Next {
                count: CHILDREN - left_out.count_ones() as usize,
                nearest: children[(low.0 & LANE_BITS) as usize],
                keys: cast(k),
                // The lowest three bits of a key are the lane, and the instruction ignores the others.
                children: cast(m.avx2._mm256_permutevar8x32_epi32(cast(*children), k)),
            }
        }

        #[inline(always)]
        fn fetch<T>(self, soon: &T) {
            let first = std::ptr::from_ref(soon).cast::<i8>();
            for line in 0..size_of::<T>().div_ceil(CACHE_LINE) {
                let at = first.wrapping_add(CACHE_LINE * line);
                self.sse._mm_prefetch::<NEAREST_CACHE>(at);
            }
        }
    }
}

#[cfg(all(test, target_arch = "x86_64"))]
mod tests {
    use super::*;
    use glam::DVec3;
    use hwall_testkit::Sampler;

    /// Keys, their order and the nearest child.
    #[test]
    fn every_machine_orders_alike() {
        let Some(vectors) = pulp::x86::V3::try_new() else {
            return;
        };
        let mut sampler = Sampler::new(5);
        let (mut met, mut near) = (0, 0);
        for _ in 0..20_000 {
            let mut node = Node::EMPTY;
            let children: [u32; CHILDREN] = std::array::from_fn(|lane| 100 + lane as u32);
            for lane in 0..sampler.index(CHILDREN + 1) {
                let middle = sampler.point_in_box(DVec3::splat(-1.0), DVec3::ONE);
                let half = sampler.uniform(0.0, 0.5);
                for axis in 0..3 {
                    node.planes[0][axis][lane] = (middle[axis] - half) as f32;
                    node.planes[1][axis][lane] = (middle[axis] + half) as f32;
                }
            }
            let origin = sampler.point_in_box(DVec3::splat(-1.0), DVec3::ONE);
            let ray = BoxRay::new(origin, sampler.unit_vector().recip());
            let max = sampler.uniform(0.0, 3.0) as f32;
            let along = Portable.along(&ray, &node, max);
            assert_eq!(along, vectors.along(&ray, &node, max));
            let p = origin.as_vec3().to_array();
            let around = Portable.near(&p, &node, max);
            assert_eq!(around, vectors.near(&p, &node, max));
            for keys in [along, around] {
                let (a, b) = (
                    Portable.next(keys, &children),
                    vectors.next(keys, &children),
                );
                let count = keys.iter().filter(|key| **key != LEFT_OUT).count();
                assert_eq!((a.count, b.count), (count, count));
                assert_eq!(a.keys, b.keys);
                assert!(a.keys[..count].is_sorted_by(|x, y| x > y));
                assert_eq!(a.children[..count], b.children[..count]);
                if count > 0 {
                    assert_eq!(a.nearest, b.nearest);
                    assert_eq!(a.nearest, a.children[count - 1]);
                }
            }
            met += along.iter().filter(|key| **key != LEFT_OUT).count();
            near += around.iter().filter(|key| **key != LEFT_OUT).count();
        }
        assert!(met > 4_000 && near > 40_000, "{met}, {near}");
    }
}
