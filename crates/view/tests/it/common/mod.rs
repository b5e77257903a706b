//! A scene and frames for all tests of the crate.

use glam::DVec3;
use hwall::haptics::Board;
use hwall::haptics::LinkInFront;
use hwall::haptics::body::{BodyRegion, Capsule};
use hwall::kinematics::{JointPositions, SrsArm};
use hwall::scene::Scene;
use hwall_testkit::Sampler;
use hwall_view::{
    MOST_MOVING, MOST_PARTS, ViewFrame, ViewHand, ViewMarker, ViewMarkerKind, ViewPart,
    ViewPrediction, ViewScene, ViewState,
};

/// A wall, a door that turns, a drawer that slides and a floor.
pub(crate) const ROOM: &str = "o wall\nv 0.6 -1 0\nv 0.6 1 0\nv 0.6 1 1.5\nv 0.6 -1 1.5\nf 1 2 3 4\n\
    o door\nv 0.6 1 0\nv 0.6 1.8 0\nv 0.6 1.8 1.5\nv 0.6 1 1.5\nf 5 6 7 8\n\
    o drawer\nv 0.5 -1.5 0\nv 0.5 -1.1 0\nv 0.5 -1.1 0.4\nv 0.5 -1.5 0.4\nf 9 10 11 12\n\
    o floor\nv -2 -2 0\nv 3 -2 0\nv 3 2 0\nv -2 2 0\nf 13 14 15 16\n";
pub(crate) const SIDECAR: &str = "[surface.door]\nkind = \"revolving_door\"\nhinge_point_m = [0.6, 1.0, 0.0]\nhinge_axis = [0.0, 0.0, 1.0]\nrange_deg = [0.0, 60.0]\n\
    [surface.drawer]\nkind = \"drawer\"\ndirection = [1.0, 0.0, 0.0]\nrange_m = [0.0, 0.3]\n\
    [surface.floor]\nkind = \"untouchable\"\n";

pub(crate) fn room() -> Scene {
    Scene::from_obj_str(ROOM, Some(SIDECAR)).expect("a room").0
}

/// An iiwa 7 with a board.
pub(crate) fn arm() -> SrsArm {
    let board = Board::default();
    SrsArm::iiwa7().with_tool(board.flange_from_board_face().expect("a board"))
}

pub(crate) fn scene() -> ViewScene {
    ViewScene::new("A <room> & \"more\"", &room(), &arm(), &Board::default()).expect("a scene")
}

/// A random frame, with and without each part.
pub(crate) fn any_frame(t_s: f64, sampler: &mut Sampler) -> ViewFrame {
    let limits = *arm().limits();
    let q = JointPositions(std::array::from_fn(|i| {
        sampler.uniform(limits[i].min_rad, limits[i].max_rad)
    }));
    let mut frame = ViewFrame::new(t_s, q);
    let point = |s: &mut Sampler| s.point_in_box(DVec3::splat(-2.0), DVec3::splat(2.0));
    if sampler.bool() {
        frame.hand = ViewHand {
            joints_m: std::array::from_fn(|_| sampler.bool().then(|| point(sampler))),
        };
    }
    frame.head_m = sampler.bool().then(|| point(sampler));
    let ray = |s: &mut Sampler| s.bool().then(|| (point(s), s.unit_vector()));
    frame.gaze = ray(sampler);
    if sampler.bool() {
        frame.predicted = Some(ViewPrediction {
            point_m: point(sampler),
            normal: sampler.unit_vector(),
            surface: sampler.bool().then(|| sampler.index(100) as u32),
            region_m: sampler.bool().then(|| [point(sampler), point(sampler)]),
            contact_s: sampler.bool().then(|| sampler.uniform(0.0, 3.0)),
        });
    }
    frame.goal = ray(sampler);
    frame.left_s = sampler.bool().then(|| sampler.uniform(0.0, 3.0));
    frame.force_n = sampler.bool().then(|| point(sampler));
    if sampler.bool() {
        let count = sampler.index(MOST_MOVING + 1);
        let openings = frame.openings[..count].iter_mut();
        openings.for_each(|opening| *opening = sampler.uniform(0.0, 1.0));
    }
    let count = sampler.index(MOST_PARTS + 1);
    for part in &mut frame.parts[..count] {
        let regions = [BodyRegion::Head, BodyRegion::Torso, BodyRegion::Arm];
        *part = Some(ViewPart {
            capsule: Capsule {
                from_m: point(sampler),
                to_m: point(sampler),
                radius_m: sampler.uniform(0.0, 0.3),
            },
            region: regions.get(sampler.index(4)).copied(),
        });
    }
    frame.link_in_front = sampler.bool().then(|| LinkInFront {
        link: sampler.index(MOST_PARTS),
        in_front_m: sampler.uniform(0.0, 0.3),
    });
    let place = |s: &mut Sampler| (point(s), s.uniform(-3.0, 3.0));
    frame.base = sampler.bool().then(|| place(sampler));
    frame.state = ViewState::ALL[sampler.index(ViewState::ALL.len())];
    frame
}

/// A full frame: all parts, all 26 joints.
pub(crate) fn full_frame(t_s: f64) -> ViewFrame {
    let wave = |i: usize| (t_s + 0.7 * i as f64).sin();
    let waves = |i: usize| DVec3::new(0.1 * wave(i), 0.2 * wave(i + 1), 0.1 * wave(i + 2));
    let point = |i: usize| DVec3::new(0.6, 0.0, 0.6) + waves(i);
    let q = |i: usize| 0.5 * wave(i) - if i == 3 { 1.2 } else { 0.0 };
    let mut openings = [0.0; MOST_MOVING];
    openings[0] = 0.3 + 0.3 * wave(0);
    openings[1] = 0.1 + 0.1 * wave(3);
    ViewFrame {
        hand: ViewHand {
            joints_m: std::array::from_fn(|i| Some(point(i))),
        },
        head_m: Some(DVec3::new(1.3, 0.0, 1.2)),
        gaze: Some((DVec3::new(1.3, 0.0, 1.2), DVec3::NEG_X)),
        predicted: Some(ViewPrediction {
            point_m: DVec3::new(0.6, 0.0, 0.6),
            normal: DVec3::X,
            surface: Some(0),
            region_m: Some([DVec3::Y * 0.05, DVec3::Z * 0.03]),
            contact_s: Some(0.4),
        }),
        goal: Some((DVec3::new(0.6, 0.0, 0.6), DVec3::X)),
        left_s: Some(0.3),
        force_n: Some(DVec3::NEG_X * 5.0),
        openings,
        state: ViewState::ALL[((t_s.abs() * 2.0) as usize) % ViewState::ALL.len()],
        ..ViewFrame::new(t_s, JointPositions(std::array::from_fn(q)))
    }
}

pub(crate) fn frames(seconds: f64) -> Vec<ViewFrame> {
    (0..(30.0 * seconds) as usize)
        .map(|i| full_frame(i as f64 / 30.0))
        .collect()
}

pub(crate) fn markers() -> Vec<ViewMarker> {
    vec![ViewMarker {
        t_s: 1.0,
        kind: ViewMarkerKind::Touched,
        text: "</script><b>touched".to_owned(),
    }]
}
