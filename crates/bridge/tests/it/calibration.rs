//! The pose of the headset's space, from three touched corners of the board, over the protocol.

use crate::common::{Socket, arm, hand, joints, scene, server, text_of, wait_for};
use glam::DVec3;
use hwall::geometry::Pose;
use hwall::hand::PointPair;
use hwall::kinematics::JointPositions;
use hwall_bridge::view::ViewFrame;
use hwall_bridge::{
    BridgeConfig, BridgeError, BridgeServer, CHECK_BOUND_M, Calibration, CalibrationError,
    FIT_BOUND_M,
};
use hwall_testkit::{Sampler, Verdict, attack};
use serde_json::Value;
use std::path::{Path, PathBuf};
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::{Duration, Instant};

/// Corners of a board of 0.2 m, upright, in the base frame: upper left, upper right, lower right, as seen by a person at larger x.
const CORNERS: [DVec3; 3] = [
    DVec3::new(0.62, -0.1, 0.6),
    DVec3::new(0.62, 0.1, 0.6),
    DVec3::new(0.62, 0.1, 0.4),
];

/// Ids of two headsets.
const HEADSETS: [u64; 2] = [7, 11];

fn calibration(pairs: [PointPair; 3]) -> Result<Calibration, CalibrationError> {
    Calibration::from_touches(HEADSETS[0], pairs)
}

/// A headset's space somewhere on the floor, as the base sees it in WebXR's axes.
fn truth(sampler: &mut Sampler) -> Pose {
    let place = sampler.array_within([(0.5, 2.5), (-1.0, 1.0), (-1.0, 0.2)]);
    let yaw = sampler.uniform(-3.1, 3.1);
    Pose::from_yaw(yaw, place.into()).expect("a pose") * Pose::Z_UP_FROM_Y_UP
}

fn touched(truth: &Pose, corners: [DVec3; 3], touches: [DVec3; 3]) -> [PointPair; 3] {
    std::array::from_fn(|i| PointPair {
        in_a_m: corners[i],
        in_b_m: truth.inverse_transform_point(touches[i]),
    })
}

#[test]
fn three_exact_corners_give_the_exact_pose() {
    let mut sampler = Sampler::new(1);
    for _ in 0..1000 {
        let truth = truth(&mut sampler);
        let found = calibration(touched(&truth, CORNERS, CORNERS)).expect("a pose");
        let pose = found.base_from_headset() * Pose::Z_UP_FROM_Y_UP;
        let off = pose.distance(&truth);
        assert!(off.position_m < 1e-9 && off.angle_rad < 1e-7, "{off:?}");
        assert!(found.rms_m() < 1e-12 && found.turn_rad() < 1e-11);
        let there_m = truth.inverse_transform_point(DVec3::ONE);
        assert!(found.place_m(there_m).distance(DVec3::ONE) < 1e-9);
        let again = Calibration::from_json(&found.to_json()).expect("its own file");
        assert_eq!(again, found);
    }
}

#[test]
fn noise_moves_the_pose_as_little_as_stated() {
    let mut sampler = Sampler::new(2);
    let (mut taken, mut turns, mut estimated) = (0, 0.0, 0.0);
    for _ in 0..1000 {
        let truth = truth(&mut sampler);
        // Errors up to 5 mm in each coordinate: at most 8.7 mm.
        let mut off = || DVec3::from_array(std::array::from_fn(|_| sampler.uniform(-5e-3, 5e-3)));
        let touches = CORNERS.map(|corner| corner + off());
        let Ok(found) = calibration(touched(&truth, CORNERS, touches)) else {
            continue;
        };
        taken += 1;
        let pose = found.base_from_headset() * Pose::Z_UP_FROM_Y_UP;
        let middle_m = DVec3::new(0.62, 0.0, 0.5);
        let there = truth.inverse_transform_point(middle_m);
        let off_m = pose.transform_point(there).distance(middle_m);
        assert!(off_m < 0.0087 * 1.5, "{off_m}");
        let turn = pose.distance(&truth).angle_rad;
        assert!(turn < 0.0087 / 0.07, "{turn}");
        assert!(found.rms_m() < 0.0087);
        turns += turn * turn;
        estimated += found.turn_rad() * found.turn_rad();
        // The vertical is preserved with any noise.
        let up = pose.transform_vector(DVec3::Y);
        assert!(up.distance(DVec3::Z) < 1e-9);
    }
    assert_eq!(taken, 1000);
    // The estimate of the turn is right on average.
    let ratio: f64 = (estimated / turns).sqrt();
    assert!((0.95..1.05).contains(&ratio), "{ratio}");
}

