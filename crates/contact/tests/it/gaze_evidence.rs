//! The information of a fixation about the next contact is learned from people, and used during the fixation.

use crate::common::{self, EYE, ball, blurred, gaze_at, scene};
use glam::DVec3;
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
    assert!(
        now(&steady, 0.15) > 0.85 && now(&steady, 0.3) > 0.85,
        "{steady:?}"
    );
    assert!(now(&steady, 1.5) < 0.1);
    // If a person glances around, the longest of four fixations is on the target. The oldest are straight ahead.
    let glancing = model_of(&GLANCING);
    assert!(now(&glancing, 0.05) < 0.4, "{glancing:?}");
    assert!(
        now(&glancing, 0.6) > now(&glancing, 0.15) + 0.3,
        "{glancing:?}"
    );
    assert!(now(&glancing, 1.5) < 0.2, "{glancing:?}");
    // While moving, the hand follows the fixated place.
    for model in [&steady, &glancing] {
        let on_the_way = model.shares(ReachPhase::UnderWay, Some(0.8), Some(0.0));
        let looked_at = [EvidenceSource::MotionAndFixation, EvidenceSource::Fixation];
        assert!(
            looked_at
                .map(|s| on_the_way[s as usize])
                .iter()
                .sum::<f64>()
                > 0.85
        );
        assert_close!(model.on_target_sd_rad, 0.002, Tol::abs(0.004));
        assert_close!(model.rest.mean_m, DVec3::new(0.7, 0.0, 0.0), Tol::abs(0.12));
    }
}

#[test]
fn what_a_look_means_is_told_while_it_lasts() {
    let config = FusedConfig {
        evidence: model_of(&GLANCING),
        ..FusedConfig::default()
    };
    let scene = scene(&[("wall", common::WALL)], None);
    let target_m = DVec3::new(0.7, 0.4, 1.0);
    let mut predictor = FusedPredictor::new(Vague, config).unwrap();
    let mut filter = HandFilter::new(HandFilterConfig::simulated()).unwrap();
    let mut sd_m_at = |age_s: f64, target_m: DVec3| {
        let mut last = None;
        predictor.reset();
        filter.reset();
        for i in 0..((0.3 + age_s) / PERIOD_S) as usize {
            let t_s = i as f64 * PERIOD_S;
            let mut frame = HandFrame::empty(t_s);
            frame.set_point(HandPoint::Index, Some(REST));
            let tracking = filter.step(&frame);
            let since_s = if t_s < 0.3 { 0.0 } else { 0.3 };
            let seen_m = if t_s < 0.3 {
                DVec3::new(0.7, -0.3, 1.5)
            } else {
                target_m
            };
            let input = PredictorInput {
                frame: &frame,
                hand: tracking.state(),
                gaze: Gaze::Fixed(Fixation::of_ray(since_s, t_s, gaze_at(EYE, seen_m))),
            };
            last = predictor.predict(&scene, &input).first().copied();
        }
        let last = last.unwrap();
        assert!(
            age_s < 0.5 || last.point_m.distance(target_m) < 0.05,
            "{last:?}"
        );
        let c = last.covariance_m2.unwrap();
        (c.y_axis.y + c.z_axis.z).sqrt()
    };
    // The longer a person who glances around fixates a place, the more certain the prediction is.
    let [young_m, old_m] = [0.1, 0.6].map(|age_s| sd_m_at(age_s, target_m));
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
    assert_eq!(
        model.on_target_sd_rad,
        EvidenceModel::default().on_target_sd_rad
    );
    assert!(model.rest.mean_m.x > 0.3, "{:?}", model.rest);
}

#[test]
fn the_filter_and_the_fusion_together_are_right_soon_after_the_landing() {
    let config = FusedConfig {
        evidence: model_of(&STEADY),
        ..FusedConfig::default()
    };
    let scene = scene(&[("wall", common::WALL)], None);
    let mut predictor = FusedPredictor::new(Vague, config).unwrap();
    let (mut right, mut all) = (0, 0);
    for seed in 100..104 {
        let (frames, contacts) = person(&STEADY, 8, seed);
        let mut hand = HandFilter::new(HandFilterConfig::simulated()).unwrap();
        let mut gaze = GazeFilter::default();
        predictor.reset();
        for frame in &frames {
            let tracking = hand.step(frame);
            let input = PredictorInput {
                frame,
                hand: tracking.state(),
                gaze: gaze.step(frame.t_s, frame.gaze_ray().as_ref()),
            };
            let first = predictor.predict(&scene, &input).first().copied();
            // From 0.1 s after the landing to the contact; the gaze leads the hand by 0.35 s, and the hand takes 0.7 s.
            let due = contacts
                .iter()
                .find(|c| (c.contact_s - 0.95..c.contact_s).contains(&frame.t_s));
            if let (Some(contact), Some(p)) = (due, first) {
                all += 1;
                right += usize::from(p.point_m.distance(contact.point_m) < 0.05);
            }
        }
    }
    assert!(
        all > 2000 && right as f64 > 0.97 * all as f64,
        "{right} of {all}"
    );
}
