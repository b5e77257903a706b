//! The film strip: well-formed, complete, and finite for any input.

use crate::common::{self, full_frame, scene};
use glam::DVec3;
use hwall_testkit::Sampler;
use hwall_view::{ViewError, ViewFrame, film_strip};

fn six() -> Vec<ViewFrame> {
    (0..6).map(|i| full_frame(f64::from(i) / 5.0)).collect()
}

#[test]
fn six_stills_with_their_times() {
    let svg = film_strip(&scene(), &six(), 0.8).unwrap();
    let document = roxmltree::Document::parse(&svg).unwrap();
    let named = |name: &str| {
        document
            .descendants()
            .filter(|n| n.has_tag_name(name))
            .count()
    };
    assert_eq!(named("clipPath"), 1);
    assert!(named("linearGradient") > 6 * 6, "the arm is shaded");
    for words in [
        "0.80 s before the touch",
        ">the touch<",
        "0.20 s after the touch began",
    ] {
        assert!(svg.contains(words), "{words}");
    }
    assert!(!svg.contains("NaN") && !svg.contains("inf"));
    assert_eq!(svg, film_strip(&scene(), &six(), 0.8).unwrap());
}

#[test]
fn another_number_of_frames_is_refused() {
    let frames = six();
    for count in [0, 1, 5] {
        let refused = film_strip(&scene(), &frames[..count], 0.0);
        assert!(
            matches!(refused, Err(ViewError::FrameCount { needed: 6, got, .. }) if got == count)
        );
    }
    assert!(film_strip(&scene(), &frames, f64::NAN).is_err());
    let mut frames = six();
    frames[2].t_s = f64::INFINITY;
    assert!(film_strip(&scene(), &frames, 0.0).is_err());
}

#[test]
fn any_frames_give_a_picture() {
    let mut sampler = Sampler::new(5);
    for _ in 0..30 {
        let mut frames: Vec<ViewFrame> = (0..6)
            .map(|i| common::any_frame(f64::from(i), &mut sampler))
            .collect();
        frames[1].q.0[2] = f64::NAN;
        frames[3].goal = Some((DVec3::NAN, DVec3::X));
        frames[5].goal = Some((DVec3::X, DVec3::ZERO));
        frames[4].predicted = frames[4].predicted.map(|p| hwall_view::ViewPrediction {
            point_m: DVec3::NAN,
            ..p
        });
        let svg = film_strip(&scene(), &frames, 3.0).unwrap();
        roxmltree::Document::parse(&svg).unwrap();
        assert!(!svg.contains("NaN") && !svg.contains("inf"));
    }
}

/// A scanned wall of ten thousand triangles takes no more space than a plain one.
#[test]
fn many_triangles_stay_small() {
    let mut scene = scene();
    let plain = film_strip(&scene, &six(), 0.8).unwrap().len();
    let at = |i: u8, j: u8| [0.6, f32::from(i) / 50.0 - 1.0, f32::from(j) / 50.0];
    let cells = (0..100).flat_map(|i| (0..50).map(move |j| (i, j)));
    scene.surfaces[0].triangles_m = cells
        .flat_map(|(i, j)| {
            let [a, b, c, d] = [at(i, j), at(i + 1, j), at(i + 1, j + 1), at(i, j + 1)];
            [[a, b, c], [a, c, d]]
        })
        .collect();
    let scanned = film_strip(&scene, &six(), 0.8).unwrap().len();
    assert!(scanned < plain + 2000, "{scanned} against {plain}");
}
