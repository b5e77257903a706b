//! Shoulder, elbow and wrist as a rigid triangle.

/// Shoulder, elbow and wrist as a triangle.
#[derive(Debug, Clone, Copy)]
pub(in crate::srs) struct Triangle {
    /// `|w|`, m.
    pub(in crate::srs) length: f64,
    /// `cos |q4|, sin |q4|`.
    pub(in crate::srs) elbow: [f64; 2],
    /// `cos, sin` of the angle at the shoulder and at the wrist.
    pub(in crate::srs) beta: [f64; 2],
    pub(in crate::srs) eta: [f64; 2],
}

/// One end of joint 4's limit.
#[derive(Debug, Clone, Copy)]
pub(in crate::srs) struct ElbowEnd {
    /// Distance from shoulder to wrist there, m.
    pub(super) length: f64,
    /// `cos |q4|, sin |q4|`.
    pub(super) elbow: [f64; 2],
}

impl Triangle {
    /// Half-angle form without `acos`: exact near a straight elbow.
    #[inline(always)]
    pub(in crate::srs) fn from_sides(a: f64, b: f64, length: f64) -> Self {
        let inv = 0.5 / (a * b);
        // Lengths beyond full stretch (by rounding; the caller has checked) count as straight.
        let opening = ((a + b - length) * (a + b + length)).max(0.0);
        let closing = ((length - a + b) * (length + a - b)).max(0.0);
        let (sin, cos) = (
            (opening * closing).sqrt() * inv,
            0.5 * (closing - opening) * inv,
        );
        Self::from_elbow(a, b, length, [cos, sin])
    }

    /// With joint 4 on a limit whose length equals the true length up to rounding.
    #[cold]
    pub(in crate::srs) fn on_limit(a: f64, b: f64, length: f64, limit: ElbowEnd) -> Self {
        Self {
            length,
            ..Self::from_elbow(a, b, limit.length, limit.elbow)
        }
    }

    #[inline(always)]
    fn from_elbow(a: f64, b: f64, length: f64, elbow: [f64; 2]) -> Self {
        let [cos, sin] = elbow;
        let inv = 1.0 / length;
        Self {
            length,
            elbow,
            beta: [(a + b * cos) * inv, b * sin * inv],
            eta: [(b + a * cos) * inv, a * sin * inv],
        }
    }

    /// From a known elbow: its angle at the shoulder and at the wrist, rad.
    pub(in crate::srs) fn from_angles(length: f64, beta: f64, eta: f64) -> Self {
        let elbow = beta + eta;
        Self {
            length,
            elbow: [elbow.cos(), elbow.sin()],
            beta: [beta.cos(), beta.sin()],
            eta: [eta.cos(), eta.sin()],
        }
    }
}
