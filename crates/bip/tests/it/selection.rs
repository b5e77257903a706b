//! Choice of the basis: simulated motions and the reference.

use crate::common::{json, reference, training_set};
use hwall_bip::{
    ArgumentError, Basis, BipError, Criterion, Demonstration, Group, SelectionConfig,
    default_candidates, select_groups,
};
use hwall_testkit::Sampler;
use serde_json::Value;

const ALL: [Criterion; 3] = [Criterion::Aic, Criterion::Bic, Criterion::LeaveOneOut];

/// Motions whose values are polynomials of these degrees, with noise.
fn polynomials(seed: u64, count: usize, degrees: &[usize], noise: f64) -> Vec<Demonstration> {
    let mut sampler = Sampler::new(seed);
    (0..count)
        .map(|_| {
            let samples = 60 + sampler.index(40);
            let shape: Vec<Vec<f64>> = degrees
                .iter()
                .map(|degree| (0..=*degree).map(|_| sampler.uniform(0.5, 1.0)).collect())
                .collect();
            let mut values = Vec::new();
            for k in 0..samples {
                let x = 2.0 * k as f64 / (samples - 1) as f64 - 1.0;
                for shape in &shape {
                    let clean: f64 = shape.iter().rev().fold(0.0, |sum, c| sum * x + c);
                    values.push(clean + noise * sampler.normal());
                }
            }
            Demonstration::from_samples(0.1, degrees.len(), values).unwrap()
        })
        .collect()
}

/// The basis chosen for all degrees of freedom as one group.
fn choose(
    demonstrations: &[Demonstration],
    dofs: usize,
    candidates: &[Basis],
    criterion: Criterion,
    config: &SelectionConfig,
) -> Result<Basis, BipError> {
    let groups = [Group::observed("a", dofs, Basis::gaussian(2))];
    select_groups(demonstrations, &groups, candidates, criterion, config).map(|g| g[0].basis)
}

#[test]
fn criteria_find_the_planted_degree() {
    let candidates: Vec<Basis> = (2..=12).map(|count| Basis::Legendre { count }).collect();
    for (seed, degree) in [(1, 3), (2, 5), (3, 8)] {
        let demonstrations = polynomials(seed, 15, &[degree; 2], 0.01);
        for criterion in ALL {
            let config = SelectionConfig::default();
            let best = choose(&demonstrations, 2, &candidates, criterion, &config).unwrap();
            // Akaike's criterion may take more, never fewer.
            let more = criterion == Criterion::Aic && best.count() > degree + 1;
            assert!(more || best.count() == degree + 1, "{criterion:?}: {best}");
        }
    }
}

#[test]
fn groups_are_chosen_one_by_one() {
    let demonstrations = polynomials(5, 8, &[2, 2, 6, 6], 0.01);
    let any = Basis::gaussian(2);
    let groups = [
        Group::observed("slow", 2, any),
        Group::controlled("fast", 2, any),
    ];
    let (candidates, config) = (default_candidates(), SelectionConfig::default());
    let bic = Criterion::Bic;
    let chosen = select_groups(&demonstrations, &groups, &candidates, bic, &config).unwrap();
    let expected = groups.iter().zip([3, 7]).map(|(group, count)| Group {
        basis: Basis::Legendre { count },
        ..group.clone()
    });
    assert!(chosen.into_iter().eq(expected));
}

