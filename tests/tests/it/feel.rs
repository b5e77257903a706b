//! What a hand feels of a moving object, with the simulated arms, and the port that keeps a loop that makes energy from giving it out.

use hwall_haptics::{ObjectConfig, ObjectPortConfig, ObjectRenderingConfig, PassivityMethod};
use hwall_lab::feel::identify::identify;
use hwall_lab::feel::push::{Hand, Profile, Push, Trace, run};
use hwall_lab::feel::rig::{Rig, Way};
use hwall_lab::feel::subject::{Kind, made};
use hwall_sim::HandBodyConfig;
use hwall_stage::run::simulated_arm::ArmLevel;

fn object(stiffness: f64, damping: f64, inertia: f64) -> ObjectConfig {
    ObjectConfig {
        stiffness,
        damping,
        ..ObjectConfig::new(inertia)
    }
}

fn spring_panel() -> ObjectConfig {
    object(500.0, 30.0, 4.0)
}

fn rendered(
    way: Way,
    kind: Kind,
    object: ObjectConfig,
    hand: Hand,
    seconds: f64,
    config: ObjectRenderingConfig,
) -> Trace {
    let rig = Rig::new().unwrap();
    let subject = made(&rig, kind, String::new(), object).unwrap();
    let push = Push {
        way,
        hand,
        seconds,
        seed: 3,
        config,
    };
    run(&rig, &subject, &push).unwrap()
}

fn pushed(way: Way, kind: Kind, object: ObjectConfig, hand: Hand, seconds: f64) -> Trace {
    let config = ObjectRenderingConfig::default();
    rendered(way, kind, object, hand, seconds, config)
}

fn wavering() -> Hand {
    Hand::Profile(Profile {
        mean_n: 10.0,
        sines: vec![[2.5, 0.7, 0.0], [2.5, 1.9, 1.0], [2.5, 3.1, 2.0]],
        until_s: f64::INFINITY,
    })
}

/// A hand of this stiffness that leans on an object with 8 N, N/m.
fn leaning(finger: f64, object: f64) -> Hand {
    let arm = 0.3 * finger;
    Hand::Body {
        config: HandBodyConfig {
            arm_stiffness_n_per_m: arm,
            finger_stiffness_n_per_m: finger,
            ..HandBodyConfig::default()
        },
        depth_m: 8.0 / arm + 8.0 / object + 8.0 / finger,
        rise_s: 0.6,
        until_s: f64::INFINITY,
    }
}

/// Least of all values and zero.
fn least(values: impl Iterator<Item = f64>) -> f64 {
    values.fold(0.0, f64::min)
}

#[test]
fn objects_are_felt_as_asked_for() {
    // Bounds of docs/FEEL.md, somewhat wider: stiffness, inertia, damping.
    let bounds = [[0.01, 0.03, 0.03], [0.05, 0.07, 0.06], [0.07, 0.08, 0.12]];
    for (way, most) in Way::ALL.into_iter().zip(bounds) {
        let asked = spring_panel();
        let trace = pushed(way, Kind::Panel, asked.clone(), wavering(), 6.0);
        let felt = identify(&trace.samples).unwrap();
        for (felt, asked, most) in [
            (felt.stiffness, asked.stiffness, most[0]),
            (felt.inertia, asked.inertia, most[1]),
            (felt.damping, asked.damping, most[2]),
        ] {
            let error = felt / asked - 1.0;
            assert!(error.abs() < most, "{}: {felt} for {asked}", way.name());
        }
    }
}

