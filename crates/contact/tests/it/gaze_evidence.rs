//! The information of a fixation about the next contact is learned from people, and used during the fixation.

use crate::common::{self, EYE, ball, blurred, gaze_at, plain_scene};
use glam::{DQuat, DVec3};
use hwall_contact::*;
use hwall_hand::{Fixation, Gaze, GazeFilter, HandFilter, HandFilterConfig, HandFrame, HandPoint};
use hwall_testkit::{Sampler, Tol, assert_close, minimum_jerk};

const REST: DVec3 = DVec3::new(0.0, 0.0, 1.2);
const PERIOD_S: f64 = 1.0 / 90.0;

/// Predicts only that a reach ends somewhere on the wall.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Vague;

impl ContactEstimator for Vague {
    fn begin(&mut self) {}

    fn step(&mut self, frame: &HandFrame) -> Option<ContactEstimate> {
        Some(ContactEstimate {
            covariance_m2: Some(ball(0.25)),
            ..ContactEstimate::of_point(frame.t_s, DVec3::new(0.7, 0.0, 1.2))
        })
    }
}

/// Gaze behaviour before a reach.
#[derive(Debug, Clone, Copy)]
struct Habits {
    /// Number of fixations on places that are not touched, before each touch.
    glances: usize,
    /// Duration of each, s.
    glance_s: [f64; 2],
    /// Duration of the preceding fixation straight ahead, s.
    ahead_s: f64,
    /// Lead of the fixation on the target before the hand, s.
    lead_s: f64,
}

/// One person's samples and contacts on a wall at x = 0.7 m.
fn person(habits: &Habits, touches: usize, seed: u64) -> (Vec<HandFrame>, Vec<StreamContact>) {
    let mut sampler = Sampler::new(seed);
    let ahead = DVec3::new(0.7, 0.1, 1.45);
    let mut on_wall = {
        let mut places = Sampler::new(seed + 1000);
        move || DVec3::new(0.7, places.uniform(-0.5, 0.5), places.uniform(0.9, 1.5))
    };
    // Fixations with their start times, and hand movements with start and end.
    let (mut dwells, mut ways, mut contacts) = (vec![(0.0, ahead)], Vec::new(), Vec::new());
    let mut t_s = 0.0;
    for _ in 0..touches {
        t_s += habits.ahead_s;
        for _ in 0..habits.glances {
            dwells.push((t_s, on_wall()));
            t_s += sampler.uniform(habits.glance_s[0], habits.glance_s[1]);
        }
        let target_m = on_wall();
        dwells.push((t_s, target_m));
        t_s += habits.lead_s;
        let there_s = t_s + 0.7;
        ways.push((t_s, there_s, REST, target_m));
        contacts.push(StreamContact {
            point_m: target_m,
            contact_s: there_s,
        });
        let back_s = there_s + 0.3;
        dwells.push((back_s, ahead));
        ways.push((back_s, back_s + 0.6, target_m, REST));
        t_s = back_s + 0.8;
    }
    let frames = (0..(t_s / PERIOD_S) as usize)
        .map(|i| {
            let t_s = i as f64 * PERIOD_S;
            let mut frame = HandFrame::empty(t_s);
            let hand_m = ways.iter().rfind(|w| w.0 <= t_s);
            let hand_m = hand_m.map_or(REST, |&(from_s, to_s, from_m, to_m)| {
                from_m.lerp(to_m, minimum_jerk((t_s - from_s) / (to_s - from_s)))
            });
            let noise = sampler.normal_vector() * 5e-4;
            frame.set_point(HandPoint::Index, Some(hand_m + noise));
            frame.head_m = Some(EYE);
            let seen_m = dwells.iter().rfind(|l| l.0 <= t_s).unwrap().1;
            let exact = gaze_at(EYE, seen_m).direction;
            frame.gaze = Some(blurred(&mut sampler, exact, 0.009));
            frame
        })
        .collect();
    (frames, contacts)
}

