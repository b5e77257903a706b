//! An estimator in a stream: each reach is replayed from its beginning.

use crate::reaches::reaches;
use glam::DVec3;
use hwall_contact::{
    ContactEstimate, ContactEstimator, LearnedConfig, LearnedEstimator, LearnedModel,
    ReachBeginning, StreamEstimator,
};
use hwall_hand::{HandFilter, HandFilterConfig, HandFrame, HandPoint, WatchConfig};
use hwall_testkit::{Sampler, minimum_jerk};
use std::sync::LazyLock;

/// Records its input.
#[derive(Debug, Default)]
struct Diary {
    reaches: Vec<Vec<f64>>,
}

impl ContactEstimator for Diary {
    fn begin(&mut self) {
        self.reaches.push(Vec::new());
    }

    fn step(&mut self, frame: &HandFrame) -> Option<ContactEstimate> {
        self.reaches.last_mut()?.push(frame.t_s);
        Some(ContactEstimate::of_point(frame.t_s, DVec3::ZERO))
    }
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
        // A repeated sample gets the same answer and is not passed to the estimator.
        assert_eq!(stream.step(&frame, tracking.state()), estimate);
    }
    let reaches = &stream.estimator().reaches;
    assert_eq!(reaches.len(), 1);
    // The speed passes 0.1 m/s at 0.57 s; the filter lags, and the onset is detected later still.
    let (seen, first_s) = (&reaches[0], estimated_s[0]);
    assert!((0.54..0.61).contains(&seen[0]), "{}", seen[0]);
    assert!((0.62..0.72).contains(&first_s), "onset seen at {first_s}");
    assert!(seen.windows(2).all(|w| (w[1] - w[0] - 0.01).abs() < 1e-9));
    assert!((1.25..1.45).contains(estimated_s.last().unwrap()));
}

/// Counts the steps of an estimator, with or without tentative beginnings.
struct Counted {
    estimator: LearnedEstimator,
    gets_ahead: bool,
    steps: usize,
}

impl ContactEstimator for Counted {
    fn begin(&mut self) {
        self.estimator.begin();
    }

    fn begin_tentatively(&mut self) -> bool {
        self.gets_ahead && self.estimator.begin_tentatively()
    }

    fn confirm(&mut self) {
        self.estimator.confirm();
    }

    fn step(&mut self, frame: &HandFrame) -> Option<ContactEstimate> {
        self.steps += 1;
        self.estimator.step(frame)
    }

    fn touched(&mut self, contact_m: DVec3, contact_s: f64) {
        self.estimator.touched(contact_m, contact_s);
    }

    fn forget(&mut self) {
        self.estimator.forget();
    }
}

/// Reaches with rests before and after them, a return, and tracker noise.
fn session(tremor_m: f64) -> Vec<HandFrame> {
    let mut sampler = Sampler::new(5);
    let mut frames: Vec<HandFrame> = Vec::new();
    let mut add = |frame: &HandFrame, shift_m: DVec3| {
        let t_s = frames.len() as f64 / 90.0;
        let mut moved = HandFrame { t_s, ..*frame };
        let noise_m = sampler.normal_vector() * tremor_m;
        for point in HandPoint::ALL {
            let place_m = frame.point(point).map(|p| p + shift_m + noise_m);
            moved.set_point(point, place_m);
        }
        frames.push(moved);
    };
    for reach in reaches(3, 2, 8) {
        let (first, last) = (reach.frames[0], reach.frames[reach.frames.len() - 1]);
        (0..50).for_each(|_| add(&first, DVec3::ZERO));
        reach.frames.iter().for_each(|f| add(f, DVec3::ZERO));
        (0..40).for_each(|_| add(&last, DVec3::ZERO));
        // A twitch that is not a reach, then the return.
        (0..9).for_each(|k| add(&last, DVec3::X * 0.002 * f64::from(k)));
        (0..20).for_each(|_| add(&last, DVec3::X * 0.018));
        reach.frames.iter().rev().for_each(|f| add(f, DVec3::ZERO));
    }
    frames
}

#[test]
fn an_estimator_that_gets_ahead_of_an_onset_says_the_same_without_a_long_step() {
    for tremor_m in [0.0, 5e-4, 3e-3] {
        let [mut ahead, mut replayed] = streams();
        let mut filter = HandFilter::new(HandFilterConfig::simulated()).unwrap();
        let frames = session(tremor_m);
        let mut longest = [0, 0];
        for (i, frame) in frames.iter().enumerate() {
            let tracking = filter.step(frame);
            let before = [&ahead, &replayed].map(|s| s.estimator().steps);
            let estimate = ahead.step(frame, tracking.state());
            assert_eq!(estimate, replayed.step(frame, tracking.state()), "{i}");
            assert_eq!(ahead.began(), replayed.began());
            if ahead.began().is_some_and(|b| !b.turned) {
                for (k, stream) in [&ahead, &replayed].into_iter().enumerate() {
                    longest[k] = longest[k].max(stream.estimator().steps - before[k]);
                }
            }
            // Touches are reported during the reach, at rest and while a reach may be beginning.
            if i % 97 == 0 {
                for stream in [&mut ahead, &mut replayed] {
                    stream.touched(frame.point(HandPoint::Index).unwrap(), frame.t_s);
                }
            }
        }
        assert!(ahead.estimator().estimator.touches() > 5);
        if tremor_m == 0.0 {
            assert!(longest[0] <= 3 && longest[1] >= 5, "{longest:?}");
        }
    }
}

