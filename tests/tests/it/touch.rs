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
        let placed = ticks
            .iter()
            .take_while(|tick| tick.t_s <= touch.contact_s)
            .collect::<Vec<_>>()
            .into_iter()
            .rev()
            .take_while(|tick| in_place(&tick.base_from_board, touch.target_m, touch.normal))
            .count();
        let lead_s = placed as f64 * common::DT_S;
        let felt = ticks
            .iter()
            .find(|tick| tick.t_s > touch.start_s && tick.in_contact())
            .expect("the touch is felt");
        println!(
            "lead {lead_s:.3} s, felt {:.3} s after the crossing at {:.2} N",
            felt.t_s - touch.contact_s,
            felt.step.normal_force_n.unwrap()
        );
        assert!(lead_s > 0.3, "{lead_s} s");
        assert!(
            (0.0..0.4).contains(&(felt.t_s - touch.contact_s)),
            "{} {touch:?}",
            felt.t_s
        );
        assert!(felt.step.normal_force_n.unwrap() > 3.0);
        let Phase::Contact { since_s } = felt.step.phase else {
            unreachable!()
        };
        // While the finger wants to be at its depth the contact is one and the board stands still.
        let (from, to) = (at(touch.press_s), at(touch.withdraw_s));
        for tick in ticks
            .iter()
            .filter(|tick| (from.t_s..to.t_s).contains(&tick.t_s))
        {
            assert_eq!(
                tick.step.phase,
                Phase::Contact { since_s },
                "at {}",
                tick.t_s
            );
            assert_eq!(tick.q, from.q, "at {}", tick.t_s);
        }
        let freed = ticks
            .iter()
            .find(|tick| tick.t_s > to.t_s && !tick.in_contact())
            .expect("freed");
        println!(
            "freed {:.3} s after the hand left",
            freed.t_s - touch.release_s
        );
        assert!(
            (-0.6..0.2).contains(&(freed.t_s - touch.release_s)),
            "{} {touch:?}",
            freed.t_s
        );
    }
    let contacts: Vec<f64> = ticks
        .iter()
        .filter_map(|tick| match tick.step.phase {
            Phase::Contact { since_s } => Some(since_s),
            _ => None,
        })
        .collect();
    let onsets = 1 + contacts
        .windows(2)
        .filter(|pair| pair[0] != pair[1])
        .count();
    assert_eq!(onsets, TARGETS_M.len(), "one contact a touch");
}

#[test]
fn the_same_seeds_give_the_same_run_to_the_last_bit_and_others_another() {
    let (_, once) = touches(3, 5);
    let (_, again) = touches(3, 5);
    assert_eq!(once, again);
    let (_, other_noise) = touches(3, 6);
    assert_ne!(once, other_noise);
    let (_, other_person) = touches(4, 5);
    assert_ne!(
        once.last().map(|tick| tick.t_s),
        other_person.last().map(|tick| tick.t_s)
    );
}