#[test]
fn corners_in_another_order_are_refused() {
    let mut sampler = Sampler::new(3);
    let [a, b, c] = CORNERS;
    let d = DVec3::new(0.62, -0.1, 0.4);
    for _ in 0..200 {
        let truth = truth(&mut sampler);
        // Some wrong orders are congruent with the right one except for the vertical.
        for order in [
            [c, b, a],
            [b, c, d],
            [c, d, a],
            [d, a, b],
            [b, a, c],
            [a, c, b],
            [b, c, a],
            [c, a, b],
        ] {
            let refused = calibration(touched(&truth, CORNERS, order));
            let Err(CalibrationError::Misfit { rms_m, .. }) = refused else {
                panic!("{refused:?}");
            };
            assert!(rms_m > 2.0 * FIT_BOUND_M, "{rms_m}");
        }
    }
}

#[test]
fn degenerate_corners_and_touches_are_refused() {
    let truth = truth(&mut Sampler::new(4));
    let [a, b, c] = CORNERS;
    let refused = |corners, touches| {
        let found = calibration(touched(&truth, corners, touches));
        found.expect_err("no calibration")
    };
    let near = |one: DVec3, other: DVec3| one + 0.4 * (other - one);
    for touches in [[a, a, a], [a, b, b], [a, b, a], [a, near(a, b), c]] {
        let error = refused(CORNERS, touches);
        assert!(matches!(error, CalibrationError::Close { .. }), "{error:?}");
        assert!(error.to_string().contains("mm apart"), "{error}");
    }
    let line = refused(CORNERS, [a, b, 2.0 * b - a]);
    assert!(matches!(line, CalibrationError::Misfit { .. }), "{line:?}");
    // A board without extent, a board that is too small, and corners above each other, which do not show the heading.
    let small = CORNERS.map(|corner| 0.2 * corner);
    for corners in [[a, a, a], small] {
        let error = refused(corners, corners);
        assert!(matches!(error, CalibrationError::Close { .. }), "{error:?}");
    }
    let above = [0.0, 0.2, 0.4].map(|up| a + up * DVec3::Z);
    let error = refused(above, above);
    assert!(matches!(error, CalibrationError::Points(_)), "{error:?}");
    for wrong in [f64::NAN, f64::INFINITY, 1e7] {
        for at in 0..2 {
            let mut pairs = touched(&truth, [a, b, c], [a, b, c]);
            match at {
                0 => pairs[1].in_a_m.y = wrong,
                _ => pairs[2].in_b_m.z = wrong,
            }
            assert_eq!(calibration(pairs), Err(CalibrationError::Range));
        }
    }
}

#[test]
fn a_text_that_is_no_calibration_is_refused() {
    let truth = truth(&mut Sampler::new(5));
    let good = calibration(touched(&truth, CORNERS, CORNERS)).expect("a pose");
    let good = good.to_json();
    for wrong in [
        "",
        "{}",
        "[1,2]",
        &good.replace("\"version\": 2", "\"version\": 1"),
        &good.replace("\"headset\": 7,", ""),
        &good.replace("base_m", "bass_m"),
        &good.replacen("0.62", "1e400", 1),
        &good.replacen("0.62", "null", 1),
    ] {
        let error = Calibration::from_json(wrong).expect_err("no calibration");
        assert!(matches!(error, CalibrationError::File { .. }), "{wrong}");
    }
    let report = attack("calibration", &[good.into_bytes()], 20_000, 5, |bytes| {
        let Ok(found) = Calibration::from_json(&String::from_utf8_lossy(bytes)) else {
            return Verdict::Refused;
        };
        assert!(found.rms_m() <= FIT_BOUND_M);
        assert!(found.base_from_headset().position_m().is_finite());
        Verdict::Accepted
    });
    assert_eq!(report.findings, 0, "{:?}", report.examples);
    assert!(report.accepted > 0 && report.refused > 0, "{report:?}");
}