#[test]
fn the_face_stays_on_the_path_and_gives_back_no_more_than_it_was_given() {
    for way in Way::ALL {
        for kind in [Kind::Panel, Kind::Door] {
            let config = match kind {
                Kind::Door => object(40.0, 10.0, 4.3),
                _ => spring_panel(),
            };
            let trace = pushed(way, kind, config, wavering(), 4.0);
            let off_m = trace.samples.iter().map(|s| s.off_path_m);
            let off_m = off_m.fold(0.0, f64::max);
            let most_m = match way.level {
                ArmLevel::Servo => 1e-3,
                ArmLevel::Torque => 4e-3,
            };
            assert!(off_m < most_m, "{} {kind:?}: {off_m} m", way.name());
            // The noise of the sensors moves the board before the hand does.
            let least_j = least(trace.samples.iter().map(|s| s.given_j));
            assert!(least_j > -1e-3, "{}: {least_j} J", way.name());
        }
    }
}

#[test]
fn stiff_hands_on_light_objects_come_to_rest() {
    for way in Way::ALL {
        for stiffness in [200.0, 3000.0] {
            let hand = leaning(stiffness, 200.0);
            let trace = pushed(way, Kind::Panel, object(200.0, 3.0, 0.05), hand, 4.0);
            assert!(trace.inertia > 0.5);
            let last = || trace.samples.iter().rev().take(1000).map(|s| s.position);
            let swing_m = last().fold(f64::MIN, f64::max) - last().fold(f64::MAX, f64::min);
            let name = way.name();
            assert!(swing_m < 1e-3, "{name}, {stiffness} N/m: {swing_m} m");
        }
    }
}

#[test]
fn the_same_seed_is_the_same_push() {
    let way = Way::ALL[2];
    let ends = [0, 1].map(|_| {
        let trace = pushed(way, Kind::Panel, spring_panel(), wavering(), 0.5);
        trace.samples.last().map(|s| s.position.to_bits())
    });
    assert_eq!(ends[0], ends[1]);
}

/// Objects so light, and so stiff a hand, that the loop swings by itself; nothing is made heavier. Ways by their number.
const BAD: [(usize, f64, f64); 3] = [(0, 200.0, 0.5), (1, 1000.0, 0.5), (2, 200.0, 0.2)];

/// Energy given to the board: the least ever, J, and how much came out in the last quarter, J.
fn came_out(trace: &Trace) -> [f64; 2] {
    let given = || trace.samples.iter().map(|sample| sample.given_j);
    let late = trace.samples.len() * 3 / 4;
    let then_j = trace.samples[late].given_j;
    [
        -least(given()),
        -least(given().skip(late).map(|now_j| now_j - then_j)),
    ]
}

#[test]
fn a_loop_that_makes_energy_gives_out_no_more_than_the_reserve() {
    let reserve_j = ObjectPortConfig::default().reserve_j;
    for (way, stiffness, mass) in BAD {
        let way = Way::ALL[way];
        let with = |method| {
            let config = ObjectRenderingConfig {
                hand_stiffness_n_per_m: 0.0,
                port: ObjectPortConfig {
                    method,
                    ..ObjectPortConfig::default()
                },
                ..ObjectRenderingConfig::default()
            };
            let (object, hand) = (object(stiffness, 3.0, mass), leaning(3000.0, stiffness));
            let trace = rendered(way, Kind::Panel, object, hand, 8.0, config);
            let [most_j, late_j] = came_out(&trace);
            let said = format!("{} {method:?}: {most_j} J, {late_j} J", way.name());
            println!("{said} {:?}", trace.ledger);
            (most_j, late_j, trace.ledger.limited_steps, said)
        };
        let (most_j, late_j, limited_steps, said) = with(PassivityMethod::Off);
        // It goes on for as long as the hand is there.
        assert!(most_j > 2.0 * reserve_j && late_j > 0.05, "{said}");
        assert_eq!(limited_steps, 0);
        let (most_j, late_j, limited_steps, said) = with(PassivityMethod::Tank);
        // Beyond the reserve, what one swing of a hand stiffer than foreseen takes.
        assert!(most_j < reserve_j + 0.1 && late_j < 0.01, "{said}");
        assert!(limited_steps > 0);
    }
}
