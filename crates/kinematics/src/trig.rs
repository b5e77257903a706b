//! Sines, cosines and directions of all joints at once.
//!
//! Forward kinematics of a seven-joint arm spends most of its time in seven calls of the platform's `sin_cos`;
//! inverse kinematics, in seven calls of `atan2`. Computing them on eight lanes without branches lets the
//! compiler vectorise.

/// Angles up to this (rad) are reduced here, because the products of the reduction are then exact.
const LARGEST_RAD: f64 = 1e5;

/// π/2 in two parts: the first has 33 bits, so that its product with a 20-bit count is exact
/// [Cody 1980].
const HALF_PI_HIGH: f64 = 1.570_796_326_734_125_6;
const HALF_PI_LOW: f64 = 6.077_100_506_506_192e-11;

/// Adding and subtracting 1.5 · 2⁵² rounds to the nearest integer.
const ROUND: f64 = 6_755_399_441_055_744.0;

// Minimax coefficients on [-π/4, π/4] for sin x = x + x³ S(x²) and cos x = 1 - x²/2 + x⁴ C(x²),
// as published with the Freely Distributable LIBM (Sun Microsystems 1993): error below 2⁻⁵⁷.
const S: [f64; 6] = [
    -1.666_666_666_666_663_2e-1,
    8.333_333_333_322_49e-3,
    -1.984_126_982_985_795e-4,
    2.755_731_370_707_007e-6,
    -2.505_076_025_340_686_3e-8,
    1.589_690_995_211_55e-10,
];
const C: [f64; 6] = [
    4.166_666_666_666_66e-2,
    -1.388_888_888_887_411e-3,
    2.480_158_728_947_673e-5,
    -2.755_731_435_139_066_3e-7,
    2.087_572_321_298_175e-9,
    -1.135_964_755_778_819_5e-11,
];

/// Sines and cosines. Error: below 2.5e-16 absolute for angles up to 1e5 rad; for larger angles,
/// NaN and infinity it calls the platform's `sin_cos`.
#[inline]
pub(crate) fn sin_cos(angles: &[f64; 7]) -> [(f64, f64); 7] {
    if !angles.iter().all(|x| x.abs() <= LARGEST_RAD) {
        return angles.map(f64::sin_cos);
    }
    let mut x = [0.0; 8];
    x[..7].copy_from_slice(angles);
    let mut sin = [0.0; 8];
    let mut cos = [0.0; 8];
    for i in 0..8 {
        let shifted = x[i] * std::f64::consts::FRAC_2_PI + ROUND;
        let turns = shifted - ROUND;
        // The low bits of the shifted number are the count of quarter turns.
        let quarter = shifted.to_bits();
        let r = (x[i] - turns * HALF_PI_HIGH) - turns * HALF_PI_LOW;
        let z = r * r;
        let s = r + r * z * (S[0] + z * (S[1] + z * (S[2] + z * (S[3] + z * (S[4] + z * S[5])))));
        let tail = z * z * (C[0] + z * (C[1] + z * (C[2] + z * (C[3] + z * (C[4] + z * C[5])))));
        let half = 0.5 * z;
        let w = 1.0 - half;
        let c = w + ((1.0 - w - half) + tail);
        // An odd quarter swaps sine and cosine; a mask avoids branches.
        let swap = 0u64.wrapping_sub(quarter & 1);
        let (s, c) = (s.to_bits(), c.to_bits());
        let difference = (s ^ c) & swap;
        // Sine changes its sign in quarters 2 and 3, cosine in 1 and 2.
        let sine_sign = (quarter & 2) << 62;
        let cosine_sign = ((quarter.wrapping_add(1)) & 2) << 62;
        sin[i] = f64::from_bits((s ^ difference) ^ sine_sign);
        cos[i] = f64::from_bits((c ^ difference) ^ cosine_sign);
    }
    std::array::from_fn(|i| (sin[i], cos[i]))
}

// Coefficients for atan x = x - x³ A(x²) on [-7/16, 7/16], of the same library: error below 2⁻⁵⁷.
const A: [f64; 11] = [
    3.333_333_333_333_293e-1,
    -1.999_999_999_987_648_3e-1,
    1.428_571_427_250_346_6e-1,
    -1.111_111_040_546_235_6e-1,
    9.090_887_133_436_507e-2,
    -7.691_876_205_044_83e-2,
    6.661_073_137_387_531e-2,
    -5.833_570_133_790_573_5e-2,
    4.976_877_994_615_932_4e-2,
    -3.653_157_274_421_691_6e-2,
    1.628_582_011_536_578_2e-2,
];