/// Streams of one model, with an estimator that supports tentative beginnings and with one that does not.
fn streams() -> [StreamEstimator<Counted>; 2] {
    static MODEL: LazyLock<LearnedModel> = LazyLock::new(|| {
        LearnedModel::train(&reaches(1, 3, 12), &LearnedConfig::default()).unwrap()
    });
    [true, false].map(|gets_ahead| {
        let counted = Counted {
            estimator: MODEL.estimator(),
            gets_ahead,
            steps: 0,
        };
        StreamEstimator::new(counted, WatchConfig::default()).unwrap()
    })
}

/// An estimate and the beginning of its reach.
type Answer = (Option<ContactEstimate>, Option<ReachBeginning>);

/// The answers of the streams, sample by sample.
fn answers(streams: &mut [StreamEstimator<Counted>; 2], frames: &[HandFrame]) -> Vec<Answer> {
    let mut filter = HandFilter::new(HandFilterConfig::simulated()).unwrap();
    let mut said = Vec::new();
    for frame in frames {
        // A filter reports a lost hand for a sample without a time.
        let tracking = filter.step(frame);
        let [ahead, replayed] = streams.each_mut().map(|stream| {
            let estimate = stream.step(frame, tracking.state());
            (estimate, stream.began().copied())
        });
        assert_eq!(ahead, replayed, "{} s", frame.t_s);
        said.push(ahead);
    }
    said
}

fn under_way(said: &[Answer]) -> usize {
    said.iter().filter(|said| said.0.is_some()).count()
}

#[test]
fn a_clock_that_is_set_back_starts_the_stream_anew() {
    let mut frames = session(0.0);
    frames.truncate(800);
    let fresh = answers(&mut streams(), &frames);
    let reach = (1..frames.len()).find(|&i| fresh[i].0.is_some()).unwrap();
    // At rest, where a reach may have begun, in its middle and after it.
    for set_back in [20, reach - 2, reach + 10, reach + 80] {
        let mut streams = streams();
        let before = answers(&mut streams, &frames[..set_back]);
        assert_eq!(before, fresh[..set_back]);
        assert_eq!(answers(&mut streams, &frames), fresh, "{set_back}");
    }
    // A hand that moves during a clock reset has not turned.
    let mut streams = streams();
    answers(&mut streams, &frames[..reach + 10]);
    let said = answers(&mut streams, &frames[reach + 5..reach + 30]);
    let mut began = said.iter().filter_map(|(_, began)| began.as_ref());
    assert!(began.all(|began| !began.turned));
}

/// Regression test: a reach forgot its beginning at a sample without a time.
#[test]
fn samples_without_a_time_change_nothing_of_the_others() {
    let frames = session(5e-4);
    let fresh = answers(&mut streams(), &frames);
    assert!(under_way(&fresh) > 100);
    let mut streams = streams();
    let mut filter = HandFilter::new(HandFilterConfig::simulated()).unwrap();
    for (i, (frame, said)) in frames.iter().zip(&fresh).enumerate() {
        let tracking = filter.step(frame);
        for stream in &mut streams {
            if i % 5 == 2 {
                for t_s in [f64::NAN, f64::INFINITY] {
                    let frame = HandFrame { t_s, ..*frame };
                    assert_eq!(stream.step(&frame, tracking.state()), None);
                    assert_eq!(stream.step(&frame, None), None);
                }
            }
            let estimate = stream.step(frame, tracking.state());
            assert_eq!((estimate, stream.began().copied()), *said, "{i}");
        }
    }
}

#[test]
fn after_a_reset_a_stream_is_a_new_one() {
    let mut frames = session(0.0);
    frames.truncate(800);
    let fresh = answers(&mut streams(), &frames);
    let ends = (1..frames.len()).find(|&i| fresh[i - 1].0.is_some() && fresh[i].0.is_none());
    // Between reaches, and during one; later times, and repeated ones.
    for at in [ends.unwrap() + 5, ends.unwrap() - 5] {
        for later_s in [0.0, 100.0] {
            let mut streams = streams();
            answers(&mut streams, &frames[..at]);
            for stream in &mut streams {
                stream.touched(DVec3::new(0.2, 0.3, 1.1), frames[at].t_s);
                assert_eq!(stream.estimator().estimator.touches(), 1);
                stream.reset();
                assert_eq!(stream.estimator().estimator.touches(), 0);
                assert!(!stream.reaching() && stream.began().is_none());
                assert!(stream.estimate().is_none());
            }
            let later = |frame: &HandFrame| HandFrame {
                t_s: frame.t_s + later_s,
                ..*frame
            };
            let frames: Vec<HandFrame> = frames.iter().map(later).collect();
            let again = answers(&mut streams, &frames);
            let expected = answers(&mut self::streams(), &frames);
            assert_eq!(again, expected);
            assert!(under_way(&again) > 100);
        }
    }
}
