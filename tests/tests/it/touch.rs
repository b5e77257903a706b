//! One simulated touch through all crates, and the same one again.

use crate::common::{self, Rig, Tick, in_place, slow_person, wall};
use glam::DVec3;
use hwall_haptics::Phase;

const TARGETS_M: [DVec3; 2] = [DVec3::new(0.6, 0.1, 0.55), DVec3::new(0.6, -0.12, 0.65)];

fn touches(person: u64, noise: u64) -> (Rig, Vec<Tick>) {
    let hand = slow_person(person, &TARGETS_M);
    let end_s = hand.duration_s() + 0.3;
    let mut run = Rig::simulated(wall(0.6), hand, noise);
    let ticks = run.run(end_s);
    (run, ticks)
}

#[test]
fn the_board_is_there_before_a_slow_hand_holds_while_touched_and_is_freed() {
    let (run, ticks) = touches(3, 5);
    let at = |t_s: f64| &ticks[(t_s / common::DT_S) as usize];
    for touch in run.hand().touches() {
        let before = ticks.partition_point(|tick| tick.t_s <= touch.contact_s);
        let is_placed =
            |tick: &&Tick| in_place(&tick.base_from_board, touch.target_m, touch.normal);
        let placed = ticks[..before].iter().rev().take_while(is_placed);
        let lead_s = placed.count() as f64 * common::DT_S;
        let mut later = ticks.iter().filter(|tick| tick.t_s > touch.start_s);
        let felt = later.find(|tick| tick.in_contact());
        let felt = felt.expect("the touch is felt");
        let after_s = felt.t_s - touch.contact_s;
        let force_n = felt.step.normal_force_n.unwrap();
        println!("lead {lead_s:.3} s, felt {after_s:.3} s after the crossing at {force_n:.2} N");
        assert!(lead_s > 0.3, "{lead_s} s");
        assert!((0.0..0.4).contains(&after_s), "{after_s} {touch:?}");
        assert!(force_n > 3.0);
        let Phase::Contact { since_s } = felt.step.phase else {
            unreachable!()
        };
        // While the finger wants to be at its depth the contact is one and the board stands still.
        let (from, to) = (at(touch.press_s), at(touch.withdraw_s));
        let pressed = |tick: &&Tick| (from.t_s..to.t_s).contains(&tick.t_s);
        for tick in ticks.iter().filter(pressed) {
            let (phase, held) = (tick.step.phase, Phase::Contact { since_s });
            assert_eq!(phase, held, "at {}", tick.t_s);
            assert_eq!(tick.q, from.q, "at {}", tick.t_s);
        }
        let freed = ticks
            .iter()
            .find(|tick| tick.t_s > to.t_s && !tick.in_contact())
            .expect("freed");
        let after_s = freed.t_s - touch.release_s;
        println!("freed {after_s:.3} s after the hand left");
        assert!((-0.6..0.2).contains(&after_s), "{after_s} {touch:?}");
    }
    let contacts = ticks.iter().filter_map(|tick| match tick.step.phase {
        Phase::Contact { since_s } => Some(since_s),
        _ => None,
    });
    let mut onsets_s: Vec<f64> = contacts.collect();
    onsets_s.dedup();
    assert_eq!(onsets_s.len(), TARGETS_M.len(), "one contact a touch");
}

#[test]
fn the_same_seeds_give_the_same_run_to_the_last_bit_and_others_another() {
    let once = touches(3, 5).1;
    assert_eq!(once, touches(3, 5).1);
    assert_ne!(once, touches(3, 6).1);
    let end_s = |ticks: &[Tick]| ticks.last().map(|tick| tick.t_s);
    assert_ne!(end_s(&once), end_s(&touches(4, 5).1));
}