#[test]
fn bad_requests_are_errors() {
    let demonstrations = polynomials(7, 3, &[2; 2], 0.01);
    let line = [Basis::Legendre { count: 2 }];
    let nominal = SelectionConfig::default();
    let (aic, left_out) = (Criterion::Aic, Criterion::LeaveOneOut);
    let of = |dofs, candidates: &[Basis], criterion, config: &SelectionConfig| {
        choose(&demonstrations, dofs, candidates, criterion, config)
    };
    assert!(of(2, &line, left_out, &nominal).is_ok());
    let out_of_range =
        |e: &BipError| matches!(e, BipError::Argument(ArgumentError::OutOfRange { .. }));
    let argument = |e: &BipError| matches!(e, BipError::Argument(_));
    let unknown = |e: &BipError| *e == BipError::UnknownDof { dof: 2, dofs: 2 };
    let too_few = |e: &BipError| matches!(e, BipError::TooFewDemonstrations { .. });
    let nan = SelectionConfig {
        noise_floor: f64::NAN,
        ..nominal.clone()
    };
    let none_held_out = SelectionConfig {
        held_out: 0,
        ..nominal.clone()
    };
    let no_basis = [Basis::Legendre { count: 0 }];
    let single = choose(&demonstrations[..1], 2, &line, left_out, &nominal);
    type Check<'a> = &'a dyn Fn(&BipError) -> bool;
    let cases: [(Result<Basis, BipError>, Check<'_>); 8] = [
        (choose(&[], 1, &line, aic, &nominal), &too_few),
        (single, &too_few),
        (of(3, &line, aic, &nominal), &unknown),
        (of(0, &line, aic, &nominal), &out_of_range),
        (of(2, &[], aic, &nominal), &out_of_range),
        (of(2, &no_basis, aic, &nominal), &out_of_range),
        (of(2, &line, aic, &nan), &argument),
        (of(2, &line, left_out, &none_held_out), &too_few),
    ];
    for (at, (result, expected)) in cases.iter().enumerate() {
        assert!(result.as_ref().is_err_and(expected), "{at}: {result:?}");
    }
}

/// Exact fits, constant columns, fewer samples than functions, a single demonstration.
#[test]
fn degenerate_demonstrations_have_a_best_basis() {
    let set = |values: &[f64], count: usize| {
        vec![Demonstration::from_samples(1.0, 1, values.to_vec()).unwrap(); count]
    };
    let (short, candidates) = ([0.0, 1.0, 4.0], default_candidates());
    for demonstrations in [
        set(&[2.0; 30], 1),
        set(&[0.0; 30], 1),
        set(&[2.0; 30], 3),
        set(&short, 1),
        set(&short, 4),
    ] {
        for criterion in ALL {
            let config = SelectionConfig::default();
            let best = choose(&demonstrations, 1, &candidates, criterion, &config);
            let enough = criterion != Criterion::LeaveOneOut || demonstrations.len() > 1;
            assert_eq!(best.is_ok(), enough, "{best:?}");
        }
    }
}

/// Among the 75 candidates of the reference, uncentred as in the reference, BIC selects nine functions for
/// both parts.
#[test]
fn choice_agrees_with_the_reference() {
    let Some(reference) = reference() else { return };
    let demonstrations = training_set(&reference);
    let entries = json(&reference.join("aic_bic.json"));
    let config = SelectionConfig {
        centre: false,
        ..SelectionConfig::default()
    };
    let candidates: Vec<Basis> = entries["hand"]
        .as_array()
        .unwrap()
        .iter()
        .map(candidate)
        .collect();
    assert_eq!(candidates.len(), 75);
    let groups = [("hand", 18), ("robot", 7)]
        .map(|(part, dofs)| Group::observed(part, dofs, Basis::gaussian(2)));
    let bic = Criterion::Bic;
    let chosen = select_groups(&demonstrations, &groups, &candidates, bic, &config).unwrap();
    let nine = chosen.iter().all(|group| group.basis.count() == 9);
    assert!(nine, "{chosen:?}");
}

fn candidate(entry: &Value) -> Basis {
    let count = entry["degree"].as_u64().unwrap() as usize;
    let size = entry["scale"].as_f64().unwrap_or_default();
    match entry["model"].as_str().unwrap() {
        "PolynomialModel" => Basis::Polynomial { count },
        "GaussianModel" => Basis::Gaussian {
            count,
            variance: size,
        },
        _ => Basis::Sigmoid { count, width: size },
    }
}
