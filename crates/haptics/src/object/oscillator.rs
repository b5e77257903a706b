//! A damped oscillator under a constant force, in closed form.

/// `y'' + 2 α y' + ω² y = g` from `y = 0`, with constant `g`; `α` and `ω²` are not negative.
///
/// The solution is `y = v h + g H`, `y' = v h' + g h`, where `h` is the unit impulse response and `H` its integral. All are computed without loss of
/// digits for any damping and any time: against the power series in short steps (tests, up to 2.5 periods and any damping) the errors of `h` and `h'`
/// are at most 1e-14 (of `t` and of 1), of `H` 1e-15 t².
#[derive(Debug, Clone, Copy)]
pub(super) struct Oscillator {
    /// α, 1/s.
    alpha: f64,
    /// ω², 1/s².
    omega2: f64,
    /// ω, 1/s.
    omega: f64,
    /// α² − ω², 1/s²; negative below critical damping.
    excess: f64,
    /// Root of its magnitude, 1/s.
    root: f64,
    /// α − β and α + β: the two decay rates above critical damping, 1/s.
    slow: f64,
    fast: f64,
}

/// The responses after some time.
struct Response {
    /// h, s.
    impulse: f64,
    /// h' as a sum: for short times 1 plus a change, so that rounding does not accumulate over many steps; later 0 plus the whole value.
    rate_kept: f64,
    rate_change: f64,
    /// H, s².
    step: f64,
}

/// Below this product of rate and time the power series is used: 20 terms then reach 1e-18.
const SERIES: f64 = 0.5;
/// Below this |α² − ω²| t² the series in it replace sines and exponentials.
const NEAR_CRITICAL: f64 = 0.05;

impl Oscillator {
    pub(super) fn new(inertia: f64, damping: f64, stiffness: f64) -> Self {
        let alpha = 0.5 * damping / inertia;
        let omega2 = stiffness / inertia;
        let omega = omega2.sqrt();
        let excess = (alpha - omega) * (alpha + omega);
        let root = excess.abs().sqrt();
        let fast = alpha + root;
        Self {
            alpha,
            omega2,
            omega,
            excess,
            root,
            // Avoids the difference of two large numbers.
            slow: if fast > 0.0 { omega2 / fast } else { 0.0 },
            fast,
        }
    }

    /// Displacement and speed after `t`, from speed `v` under the acceleration `g`.
    pub(super) fn after(&self, v: f64, g: f64, t: f64) -> (f64, f64) {
        let answer = self.response(t);
        let displacement = v * answer.impulse + g * answer.step;
        let change = v * answer.rate_change + g * answer.impulse;
        (displacement, v * answer.rate_kept + change)
    }

    /// Acceleration at the start.
    pub(super) fn first_acceleration(&self, v: f64, g: f64) -> f64 {
        g - 2.0 * self.alpha * v
    }

    /// Does the motion from speed `v` under `g` stay between displacements `low` and `high` forever? `false` if in doubt.
    pub(super) fn stays_within(&self, v: f64, g: f64, low: f64, high: f64) -> bool {
        if low == f64::NEG_INFINITY && high == f64::INFINITY {
            return true;
        }
        // The energy about the equilibrium does not grow; the margin exceeds rounding.
        let balance = g / self.omega2;
        let most = balance.hypot(v / self.omega) * (1.0 + 1e-12);
        balance - most > low && balance + most < high
    }

    /// First time after the start at which the speed `v >= 0` is zero; infinity if there is none.
    pub(super) fn reversal_s(&self, v: f64, g: f64) -> f64 {
        if self.excess < 0.0 {
            let angle = (self.root * v).atan2(self.alpha * v - g);
            return angle / self.root;
        }
        // tanh(β t) = β v / (α v − g)
        let slack = self.slow * v - g;
        if slack <= 0.0 || v == 0.0 {
            return f64::INFINITY;
        }
        let z = 2.0 * self.root * v / slack;
        let share = if z < 1e-5 {
            1.0 - z * (0.5 - z / 3.0)
        } else {
            z.ln_1p() / z
        };
        v / slack * share
    }

    fn response(&self, t: f64) -> Response {
        if self.alpha.max(self.omega) * t < SERIES {
            return self.series(t);
        }
        let q = self.excess * t * t;
        if q > NEAR_CRITICAL {
            return self.above_critical(t);
        }
        let decay = (-self.alpha * t).exp();
        let (s, c) = if q < -NEAR_CRITICAL {
            let (sin, cos) = (self.root * t).sin_cos();
            (sin / self.root, cos)
        } else {
            let (s, c) = near_critical(q);
            (s * t, c)
        };
        let impulse = decay * s;
        let along = decay * c;
        Response {
            impulse,
            rate_kept: 0.0,
            rate_change: along - self.alpha * impulse,
            step: (1.0 - along - self.alpha * impulse) / self.omega2,
        }
    }

    /// Two different real rates.
    fn above_critical(&self, t: f64) -> Response {
        let [slow, fast] = [self.slow, self.fast].map(|rate| (-rate * t).exp());
        // ∫ exp(−rate t)
        let [slow_sum, fast_sum] = [self.slow, self.fast].map(|rate| {
            let x = rate * t;
            if x < 1e-300 { t } else { -(-x).exp_m1() / rate }
        });
        let scale = 0.5 / self.root;
        Response {
            impulse: scale * (slow - fast),
            rate_kept: 0.0,
            rate_change: scale * (self.fast * fast - self.slow * slow),
            step: scale * (slow_sum - fast_sum),
        }
    }

