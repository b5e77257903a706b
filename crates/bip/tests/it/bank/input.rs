//! Bad input.

use super::{HAND, config, demonstrations, model, training};
use hwall_bip::{ArgumentError, Bank, BankConfig, BipError, Component, Model, Observation};
use hwall_testkit::Sampler;

#[test]
fn bad_evidence_changes_nothing() {
    let model = model();
    let mut bank = Bank::new(&model, &config()).unwrap();
    bank.predict(1.0).unwrap();
    let before: Vec<_> = bank.hypotheses().collect();
    for (dofs, values) in [
        (vec![0, 0], vec![0.1, 0.1]),
        (vec![9], vec![0.1]),
        (vec![0], vec![f64::NAN]),
        (vec![0, 1], vec![0.1]),
    ] {
        assert!(bank.observe(&Observation::new(&dofs, &values)).is_err());
    }
    // Nor does a step that no clock takes.
    for dt in [f64::NAN, -1.0, 1e160, 1e300] {
        assert!(bank.predict(dt).is_err(), "{dt}");
    }
    assert!(bank.observe_phase(0.3, 0.0).is_err());
    assert_eq!(before, bank.hypotheses().collect::<Vec<_>>());
    bank.observe(&Observation::new(&[], &[])).unwrap();
    let (mut one, mut two) = ([0.0; 1], [0.0; 2]);
    assert!(bank.moments_at(1.0, &[0], &mut one, &mut two).is_err());
    for (phase, dof) in [(f64::NAN, 0), (1.0, 7)] {
        let moments = bank.moments_at(phase, &[dof], &mut one, &mut [0.0]);
        assert!(moments.is_err(), "{phase} {dof}");
    }
}

#[test]
fn malformed_banks_are_typed_errors() {
    let model = model();
    let refused = |change: &dyn Fn(&mut BankConfig)| {
        let mut config = config();
        change(&mut config);
        let bank = Bank::new(&model, &config);
        matches!(
            bank,
            Err(BipError::Argument(ArgumentError::OutOfRange { .. }))
        )
    };
    assert!(refused(&|c| c.hypotheses = 0));
    assert!(refused(&|c| c.pauses = -1.0));
    assert!(refused(&|c| c.pause_length = 0.0));
    assert!(refused(&|c| c.not_begun = 1.0));
    assert!(refused(&|c| c.changes = f64::NAN));
    let of = |probability| Component {
        model: &model,
        probability,
    };
    assert!(Bank::of_components(&[], &config()).is_err());
    assert!(Bank::of_components(&[of(0.0)], &config()).is_err());
    assert!(Bank::of_components(&[of(f64::NAN)], &config()).is_err());
}

/// Regression test: hypotheses that all scored NaN were all discarded, and `predict` met an empty bank.
#[test]
fn hostile_evidence_never_empties_a_bank() {
    let model = Model::train(&demonstrations(1, 12), &training()).unwrap();
    let (least, most) = (f64::MIN_POSITIVE, f64::MAX);
    let (nan, infinite) = (f64::NAN, f64::INFINITY);
    let sizes = [
        0.0, 1.0, -1.0, 1e-320, 5e-324, 1e-160, 1e-154, 1e154, 1e160, 1e300, -1e300, 1.7e308, most,
        least, nan, infinite,
    ];
    let mut sampler = Sampler::new(3);
    for round in 0..300 {
        let config = BankConfig::default();
        let mut bank = Bank::new(&model, &config).unwrap();
        for _ in 0..30 {
            let mut any = || sizes[sampler.index(sizes.len())];
            let (values, variances) = ([any(), any(), any()], [any(), any(), any()]);
            let (dt, phase, variance) = (any(), any(), any());
            let seen = Observation::new(&HAND, &values);
            // Errors are returned; the bank must still work afterwards.
            let _ = match round % 4 {
                0 => bank.observe(&seen),
                1 => bank.observe(&seen.with_variances(&variances)),
                2 => bank.observe_at(phase, &seen.with_variances(&variances)),
                _ => bank.observe_phase(phase, variance),
            };
            let _ = bank.predict(dt);
            let _ = bank.predict(0.01);
            let total: f64 = bank.hypotheses().map(|h| h.probability).sum();
            assert!((total - 1.0).abs() < 1e-9, "{total}");
            assert!(bank.phase().is_finite());
        }
    }
}
