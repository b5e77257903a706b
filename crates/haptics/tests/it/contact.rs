//! The contact state machine on simulated forces.

use crate::support::DT_S;
use hwall_haptics::{ArgumentError, ContactConfig, ContactDetector, ContactState, HapticsError};
use hwall_testkit::{Sampler, refused};

/// Number of onsets and of ends over the samples.
fn changes(
    detector: &mut ContactDetector,
    forces: impl IntoIterator<Item = f64>,
) -> (usize, usize) {
    let (mut on, mut off, mut before) = (0, 0, detector.state());
    for (i, force_n) in forces.into_iter().enumerate() {
        let state = detector.step(i as f64 * DT_S, force_n).unwrap();
        match (before, state) {
            (ContactState::NonContact, ContactState::Contact { .. }) => on += 1,
            (ContactState::Contact { .. }, ContactState::NonContact) => off += 1,
            _ => {}
        }
        before = state;
    }
    (on, off)
}

fn detector() -> ContactDetector {
    ContactDetector::new(ContactConfig::default()).unwrap()
}

#[test]
fn noise_around_the_thresholds_is_one_contact() {
    let mut s = Sampler::new(3);
    let around_the_upper: Vec<f64> = (0..10_000).map(|_| 3.0 + 0.4 * s.normal()).collect();
    let around_the_lower = (0..10_000).map(|i| if i < 5 { 4.0 } else { 1.6 + 0.3 * s.normal() });
    for forces in [around_the_upper, around_the_lower.collect()] {
        assert_eq!(changes(&mut detector(), forces), (1, 0));
    }
}

/// Times, s, forces, N, and the onset of the contact, s.
type Script<'a> = &'a [(f64, f64, Option<f64>)];

#[test]
fn the_onset_is_the_first_sample_above_and_a_release_takes_the_whole_dwell() {
    let onset: Script<'_> = &[
        (0.0, 0.0, None),
        (0.1, 2.9, None),
        (0.2, 3.0, None),
        (0.3, 3.1, Some(0.3)),
        (0.4, 8.0, Some(0.3)),
        (0.5, 8.0, Some(0.3)),
    ];
    let release: Script<'_> = &[
        (0.0, 5.0, Some(0.0)),
        (0.1, 0.0, Some(0.0)),
        (0.149, 0.0, Some(0.0)),
        (0.151, 0.0, None),
    ];
    let set_back: Script<'_> = &[
        (10.0, 5.0, Some(10.0)),
        (10.1, 0.0, Some(10.0)),
        (0.0, 0.0, Some(10.0)),
        (0.06, 0.0, None),
    ];
    for script in [onset, release, set_back] {
        let mut d = detector();
        for &(t_s, force_n, since_s) in script {
            let state = since_s.map_or(ContactState::NonContact, |since_s| ContactState::Contact {
                since_s,
            });
            let found = d.step(t_s, force_n).unwrap();
            assert_eq!(found, state, "{t_s} s of {script:?}");
        }
    }
}

#[test]
fn a_short_lapse_restarts_the_dwell() {
    let mut d = detector();
    let lapse =
        |i: u32| [(0.1, 0.0), (0.14, 0.0), (0.145, 2.0)].map(|(t, n)| (t + 0.1 * f64::from(i), n));
    for (t_s, force_n) in [(0.0, 5.0)].into_iter().chain((0..20).flat_map(lapse)) {
        let state = d.step(t_s, force_n).unwrap();
        assert_eq!(state, ContactState::Contact { since_s: 0.0 }, "{t_s}");
    }
}

#[test]
fn nan_is_an_error_and_keeps_the_state() {
    let mut d = detector();
    d.step(0.0, 5.0).unwrap();
    let before = d;
    for (t_s, force_n) in [
        (1.0, f64::NAN),
        (f64::NAN, 0.0),
        (f64::INFINITY, 0.0),
        (1.0, f64::NEG_INFINITY),
    ] {
        assert!(matches!(
            d.step(t_s, force_n),
            Err(HapticsError::Argument(ArgumentError::NonFinite { .. }))
        ));
        assert_eq!(d, before);
    }
}

#[test]
fn settings_out_of_range_are_named() {
    let above_on_n = ContactConfig::default().on_n + 0.5;
    refused!(ContactConfig::default(), ContactDetector::new, {
        on_n = f64::NAN, -3.0;
        off_n = f64::NAN, above_on_n;
        dwell_s = f64::INFINITY;
    });
    let equal = ContactConfig {
        on_n: 3.0,
        off_n: 3.0,
        dwell_s: 0.0,
    };
    assert!(ContactDetector::new(equal).is_ok());
}
