//! A loop that makes energy, and the port that keeps it from coming out.

use hwall_haptics::{ObjectConfig, ObjectPortConfig, ObjectRenderingConfig, PassivityMethod};
use hwall_lab::feel::push::{Hand, Push, Trace, run};
use hwall_lab::feel::rig::{Rig, Way};
use hwall_lab::feel::subject::{Kind, made};
use hwall_sim::HandBodyConfig;

fn badly_tuned(
    way: Way,
    stiffness: f64,
    mass: f64,
    hand_n_per_m: f64,
    method: PassivityMethod,
) -> Trace {
    let rig = Rig::new().unwrap();
    let asked = ObjectConfig {
        stiffness,
        damping: 3.0,
        ..ObjectConfig::new(mass)
    };
    let subject = made(&rig, Kind::Panel, String::new(), asked).unwrap();
    let hand = Hand::Body {
        config: HandBodyConfig {
            arm_stiffness_n_per_m: 0.3 * hand_n_per_m,
            finger_stiffness_n_per_m: hand_n_per_m,
            ..HandBodyConfig::default()
        },
        depth_m: 8.0 / (0.3 * hand_n_per_m) + 8.0 / stiffness + 8.0 / hand_n_per_m,
        rise_s: 0.6,
        until_s: f64::INFINITY,
    };
    let push = Push {
        way,
        hand,
        seconds: 8.0,
        seed: 3,
        config: ObjectRenderingConfig {
            hand_stiffness_n_per_m: 0.0,
            port: ObjectPortConfig {
                method,
                ..ObjectPortConfig::default()
            },
            ..ObjectRenderingConfig::default()
        },
    };
    run(&rig, &subject, &push).unwrap()
}

/// Energy given to the board: the least ever, J, and how much came out in the last quarter, J.
fn came_out(trace: &Trace) -> [f64; 2] {
    let given = || trace.samples.iter().map(|sample| sample.given_j);
    let late = trace.samples.len() * 3 / 4;
    let then_j = trace.samples[late].given_j;
    let least = |values: &mut dyn Iterator<Item = f64>| values.fold(0.0, f64::min);
    [
        -least(&mut given()),
        -least(&mut given().skip(late).map(|now_j| now_j - then_j)),
    ]
}

/// Objects so light, and so stiff a hand, that the loop swings by itself; nothing is made heavier.
const BAD: [(usize, f64, f64); 3] = [(0, 200.0, 0.5), (1, 1000.0, 0.5), (2, 200.0, 0.2)];

#[test]
fn a_loop_that_makes_energy_gives_out_no_more_than_the_reserve() {
    let reserve_j = ObjectPortConfig::default().reserve_j;
    for (way, stiffness, mass) in BAD {
        let way = Way::ALL[way];
        let off = badly_tuned(way, stiffness, mass, 3000.0, PassivityMethod::Off);
        let [most_j, late_j] = came_out(&off);
        println!("{} off {most_j} {late_j} {:?}", way.name(), off.ledger);
        let on = badly_tuned(way, stiffness, mass, 3000.0, PassivityMethod::Tank);
        let [most_on_j, late_on_j] = came_out(&on);
        println!("{} on {most_on_j} {late_on_j} {:?}", way.name(), on.ledger);
        // It goes on for as long as the hand is there.
        assert!(
            most_j > 2.0 * reserve_j && late_j > 0.05,
            "{}: {most_j} J, {late_j} J",
            way.name()
        );
        assert_eq!(off.ledger.limited_steps, 0);
        // Beyond the reserve, what one swing of a hand stiffer than foreseen takes.
        assert!(
            most_on_j < reserve_j + 0.1 && late_on_j < 0.01,
            "{}: {most_on_j} J, {late_on_j} J",
            way.name()
        );
        assert!(on.ledger.limited_steps > 0);
    }
}
