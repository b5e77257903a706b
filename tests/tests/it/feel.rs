//! What a hand feels of a moving object, with the simulated arms.

use hwall_haptics::{ObjectConfig, ObjectRenderingConfig};
use hwall_lab::feel::identify::identify;
use hwall_lab::feel::push::{Hand, Profile, Push, Trace, run};
use hwall_lab::feel::rig::{Rig, Way};
use hwall_lab::feel::subject::{Kind, made};
use hwall_sim::HandBodyConfig;
use hwall_stage::run::simulated_arm::ArmLevel;

fn spring_panel() -> ObjectConfig {
    ObjectConfig {
        stiffness: 500.0,
        damping: 30.0,
        ..ObjectConfig::new(4.0)
    }
}

fn pushed(way: Way, kind: Kind, config: ObjectConfig, hand: Hand, seconds: f64) -> Trace {
    let rig = Rig::new().unwrap();
    let subject = made(&rig, kind, String::new(), config).unwrap();
    let push = Push {
        way,
        hand,
        seconds,
        seed: 3,
        config: ObjectRenderingConfig::default(),
    };
    run(&rig, &subject, &push).unwrap()
}

fn wavering() -> Hand {
    Hand::Profile(Profile {
        mean_n: 10.0,
        sines: vec![[2.5, 0.7, 0.0], [2.5, 1.9, 1.0], [2.5, 3.1, 2.0]],
        until_s: f64::INFINITY,
    })
}

#[test]
fn objects_are_felt_as_asked_for() {
    // Bounds of docs/FEEL.md, somewhat wider: stiffness, inertia, damping.
    for (way, most) in
        Way::ALL
            .into_iter()
            .zip([[0.01, 0.03, 0.03], [0.05, 0.07, 0.06], [0.07, 0.08, 0.12]])
    {
        let asked = spring_panel();
        let trace = pushed(way, Kind::Panel, asked.clone(), wavering(), 6.0);
        let felt = identify(&trace.samples).unwrap();
        for ((felt, asked), most) in [
            (felt.stiffness, asked.stiffness),
            (felt.inertia, asked.inertia),
            (felt.damping, asked.damping),
        ]
        .into_iter()
        .zip(most)
        {
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
                Kind::Door => ObjectConfig {
                    stiffness: 40.0,
                    damping: 10.0,
                    ..ObjectConfig::new(4.3)
                },
                _ => spring_panel(),
            };
            let trace = pushed(way, kind, config, wavering(), 4.0);
            let off_m = trace
                .samples
                .iter()
                .map(|s| s.off_path_m)
                .fold(0.0, f64::max);
            let most_m = match way.level {
                ArmLevel::Servo => 1e-3,
                ArmLevel::Torque => 4e-3,
            };
            assert!(off_m < most_m, "{} {kind:?}: {off_m} m", way.name());
            // The noise of the sensors moves the board before the hand does.
            let least_j = trace.samples.iter().map(|s| s.given_j).fold(0.0, f64::min);
            assert!(least_j > -1e-3, "{}: {least_j} J", way.name());
        }
    }
}

#[test]
fn stiff_hands_on_light_objects_come_to_rest() {
    for way in Way::ALL {
        for stiffness in [200.0, 3000.0] {
            let config = ObjectConfig {
                stiffness: 200.0,
                damping: 3.0,
                ..ObjectConfig::new(0.05)
            };
            let hand = Hand::Body {
                config: HandBodyConfig {
                    arm_stiffness_n_per_m: 0.3 * stiffness,
                    finger_stiffness_n_per_m: stiffness,
                    ..HandBodyConfig::default()
                },
                depth_m: 8.0 / (0.3 * stiffness) + 8.0 / 200.0 + 8.0 / stiffness,
                rise_s: 0.6,
                until_s: f64::INFINITY,
            };
            let trace = pushed(way, Kind::Panel, config, hand, 4.0);
            assert!(trace.inertia > 0.5);
            let last = || trace.samples.iter().rev().take(1000).map(|s| s.position);
            let swing_m = last().fold(f64::MIN, f64::max) - last().fold(f64::MAX, f64::min);
            assert!(
                swing_m < 1e-3,
                "{}, {stiffness} N/m: {swing_m} m",
                way.name()
            );
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