fn model_of(habits: &Habits) -> EvidenceModel {
    let people: Vec<_> = (0..8).map(|seed| person(habits, 12, seed)).collect();
    let streams: Vec<_> = people
        .iter()
        .map(|(frames, contacts)| LabelledStream { frames, contacts })
        .collect();
    EvidenceModel::default()
        .fit_streams(&streams, |_| Vague, &simulated())
        .unwrap()
}

fn simulated() -> StreamFilters {
    StreamFilters {
        hand: HandFilterConfig::simulated(),
        ..StreamFilters::default()
    }
}

const STEADY: Habits = Habits {
    glances: 0,
    glance_s: [0.2, 0.5],
    ahead_s: 1.5,
    lead_s: 0.35,
};
const GLANCING: Habits = Habits {
    glances: 3,
    lead_s: 0.9,
    ..STEADY
};

#[test]
fn how_long_a_look_precedes_a_reach_is_learnt() {
    let steady = model_of(&STEADY);
    assert_eq!(steady.touches, 96);
    // If a person looks at one thing and touches it, a recent fixation is on the target and an old one is straight ahead.
    let now = |model: &EvidenceModel, age_s: f64| {
        model.shares(ReachPhase::Rest, Some(age_s), None)[EvidenceSource::Fixation as usize]
    };
    let young = [0.15, 0.3].map(|age_s| now(&steady, age_s));
    assert!(young.iter().all(|share| *share > 0.85), "{steady:?}");
    assert!(now(&steady, 1.5) < 0.1);
    // If a person glances around, the longest of four fixations is on the target. The oldest are straight ahead.
    let glancing = model_of(&GLANCING);
    let [glimpse, young, old, oldest] = [0.05, 0.15, 0.6, 1.5].map(|age_s| now(&glancing, age_s));
    assert!(glimpse < 0.4 && oldest < 0.2, "{glancing:?}");
    assert!(old > young + 0.3, "{glancing:?}");
    // While moving, the hand follows the fixated place.
    for model in [&steady, &glancing] {
        let on_the_way = model.shares(ReachPhase::UnderWay, Some(0.8), Some(0.0));
        let looked_at = [EvidenceSource::MotionAndFixation, EvidenceSource::Fixation];
        let share: f64 = looked_at.map(|s| on_the_way[s as usize]).iter().sum();
        assert!(share > 0.85, "{model:?}");
        assert_close!(model.on_target_sd_rad, 0.002, Tol::abs(0.004));
        assert_close!(model.rest.mean_m, DVec3::new(0.7, 0.0, 0.0), Tol::abs(0.12));
    }
}

/// Knows the next contacts up to an error, and states another one.
#[derive(Debug, Clone)]
struct Knows {
    contacts: Vec<(f64, DVec3)>,
    states_m: f64,
}

impl Knows {
    fn of(contacts: &[StreamContact], [errs_m, states_m]: [f64; 2], seed: u64) -> Self {
        let mut sampler = Sampler::new(seed);
        let known = |contact: &StreamContact| {
            let point_m = contact.point_m + sampler.normal_vector() * errs_m;
            (contact.contact_s, point_m)
        };
        Self {
            contacts: contacts.iter().map(known).collect(),
            states_m,
        }
    }
}

impl ContactEstimator for Knows {
    fn begin(&mut self) {}

    fn step(&mut self, frame: &HandFrame) -> Option<ContactEstimate> {
        let mut contacts = self.contacts.iter();
        let next = contacts.find(|(contact_s, _)| frame.t_s < *contact_s);
        next.map(|(_, point_m)| ContactEstimate {
            covariance_m2: Some(ball(self.states_m)),
            ..ContactEstimate::of_point(frame.t_s, *point_m)
        })
    }
}

