//! Joint arrays of a seven-joint arm, one type per quantity, and joint limits.

use crate::error::KinematicsError;
use hwall_numeric::ArgumentError;
use hwall_numeric::check::{all_finite, that};
use std::f64::consts::{PI, TAU};

/// Largest finite limit of a joint, rad or m. Some descriptions write 1e16 for no limit; its square stays finite.
pub(crate) const MOST_LIMIT: f64 = 1e100;
/// Largest value of an arm parameter in its unit (length, mass, velocity). Squares and products stay finite.
pub(crate) const MOST: f64 = 1e9;

/// Maximum number of joints of an arm: the length of every joint array.
pub const MOST_JOINTS: usize = 7;

macro_rules! joint_array {
    ($(#[$doc:meta])* $name:ident) => {
        $(#[$doc])*
        #[derive(Debug, Clone, Copy, PartialEq, Default)]
        #[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
        pub struct $name(pub [f64; 7]);

        impl $name {
            /// From a slice, which must hold seven finite numbers.
            ///
            /// # Errors
            /// Another length, NaN or infinity.
            pub fn from_slice(values: &[f64]) -> Result<Self, KinematicsError> {
                let array: [f64; 7] = values.try_into().map_err(|_| KinematicsError::WrongJointCount {
                    what: stringify!($name),
                    expected: 7,
                    got: values.len(),
                })?;
                all_finite(stringify!($name), values)?;
                Ok(Self(array))
            }
        }

        impl From<[f64; 7]> for $name {
            fn from(values: [f64; 7]) -> Self {
                Self(values)
            }
        }

        impl AsRef<[f64]> for $name {
            fn as_ref(&self) -> &[f64] {
                &self.0
            }
        }

        impl std::ops::Index<usize> for $name {
            type Output = f64;
            fn index(&self, joint: usize) -> &f64 {
                &self.0[joint]
            }
        }

        impl std::ops::IndexMut<usize> for $name {
            fn index_mut(&mut self, joint: usize) -> &mut f64 {
                &mut self.0[joint]
            }
        }
    };
}

joint_array!(
    /// Joint angles, rad, joint 1 at the base first.
    JointPositions
);
joint_array!(
    /// Joint velocities, rad/s.
    JointVelocities
);
joint_array!(
    /// Joint torques, N m.
    JointTorques
);

impl JointPositions {
    /// From angles in degrees.
    #[must_use]
    pub fn from_deg(degrees: [f64; 7]) -> Self {
        Self(degrees.map(f64::to_radians))
    }

    /// Sample `number` of a set of configurations spread evenly within the limits: within one turn about the middle for an unlimited
    /// joint, 0 for a joint that does not exist.
    ///
    /// Source: Halton sequence, one prime base per joint.
    #[must_use]
    pub fn spread(limits: &[JointLimit; MOST_JOINTS], number: u32) -> Self {
        const PRIMES: [u32; MOST_JOINTS] = [2, 3, 5, 7, 11, 13, 17];
        Self(std::array::from_fn(|joint| {
            let share = radical_inverse(number.saturating_add(1), PRIMES[joint]);
            let (limit, middle) = (limits[joint], limits[joint].middle_rad());
            let min = limit.min_rad.max(middle - PI);
            min + share * (limit.max_rad.min(middle + PI) - min)
        }))
    }

    /// Largest joint difference to another configuration, rad.
    #[must_use]
    pub fn max_abs_difference(&self, other: &Self) -> f64 {
        let pairs = self.0.iter().zip(other.0);
        pairs.fold(0.0, |m: f64, (a, b)| m.max((a - b).abs()))
    }
}

/// Closed interval of a joint, rad.
#[derive(Debug, Clone, Copy, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[cfg_attr(feature = "serde", serde(from = "RawLimit", into = "RawLimit"))]
pub struct JointLimit {
    /// Lower end, rad.
    pub min_rad: f64,
    /// Upper end, rad.
    pub max_rad: f64,
}

impl JointLimit {
    /// From the smallest to the largest angle, rad.
    #[must_use]
    pub const fn new(min_rad: f64, max_rad: f64) -> Self {
        Self { min_rad, max_rad }
    }

    /// No limit at all.
    pub const FREE: Self = Self::new(f64::NEG_INFINITY, f64::INFINITY);

    /// `[-half_range, +half_range]`, from degrees.
    #[must_use]
    pub fn symmetric_deg(half_range: f64) -> Self {
        let h = half_range.to_radians();
        Self::new(-h, h)
    }

    /// Is the angle inside, both ends included? NaN is not.
    #[must_use]
    pub fn contains(&self, angle_rad: f64) -> bool {
        self.min_rad <= angle_rad && angle_rad <= self.max_rad
    }

    /// Distance to the nearer end, rad; negative outside.
    #[must_use]
    pub fn distance_rad(&self, angle_rad: f64) -> f64 {
        (angle_rad - self.min_rad).min(self.max_rad - angle_rad)
    }

    /// Default start of a search, rad: the middle; for a range wider than 1000 rad (no limit, one limit, or
    /// values that mean "none") the value in it nearest to zero.
    #[must_use]
    pub fn middle_rad(&self) -> f64 {
        if self.max_rad - self.min_rad <= 1e3 {
            0.5 * self.min_rad + 0.5 * self.max_rad
        } else {
            0_f64.max(self.min_rad).min(self.max_rad)
        }
    }

    /// Both ends moved inwards (outwards for a negative amount), rad.
    #[must_use]
    pub fn shrunk(&self, by_rad: f64) -> Self {
        Self::new(self.min_rad + by_rad, self.max_rad - by_rad)
    }

    /// The angle plus full turns within the limit that is nearest to the reference; if none is
    /// within, the one nearest to the limit.
    #[must_use]
    pub fn nearest_turn(&self, angle: f64, reference: f64) -> f64 {
        if self.max_rad - self.min_rad < TAU {
            // At most one candidate fits; otherwise take the one closest to the limit.
            return nearest_turn(angle, self.middle_rad());
        }
        let mut best = nearest_turn(angle, reference);
        if best < self.min_rad {
            best += TAU * ((self.min_rad - best) / TAU).ceil();
        } else if best > self.max_rad {
            best -= TAU * ((best - self.max_rad) / TAU).ceil();
        }
        best
    }

    /// Rejects NaN, reversed ends and finite ends beyond 1e100; infinite ends mean "no limit".
    pub(crate) fn validate(&self, index: usize) -> Result<(), KinematicsError> {
        if self.min_rad.is_nan() || self.max_rad.is_nan() {
            return Err(ArgumentError::NonFinite {
                what: "joint limits",
                index: Some(index),
                value: f64::NAN,
            }
            .into());
        }
        for (what, value) in [
            ("lower joint limit", self.min_rad),
            ("upper joint limit", self.max_rad),
        ] {
            // NaN was rejected above.
            let usable = value.is_infinite() || value.abs() <= MOST_LIMIT;
            that(usable, what, value, "within 1e100 of zero, or infinite")?;
        }
        if self.min_rad > self.max_rad {
            return Err(KinematicsError::LimitsReversed {
                index,
                min_rad: self.min_rad,
                max_rad: self.max_rad,
            });
        }
        Ok(())
    }
}

/// Radical inverse: the digits of a number mirrored at the radix point, in [0, 1).
fn radical_inverse(mut number: u32, base: u32) -> f64 {
    let (mut value, mut digit) = (0.0, 1.0);
    while number > 0 {
        digit /= f64::from(base);
        value += digit * f64::from(number % base);
        number /= base;
    }
    value
}

/// The angle plus full turns that is nearest to `to`.
pub(crate) fn nearest_turn(angle: f64, to: f64) -> f64 {
    let d = angle - to;
    if d.abs() > PI {
        angle - TAU * (d / TAU).round()
    } else {
        angle
    }
}

/// In files an unlimited end is absent: JSON has no infinity.
#[cfg(feature = "serde")]
#[derive(serde::Serialize, serde::Deserialize)]
struct RawLimit {
    min_rad: Option<f64>,
    max_rad: Option<f64>,
}

#[cfg(feature = "serde")]
impl From<RawLimit> for JointLimit {
    fn from(raw: RawLimit) -> Self {
        Self::new(
            raw.min_rad.unwrap_or(f64::NEG_INFINITY),
            raw.max_rad.unwrap_or(f64::INFINITY),
        )
    }
}

#[cfg(feature = "serde")]
impl From<JointLimit> for RawLimit {
    fn from(limit: JointLimit) -> Self {
        // NaN is kept, so that the model that reads it can report it.
        let end = |value: f64| (!value.is_infinite()).then_some(value);
        Self {
            min_rad: end(limit.min_rad),
            max_rad: end(limit.max_rad),
        }
    }
}