/// A headset in front of a standing board.
struct Wearer<'a> {
    socket: Socket,
    truth: Pose,
    stops: &'a AtomicBool,
    /// While true, no state of the arm arrives.
    is_silent: &'a AtomicBool,
    /// The head in front of the board, base frame; `None`: not seen.
    head_m: Option<DVec3>,
    seq: u64,
    began: Instant,
}

/// A posture, and the corners of the board there in the order of the server's requests.
fn face() -> (JointPositions, [DVec3; 3]) {
    let q = JointPositions::from_deg([0.0, 30.0, 0.0, -90.0, 0.0, -30.0, 0.0]);
    let base_from_face = arm().0.forward(&q);
    let [x, y, out] = [DVec3::X, DVec3::Y, DVec3::Z].map(|v| base_from_face.transform_vector(v));
    let edge = if y.z.abs() >= x.z.abs() { y } else { x };
    let up = edge * edge.z.signum();
    let right = up.cross(out);
    let corners = [[-0.1, 0.1], [0.1, 0.1], [0.1, -0.1]];
    let middle_m = base_from_face.position_m();
    (q, corners.map(|[r, u]| middle_m + r * right + u * up))
}

impl Drop for Wearer<'_> {
    /// Also after a panic; otherwise the loop would never end.
    fn drop(&mut self) {
        self.stops.store(true, Ordering::SeqCst);
    }
}