/// Predictions of a stream, with feedback, while the contact is this far away in time, s; and the contacts.
fn followed<E: ContactEstimator>(
    predictor: &mut FusedPredictor<E>,
    (frames, contacts): &(Vec<HandFrame>, Vec<StreamContact>),
    before_s: [f64; 2],
) -> Vec<(ContactPrediction, DVec3)> {
    let scene = plain_scene(&[("wall", common::WALL)]);
    let mut hand = HandFilter::new(HandFilterConfig::simulated()).unwrap();
    let mut gaze = GazeFilter::default();
    let mut found = Vec::new();
    let mut left = &contacts[..];
    for frame in frames {
        if let Some((first, rest)) = left.split_first()
            && frame.t_s >= first.contact_s
        {
            predictor.touched(first.point_m, first.contact_s);
            left = rest;
        }
        let tracking = hand.step(frame);
        let input = PredictorInput {
            frame,
            hand: tracking.state(),
            gaze: gaze.step(frame.t_s, frame.gaze_ray().as_ref()),
        };
        let first = predictor.predict(&scene, &input).first().copied();
        let due = left.iter().find(|contact| {
            let left_s = contact.contact_s - frame.t_s;
            before_s[0] < left_s && left_s <= before_s[1]
        });
        found.extend(first.zip(due.map(|contact| contact.point_m)));
    }
    found
}

#[test]
fn how_an_estimator_errs_is_learnt_whatever_it_states() {
    let mut people: Vec<_> = (0..8).map(|seed| person(&STEADY, 12, seed)).collect();
    for (frames, _) in &mut people {
        frames.iter_mut().for_each(|frame| frame.gaze = None);
    }
    let stream = |(frames, contacts)| LabelledStream { frames, contacts };
    let streams: Vec<_> = (people[1..].iter().map(|(f, c)| stream((f, c)))).collect();
    // Errors made and stated, m: the estimator states too much, too little, and no error where it makes none.
    for (errs, within_m) in [
        ([0.03, 0.09], 0.02..0.05),
        ([0.08, 0.02], 0.05..0.14),
        ([0.0, 0.0], 0.0..0.02),
    ] {
        let estimator = |i: usize| Knows::of(streams[i].contacts, errs, i as u64);
        let evidence = EvidenceModel::default()
            .fit_streams(&streams, estimator, &simulated())
            .unwrap();
        let config = FusedConfig {
            evidence,
            registration_sd_m: 0.0,
            ..FusedConfig::default()
        };
        let known = Knows::of(&people[0].1, errs, 99);
        let mut predictor = FusedPredictor::new(known, config).unwrap();
        let found = followed(&mut predictor, &people[0], [0.0, 0.3]);
        let sd_m = |(prediction, _): &(ContactPrediction, DVec3)| {
            prediction.covariance_m2.unwrap().y_axis.y.sqrt()
        };
        let mut sds_m: Vec<f64> = found.iter().map(sd_m).collect();
        sds_m.sort_by(f64::total_cmp);
        let median_m = sds_m[sds_m.len() / 2];
        assert!(found.len() > 200, "{}", found.len());
        assert!(within_m.contains(&median_m), "{errs:?}: {median_m}");
    }
}

#[test]
fn a_constant_error_of_the_gaze_is_learnt_from_touches() {
    // Calibrated eye trackers are off by 1 to 3 degrees.
    let off = DQuat::from_rotation_y(-2.5_f64.to_radians());
    let off = DQuat::from_rotation_z(1.5_f64.to_radians()) * off;
    let mut watched = person(&STEADY, 16, 5);
    for frame in &mut watched.0 {
        frame.gaze = frame.gaze.map(|gaze| off * gaze);
    }
    let mut predictor = FusedPredictor::new(Vague, FusedConfig::default()).unwrap();
    let errors_m = |predictor: &mut FusedPredictor<Vague>| {
        let found = followed(predictor, &watched, [0.6, 0.75]);
        let quarter = found.len() / 4;
        let mean_m = |part: &[(ContactPrediction, DVec3)]| {
            let sum_m: f64 = part.iter().map(|(p, at_m)| p.point_m.distance(*at_m)).sum();
            sum_m / part.len() as f64
        };
        [
            mean_m(&found[..quarter]),
            mean_m(&found[found.len() - quarter..]),
        ]
    };
    let [first_m, last_m] = errors_m(&mut predictor);
    assert!(
        first_m > 0.02 && last_m < 0.6 * first_m,
        "{first_m} {last_m}"
    );
    // Another person comes.
    predictor.reset();
    let [again_m, _] = errors_m(&mut predictor);
    assert!((again_m - first_m).abs() < 1e-12, "{first_m} {again_m}");
}

