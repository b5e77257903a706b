//! Random numbers that depend only on a seed and a number.

use rand::SeedableRng;
use rand_pcg::Pcg64;

/// The generator of subject or study `number`, independent of those before it.
pub(super) fn generator(seed: u64, number: usize) -> Pcg64 {
    // An odd factor maps numbers one to one; seeding mixes the bits.
    let step = (number as u64).wrapping_mul(0x9e37_79b9_7f4a_7c15);
    Pcg64::seed_from_u64(seed.wrapping_add(step))
}
