//! An estimator in a stream: each reach is replayed from where it began.

use glam::DVec3;
use hwall_contact::{ContactEstimate, ContactEstimator, StreamEstimator};
use hwall_hand::{HandFilter, HandFilterConfig, HandFrame, WatchConfig};

/// Writes down what it is given.
#[derive(Debug, Default)]
struct Diary {
    reaches: Vec<Vec<f64>>,
    touches: Vec<DVec3>,
}

impl ContactEstimator for Diary {
    fn begin(&mut self) {
        self.reaches.push(Vec::new());
    }

    fn step(&mut self, frame: &HandFrame) -> Option<ContactEstimate> {
        self.reaches.last_mut()?.push(frame.t_s);
        Some(ContactEstimate::of_point(frame.t_s, DVec3::ZERO))
    }

    fn touched(&mut self, contact_m: DVec3, _: f64) {
        self.touches.push(contact_m);
    }

    fn forget(&mut self) {
        self.touches.clear();
    }
}

fn minimum_jerk(t: f64) -> f64 {
    let s = t.clamp(0.0, 1.0);
    s * s * s * (10.0 - 15.0 * s + 6.0 * s * s)
}

/// A palm at rest until 0.5 s that then moves 0.6 m in 0.8 s.
fn frame(t_s: f64) -> HandFrame {
    HandFrame {
        palm_m: Some(DVec3::new(0.6 * minimum_jerk((t_s - 0.5) / 0.8), 0.0, 1.0)),
        ..HandFrame::empty(t_s)
    }
}

#[test]
fn a_reach_is_replayed_from_where_it_began_and_ends_at_rest() {
    let mut filter = HandFilter::new(HandFilterConfig::simulated()).unwrap();
    let mut stream = StreamEstimator::new(Diary::default(), WatchConfig::default()).unwrap();
    let mut estimated_s = Vec::new();
    for i in 0..300 {
        let frame = frame(0.01 * f64::from(i));
        let tracking = filter.step(&frame);
        let estimate = stream.step(&frame, tracking.state());
        assert_eq!(estimate.is_some(), stream.reaching());
        assert_eq!(stream.estimate(), estimate.as_ref());
        estimated_s.extend(estimate.map(|e| e.t_s));
        // A repeated sample gets the same answer and does not reach the estimator.
        assert_eq!(stream.step(&frame, tracking.state()), estimate);
    }
    let reaches = &stream.estimator().reaches;
    assert_eq!(reaches.len(), 1);
    // The speed passes 0.1 m/s at 0.57 s, the filter is late, and the onset is seen later still.
    let (seen, first_s) = (&reaches[0], estimated_s[0]);
    assert!((0.54..0.61).contains(&seen[0]), "{}", seen[0]);
    assert!((0.62..0.72).contains(&first_s), "onset seen at {first_s}");
    assert!(seen.windows(2).all(|w| (w[1] - w[0] - 0.01).abs() < 1e-9));
    assert!((1.25..1.45).contains(estimated_s.last().unwrap()));
}

#[test]
fn samples_without_a_time_have_no_estimate_and_a_reset_forgets() {
    let mut filter = HandFilter::new(HandFilterConfig::simulated()).unwrap();
    let mut stream = StreamEstimator::new(Diary::default(), WatchConfig::default()).unwrap();
    for i in 0..90 {
        let frame = frame(0.01 * f64::from(i));
        let tracking = filter.step(&frame);
        stream.step(&frame, tracking.state());
    }
    assert!(stream.reaching() && stream.estimate().is_some());
    assert_eq!(stream.step(&HandFrame::empty(f64::NAN), None), None);
    stream.reset();
    assert!(!stream.reaching() && stream.estimate().is_none());
}

#[test]
fn touches_reach_the_estimator_and_a_reset_forgets_them() {
    let mut stream = StreamEstimator::new(Diary::default(), WatchConfig::default()).unwrap();
    stream.touched(DVec3::ONE, 1.0);
    assert_eq!(stream.estimator().touches, [DVec3::ONE]);
    stream.reset();
    assert!(stream.estimator().touches.is_empty());
}