#[test]
fn what_a_look_means_is_told_while_it_lasts() {
    let config = FusedConfig {
        evidence: model_of(&GLANCING),
        ..FusedConfig::default()
    };
    let scene = plain_scene(&[("wall", common::WALL)]);
    let target_m = DVec3::new(0.7, 0.4, 1.0);
    let mut predictor = FusedPredictor::new(Vague, config).unwrap();
    let mut filter = HandFilter::new(HandFilterConfig::simulated()).unwrap();
    let sd_m_at = |age_s: f64| {
        let mut last = None;
        predictor.reset();
        filter.reset();
        for i in 0..((0.3 + age_s) / PERIOD_S) as usize {
            let t_s = i as f64 * PERIOD_S;
            let mut frame = HandFrame::empty(t_s);
            frame.set_point(HandPoint::Index, Some(REST));
            let tracking = filter.step(&frame);
            let (since_s, seen_m) = match t_s < 0.3 {
                true => (0.0, DVec3::new(0.7, -0.3, 1.5)),
                false => (0.3, target_m),
            };
            let input = PredictorInput {
                frame: &frame,
                hand: tracking.state(),
                gaze: Gaze::Fixed(Fixation::of_ray(since_s, t_s, gaze_at(EYE, seen_m))),
            };
            last = predictor.predict(&scene, &input).first().copied();
        }
        let last = last.unwrap();
        let off_m = last.point_m.distance(target_m);
        assert!(age_s < 0.5 || off_m < 0.05, "{last:?}");
        let c = last.covariance_m2.unwrap();
        (c.y_axis.y + c.z_axis.z).sqrt()
    };
    // The longer a person who glances around fixates a place, the more certain the prediction is.
    let [young_m, old_m] = [0.1, 0.6].map(sd_m_at);
    assert!(old_m < 0.8 * young_m, "{young_m} {old_m}");
}

#[test]
fn streams_that_teach_nothing_are_refused_and_those_without_a_gaze_teach_the_rest() {
    let (frames, contacts) = person(&STEADY, 12, 3);
    let fit = |frames: &[HandFrame], contacts: &[StreamContact]| {
        let stream = LabelledStream { frames, contacts };
        EvidenceModel::default().fit_streams(&[stream], |_| Vague, &simulated())
    };
    assert!(matches!(
        fit(&frames, &contacts[..3]),
        Err(ContactError::TooFewReaches { got: 3, .. })
    ));
    let mut bad = contacts.clone();
    bad[2].point_m.y = f64::NAN;
    assert!(matches!(fit(&frames, &bad), Err(ContactError::Argument(_))));
    let mut blind = frames;
    blind.iter_mut().for_each(|frame| frame.gaze = None);
    let model = fit(&blind, &contacts).unwrap();
    let nominal = EvidenceModel::default();
    assert_eq!(model.on_target_sd_rad, nominal.on_target_sd_rad);
    assert!(model.rest.mean_m.x > 0.3, "{:?}", model.rest);
}

#[test]
fn the_filter_and_the_fusion_together_are_right_soon_after_the_landing() {
    let config = FusedConfig {
        evidence: model_of(&STEADY),
        ..FusedConfig::default()
    };
    let mut predictor = FusedPredictor::new(Vague, config).unwrap();
    let (mut right, mut all) = (0, 0);
    for seed in 100..104 {
        predictor.reset();
        // From 0.1 s after the landing to the contact; the gaze leads the hand by 0.35 s, and the hand takes 0.7 s.
        for (p, contact_m) in followed(&mut predictor, &person(&STEADY, 8, seed), [0.0, 0.95]) {
            all += 1;
            right += usize::from(p.point_m.distance(contact_m) < 0.05);
        }
    }
    assert!(
        all > 2000 && right as f64 > 0.97 * all as f64,
        "{right} of {all}"
    );
}
