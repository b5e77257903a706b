//! Twist and wrench of a frame.

use glam::DVec3;

/// Linear and angular velocity of a frame, both in the axes stated by the producing function.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct Twist {
    /// Velocity of the origin, m/s.
    pub linear_m_per_s: DVec3,
    /// Angular velocity, rad/s.
    pub angular_rad_per_s: DVec3,
}

/// Force and moment at a frame's origin, both in the axes stated by the producing function.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct Wrench {
    /// Force, N.
    pub force_n: DVec3,
    /// Moment about the origin, N m.
    pub moment_n_m: DVec3,
}

impl Twist {
    /// `[vx vy vz ωx ωy ωz]`.
    #[inline]
    #[must_use]
    pub fn to_array(self) -> [f64; 6] {
        join(self.linear_m_per_s, self.angular_rad_per_s)
    }

    /// From `[vx vy vz ωx ωy ωz]`.
    #[inline]
    #[must_use]
    pub fn from_array(v: [f64; 6]) -> Self {
        let (linear_m_per_s, angular_rad_per_s) = split(v);
        Self {
            linear_m_per_s,
            angular_rad_per_s,
        }
    }
}

impl Wrench {
    /// `[fx fy fz mx my mz]`.
    #[inline]
    #[must_use]
    pub fn to_array(self) -> [f64; 6] {
        join(self.force_n, self.moment_n_m)
    }

    /// From `[fx fy fz mx my mz]`.
    #[inline]
    #[must_use]
    pub fn from_array(v: [f64; 6]) -> Self {
        let (force_n, moment_n_m) = split(v);
        Self {
            force_n,
            moment_n_m,
        }
    }

    /// Component of the force along a unit normal, N; positive along the normal.
    #[inline]
    #[must_use]
    pub fn normal_force_n(&self, normal: DVec3) -> f64 {
        self.force_n.dot(normal)
    }
}

fn join(a: DVec3, b: DVec3) -> [f64; 6] {
    [a.x, a.y, a.z, b.x, b.y, b.z]
}

fn split(v: [f64; 6]) -> (DVec3, DVec3) {
    (DVec3::new(v[0], v[1], v[2]), DVec3::new(v[3], v[4], v[5]))
}
