//! Sessions that are led by a response.

use super::{Reach, TOUCHES, WALL_X_M, drawn, seen};
use crate::common::{config, iiwa, session_on, wall, world_at};
use hwall::contact::Predictor;
use hwall::glam::DVec3;
use hwall::hand::HandFrame;
use hwall::kinematics::SrsArm;
use hwall::response::{EndToEnd, ResponseModel, ResponseState, Task};
use hwall::{EventKind, Perception, Walls};
use std::sync::Arc;

/// A session led by a response, for an arm with given limits; without its other half.
fn led(model: &ResponseModel, limited: SrsArm) -> Perception<EndToEnd> {
    let predictor = EndToEnd::new(model, Arc::new(limited)).expect("a predictor");
    session_on(wall(WALL_X_M), Walls::default(), predictor, config())
        .split()
        .0
}

/// Shows a frame; returns how often the hand was reported as unfamiliar.
fn strangers(perception: &mut Perception<EndToEnd>, frame: &HandFrame) -> usize {
    perception.frame(frame);
    let events = std::iter::from_fn(|| perception.next_event());
    events
        .filter(|event| matches!(event.kind, EventKind::HandUnfamiliar))
        .count()
}

/// Regression: a response slightly outside the limits in one frame and inside in the next would move the arm back and forth.
#[test]
fn an_answer_outside_the_limits_is_none_until_it_is_well_inside() {
    const INSIDE_RAD: f64 = 0.03;
    const JOINT: usize = 0;
    let (.., model) = &*TOUCHES;
    let reach = Reach {
        target_m: DVec3::new(WALL_X_M, 0.2, 0.6),
        ..drawn(Task::Touch, 1, 2)[0]
    };
    let frames = seen(&reach, 0.0);
    let mut free = led(model, iiwa());
    let answers = frames.iter().map(|frame| {
        free.frame(frame);
        free.predictor().response_rad().map(|q_rad| q_rad[JOINT])
    });
    let answers: Vec<Option<f64>> = answers.collect();
    // After the reach, the last response is kept.
    let over = 1 + answers.windows(2).rposition(|w| w[0] != w[1]).unwrap();
    let answers = &answers[..=over];
    let first_rad = answers.iter().flatten().next().copied().expect("an answer");
    let last_rad = answers[over].expect("an answer");
    let towards = (last_rad - first_rad).signum();
    // Distance of a limit beyond the last response, whether the responses come from outside it, and the final state.
    let cases = [
        (-0.5 * INSIDE_RAD, true, ResponseState::BeyondLimits),
        (-1.5 * INSIDE_RAD, true, ResponseState::Answering),
        (0.5 * INSIDE_RAD, false, ResponseState::Answering),
        (-0.5 * INSIDE_RAD, false, ResponseState::BeyondLimits),
    ];
    for (beyond_rad, from_outside, at_end) in cases {
        let limit_rad = last_rad + towards * beyond_rad;
        let is_least = (towards > 0.0) == from_outside;
        let mut limits = *iiwa().limits();
        match is_least {
            true => limits[JOINT].min_rad = limit_rad,
            false => limits[JOINT].max_rad = limit_rad,
        }
        let mut bound = led(model, iiwa().with_limits(limits).expect("limits"));
        let mut was = ResponseState::Idle;
        let mut between = 0;
        for (frame, q_rad) in frames.iter().zip(answers) {
            bound.frame(frame);
            let (state, answer) = (bound.predictor().state(), bound.predictor().response_rad());
            assert_eq!(answer.is_some(), state == ResponseState::Answering);
            let inside_rad = q_rad.map(|q_rad| match is_least {
                true => q_rad - limit_rad,
                false => limit_rad - q_rad,
            });
            let expected = match inside_rad {
                None => ResponseState::Idle,
                Some(inside_rad) if inside_rad < 0.0 => ResponseState::BeyondLimits,
                Some(inside_rad) if inside_rad > INSIDE_RAD => ResponseState::Answering,
                Some(_) => {
                    between += 1;
                    was
                }
            };
            assert_eq!(state, expected, "{inside_rad:?}");
            was = state;
        }
        assert!(between > 0 && was == at_end, "{beyond_rad}: {was:?}");
        bound.predictor_mut().reset();
        assert_eq!(bound.predictor().state(), ResponseState::Idle);
        assert_eq!(bound.predictor().response_rad(), None);
    }
}

#[test]
fn an_unfamiliar_hand_is_named_once_for_each_reach_and_a_reset_forgets_it() {
    let (.., model) = &*TOUCHES;
    let mut perception = led(model, iiwa());
    let mut reach = drawn(Task::Touch, 1, 32)[0];
    reach.rest_m.y += 0.6;
    let first = seen(&reach, 0.0);
    let second = seen(&reach, 10.0);
    for frames in [&first, &second] {
        let (mut named, mut unfamiliar) = (0, 0);
        for frame in frames {
            named += strangers(&mut perception, frame);
            let predictor = perception.predictor();
            let is_unfamiliar = predictor.state() == ResponseState::Unfamiliar;
            assert_eq!(predictor.is_unfamiliar(), is_unfamiliar);
            if is_unfamiliar {
                unfamiliar += 1;
                assert_eq!(predictor.response_rad(), None);
                assert_eq!(predictor.posterior(), None);
            }
        }
        assert_eq!(named, 1);
        assert!(unfamiliar > 10, "{unfamiliar}");
        assert_eq!(perception.predictor().state(), ResponseState::Idle);
    }
    // A familiar reach is not reported, and a reach whose beginning is forgotten is no longer unfamiliar.
    for frame in &seen(&drawn(Task::Touch, 1, 31)[0], 20.0) {
        assert_eq!(strangers(&mut perception, frame), 0);
    }
    let mut third = seen(&reach, 30.0).into_iter();
    let named = third.find(|frame| strangers(&mut perception, frame) > 0);
    assert!(named.is_some() && perception.predictor().is_unfamiliar());
    let leap = world_at(named.expect("a frame").t_s, DVec3::Y);
    perception.world(&leap).expect("a time in order");
    assert_eq!(perception.predictor().state(), ResponseState::Idle);
    assert!(!perception.predictor().is_unfamiliar());
    assert_eq!(perception.predictor().response_rad(), None);
}
