//! Estimates the stiffness of the hand on an object.

/// Number of samples stored; a power of two.
const SAMPLES: usize = 64;

/// The stiffness of the hand as seen by the loop: force changes against position changes, by least squares.
///
/// The sign does not matter: below the resonance of a stiff finger with the mass `m` behind it, the hand seems to have the stiffness `-m ω²`, and the
/// loop oscillates with it as it does with a spring.
///
/// Only changes about their mean over one loop delay count. So an increasing push or a steady motion has no effect, while a loop that begins to
/// oscillate reveals its stiffness within one delay. The estimate is kept for the whole touch: a hand that has lost contact for a moment is as stiff
/// when it returns.
#[derive(Debug, Clone, Copy)]
pub(super) struct FeltStiffness {
    loop_s: f64,
    /// Smaller changes are noise, m.
    least_m: f64,
    /// Force, N, and position, m; the newest at `count % SAMPLES`.
    samples: [[f64; 2]; SAMPLES],
    count: usize,
    /// Means of both changes, of their product and of the squared displacement.
    mean: [f64; 2],
    product: f64,
    square: f64,
    /// The largest stiffness so far, N/m.
    stiffest_n_per_m: f64,
}

impl FeltStiffness {
    pub(super) const fn new(loop_s: f64, least_m: f64) -> Self {
        Self {
            loop_s,
            least_m,
            samples: [[0.0; 2]; SAMPLES],
            count: 0,
            mean: [0.0; 2],
            product: 0.0,
            square: 0.0,
            stiffest_n_per_m: 0.0,
        }
    }

    /// Begins another touch.
    pub(super) const fn begin(&mut self) {
        *self = Self::new(self.loop_s, self.least_m);
    }

    /// Takes the next sample. Both values are finite.
    pub(super) fn step(&mut self, force_n: f64, position_m: f64, dt_s: f64) {
        let sample = [force_n, position_m];
        if self.count == 0 {
            self.samples = [sample; SAMPLES];
        }
        self.count += 1;
        self.samples[self.count % SAMPLES] = sample;
        // Changes over a quarter of the delay: short against an oscillation of the loop, long against the noise.
        let span = (0.25 * self.loop_s / dt_s).clamp(1.0, (SAMPLES - 1) as f64) as usize;
        let before = self.samples[(self.count + SAMPLES - span) % SAMPLES];
        let share = -(-dt_s / self.loop_s).exp_m1();
        let mut change = [sample[0] - before[0], sample[1] - before[1]];
        for (change, mean) in change.iter_mut().zip(&mut self.mean) {
            *mean += share * (*change - *mean);
            *change -= *mean;
        }
        let [force_n, way_m] = change;
        self.product += share * (-force_n * way_m - self.product);
        self.square += share * (way_m * way_m - self.square);
        let now_n_per_m = self.product.abs() / (self.square + self.least_m * self.least_m);
        self.stiffest_n_per_m += share * (now_n_per_m - self.stiffest_n_per_m).max(0.0);
    }

    /// Estimated size of the stiffness, N/m; about zero for a hand whose push does not depend on the position.
    pub(super) const fn n_per_m(&self) -> f64 {
        self.stiffest_n_per_m
    }
}
