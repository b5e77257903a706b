//! Sinusoids of the arm angle and their roots.

/// A linear sinusoid `s sin ψ + c cos ψ + k`.
#[derive(Debug, Clone, Copy)]
pub(in crate::srs) struct Sinusoid {
    pub(in crate::srs) s: f64,
    pub(in crate::srs) c: f64,
    pub(in crate::srs) k: f64,
}

impl Sinusoid {
    #[inline(always)]
    pub(in crate::srs) const fn new(s: f64, c: f64, k: f64) -> Self {
        Self { s, c, k }
    }

    #[inline(always)]
    pub(in crate::srs) fn at(&self, psi: Direction) -> f64 {
        self.s * psi.sin + self.c * psi.cos + self.k
    }

    /// `self - value`.
    #[inline(always)]
    pub(in crate::srs) fn minus(&self, value: f64) -> Self {
        Self::new(self.s, self.c, self.k - value)
    }

    /// Slope with respect to ψ.
    #[inline(always)]
    pub(in crate::srs) fn slope(&self, psi: Direction) -> f64 {
        self.s * psi.cos - self.c * psi.sin
    }

    /// `a x + b y`.
    #[inline(always)]
    pub(in crate::srs) fn combine(a: f64, x: &Self, b: f64, y: &Self) -> Self {
        let (s, c) = (a * x.s + b * y.s, a * x.c + b * y.c);
        Self::new(s, c, a * x.k + b * y.k)
    }

    /// Passes both roots to `visit`; a tangency within `tolerance` counts as one root.
    #[inline(always)]
    pub(in crate::srs) fn roots(&self, tolerance: f64, mut visit: impl FnMut(Direction)) {
        let r2 = self.s * self.s + self.c * self.c;
        if r2 <= tolerance * tolerance {
            return; // constant: any other angle shows whether it holds
        }
        let gap = r2 - self.k * self.k;
        let inv = 1.0 / r2;
        if gap > 0.0 {
            let along = -self.k * inv;
            let across = gap.sqrt() * inv;
            let [s, c] = [self.s, self.c];
            visit(Direction::new(
                s * along + c * across,
                c * along - s * across,
            ));
            visit(Direction::new(
                s * along - c * across,
                c * along + s * across,
            ));
        } else if self.k.abs() - r2.sqrt() <= tolerance {
            let scale = -self.k.signum() * inv.sqrt();
            visit(Direction::new(self.s * scale, self.c * scale));
        }
    }
}

/// An arm angle as `sin, cos`.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(in crate::srs) struct Direction {
    pub(in crate::srs) sin: f64,
    pub(in crate::srs) cos: f64,
}

impl Direction {
    pub(in crate::srs) const ZERO: Self = Self::new(0.0, 1.0);
    pub(in crate::srs) const HALF_TURN: Self = Self::new(0.0, -1.0);

    #[inline(always)]
    pub(in crate::srs) const fn new(sin: f64, cos: f64) -> Self {
        Self { sin, cos }
    }

    pub(in crate::srs) fn from_angle(psi_rad: f64) -> Self {
        let (sin, cos) = psi_rad.sin_cos();
        Self::new(sin, cos)
    }

    pub(in crate::srs) fn angle(self) -> f64 {
        self.sin.atan2(self.cos)
    }

    pub(in crate::srs) fn turned(self, by_rad: f64) -> Self {
        self.turned_by(Self::from_angle(by_rad))
    }

    /// The direction midway to another at most a quarter turn away.
    #[inline(always)]
    pub(in crate::srs) fn between(self, other: Self) -> Self {
        let (sin, cos) = (self.sin + other.sin, self.cos + other.cos);
        let scale = 1.0 / (sin * sin + cos * cos).sqrt();
        Self::new(sin * scale, cos * scale)
    }

    #[inline(always)]
    pub(in crate::srs) fn turned_by(self, by: Self) -> Self {
        Self::new(
            self.sin * by.cos + self.cos * by.sin,
            self.cos * by.cos - self.sin * by.sin,
        )
    }

    #[inline(always)]
    pub(in crate::srs) const fn opposite(self) -> Self {
        Self::new(-self.sin, -self.cos)
    }
}
