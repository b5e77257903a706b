//! The extended Kalman filter on all weights, as the published implementation computes it.
//!
//! For comparison only: like the original, it is slower by orders of magnitude and loses positive definiteness with
//! ill-conditioned bases.

use hwall_bip::{Basis, BipError, MotionFilter, Observation, Prior};
use hwall_numeric::check;
use hwall_numeric::dense::{cholesky_in_place, dot, solve_lower, solve_lower_transposed};

/// Noise that the published convention adds to degrees of freedom that are not observed.
const INACTIVE_NOISE: f64 = 1e4;

/// The published filter: state `[phase, phase velocity, all weights]`, full covariance.
///
/// One innovation over *all* degrees of freedom: unobserved ones enter as 0 with 1e4 added to their
/// noise, and their columns of the gain are set to zero. `P ← (1 - K H) P`; the phase is clipped to
/// `[0, 1]` after prediction and after each call.
#[derive(Debug, Clone)]
pub struct FullFilter {
    bases: Vec<Basis>,
    /// Basis and first weight of each degree of freedom.
    layout: Vec<(usize, usize)>,
    offset: Vec<f64>,
    noise: Vec<f64>,
    process_variance: f64,
    state: Vec<f64>,
    covariance: Vec<f64>,
}

/// Values and slopes of the basis functions of a group at one phase.
type Functions = (Vec<f64>, Vec<f64>);

impl FullFilter {
    /// From a prior, with the variance of the phase at its start and of its acceleration.
    ///
    /// # Errors
    /// Mismatched lengths, numbers that are not finite.
    pub fn new(
        prior: &Prior,
        phase_variance: f64,
        process_variance: f64,
    ) -> Result<Self, BipError> {
        check::all_finite("variances", &[phase_variance, process_variance])?;
        let bases: Vec<Basis> = prior.groups.iter().map(|g| g.basis).collect();
        let mut layout = Vec::new();
        let mut n = 2;
        for (g, group) in prior.groups.iter().enumerate() {
            for _ in 0..group.dofs {
                layout.push((g, n));
                n += group.basis.count();
            }
        }
        let entries = (n - 2).saturating_mul(prior.rank);
        for (what, expected, got) in [
            ("mean", n - 2, prior.mean.len()),
            ("factor", entries, prior.factor.len()),
            ("noise", layout.len(), prior.noise.len()),
            ("offset", layout.len(), prior.offset.len()),
        ] {
            length(what, expected, got)?;
        }
        check::all_finite("offset", &prior.offset)?;
        let mut state = vec![0.0, prior.phase_velocity.mean];
        state.extend(&prior.mean);
        let mut covariance = vec![0.0; n * n];
        covariance[0] = phase_variance;
        covariance[n + 1] = prior.phase_velocity.variance;
        let row = |w: usize| &prior.factor[w * prior.rank..(w + 1) * prior.rank];
        for i in 2..n {
            for j in 2..n {
                covariance[i * n + j] = dot(row(i - 2), row(j - 2));
            }
        }
        check::all_finite("prior", &state)?;
        check::all_finite("prior", &covariance)?;
        Ok(Self {
            bases,
            layout,
            offset: prior.offset.clone(),
            noise: prior.noise.clone(),
            process_variance,
            state,
            covariance,
        })
    }

    fn update(&mut self, y: &[f64], noise: &[f64], active: &[bool]) -> Result<(), BipError> {
        let (n, m) = (self.state.len(), self.layout.len());
        let functions = self.functions(self.state[0])?;
        let mut predicted = vec![0.0; m];
        // Sparse rows of H: the slope at the phase, the basis at the weights.
        let mut slope = vec![0.0; m];
        for (d, &(g, first)) in self.layout.iter().enumerate() {
            let (values, slopes) = &functions[g];
            let weights = &self.state[first..first + values.len()];
            predicted[d] = self.offset[d] + dot(values, weights);
            slope[d] = dot(slopes, weights);
        }
        let mut hp = vec![0.0; m * n];
        let mut pht = vec![0.0; n * m];
        for (d, &(g, first)) in self.layout.iter().enumerate() {
            for j in 0..n {
                let mut row = slope[d] * self.covariance[j];
                let mut column = slope[d] * self.covariance[j * n];
                for (b, psi) in functions[g].0.iter().enumerate() {
                    row += psi * self.covariance[(first + b) * n + j];
                    column += psi * self.covariance[j * n + first + b];
                }
                hp[d * n + j] = row;
                pht[j * m + d] = column;
            }
        }
        let mut s = vec![0.0; m * m];
        for i in 0..m {
            for (e, &(g, first)) in self.layout.iter().enumerate() {
                let (values, _) = &functions[g];
                s[i * m + e] =
                    slope[e] * hp[i * n] + dot(values, &hp[i * n + first..][..values.len()]);
            }
            s[i * m + i] += noise[i];
        }
        cholesky_in_place(m, &mut s).map_err(|e| BipError::NotPositiveDefinite {
            what: "innovation covariance",
            pivot: e.pivot,
            value: e.value,
        })?;
        for j in 0..n {
            let gain = &mut pht[j * m..(j + 1) * m];
            solve_lower(&s, gain);
            solve_lower_transposed(&s, gain);
            for (k, active) in gain.iter_mut().zip(active) {
                *k = if *active { *k } else { 0.0 };
            }
            self.state[j] += (0..m).map(|d| gain[d] * (y[d] - predicted[d])).sum::<f64>();
            for (d, k) in gain.iter().enumerate().filter(|(d, _)| active[*d]) {
                let row = &mut self.covariance[j * n..(j + 1) * n];
                for (p, h) in row.iter_mut().zip(&hp[d * n..(d + 1) * n]) {
                    *p -= k * h;
                }
            }
        }
        Ok(check::all_finite("state", &self.state)?)
    }

