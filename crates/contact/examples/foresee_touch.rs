//! Which of two surfaces will a hand touch, where and when? Learned from reaches, predicted while the hand moves.
//!
//! `cargo run --release -p hwall-contact --example foresee_touch`

use hwall_contact::glam::DVec3;
use hwall_contact::hwall_hand::{
    Gaze, HandFilter, HandFilterConfig, HandFrame, HandPoint, LabelledReach,
};
use hwall_contact::hwall_scene::Scene;
use hwall_contact::*;

const ROOM: &str = "o panel\nv 0.6 -0.8 0\nv 0.6 0 0\nv 0.6 0 2\nv 0.6 -0.8 2\nf 1 4 3 2\n\
                    o door\nv 0.6 0 0\nv 0.6 0.8 0\nv 0.6 0.8 2\nv 0.6 0 2\nf 5 8 7 6\n";

/// A reach of an index finger, slightly curved; in practice, `labelled_reaches` makes these from recordings.
fn reach(person: usize, end_m: DVec3, duration_s: f64) -> LabelledReach {
    let rest_m = DVec3::new(0.05, 0.02 * person as f64, 1.0);
    let frame = |k: usize| {
        let tau = k as f64 / 59.0;
        let share = tau.powi(3) * (10.0 - 15.0 * tau + 6.0 * tau * tau);
        let bow_m = DVec3::Z * (0.05 + 0.01 * person as f64) * share * (1.0 - share);
        let mut frame = HandFrame::empty(tau * duration_s);
        frame.set_point(HandPoint::Index, Some(rest_m.lerp(end_m, share) + bow_m));
        frame
    };
    LabelledReach {
        person: Some(format!("person {person}")),
        trial: None,
        point: HandPoint::Index,
        frames: (0..60).map(frame).collect(),
        contact_m: end_m,
        contact_s: duration_s,
        normal: None,
    }
}

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let place = |k: usize| {
        DVec3::new(
            0.6,
            0.09 * (k % 7) as f64 - 0.3,
            0.9 + 0.08 * (k % 5) as f64,
        )
    };
    let known = (0..32).map(|k| reach(k % 4, place(k), 0.7 + 0.03 * (k % 5) as f64));
    let model = LearnedModel::train(&known.collect::<Vec<_>>(), &LearnedConfig::default())?;
    println!(
        "learned from {} reaches of {} people",
        model.reaches(),
        model.people()
    );

    let (scene, _) = Scene::from_obj_str(ROOM, None)?;
    let mut predictor = FusedPredictor::new(model.estimator(), FusedConfig::default())?;
    let mut filter = HandFilter::new(HandFilterConfig::simulated())?;
    let new = reach(5, DVec3::new(0.6, 0.2, 1.15), 0.76);
    for (k, frame) in new.frames.iter().enumerate() {
        let (tracking, gaze) = (filter.step(frame), Gaze::Lost); // no gaze: the hand has to do
        let hand = tracking.state();
        let ranked = predictor.predict(&scene, &PredictorInput { frame, hand, gaze });
        if k % 8 == 7 {
            print!("{:.2} s before contact:", new.contact_s - frame.t_s);
            for likely in ranked {
                let off_mm = 1e3 * likely.point_m.distance(new.contact_m);
                let (name, percent) = (
                    &scene.surface(likely.surface).name,
                    100.0 * likely.probability,
                );
                print!("  {name} {percent:.0} %, {off_mm:.0} mm off");
            }
            println!();
        }
    }
    Ok(())
}
