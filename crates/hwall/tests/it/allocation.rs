//! The loops do not allocate.

use crate::common::{Bench, Hand, rough_wall, session};
use hwall::glam::DVec3;
use hwall::haptics::HoldReason;
use hwall::kinematics::JointPositions;
use hwall::{EventKind, SessionState};

/// A reach for a rough wall, a touch that slides, and the retraction.
#[test]
fn steps_and_frames_do_not_allocate() {
    let hand = Hand {
        slide_m_per_s: DVec3::Y * 0.08,
        ..Hand::reaching_in(1.5, DVec3::new(0.6, 0.0, 0.6))
    };
    let (mut perception, mut planner, mut control) = session(rough_wall(0.6, Some(0.5))).split();
    let mut bench = Bench::new(hand);
    let (mut approaching, mut in_place, mut sliding, mut held, mut goals) = (0, 0, 0, 0, 0);
    let mut warm = false;
    while bench.now_s() < hand.end_s + 0.5 {
        while let Some(frame) = bench.next_frame() {
            let info = allocation_counter::measure(|| perception.frame(&frame));
            // The first prediction may allocate.
            assert!(
                !warm || info.count_total == 0,
                "{info:?} at {} s",
                frame.t_s
            );
            warm |= perception.contact().is_some();
            while let Some(event) = perception.next_event() {
                goals += usize::from(matches!(event.kind, EventKind::GoalSet(_)));
            }
        }
        // Occasional bad states, before the touch and during it; in between the session recovers.
        let is_bad = (bench.now_s() / 0.01).round() as i64 % 70 == 0;
        bench.step_apart(&mut control, &mut planner, |state| {
            if is_bad {
                state.q = JointPositions([f64::NAN; 7]);
            }
        });
        match control.state() {
            SessionState::Approaching | SessionState::Late => approaching += 1,
            SessionState::InPlace => in_place += 1,
            SessionState::Holding(HoldReason::NonFiniteState { .. }) => held += 1,
            _ => {}
        }
        sliding += usize::from(control.last_step().is_some_and(|step| step.sliding));
    }
    let counts = [approaching, in_place, held];
    assert!(counts.iter().all(|n| *n > 100), "{counts:?}");
    assert!(sliding > 100 || !cfg!(feature = "texture"), "{sliding}");
    assert!(goals > 0);
}