/// Angles of the directions `(x, y)`, rad, in `[-π, π]`. Error: below 1e-15 for finite coordinates whose larger one is
/// from 1e-300 to 1e300; NaN where one is NaN, infinite or both are zero.
#[inline]
pub(crate) fn atan2<const N: usize>(y: &[f64; N], x: &[f64; N]) -> [f64; N] {
    use std::f64::consts::{FRAC_PI_2, FRAC_PI_4, PI};
    const SIGN: u64 = 1 << 63;
    // Masks avoid branches.
    let select = |yes: bool, a: f64, b: f64| {
        let mask = u64::from(yes).wrapping_neg();
        f64::from_bits((a.to_bits() & mask) | (b.to_bits() & !mask))
    };
    let mut angles = [0.0; N];
    for i in 0..N {
        let (across, along) = (y[i].abs(), x[i].abs());
        let steep = across > along;
        let (less, more) = (select(steep, along, across), select(steep, across, along));
        // Beyond 22.5 degrees the angle is measured from 45 degrees.
        let from_diagonal = less > 0.414_213_562_373_095 * more;
        let top = select(from_diagonal, less - more, less);
        let bottom = select(from_diagonal, less + more, more);
        let t = top / bottom;
        let z = t * t;
        // Even and odd terms separately, to shorten the chain of dependent products.
        let w = z * z;
        let even = A[0] + w * (A[2] + w * (A[4] + w * (A[6] + w * (A[8] + w * A[10]))));
        let odd = A[1] + w * (A[3] + w * (A[5] + w * (A[7] + w * A[9])));
        let tail = even + z * odd;
        let angle = (t - t * (z * tail)) + select(from_diagonal, FRAC_PI_4, 0.0);
        let angle = select(steep, FRAC_PI_2 - angle, angle);
        let angle = select(x[i] < 0.0, PI - angle, angle);
        angles[i] = f64::from_bits(angle.to_bits() | (y[i].to_bits() & SIGN));
    }
    angles
}

#[cfg(test)]
mod tests {
    use super::{atan2, sin_cos};
    use std::f64::consts::FRAC_PI_2;

    #[test]
    fn directions_agree_with_the_platform() {
        let mut angle = 0.1_f64;
        let mut worst = 0.0_f64;
        for i in 0..500_000 {
            angle = (angle * 1.618_033_988_749_895 + 0.1).rem_euclid(8.0);
            // Every other angle near an eighth of a turn, lengths over many powers of ten.
            let turn = if i % 2 == 0 {
                (angle * 4.0).round() * 0.5 * FRAC_PI_2 + angle * 1e-13
            } else {
                angle
            };
            let length = 10.0_f64.powi(i % 300 - 150);
            let (y, x) = (turn.sin() * length, turn.cos() * length);
            let found = atan2(
                &[y, x, -y, 1.0, 0.0, 0.0, -0.0, y],
                &[x, y, -x, 0.0, 1.0, -1.0, -1.0, 0.0],
            );
            let exact = [
                y.atan2(x),
                x.atan2(y),
                (-y).atan2(-x),
                FRAC_PI_2,
                0.0,
                2.0 * FRAC_PI_2,
                -2.0 * FRAC_PI_2,
                y.atan2(0.0),
            ];
            for (found, exact) in found.into_iter().zip(exact) {
                worst = worst.max((found - exact).abs());
            }
        }
        assert!(worst <= 1e-15, "{worst}");
    }

    #[test]
    fn no_direction_is_nan() {
        let strange = [
            f64::NAN,
            1.0,
            0.0,
            f64::INFINITY,
            f64::INFINITY,
            0.0,
            1.0,
            1.0,
        ];
        let other = [1.0, f64::NAN, 0.0, f64::INFINITY, 1.0, 1.0, 1.0, 1.0];
        for (i, angle) in atan2(&strange, &other).into_iter().enumerate() {
            assert_eq!(angle.is_nan(), i < 4, "{i}: {angle}");
        }
    }

    #[test]
    fn agrees_with_the_platform() {
        let mut x = 0.37_f64;
        let mut worst = 0.0_f64;
        for i in 0..1_000_000 {
            // A fixed walk over ±20, with every third angle near a quarter turn.
            x = (x * 1.618_033_988_749_895 + 0.1).rem_euclid(40.0);
            let angle = if i % 3 == 0 {
                ((x - 20.0) / FRAC_PI_2).round() * FRAC_PI_2 + x * 1e-9
            } else {
                x - 20.0
            };
            let angles = [angle, -angle, 0.0, 1e-300, angle * 1e3, -0.0, angle * 0.01];
            for (fast, angle) in sin_cos(&angles).into_iter().zip(angles) {
                let exact = angle.sin_cos();
                worst = worst
                    .max((fast.0 - exact.0).abs())
                    .max((fast.1 - exact.1).abs());
            }
        }
        assert!(worst <= 2.5e-16, "{worst}");
    }

    #[test]
    fn exact_at_zero_and_as_the_platform_beyond_the_range() {
        assert_eq!(sin_cos(&[0.0; 7])[0], (0.0, 1.0));
        assert_eq!(sin_cos(&[1e9; 7])[3], 1e9_f64.sin_cos());
        assert!(sin_cos(&[f64::NAN; 7])[0].0.is_nan());
        let mixed = sin_cos(&[0.0, f64::INFINITY, 0.0, 0.0, 0.0, 0.0, 0.0]);
        assert!(mixed[1].0.is_nan() && mixed[0].1 == 1.0);
    }
}
