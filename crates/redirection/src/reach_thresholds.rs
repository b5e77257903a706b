//! Detection thresholds while reaching: how far the real hand may be shifted from the virtual one.

use crate::error::{RedirectionError, Result};
use glam::DVec3;
use hwall_geometry::direction;
use hwall_numeric::check::{all_finite, finite, positive, that};

/// Detection thresholds of a shifted hand, seen from the start of the reach.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ReachThresholds {
    /// Angle to the left and to the right, rad, below 0.5; default 4 degrees. [Zenner and Krüger 2019] report about 4.5 degrees
    /// as a conservative bound for reaches at a desk; other studies report more.
    pub horizontal_rad: f64,
    /// Angle up and down, rad, below 0.5; default 4 degrees, from the same source.
    pub vertical_rad: f64,
    /// Smallest and largest gain (virtual over real distance); must include 1. Default 0.88 to 1.07: a real reach 13 %
    /// longer or 6 % shorter than the virtual one; same source.
    pub gain: [f64; 2],
}

impl Default for ReachThresholds {
    fn default() -> Self {
        Self {
            horizontal_rad: 4_f64.to_radians(),
            vertical_rad: 4_f64.to_radians(),
            gain: [0.88, 1.07],
        }
    }
}

/// Difference of the real reach from the virtual one.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ReachShift {
    /// Angle of the real hand to the right of the virtual one, rad.
    pub horizontal_rad: f64,
    /// Angle of the real hand above the virtual one, rad.
    pub vertical_rad: f64,
    /// Virtual over real distance.
    pub gain: f64,
}

impl ReachShift {
    /// No shift: both hands coincide.
    pub const NONE: Self = Self {
        horizontal_rad: 0.0,
        vertical_rad: 0.0,
        gain: 1.0,
    };
}

/// The axes of a reach: along it, to the right, and upwards. A reach must be longer than 1 mm.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ReachFrame {
    start_m: DVec3,
    length_m: f64,
    along: DVec3,
    right: DVec3,
    up: DVec3,
}

/// Least length of a reach, m.
const LEAST_REACH_M: f64 = 1e-3;

impl ReachThresholds {
    /// Nothing is shifted.
    pub const NONE: Self = Self {
        horizontal_rad: 0.0,
        vertical_rad: 0.0,
        gain: [1.0, 1.0],
    };

    /// Rejects settings out of range.
    ///
    /// # Errors
    /// The first setting outside its range; NaN is outside every range.
    pub fn validate(&self) -> Result<()> {
        for (what, angle) in [
            ("horizontal_rad", self.horizontal_rad),
            ("vertical_rad", self.vertical_rad),
        ] {
            that(
                (0.0..0.5).contains(&angle),
                what,
                angle,
                "0 to below 0.5 rad",
            )?;
        }
        let [least, most] = self.gain;
        positive("least gain", least)?;
        that(least <= 1.0, "least gain", least, "at most 1")?;
        let fits = (1.0..=10.0).contains(&most);
        that(fits, "largest gain", most, "1 to 10")?;
        Ok(())
    }

    /// The shift clamped to the thresholds in each of its three parts.
    #[must_use]
    pub fn nearest(&self, shift: &ReachShift) -> ReachShift {
        let within = |value: f64, least: f64, most: f64| value.min(most).max(least);
        ReachShift {
            horizontal_rad: within(
                shift.horizontal_rad,
                -self.horizontal_rad,
                self.horizontal_rad,
            ),
            vertical_rad: within(shift.vertical_rad, -self.vertical_rad, self.vertical_rad),
            gain: within(shift.gain, self.gain[0], self.gain[1]),
        }
    }

    /// Checks that a shift is within the thresholds, with a rounding tolerance of 1e-9.
    ///
    /// # Errors
    /// The first part that exceeds its threshold, or is NaN.
    pub fn check(&self, shift: &ReachShift) -> Result<()> {
        /// Rounding tolerance for positions computed from a shift exactly at the threshold.
        const ROUNDING: f64 = 1e-9;
        for (what, value, least, most) in [
            (
                "horizontal angle",
                shift.horizontal_rad,
                -self.horizontal_rad,
                self.horizontal_rad,
            ),
            (
                "vertical angle",
                shift.vertical_rad,
                -self.vertical_rad,
                self.vertical_rad,
            ),
            ("gain", shift.gain, self.gain[0], self.gain[1]),
        ] {
            if !(least - ROUNDING <= value && value <= most + ROUNDING) {
                return Err(RedirectionError::Noticed {
                    what,
                    value,
                    least,
                    most,
                });
            }
        }
        Ok(())
    }
}

impl ReachFrame {
    /// The frame of a reach between two positions, m, z up.
    ///
    /// # Errors
    /// NaN, infinity, or no reach: a goal within 1 mm of the start.
    pub fn new(start_m: DVec3, goal_m: DVec3) -> Result<Self> {
        all_finite("start_m", &start_m.to_array())?;
        all_finite("goal_m", &goal_m.to_array())?;
        let way = goal_m - start_m;
        let length_m = finite("length of the reach", way.length())?;
        if length_m < LEAST_REACH_M {
            return Err(RedirectionError::NoReach { length_m });
        }
        let along = direction("reach", way)?;
        // A vertical reach has no right side: choose any.
        let right = along
            .cross(DVec3::Z)
            .try_normalize()
            .unwrap_or_else(|| along.any_orthonormal_vector());
        Ok(Self {
            start_m,
            length_m,
            along,
            right,
            up: right.cross(along),
        })
    }

    /// The start, m.
    #[must_use]
    pub const fn start_m(&self) -> DVec3 {
        self.start_m
    }

    /// Length of the reach, m.
    #[must_use]
    pub const fn length_m(&self) -> f64 {
        self.length_m
    }

    /// Position of the real hand when the virtual one is at the goal, m; angles must be below a quarter turn, gains positive.
    #[must_use]
    pub fn real_goal_m(&self, shift: &ReachShift) -> DVec3 {
        let way = self.along
            + self.right * shift.horizontal_rad.tan()
            + self.up * shift.vertical_rad.tan();
        self.start_m + way.normalize() * (self.length_m / shift.gain)
    }

    /// The shift that puts the real hand at a position when the virtual one is at the goal: the inverse of
    /// [`real_goal_m`](Self::real_goal_m). NaN in gives NaN out.
    #[must_use]
    pub fn shift_to(&self, real_goal_m: DVec3) -> ReachShift {
        let real = real_goal_m - self.start_m;
        let along = real.dot(self.along);
        ReachShift {
            horizontal_rad: real.dot(self.right).atan2(along),
            vertical_rad: real.dot(self.up).atan2(along),
            gain: self.length_m / real.length(),
        }
    }

    /// The shift between a real and a virtual position, m, in the frame of the reach.
    #[must_use]
    pub(crate) fn shift_between(&self, real_m: DVec3, virtual_m: DVec3) -> ReachShift {
        let angles = |place_m: DVec3| {
            let way = place_m - self.start_m;
            let along = way.dot(self.along);
            let [right, up] = [self.right, self.up].map(|axis| way.dot(axis).atan2(along));
            (right, up, way.length())
        };
        let (real, virt) = (angles(real_m), angles(virtual_m));
        ReachShift {
            horizontal_rad: real.0 - virt.0,
            vertical_rad: real.1 - virt.1,
            gain: virt.2 / real.2,
        }
    }
}