    /// Values and slopes of the functions of each group.
    fn functions(&self, phase: f64) -> Result<Vec<Functions>, BipError> {
        let of = |basis: &Basis| {
            let (mut values, mut slopes) = (vec![0.0; basis.count()], vec![0.0; basis.count()]);
            basis.evaluate_into(phase, &mut values, &mut slopes)?;
            Ok((values, slopes))
        };
        self.bases.iter().map(of).collect()
    }
}

impl MotionFilter for FullFilter {
    fn predict(&mut self, dt: f64) -> Result<(), BipError> {
        check::finite("dt", dt)?;
        let n = self.state.len();
        let p = &mut self.covariance;
        self.state[0] = (self.state[0] + dt * self.state[1]).clamp(0.0, 1.0);
        for j in 0..n {
            p[j] += dt * p[n + j];
        }
        for i in 0..n {
            p[i * n] += dt * p[i * n + 1];
        }
        let q = self.process_variance;
        p[0] += q * dt.powi(4) / 4.0;
        p[1] += q * dt.powi(3) / 2.0;
        p[n] += q * dt.powi(3) / 2.0;
        p[n + 1] += q * dt * dt;
        Ok(())
    }

    fn observe(&mut self, observation: &Observation<'_>) -> Result<(), BipError> {
        let (dofs, values) = (observation.dofs(), observation.values());
        length("values", dofs.len(), values.len())?;
        check::all_finite("values", values)?;
        let count = self.layout.len();
        let mut y = vec![0.0; count];
        let mut noise: Vec<f64> = self.noise.iter().map(|r| r + INACTIVE_NOISE).collect();
        let mut active = vec![false; count];
        for (&dof, value) in dofs.iter().zip(values) {
            if dof >= count {
                return Err(BipError::UnknownDof { dof, dofs: count });
            }
            y[dof] = *value;
            noise[dof] = self.noise[dof];
            active[dof] = true;
        }
        self.update(&y, &noise, &active)?;
        self.state[0] = self.state[0].clamp(0.0, 1.0);
        Ok(())
    }

    /// Variances can be negative, because rounding destroys the covariance's definiteness.
    fn moments_at(
        &mut self,
        phase: f64,
        dofs: &[usize],
        mean: &mut [f64],
        variance: &mut [f64],
    ) -> Result<(), BipError> {
        let (functions, n) = (self.functions(phase)?, self.state.len());
        for ((&dof, mean), variance) in dofs.iter().zip(mean).zip(variance) {
            let count = self.layout.len();
            let unknown = BipError::UnknownDof { dof, dofs: count };
            let &(g, first) = self.layout.get(dof).ok_or(unknown)?;
            let psi = &functions[g].0;
            let row = |i: usize| &self.covariance[(first + i) * n + first..][..psi.len()];
            let weighted = psi.iter().enumerate().map(|(i, x)| x * dot(row(i), psi));
            *variance = weighted.sum();
            *mean = self.offset[dof] + dot(psi, &self.state[first..first + psi.len()]);
        }
        Ok(())
    }

    /// In this convention, only the mean motion.
    fn predict_at(
        &mut self,
        phase: f64,
        dofs: &[usize],
        mean: &mut [f64],
        variance: &mut [f64],
    ) -> Result<(), BipError> {
        self.moments_at(phase, dofs, mean, variance)
    }

    fn phase(&self) -> f64 {
        self.state[0]
    }

    fn phase_velocity(&self) -> f64 {
        self.state[1]
    }

    /// The result need not be symmetric.
    fn phase_covariance(&mut self) -> [[f64; 2]; 2] {
        let (n, p) = (self.state.len(), &self.covariance);
        [[p[0], p[1]], [p[n], p[n + 1]]]
    }
}

fn length(what: &'static str, expected: usize, got: usize) -> Result<(), BipError> {
    if expected == got {
        return Ok(());
    }
    Err(BipError::WrongLength {
        what,
        expected,
        got,
    })
}
