//! A step of a filter does not allocate.

use hwall_bip::{
    Bank, BankConfig, Basis, Demonstration, Filter, FilterConfig, Gate, Group, Model, Observation,
    TrainingConfig,
};
use hwall_testkit::Sampler;

#[test]
fn steps_do_not_allocate() {
    let mut sampler = Sampler::new(31);
    let demonstrations: Vec<Demonstration> = (0..12)
        .map(|_| {
            let goal = sampler.uniform(0.3, 0.8);
            let values = (0..60)
                .flat_map(|k| {
                    let t = f64::from(k) / 59.0;
                    [goal * t * t, goal * t].map(|x| x + 1e-3 * sampler.normal())
                })
                .collect();
            Demonstration::from_samples(1.0, 2, values).unwrap()
        })
        .collect();
    let basis = Basis::Legendre { count: 6 };
    let groups = vec![Group::observed("hand", 2, basis)];
    let model = Model::train(&demonstrations, &TrainingConfig::new(groups)).unwrap();
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
