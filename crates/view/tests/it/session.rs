//! Frames of a running session.

use crate::common;
use glam::DVec3;
use hwall::contact::{DeterministicConfig, DeterministicPredictor};
use hwall::hand::{HandFilterConfig, HandFrame, HandPoint};
use hwall::haptics::{ArmState, Board};
use hwall::kinematics::{JointPositions, JointTorques, JointVelocities};
use hwall::{Session, SessionConfig, Walls};
use hwall_view::{ViewFrame, ViewScene, ViewState};

fn session() -> Session<DeterministicPredictor> {
    let config = SessionConfig {
        hand: HandFilterConfig::simulated(),
        ..SessionConfig::default()
    };
    let predictor = DeterministicPredictor::new(DeterministicConfig::ray_led()).unwrap();
    let (arm, board, room) = (common::arm(), Board::default(), common::room());
    Session::new(&arm, &board, room, Walls::default(), predictor, config).unwrap()
}

fn hand_at(t_s: f64) -> HandFrame {
    let mut frame = HandFrame::empty(t_s);
    let tip_m = DVec3::new(1.2 - 0.5 * t_s, 0.0, 0.6);
    frame.set_point(HandPoint::Index, Some(tip_m));
    frame.set_point(HandPoint::Palm, Some(tip_m + DVec3::X * 0.1));
    frame.head_m = Some(DVec3::new(1.4, 0.0, 1.1));
    frame.gaze = Some(DVec3::new(-0.8, 0.0, -0.5).normalize());
    frame
}

#[test]
fn a_session_is_seen_and_nothing_is_allocated_for_it() {
    let mut session = session();
    let scene = ViewScene::of("a session", &session).unwrap();
    assert_eq!(scene.surfaces.len(), 4);
    let mut state = ArmState {
        t_s: 0.0,
        q: JointPositions::from_deg([0.0, 30.0, 0.0, -90.0, 0.0, -30.0, 0.0]),
        qd: JointVelocities::default(),
        external_torque: Some(JointTorques::default()),
    };
    let before = ViewFrame::of(&session, &state, None);
    assert_eq!(before.state, ViewState::Holding);
    assert!(before.hand.is_lost() && before.predicted.is_none());
    let mut bytes = Vec::with_capacity(ViewFrame::MOST_BYTES);
    let mut predicted = 0;
    for i in 0..60 {
        let t_s = f64::from(i) / 72.0;
        let seen = hand_at(t_s);
        session.frame(&seen);
        state.t_s = t_s;
        session.step(t_s, &state);
        session.plan();
        bytes.clear();
        let mut frame = ViewFrame::new(t_s, state.q);
        let info = allocation_counter::measure(|| {
            frame = ViewFrame::of(&session, &state, Some(&seen));
            frame.encode(&mut bytes);
        });
        assert_eq!(info.count_total, 0);
        assert_eq!((frame.t_s, frame.q), (t_s, state.q));
        if let Some(p) = frame.predicted {
            predicted += 1;
            assert!((p.point_m.x - 0.6).abs() < 1e-9);
            assert_eq!(scene.surfaces[p.surface.unwrap() as usize].name, "wall");
        }
        if i > 20 {
            assert_eq!(frame.hand.joints_m[10], seen.point(HandPoint::Index));
            assert!(frame.gaze.is_some());
        }
    }
    assert!(predicted > 20);
    // The tracker goes blind: the hand is lost, not frozen.
    let mut last = ViewFrame::new(0.0, state.q);
    for i in 60..100 {
        let blind = HandFrame::empty(f64::from(i) / 72.0);
        session.frame(&blind);
        last = ViewFrame::of(&session, &state, Some(&hand_at(0.5)));
    }
    assert!(last.hand.is_lost());
}

/// The axes of the 90 % region contain 90 % of points drawn from the covariance.
#[test]
fn the_region_holds_ninety_percent() {
    use hwall::contact::ContactPrediction;
    use hwall::glam::DMat3;
    use hwall::scene::SurfaceId;
    let mut sampler = hwall_testkit::Sampler::new(6);
    for _ in 0..5 {
        let turn = sampler.rotation();
        let sd_m = [0.02, 0.05, 0.01];
        let covariance =
            turn * DMat3::from_diagonal(DVec3::from_array(sd_m.map(|s| s * s))) * turn.transpose();
        let normal = sampler.unit_vector();
        let contact = ContactPrediction {
            covariance_m2: Some(covariance),
            ..ContactPrediction::of_place(SurfaceId(0), DVec3::ZERO, normal)
        };
        let [a, b] = hwall_view::ViewPrediction::of(&contact).region_m.unwrap();
        assert!(a.dot(b).abs() < 1e-9 && a.dot(normal).abs() < 1e-9 && a.length() >= b.length());
        let mut is_inside = || {
            let z = DVec3::from_array([(); 3].map(|()| sampler.normal()));
            let miss_m = turn * (z * DVec3::from_array(sd_m));
            let [x, y] = [a, b].map(|axis| miss_m.dot(axis) / axis.length_squared());
            x * x + y * y <= 1.0
        };
        let draws = 20_000;
        let inside = (0..draws).filter(|_| is_inside()).count();
        let share = inside as f64 / f64::from(draws);
        // Five standard deviations of the count.
        assert!((share - 0.9).abs() < 0.011, "{share}");
    }
}
