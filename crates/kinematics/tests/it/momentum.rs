//! Generalized momentum and the gradient of the kinetic energy against the mass matrix and central differences.

use crate::dynamics::random_dynamics;
use hwall_kinematics::{Chain, ChainDynamics};
use hwall_testkit::{Sampler, Tol, assert_close};

#[test]
fn momentum_is_the_mass_matrix_times_velocity_and_its_gradient_that_of_the_energy() {
    let mut sampler = Sampler::new(11);
    let mut arms = vec![ChainDynamics::new(&Chain::iiwa7()).unwrap()];
    arms.extend((2..7).map(|n| random_dynamics(&mut sampler, n, 0.5)));
    for arm in &arms {
        let n = arm.chain().joint_count();
        let mut scratch = arm.scratch();
        let (mut momentum, mut gradient) = (vec![0.0; n], vec![0.0; n]);
        for _ in 0..100 {
            let ranges = vec![(-2.0, 2.0); n];
            let (q, qd) = (sampler.within(&ranges), sampler.within(&ranges));
            arm.momentum_into(&q, &qd, &mut scratch, &mut momentum, &mut gradient)
                .unwrap();
            let matrix = arm.mass_matrix(&q).unwrap();
            let energy = |q: &[f64]| arm.kinetic_energy_j(q, &qd).unwrap();
            for i in 0..n {
                let product: f64 = (0..n).map(|j| matrix[i * n + j] * qd[j]).sum();
                assert_close!(momentum[i], product, Tol::new(1e-12, 1e-12));
                // Fourth-order central difference.
                let moved = |by: f64| {
                    let mut q = q.clone();
                    q[i] += by;
                    energy(&q)
                };
                let h = 1e-3;
                let near = moved(h) - moved(-h);
                let far = moved(2.0 * h) - moved(-2.0 * h);
                let difference = (8.0 * near - far) / (12.0 * h);
                assert_close!(gradient[i], difference, Tol::new(1e-8, 1e-8));
            }
        }
    }
}

#[test]
fn bad_input_is_an_error() {
    let arm = ChainDynamics::new(&Chain::iiwa7()).unwrap();
    let (mut scratch, zeros) = (arm.scratch(), [0.0; 7]);
    let (mut a, mut b) = ([0.0; 7], [0.0; 7]);
    let nan = [f64::NAN; 7];
    for (q, qd, length) in [
        (&nan[..], &zeros[..], 7),
        (&zeros, &nan, 7),
        (&zeros, &zeros[..6], 7),
        (&zeros, &zeros, 6),
    ] {
        let done = arm.momentum_into(q, qd, &mut scratch, &mut a[..length], &mut b);
        assert!(done.is_err());
    }
}
