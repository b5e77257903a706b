//! Predictions depend neither on the place, heading and surface order of a room nor on the clock.

use crate::common::{Quad, ball, fused, gaze_at, hand, plain_scene, room, see, target};
use crate::learned::{follow, reaches};
use glam::{DMat3, DVec3};
use hwall_contact::{ContactPrediction, DeterministicPredictor, LearnedConfig, LearnedModel};
use hwall_hand::Gaze;
use hwall_scene::Scene;
use hwall_testkit::{Sampler, minimum_jerk};

/// A world in another frame.
#[derive(Clone, Copy)]
struct View {
    linear: DMat3,
    shift: DVec3,
    reversed: bool,
}

impl View {
    const PLAIN: Self = Self {
        linear: DMat3::IDENTITY,
        shift: DVec3::ZERO,
        reversed: false,
    };

    fn point(&self, p: DVec3) -> DVec3 {
        self.linear * p + self.shift
    }

    fn scene(&self) -> Scene {
        let mut quads = room(12);
        for (_, quad) in &mut quads {
            *quad = quad.map(|corner| self.point(DVec3::from_array(corner)).to_array());
        }
        if self.reversed {
            quads.reverse();
        }
        plain_scene(&quads)
    }
}

type Said = Vec<(String, ContactPrediction)>;

/// Predictions for some reaches in a room: by fusion, and by the hand alone.
fn said(view: &View) -> Vec<[Said; 2]> {
    let (here, there) = (View::PLAIN.scene(), view.scene());
    let quads: Vec<(&str, Quad)> = room(12);
    let named = |answers: &[ContactPrediction]| -> Said {
        let name = |a: &ContactPrediction| there.surface(a.surface).name.clone();
        answers.iter().map(|a| (name(a), *a)).collect()
    };
    let mut sampler = Sampler::new(21);
    let mut said = Vec::new();
    for _ in 0..12 {
        let from = DVec3::new(0.0, 0.05, 1.2) + 0.1 * sampler.unit_vector();
        let (_, to) = target(&mut sampler, &here, &quads, from);
        let miss = 0.03 * sampler.unit_vector();
        let eye = DVec3::new(-0.25, 0.1, 1.6);
        let (mut fused, mut alone) = (fused(), DeterministicPredictor::default());
        for k in 0..40 {
            let way = |tau: f64| from.lerp(to, minimum_jerk(tau));
            let tau = f64::from(k) / 50.0;
            let (at, velocity) = (way(tau), (way(tau + 0.01) - way(tau - 0.01)) / 0.014);
            let state = (view.point(at), view.linear * velocity);
            let gaze = gaze_at(view.point(eye), view.point(to + 0.5 * miss));
            let estimate = (k > 10).then(|| (view.point(to + miss), ball(0.05)));
            let answers = named(fused.see(&there, state, estimate, (k > 5).then_some(gaze)));
            if k % 10 != 9 {
                continue;
            }
            let hand = hand(1.0, state.0, state.1);
            let by_hand = named(see(&mut alone, &there, &hand, Gaze::Lost));
            said.push([answers, by_hand]);
        }
    }
    said
}

/// Largest difference of probabilities, and of points, m.
const CLOSE: f64 = 1e-6;

/// Surfaces below that probability may be missing.
fn compare(name: &str, view: View, nominal: &[[Said; 2]]) {
    let mut worst = [0.0_f64; 2];
    for (case, (here, there)) in nominal.iter().zip(said(&view)).enumerate() {
        for (a, b) in here.iter().zip(&there) {
            let probable = |said: &Said| {
                let probable = said.iter().filter(|(_, p)| p.probability > 2.0 * CLOSE);
                probable.cloned().collect::<Said>()
            };
            for (surface, a) in probable(a) {
                let off = |b: &ContactPrediction| {
                    let off_m = view.point(a.point_m).distance(b.point_m);
                    [(a.probability - b.probability).abs(), off_m]
                };
                let of_surface = b.iter().filter(|(named, _)| *named == surface);
                let nearest = of_surface.min_by(|x, y| off(&x.1)[1].total_cmp(&off(&y.1)[1]));
                let Some((_, b)) = nearest else {
                    panic!("{name}, {case}: no {surface}, {a:?}");
                };
                let off = off(b);
                worst = [worst[0].max(off[0]), worst[1].max(off[1])];
                assert!(
                    (view.linear * a.normal).distance(b.normal) < 1e-6,
                    "{name}, {case}"
                );
            }
        }
    }
    println!("{name}: {worst:?}");
    assert!(worst.iter().all(|off| *off < CLOSE), "{name}: {worst:?}");
}

#[test]
fn the_room_may_be_shifted_and_turned_and_its_surfaces_come_in_any_order() {
    let plain = View::PLAIN;
    let turned = |turn_rad| View {
        linear: DMat3::from_rotation_z(turn_rad),
        ..plain
    };
    let shifted = View {
        shift: DVec3::new(4.0, -2.5, 0.0),
        ..plain
    };
    let reversed = View {
        reversed: true,
        ..plain
    };
    let nominal = said(&plain);
    assert!(nominal.len() > 40);
    for (name, view) in [
        ("shift", shifted),
        ("turn", turned(0.9)),
        ("turn", turned(-2.4)),
        ("order", reversed),
    ] {
        compare(name, view, &nominal);
    }
}

#[test]
fn the_clock_may_start_at_any_time() {
    let model = LearnedModel::train(&reaches(1, 4, 12), &LearnedConfig::default()).unwrap();
    for test in reaches(3, 2, 3) {
        let nominal = follow(&mut model.estimator(), &test.frames);
        for clock_s in [1.0, 1e4, 1.7e9] {
            let mut frames = test.frames.clone();
            frames.iter_mut().for_each(|frame| frame.t_s += clock_s);
            let later = follow(&mut model.estimator(), &frames);
            assert_eq!(nominal.len(), later.len());
            for (a, b) in nominal.iter().zip(&later) {
                // The clock itself is rounded to 0.2 us.
                let off_m = a.point_m.distance(b.point_m);
                assert!(off_m < 1e-4, "{clock_s} s: {off_m} m");
            }
        }
    }
}
