//! Predictions in a room of six surfaces, by people that nothing was learnt from.

use hwall_contact::{FusedConfig, GazeModel, LabelledReach, RidgeWindow};
use hwall_examples::contact_moments::Moment;
use hwall_examples::contact_rooms::{Cast, Condition, Room, listen, reaches, streams};
use hwall_examples::contact_rooms_contenders::Contender;
use hwall_examples::contact_rooms_scores::{Told, summary};

/// What each predictor said: ray cast, ray led, regression on the closest surface, regression fused.
fn told(condition: &Condition) -> Vec<Vec<Told>> {
    let room = Room::new(6).unwrap();
    let [learnt, judged] = streams(&room, condition, &Cast::default()).unwrap();
    let reaches: Vec<LabelledReach> = reaches(&learnt, condition).unwrap();
    let config = FusedConfig {
        gaze: GazeModel::default().fit(&reaches).unwrap(),
        ..FusedConfig::default()
    };
    let ridge = || Box::new(RidgeWindow::train(&reaches).unwrap());
    [
        Contender::ray_cast(),
        Contender::ray_led(),
        Contender::projected("ridge", ridge()),
        Contender::fused("ridge, fused", ridge(), &config),
    ]
    .map(|contender| {
        let mut predictor = contender.unwrap().predictor;
        listen(predictor.as_mut(), &room, &judged, condition).unwrap()
    })
    .to_vec()
}

#[test]
fn all_evidence_beats_each_alone_at_seventy_percent() {
    let told = told(&Condition::usual());
    let at = Moment::Share(0.7);
    let [cast, led, regression, fused] = [0, 1, 2, 3].map(|i| summary(&told[i], at));
    println!("{cast:?}\n{led:?}\n{regression:?}\n{fused:?}");
    assert!(told[3].len() > 80);
    assert!(fused.right >= 0.99 && fused.missed == 0.0);
    assert!(fused.median_m < led.median_m.min(regression.median_m).min(0.02));
    assert!(fused.right >= cast.right.max(regression.right));
    // Right for good a quarter of a second earlier than the ray cast, on the median.
    let mut gained_s: Vec<f64> = told[3]
        .iter()
        .zip(&told[0])
        .map(|(f, c)| f.lead_s() - c.lead_s())
        .collect();
    gained_s.sort_by(f64::total_cmp);
    assert!(gained_s[gained_s.len() / 2] > 0.25);
}

#[test]
fn where_the_eyes_are_no_help_the_hand_is() {
    for condition in Condition::all() {
        if condition.name == "gaze misses" || condition.name == "occluded" {
            let told = told(&condition);
            let [cast, fused] = [0, 3].map(|i| summary(&told[i], Moment::Share(0.7)));
            println!("{}: {cast:?} {fused:?}", condition.name);
            assert!(fused.right >= 0.95 && fused.missed <= 0.05);
            assert!(fused.right > cast.right + 0.1);
        }
    }
}
