//! A step of a filter does not allocate.

use crate::common::{reaches, trained};
use hwall_bip::{Bank, BankConfig, Basis, Filter, FilterConfig, Gate, Observation};

#[test]
fn steps_do_not_allocate() {
    let demonstrations = reaches(31, 12, 2);
    let model = trained(&demonstrations, Basis::Legendre { count: 6 });
    let config = FilterConfig {
        gate: Some(Gate::default()),
        ..FilterConfig::default()
    };
    let mut filter = Filter::new(&model, &config).unwrap();
    let bank_config = BankConfig {
        filter: config,
        ..BankConfig::default()
    };
    let mut bank = Bank::new(&model, &bank_config).unwrap();
    let seen = &demonstrations[0];
    let covariance = [1e-4, 2e-5, 2e-5, 1e-4];
    let info = allocation_counter::measure(|| {
        let (mut mean, mut variance, mut full) = ([0.0; 2], [0.0; 2], [0.0; 4]);
        for k in 0..seen.len() {
            let observation = Observation::new(&[0, 1], seen.sample(k));
            filter.predict(1.0).unwrap();
            filter.observe(&observation).unwrap();
            filter
                .observe_at(1.0, &observation.with_covariance(&covariance))
                .unwrap();
            filter.observe_phase(0.5, 0.1).unwrap();
            filter
                .moments_at(1.0, &[0, 1], &mut mean, &mut variance)
                .unwrap();
            filter
                .covariance_at(1.0, &[0, 1], &mut mean, &mut full)
                .unwrap();
            assert!(filter.time_to_end().is_none_or(|t| t.sd >= 0.0));
            bank.predict(1.0).unwrap();
            bank.observe(&observation).unwrap();
            bank.moments_at(1.0, &[0, 1], &mut mean, &mut variance)
                .unwrap();
            assert!(bank.time_to_end().is_none_or(|t| t.sd >= 0.0));
        }
    });
    assert_eq!(info.count_total, 0);
}