impl Wearer<'_> {
    /// Holds the finger at a place of the base frame, then sends `take`. Returns the server's reply.
    fn touches(&mut self, at_m: DVec3) -> Value {
        let there_m = self.truth.inverse_transform_point(at_m);
        for _ in 0..50 {
            self.sample(there_m);
        }
        self.asks("take")
    }

    fn sample(&mut self, there_m: DVec3) {
        self.seq += 1;
        let text = hand(
            self.seq,
            1e3 * self.began.elapsed().as_secs_f64(),
            &joints(25, there_m.to_array()),
            "webxr",
        );
        let head = self.head_m.map_or("null".to_owned(), |head_m| {
            let [x, y, z] = self.truth.inverse_transform_point(head_m).to_array();
            format!("[{x},{y},{z},0,0,0,1]")
        });
        let text = text.replace("\"head\":null", &format!("\"head\":{head}"));
        self.socket.text(&text);
        std::thread::sleep(Duration::from_millis(14));
    }

    /// Identifies this headset. Returns the server's state of the calibration.
    fn is_in(&mut self, headset: u64) -> Value {
        self.socket
            .text(&format!(r#"{{"type":"headset","id":{headset}}}"#));
        self.told()
    }

    /// The server's state of the calibration after all messages were received.
    fn told(&mut self) -> Value {
        self.socket.text(r#"{"type":"ping","id":1,"client_ms":1}"#);
        let mut told = Value::Null;
        loop {
            let message = self.socket.next();
            match text_of(&message, "type") {
                "calibration" => told = message,
                "pong" => return told,
                _ => {}
            }
        }
    }

    /// Touches all corners, in order.
    fn calibrates(&mut self, corners: [DVec3; 3]) -> Value {
        assert_eq!(self.asks("begin")["corner"], 0);
        corners.map(|corner| self.touches(corner))[2].clone()
    }

    fn asks(&mut self, step: &str) -> Value {
        self.socket
            .text(&format!(r#"{{"type":"calibrate","step":"{step}"}}"#));
        self.told()
    }
}

/// Runs a server with this file and a standing board, and lets `act` control a wearer.
fn worn(file: &Path, truth: Pose, act: impl FnOnce(&mut Wearer<'_>, &BridgeServer)) {
    let server = server(BridgeConfig {
        calibration: Some(file.to_owned()),
        ..BridgeConfig::default()
    });
    let mut bridge = server.connect(&scene());
    let [stops, is_silent] = [false; 2].map(AtomicBool::new);
    let orders = bridge.view.orders();
    std::thread::scope(|scope| {
        scope.spawn(|| {
            while !stops.load(Ordering::SeqCst) {
                let now_s = bridge.pacing.wait();
                let _ = bridge.hands.next_frame(now_s);
                if !is_silent.load(Ordering::SeqCst) {
                    bridge.view.send(&ViewFrame::new(now_s, face().0));
                }
                std::thread::sleep(Duration::from_millis(5));
            }
        });
        let mut wearer = Wearer {
            socket: Socket::open(&server),
            truth,
            stops: &stops,
            is_silent: &is_silent,
            head_m: Some(DVec3::new(1.4, 0.1, 0.9)),
            seq: 0,
            began: Instant::now(),
        };
        // Once the board was shown, the server knows and reports it.
        wait_for("the board", || {
            wearer.asks("cancel")["corners_mm"][0].is_array()
        });
        let greeted = wearer.is_in(HEADSETS[0]);
        assert!(orders.is_uncalibrated(), "{greeted}");
        act(&mut wearer, &server);
    });
}

fn kept(file: &Path) -> Calibration {
    let text = std::fs::read_to_string(file).expect("a file");
    Calibration::from_json(&text).expect("a calibration")
}

fn file(name: &str) -> PathBuf {
    let file = Path::new(env!("CARGO_TARGET_TMPDIR")).join(name);
    let _ = std::fs::remove_file(&file);
    file
}

#[test]
fn three_touches_calibrate_and_two_check_at_the_next_start() {
    let file = file("headset.json");
    let truth = truth(&mut Sampler::new(6));
    let (_, corners) = face();
    worn(&file, truth, |wearer, _| {
        assert_eq!(wearer.asks("cancel")["state"], "needed");
        assert_eq!(wearer.asks("begin")["corner"], 0);
        // A moving finger does not count as a touch.
        for i in 0..40 {
            wearer.sample(DVec3::splat(1.0 + 1e-3 * f64::from(i)));
        }
        let moving = wearer.asks("take");
        assert!(text_of(&moving, "text").contains("still"), "{moving}");
        assert_eq!(moving["corner"], 0);
        for (i, corner) in corners.iter().enumerate() {
            let told = wearer.touches(*corner);
            let state = if i == 2 { "good" } else { "touching" };
            assert_eq!(told["state"], state, "{told}");
            // Two touches determine where the third should be.
            assert_eq!(told["target_m"].is_array(), i == 1, "{told}");
            if i == 1 {
                let there_m = truth.inverse_transform_point(corners[2]);
                let target_m: [f64; 3] =
                    std::array::from_fn(|k| told["target_m"][k].as_f64().expect("a coordinate"));
                assert!(there_m.distance(target_m.into()) < 2e-3, "{told}");
            }
        }
        // After the headset has moved its space, the calibration must be checked again.
        assert_eq!(wearer.asks("recentred")["state"], "unchecked");
    });
    let kept = kept(&file);
    assert_eq!(kept.headset(), HEADSETS[0]);
    let off = (kept.base_from_headset() * Pose::Z_UP_FROM_Y_UP).distance(&truth);
    assert!(off.position_m < 1e-3 && off.angle_rad < 1e-3, "{off:?}");
    let aside = DVec3::new(0.0, 1.2 * CHECK_BOUND_M, 0.0);
    worn(&file, truth, |wearer, _| {
        let off = wearer.touches(corners[0] + aside);
        assert_eq!(off["state"], "off", "{off}");
        let off_mm = off["off_mm"].as_f64().expect("mm");
        assert!((off_mm - 24.0).abs() < 1.0, "{off}");
        let next = wearer.touches(corners[0] + 0.5 * aside);
        let asked = (&next["state"], &next["corner"]);
        assert_eq!(asked, (&"unchecked".into(), &1.into()), "{next}");
        // Each error is within the bound, but together they mean a rotation of the space.
        let out = DVec3::new(0.0, 0.0, 0.5 * CHECK_BOUND_M);
        let turned = wearer.touches(corners[1] - 0.8 * aside + out);
        assert_eq!(turned["state"], "off", "{turned}");
        for corner in &corners[..2] {
            wearer.touches(*corner + 0.5 * aside);
        }
        let good = wearer.asks("take");
        assert_eq!(good["state"], "good", "{good}");
        assert!(text_of(&good, "text").contains("nothing"), "{good}");
    });
}

/// Regression: the space of one headset was used for another.
#[test]
fn a_calibration_is_of_one_headset() {
    let file = file("headset_other.json");
    let truth = truth(&mut Sampler::new(8));
    let (_, corners) = face();
    let [one, other] = HEADSETS;
    worn(&file, truth, |wearer, server| {
        let accepted = |wearer: &mut Wearer<'_>| {
            let before = server.counts();
            for _ in 0..5 {
                wearer.sample(DVec3::ONE);
            }
            wearer.told();
            let now = server.counts();
            let uncalibrated = now.uncalibrated - before.uncalibrated;
            [now.accepted - before.accepted, uncalibrated]
        };
        assert_eq!(accepted(wearer), [0, 5], "nobody's hands count yet");
        assert_eq!(wearer.calibrates(corners)["state"], "good");
        assert_eq!(accepted(wearer), [5, 0]);
        // The same page in another headset.
        let told = wearer.is_in(other);
        assert_eq!(told["state"], "other", "{told}");
        assert!(told["base_from_headset"].is_null(), "{told}");
        assert!(text_of(&told, "text").contains("press Calibrate"));
        assert_eq!(accepted(wearer), [0, 5]);
        // It can neither check nor cancel another headset's calibration.
        wearer.asks("recentred");
        assert_eq!(wearer.is_in(one)["state"], "good");
        wearer.asks("recentred");
        wearer.is_in(other);
        wearer.touches(corners[0]);
        assert_eq!(wearer.is_in(one)["state"], "unchecked");
        // It is calibrated, and the first one must then be calibrated again.
        wearer.is_in(other);
        assert_eq!(wearer.calibrates(corners)["state"], "good");
        assert_eq!(accepted(wearer), [5, 0]);
        assert_eq!(wearer.is_in(one)["state"], "other");
        assert_eq!(accepted(wearer), [0, 5]);
    });
    let kept = kept(&file);
    assert_eq!(kept.headset(), other);
    // At the next start the file applies only to its headset.
    worn(&file, truth, |wearer, _| {
        assert_eq!(wearer.is_in(one)["state"], "other");
        assert_eq!(wearer.is_in(other)["state"], "unchecked");
    });
}

#[test]
fn a_client_that_does_not_say_which_headset_it_is_is_told() {
    let file = file("headset_nameless.json");
    let (_, corners) = face();
    worn(&file, truth(&mut Sampler::new(9)), |wearer, server| {
        wearer.socket = Socket::open(server);
        wearer.sample(corners[0]);
        let said = wearer.socket.wait_for("error");
        assert!(text_of(&said, "text").contains("headset"), "{said}");
        wearer.asks("begin");
        let told = wearer.touches(corners[0]);
        assert!(text_of(&told, "text").contains("no headset"), "{told}");
    });
}

/// On an upright board, exchanged left and right also fit, with the space turned by half a turn.
#[test]
fn exchanged_sides_and_other_orders_are_refused() {
    let file = file("headset_orders.json");
    let (_, [a, b, c]) = face();
    worn(&file, truth(&mut Sampler::new(10)), |wearer, _| {
        for (touched, why) in [([b, a, a + c - b], "left and right"), ([c, b, a], "order")] {
            let told = wearer.calibrates(touched);
            let step = (&told["state"], &told["corner"]);
            assert_eq!(step, (&"touching".into(), &0.into()), "{told}");
            assert!(text_of(&told, "text").contains(why), "{told}");
        }
    });
    assert!(!file.exists());
}

/// Regression: exchanged sides were accepted if the newest sample had no head.
#[test]
fn exchanged_sides_are_refused_without_a_head_in_view() {
    let file = file("headset_headless.json");
    let (_, [a, b, c]) = face();
    let exchanged = [b, a, a + c - b];
    worn(&file, truth(&mut Sampler::new(11)), |wearer, _| {
        let seen = wearer.head_m.take();
        let told = wearer.calibrates(exchanged);
        assert_eq!(told["corner"], 0, "{told}");
        assert!(text_of(&told, "text").contains("head is not seen"));
        // It was seen at the first corner.
        wearer.head_m = seen;
        wearer.asks("begin");
        wearer.touches(exchanged[0]);
        wearer.head_m = None;
        assert_eq!(wearer.touches(exchanged[1])["corner"], 2);
        let told = wearer.touches(exchanged[2]);
        assert_eq!(told["corner"], 0, "{told}");
        assert!(text_of(&told, "text").contains("left and right"), "{told}");
        // The head from an earlier calibration does not count.
        let told = wearer.calibrates(exchanged);
        assert!(text_of(&told, "text").contains("head is not seen"));
    });
    assert!(!file.exists());
}

#[test]
fn a_touch_of_the_same_corner_is_refused_at_once() {
    let file = file("headset_close.json");
    let (_, corners) = face();
    worn(&file, truth(&mut Sampler::new(12)), |wearer, _| {
        wearer.asks("begin");
        wearer.touches(corners[0]);
        let told = wearer.touches(corners[0] + 0.02 * DVec3::Y);
        assert_eq!(told["corner"], 1, "{told}");
        assert!(text_of(&told, "text").contains("mm apart"), "{told}");
        assert_eq!(wearer.touches(corners[1])["corner"], 2);
    });
}

/// Regression: corners were taken from the last seen pose of the board, regardless of its age.
#[test]
fn a_board_that_is_not_seen_any_more_is_not_touched() {
    let file = file("headset_board.json");
    let (_, corners) = face();
    worn(&file, truth(&mut Sampler::new(13)), |wearer, _| {
        wearer.asks("begin");
        wearer.is_silent.store(true, Ordering::SeqCst);
        let told = wearer.touches(corners[0]);
        assert_eq!(told["corner"], 0, "{told}");
        assert!(text_of(&told, "text").contains("not known"), "{told}");
        wearer.is_silent.store(false, Ordering::SeqCst);
        assert_eq!(wearer.touches(corners[0])["corner"], 1);
    });
}

#[test]
fn a_calibration_that_cannot_be_kept_is_told() {
    let file = file("headset_folder/headset.json");
    let (_, corners) = face();
    worn(&file, truth(&mut Sampler::new(14)), |wearer, _| {
        let told = wearer.calibrates(corners);
        assert_eq!(told["state"], "good", "{told}");
        assert!(text_of(&told, "text").contains("not kept"), "{told}");
    });
}

#[test]
fn a_file_that_is_no_calibration_is_named() {
    let file = file("headset_bad.json");
    std::fs::write(&file, "{}").expect("a file");
    let started = BridgeServer::start(BridgeConfig {
        calibration: Some(file.clone()),
        listen: ([127, 0, 0, 1], 0).into(),
        ..BridgeConfig::default()
    });
    let error = started.err().expect("an error");
    assert!(matches!(error, BridgeError::Calibration { .. }));
    assert!(error.to_string().contains("headset_bad.json"), "{error}");
}

/// Without the feature, HTTPS is refused with the command that builds it.
#[test]
#[cfg(not(feature = "tls"))]
fn https_without_the_feature_names_the_build() {
    let started = BridgeServer::start(BridgeConfig {
        certificate: Some(hwall_bridge::Certificate::SelfSigned("x.pem".into())),
        ..BridgeConfig::default()
    });
    let error = started.err().expect("an error");
    assert!(error.to_string().contains("--features tls"), "{error}");
}
