//! The waiting posture of the arm suits the time that a person leaves it, and changes only between touches.

use crate::common::{Bench, Hand, by_gaze, config, iiwa, session_on, wall, world_at};
use hwall::arrival::WaitingConfig;
use hwall::contact::DeterministicPredictor;
use hwall::glam::DVec3;
use hwall::hand::HandFrame;
use hwall::haptics::Board;
use hwall::kinematics::JointPositions;
use hwall::{Control, Perception, Planner, SessionState, Walls, WallsConfig};
use std::sync::Arc;

fn walls() -> Walls {
    let config = WallsConfig {
        waiting: WaitingConfig {
            starts: 1,
            most_targets: 8,
            ..WaitingConfig::default()
        },
        other_budgets_s: vec![0.4],
        ..WallsConfig::default()
    };
    Walls::of(&wall(0.6), &iiwa(), &Board::default(), &config).expect("within reach")
}

/// Both halves, the arm, and a person who looks at the wall only while they reach for it.
struct Person {
    perception: Perception<DeterministicPredictor>,
    planner: Planner,
    control: Control,
    bench: Bench,
    frames: u32,
}

impl Person {
    fn meets(walls: &Walls) -> Self {
        let session = session_on(wall(0.6), walls.clone(), by_gaze(), config());
        let (perception, planner, control) = session.split();
        let start = walls.waiting.expect("a posture");
        let hand = Hand::reaching_in(0.3, DVec3::new(0.6, 0.0, 0.6));
        Self {
            perception,
            planner,
            control,
            bench: Bench::with_arm(Arc::new(iiwa()), start, hand),
            frames: 0,
        }
    }

    /// Touches the wall once, with a reach of `reach_s`, and rests.
    fn touches(&mut self, reach_s: f64) {
        let hand = Hand::reaching_in(reach_s, DVec3::new(0.6, 0.0, 0.6));
        self.bench.hand = hand.later(self.bench.now_s());
        let until_s = self.bench.hand.end_s + 1.5;
        self.goes_on(until_s, |frame| frame);
    }

    fn goes_on(&mut self, until_s: f64, seen: impl Fn(HandFrame) -> HandFrame) {
        while self.bench.now_s() < until_s {
            while let Some(frame) = self.bench.next_frame() {
                let hand = self.bench.hand;
                let looks = frame.t_s >= hand.start_s && frame.t_s < hand.leave_s;
                let frame = seen(HandFrame {
                    gaze: frame.gaze.filter(|_| looks),
                    ..frame
                });
                let waits_at = self.perception.waits_at();
                let info = allocation_counter::measure(|| self.perception.frame(&frame));
                self.frames += 1;
                // The first predictions may allocate.
                let is_warm = self.frames > 200;
                assert!(!is_warm || info.count_total == 0, "{info:?}");
                if self.control.state() == SessionState::InPlace && looks {
                    assert_eq!(self.perception.waits_at(), waits_at);
                }
            }
            let (control, planner) = (&mut self.control, &mut self.planner);
            self.bench.step_apart(control, planner, |_| {});
        }
    }

    fn rests_at(&self, posture: &JointPositions) -> bool {
        let off_rad = self.bench.arm.q().max_abs_difference(posture);
        self.control.state() == SessionState::Waiting && off_rad < 0.02
    }
}

#[test]
fn somebody_in_a_hurry_is_waited_for_elsewhere_and_somebody_slow_is_not() {
    let walls = walls();
    let nominal = walls.waiting.expect("a posture");
    let other = *walls.others[0].atlas.waiting();
    assert!(
        nominal.max_abs_difference(&other) > 0.02,
        "{nominal:?} {other:?}"
    );
    let mut person = Person::meets(&walls);
    assert_eq!(person.perception.waits_at(), Some(nominal));
    for _ in 0..4 {
        person.touches(0.3);
    }
    let budget_s = person.perception.budget_s();
    assert!(budget_s < 0.55, "{budget_s}");
    assert_eq!(person.perception.waits_at(), Some(other));
    assert!(person.rests_at(&other));

    // No change from a lost hand, a world that jumps, or a clock that was set back.
    let until_s = person.bench.now_s() + 0.5;
    person.goes_on(until_s, |frame| HandFrame::empty(frame.t_s));
    for (t_s, by_m) in [(until_s, DVec3::Y * 0.5), (until_s + 0.1, DVec3::ZERO)] {
        let world = world_at(t_s, by_m);
        person.perception.world(&world).expect("a world");
    }
    person.perception.frame(&HandFrame::empty(0.0));
    assert_eq!(person.perception.budget_s(), budget_s);
    assert_eq!(person.perception.waits_at(), Some(other));

    let mut slow = Person::meets(&walls);
    for _ in 0..3 {
        slow.touches(1.2);
    }
    assert!(slow.perception.budget_s() > 0.7);
    assert!(slow.rests_at(&nominal));
}
