//! Random numbers that depend on a seed and a number alone.

use rand::SeedableRng;
use rand_pcg::Pcg64;

/// The generator of subject, or study, `number`: the same whatever came before it.
pub(crate) fn generator(seed: u64, number: usize) -> Pcg64 {
    // An odd factor maps numbers one to one; seeding mixes the bits.
    let step = (number as u64).wrapping_mul(0x9e37_79b9_7f4a_7c15);
    Pcg64::seed_from_u64(seed.wrapping_add(step))
}