    /// Power series about `t = 0`: `h = Σ c_n tⁿ`, from the differential equation.
    fn series(&self, t: f64) -> Response {
        let (a, b) = (2.0 * self.alpha * t, self.omega2 * t * t);
        // c_n t^(n−1) of this term and the previous one.
        let (mut before, mut term) = (0.0, 1.0);
        let (mut impulse, mut rate, mut step) = (1.0, 0.0, 0.5);
        for n in 1..32 {
            let n = f64::from(n);
            let next = -(a * n * term + b * before) / (n * (n + 1.0));
            before = term;
            term = next;
            impulse += term;
            rate += (n + 1.0) * term;
            step += term / (n + 2.0);
            if before.abs() + term.abs() < 1e-18 {
                break;
            }
        }
        Response {
            impulse: impulse * t,
            rate_kept: 1.0,
            rate_change: rate,
            step: step * t * t,
        }
    }
}

/// sinh(√q)/√q and cosh(√q), for |q| up to [`NEAR_CRITICAL`].
fn near_critical(q: f64) -> (f64, f64) {
    let s =
        1.0 + q / 6.0 * (1.0 + q / 20.0 * (1.0 + q / 42.0 * (1.0 + q / 72.0 * (1.0 + q / 110.0))));
    let c = 1.0
        + q / 2.0
            * (1.0
                + q / 12.0
                    * (1.0 + q / 30.0 * (1.0 + q / 56.0 * (1.0 + q / 90.0 * (1.0 + q / 132.0)))));
    (s, c)
}

#[cfg(test)]
mod tests {
    use super::*;
    use hwall_testkit::Sampler;

    /// Power series alone, in short steps.
    fn in_series(oscillator: &Oscillator, t: f64) -> [f64; 3] {
        let steps = (8.0 * oscillator.alpha.max(oscillator.omega) * t)
            .ceil()
            .max(1.0);
        let short = oscillator.series(t / steps);
        let short_rate = 1.0 + short.rate_change;
        // Advances h and its rate, and H, by one short step.
        let (mut h, mut rate, mut sum) = (0.0, 1.0, 0.0);
        for _ in 0..steps as usize {
            let next =
                rate * short.impulse + h * (short_rate + 2.0 * oscillator.alpha * short.impulse);
            sum += h * (short.impulse + 2.0 * oscillator.alpha * short.step) + rate * short.step;
            rate = rate * short_rate - h * oscillator.omega2 * short.impulse;
            h = next;
        }
        [h, rate, sum]
    }

    #[test]
    fn all_forms_agree_with_the_series_where_they_meet_and_beyond() {
        let mut sampler = Sampler::new(1);
        let mut worst = [0.0_f64; 3];
        for case in 0..40_000 {
            let t = 10_f64.powf(sampler.uniform(-4.0, 1.0));
            let omega = 10_f64.powf(sampler.uniform(-3.0, 1.2)) / t;
            let zeta = match case % 4 {
                0 => 0.0,
                1 => sampler.uniform(0.0, 1.0),
                2 => 1.0 + sampler.normal() * 10_f64.powf(sampler.uniform(-16.0, -1.0)),
                _ => (10_f64.powf(sampler.uniform(0.0, 4.0))).min(30.0 / (omega * t)),
            };
            let spring = if case % 7 == 0 { 0.0 } else { omega * omega };
            let oscillator = Oscillator::new(1.0, 2.0 * zeta.abs() * omega, spring);
            let [h, rate, sum] = in_series(&oscillator, t);
            let found = oscillator.response(t);
            let errors = [
                (found.impulse - h).abs() / t,
                (found.rate_kept + found.rate_change - rate).abs(),
                (found.step - sum).abs() / (t * t),
            ];
            for (worst, error) in worst.iter_mut().zip(errors) {
                *worst = worst.max(error);
            }
        }
        // Of h, its rate, and H.
        assert!(worst.iter().all(|&w| w < 1e-13), "{worst:?}");
    }

    #[test]
    fn at_its_reversal_it_has_no_speed() {
        let mut sampler = Sampler::new(2);
        for case in 0..40_000 {
            let stiffness = [0.0, 10_f64.powf(sampler.uniform(-8.0, 8.0))][case % 2];
            let damping = match case % 5 {
                0 => 0.0,
                1 => 2.0 * stiffness.sqrt() * (1.0 + 1e-9 * sampler.normal()),
                _ => 10_f64.powf(sampler.uniform(-6.0, 5.0)),
            };
            let oscillator = Oscillator::new(1.0, damping, stiffness);
            let (v, g) = (sampler.uniform(0.0, 2.0), sampler.uniform(-5.0, 5.0));
            let t = oscillator.reversal_s(v, g);
            if t == f64::INFINITY {
                // It never ends: forwards at any time.
                for t in [1e-3, 1.0, 1e3] {
                    let (_, speed) = oscillator.after(v, g, t);
                    assert!(speed >= -1e-12, "{oscillator:?} {v} {g}");
                }
                continue;
            }
            // Not before, and then exactly.
            let (_, speed) = oscillator.after(v, g, t);
            let scale = v + g.abs() * t.min(1.0);
            let rests = speed.abs() < 1e-10 * scale;
            assert!(rests, "{oscillator:?} {v} {g}: {speed} at {t}");
            let (_, before) = oscillator.after(v, g, sampler.uniform(0.0, 0.99) * t);
            assert!(before > -1e-12 * scale, "{oscillator:?} {v} {g}");
        }
    }
}
