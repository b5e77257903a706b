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
fn noise_around_the_threshold_is_one_contact() {
    let mut s = Sampler::new(3);
    let mut d = detector();
    assert_eq!(
        changes(&mut d, (0..10_000).map(|_| 3.0 + 0.4 * s.normal())),
        (1, 0)
    );
}

#[test]
fn noise_around_the_lower_threshold_does_not_release() {
    let mut s = Sampler::new(4);
    let mut d = detector();
    let forces = (0..10_000).map(|i| if i < 5 { 4.0 } else { 1.6 + 0.3 * s.normal() });
    assert_eq!(changes(&mut d, forces), (1, 0));
}

#[test]
fn the_onset_is_the_first_sample_above() {
    let mut d = detector();
    changes(&mut d, [0.0, 2.9, 3.0, 3.1, 8.0, 8.0]);
    assert_eq!(
        d.state(),
        ContactState::Contact {
            since_s: 3.0 * DT_S
        }
    );
}

#[test]
fn a_release_takes_the_whole_dwell() {
    let mut d = detector();
    d.step(0.0, 5.0).unwrap();
    d.step(0.1, 0.0).unwrap();
    assert!(matches!(
        d.step(0.149, 0.0).unwrap(),
        ContactState::Contact { since_s: 0.0 }
    ));
    assert_eq!(d.step(0.151, 0.0).unwrap(), ContactState::NonContact);
}

#[test]
fn a_short_lapse_restarts_the_dwell() {
    let mut d = detector();
    d.step(0.0, 5.0).unwrap();
    for i in 0..20 {
        let t_s = 0.1 * f64::from(i + 1);
        d.step(t_s, 0.0).unwrap();
        assert!(matches!(
            d.step(t_s + 0.04, 0.0).unwrap(),
            ContactState::Contact { .. }
        ));
        d.step(t_s + 0.045, 2.0).unwrap();
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
fn a_clock_set_back_restarts_the_dwell() {
    let mut d = detector();
    d.step(10.0, 5.0).unwrap();
    d.step(10.1, 0.0).unwrap();
    assert!(matches!(
        d.step(0.0, 0.0).unwrap(),
        ContactState::Contact { .. }
    ));
    assert_eq!(d.step(0.06, 0.0).unwrap(), ContactState::NonContact);
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
