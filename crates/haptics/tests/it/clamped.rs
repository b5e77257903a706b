//! A person caught by the arm is released: on either side of the board, or at a link.

use crate::support::{DT_S, at_rest, home, iiwa, person_at, rates, unpressed};
use glam::DVec3;
use hwall_haptics::safety::{GuardLimits, Supervisor, SupervisorConfig, SupervisorInput};
use hwall_haptics::{
    ArmCommand, ArmState, Board, BoardTarget, RenderInput, Renderer, RendererConfig, SafeRequest,
    SafeState,
};
use hwall_kinematics::{ArmKinematics, JointPositions, JointTorques, SrsArm};
use hwall_testkit::{Sampler, seeds};
use std::collections::VecDeque;
use std::sync::Arc;

const REACTION: usize = 22;
const FACE: f64 = 4.0;
/// Torque limits of the joints of an iiwa 7, N m.
const LARGEST_N_M: [f64; 7] = [176.0, 176.0, 110.0, 110.0, 110.0, 40.0, 40.0];
/// A push that loads a joint above this share of its torque limit moves it; contacts are reported from 3 % on.
const TURNS: f64 = 0.04;

/// A soft obstacle that the arm meets.
#[derive(Clone, Copy)]
struct Hand {
    /// The point of the body that it touches: 2 the elbow, 3 the wrist, 4 the face; fractions are on the links between them.
    point: f64,
    /// Its surface, m, and the direction in which it pushes.
    at_m: DVec3,
    pushes: DVec3,
    n_per_m: f64,
}

struct Scene {
    /// The configuration that presents the board.
    home: JointPositions,
    arm: Arc<dyn ArmKinematics>,
    renderer: Renderer,
    supervisor: Supervisor,
    state: ArmState,
    sent: VecDeque<JointPositions>,
    now_s: f64,
    request: Option<SafeRequest>,
    force_n: f64,
    said: SafeState,
    fingertip_stamp_s: Option<f64>,
    head_m: DVec3,
    /// A hand is at the board.
    is_touched: bool,
    /// Reading of the first torque sensor without a push, N m.
    bias_n_m: f64,
    /// A second push; `force_n` is then that of this one.
    other: Option<Hand>,
}

impl Scene {
    fn new() -> Self {
        Self::at(home())
    }

    fn at(home: JointPositions) -> Self {
        Self::with(home, SupervisorConfig::default())
    }

    fn with(home: JointPositions, mut config: SupervisorConfig) -> Self {
        let board = Board::default();
        config.hand.frozen_s = None;
        config.head.frozen_s = None;
        Self {
            renderer: Renderer::new(&SrsArm::iiwa7(), &board, RendererConfig::default()).unwrap(),
            supervisor: Supervisor::new(&SrsArm::iiwa7(), &board, config).unwrap(),
            arm: Arc::new(iiwa()),
            state: at_rest(0.0, home),
            sent: VecDeque::from(vec![home; REACTION]),
            home,
            now_s: 0.0,
            request: None,
            force_n: 0.0,
            said: SafeState::Normal,
            fingertip_stamp_s: None,
            head_m: DVec3::new(2.0, 0.0, 1.0),
            is_touched: false,
            bias_n_m: 0.0,
            other: None,
        }
    }

    /// A hand is at the board, and presses its face with 200 N.
    fn pressed() -> (Self, Hand) {
        let mut scene = Self::new();
        scene.is_touched = true;
        let hand = scene.obstacle(FACE, -0.1, -scene.normal(), 2e3);
        (scene, hand)
    }

    /// The outward normal of the face at home.
    fn normal(&self) -> DVec3 {
        self.arm.forward(&self.home).rotation().z_axis
    }

    /// An obstacle this far before a point of the arm at home; a negative gap is a depth.
    fn obstacle(&self, point: f64, gap_m: f64, pushes: DVec3, n_per_m: f64) -> Hand {
        Hand {
            point,
            at_m: self.point_m(&self.home, point) - gap_m * pushes,
            pushes,
            n_per_m,
        }
    }

    /// The hand is now where it pushes the arm with a force.
    fn pushes_with(&self, hand: &mut Hand, force_n: f64) {
        let at_m = self.point_m(&self.state.q, hand.point);
        hand.at_m = at_m + hand.pushes * (force_n / hand.n_per_m);
    }

    /// The time until something is reported, at most 50 ms.
    fn named_ms(&mut self, hand: &Hand) -> Option<usize> {
        (0..50).find(|_| {
            self.step(hand);
            self.said != SafeState::Normal
        })
    }

    fn run(&mut self, hand: &Hand, cycles: usize) {
        for _ in 0..cycles {
            self.step(hand);
        }
    }

    /// The largest force during the run, N.
    fn most_n(&mut self, hand: &Hand, cycles: usize) -> f64 {
        (0..cycles).fold(0.0, |most_n, _| {
            self.step(hand);
            self.force_n.max(most_n)
        })
    }

    fn point_m(&self, q: &JointPositions, point: f64) -> DVec3 {
        let body = self.arm.body_points(q);
        let [from_m, to_m] = [point.floor(), point.ceil()].map(|i| body.points_m()[i as usize]);
        from_m.lerp(to_m, point.fract())
    }

    fn step(&mut self, hand: &Hand) {
        self.now_s += DT_S;
        let q = self.state.q;
        let mut torque = JointTorques::default();
        for pushing in [Some(hand), self.other.as_ref()].into_iter().flatten() {
            let depth_m = (pushing.at_m - self.point_m(&q, pushing.point))
                .dot(pushing.pushes)
                .max(0.0);
            let force = pushing.pushes * (pushing.n_per_m * depth_m);
            self.force_n = force.length();
            // By virtual work, wherever it acts.
            for joint in 0..7 {
                let mut ahead = q;
                ahead[joint] += 1e-6;
                let way = self.point_m(&ahead, pushing.point) - self.point_m(&q, pushing.point);
                torque[joint] += force.dot(way) / 1e-6;
            }
        }
        torque[0] += self.bias_n_m;
        self.state.external_torque = Some(torque);
        self.state.t_s = self.now_s;
        let face = self.arm.forward(&self.home);
        let target = BoardTarget::new(face.position_m(), face.rotation().z_axis, self.now_s);
        let input = RenderInput {
            target: Some(&target),
            request: self.request,
            ..RenderInput::default()
        };
        let step = self.renderer.step_with(self.now_s, &self.state, &input);
        self.renderer.plan();
        let stamp_s = self.fingertip_stamp_s.unwrap_or(self.now_s);
        let mut person = person_at(DVec3::new(2.0, 0.0, 1.0), stamp_s);
        person[1].position_m = self.head_m;
        // The fingertip is far away, or its position is unknown.
        let is_seen = self.fingertip_stamp_s.is_none() && !self.is_touched;
        self.supervisor.set_out_of_reach(is_seen);
        let said = self.supervisor.step(&SupervisorInput {
            force: step.wrench,
            ..unpressed(self.now_s, &self.state, &person, step.command)
        });
        (self.request, self.said) = (Some(said.request), said.state);
        let next = match said.command {
            ArmCommand::Position(q) => q,
            _ => *self.sent.back().unwrap(),
        };
        self.sent.push_back(next);
        let q = self.sent.pop_front().unwrap();
        self.state.qd = rates(&self.state.q, &q);
        self.state.q = q;
    }
}

/// Rise of the force after the first reported state, N, and the force half a second later.
fn clamped(home: JointPositions, pushes: DVec3, n_per_m: f64, most_n: f64) -> (f64, f64) {
    let mut scene = Scene::at(home);
    scene.is_touched = true;
    let mut hand = scene.obstacle(FACE, 0.01, pushes, n_per_m);
    scene.run(&hand, 300);
    assert_eq!(scene.said, SafeState::Normal);
    // The force increases until it is detected.
    for _ in 0..60_000 {
        if scene.said != SafeState::Normal {
            break;
        }
        if scene.force_n < most_n {
            hand.at_m += pushes * (20.0 / n_per_m * DT_S);
        }
        scene.step(&hand);
    }
    let noticed_n = scene.force_n;
    assert_ne!(scene.said, SafeState::Normal, "{noticed_n} N");
    let most_n = scene.most_n(&hand, 500);
    let left_n = scene.force_n;
    let most_n = scene.most_n(&hand, 3000).max(most_n);
    assert!(scene.force_n < 65.0, "{} N for ever", scene.force_n);
    (most_n - noticed_n, left_n)
}

#[test]
fn a_hand_that_is_squeezed_is_let_go_on_either_side_of_the_board() {
    let normal = Scene::new().normal();
    for side in [1.0, -1.0] {
        for n_per_m in [1.3e3, 2e3, 5e3, 20e3] {
            let (rise_n, left_n) = clamped(home(), side * normal, n_per_m, 200.0);
            println!("{side} {n_per_m}: + {rise_n:.1} N, {left_n:.1} N after 0.5 s");
            assert!(rise_n <= 10.0, "{side} {n_per_m}: {rise_n} N more");
            assert!(left_n < 65.0, "{side} {n_per_m}: {left_n} N left");
        }
    }
}

/// A posture near the nominal one.
fn near_home(random: &mut Sampler) -> JointPositions {
    JointPositions(home().0.map(|q| q + random.uniform(-0.3, 0.3)))
}

#[test]
#[ignore = "minutes"]
fn a_hand_that_is_squeezed_in_many_ways_is_let_go() {
    let (mut most_n, mut least_free_n, mut bad, mut count) = (0.0_f64, 0.0_f64, 0, 0);
    for seed in seeds(0..20) {
        let mut random = Sampler::new(seed);
        let at = near_home(&mut random);
        let normal = iiwa().forward(&at).rotation().z_axis;
        let aslant = random.unit_vector() * random.uniform(0.0, 0.3);
        let side = if random.bool() { 1.0 } else { -1.0 };
        let pushes = (side * normal + aslant).normalize();
        let n_per_m = 2e3 * 37.5_f64.powf(random.uniform(0.0, 1.0));
        let (rise_n, left_n) = clamped(at, pushes, n_per_m, 200.0);
        let is_bad = rise_n > 10.0 || left_n >= 65.0;
        if is_bad {
            println!("seed {seed}: {pushes} {n_per_m:.0} N/m: + {rise_n:.1} N, {left_n:.1} N");
        }
        (most_n, least_free_n) = (most_n.max(rise_n), least_free_n.max(left_n));
        (bad, count) = (bad + u32::from(is_bad), count + 1);
    }
    println!(
        "goal: (b) the force on a squeezed hand of 2 to 75 N/mm rises by at most 10 N after the first named state and is below 65 N 0.5 s later \
         | 10 N, 65 N | {most_n:.1} N, {least_free_n:.1} N, {bad} beyond | {count} hands"
    );
    assert_eq!(bad, 0);
}

/// Regression: whoever let go of the enabling switch before the clamp was noticed was held by up to 280 N until a reset.
#[test]
fn a_stop_before_a_clamp_is_noticed_does_not_keep_it() {
    let (mut scene, hand) = Scene::pressed();
    scene.run(&hand, 100);
    assert_eq!(scene.said, SafeState::Normal);
    assert!(scene.force_n > 140.0, "{} N", scene.force_n);
    scene.supervisor.stop();
    // 0.5 s until 200 N count as lasting, and half a second to give way.
    scene.run(&hand, 1000);
    assert!(scene.force_n < 65.0, "{} N", scene.force_n);
    scene.run(&hand, 3000);
    assert_eq!(scene.said.name(), "stopped");
}

/// Regression: a push beyond the torque that a joint's motor can hold was taken for a broken arm, which stands.
#[test]
fn a_push_that_is_stronger_than_a_joint_is_given_way_to() {
    let guard = GuardLimits {
        // The wrist of a Panda.
        torque_n_m: [87.0, 87.0, 87.0, 87.0, 12.0, 12.0, 12.0],
        ..GuardLimits::of_arm(&iiwa())
    };
    let config = SupervisorConfig {
        guard: Some(guard),
        ..SupervisorConfig::default()
    };
    let mut scene = Scene::with(home(), config);
    scene.is_touched = true;
    let across = scene.arm.forward(&home()).rotation().y_axis;
    let mut hand = scene.obstacle(FACE, 0.01, across, 2e3);
    scene.run(&hand, 100);
    hand.at_m += 0.07 * across;
    scene.run(&hand, 2);
    let reason = scene.said.reason().map(|reason| reason.name());
    assert_eq!(reason, Some("joint_limit"));
    scene.run(&hand, 1000);
    println!("{:.1} N, {}", scene.force_n, scene.said);
    assert!(scene.force_n < 65.0, "{} N", scene.force_n);
}

/// The person's torso is so close to the board that no other motion is allowed.
#[test]
fn a_squeezed_person_who_stands_close_by_is_let_go() {
    for gap_m in [0.05, 0.1, 0.3] {
        let (mut scene, hand) = Scene::pressed();
        let level = scene.normal().with_z(0.0).normalize();
        let face_m = scene.point_m(&home(), FACE);
        scene.head_m = face_m + level * (gap_m + 0.18) + DVec3::Z * 0.5;
        scene.run(&hand, 1000);
        println!("{gap_m} m: {:.1} N, {}", scene.force_n, scene.said);
        assert!(scene.force_n < 65.0, "{gap_m} m: {} N", scene.force_n);
    }
}

/// Repeated bad cycles during the push.
#[test]
fn giving_way_goes_on_after_a_bad_cycle() {
    for every in [3000, 400] {
        let (mut scene, hand) = Scene::pressed();
        for cycle in 0..6000 {
            if cycle % every == 30 {
                scene.supervisor.refused();
            }
            scene.step(&hand);
        }
        println!("{every}: {:.1} N, {}", scene.force_n, scene.said);
        assert!(scene.force_n < 65.0, "{every}: {} N", scene.force_n);
    }
}

/// A sensor that fails during a touch reports a push that no motion relieves.
#[test]
fn a_failed_sensor_does_not_lead_the_arm_away() {
    let mut scene = Scene::new();
    scene.is_touched = true;
    let hand = scene.obstacle(FACE, 3.0, DVec3::Z, 0.0);
    scene.run(&hand, 300);
    scene.bias_n_m = 100.0;
    let before_m = scene.point_m(&scene.state.q, FACE);
    scene.run(&hand, 6000);
    let way_m = before_m.distance(scene.point_m(&scene.state.q, FACE));
    println!("{way_m:.3} m, {}", scene.said);
    assert!(way_m < 0.2, "{way_m}");
}

/// A board that withdraws because the tracker lost the hand meets the hand on the way back.
#[test]
fn a_retreat_stops_before_a_hand_that_nobody_sees() {
    for (n_per_m, limit_n) in [(1e3, 65.0), (5e3, 65.0), (20e3, 140.0)] {
        let mut scene = Scene::new();
        let hand = scene.obstacle(FACE, 0.03, scene.normal(), n_per_m);
        // The arm rests out of reach: the sensor bias becomes known.
        scene.run(&hand, 1000);
        scene.fingertip_stamp_s = Some(scene.now_s);
        let most_n = scene.most_n(&hand, 6000);
        let end_n = scene.force_n;
        println!("{n_per_m}: at most {most_n:.1} N, {end_n:.1} N at the end");
        assert!(most_n < limit_n && end_n < 20.0, "{n_per_m}: {most_n}");
    }
}

/// On a link, with nobody at the board: reported within 50 ms, and released.
#[test]
fn a_push_on_a_link_is_named_and_let_go() {
    let [x, y, aslant] = [DVec3::X, DVec3::Y, DVec3::new(0.6, 0.0, -0.8)];
    for point in [2.0, 3.0] {
        for pushes in [x, y, -x, -y, aslant] {
            let mut scene = Scene::new();
            let mut hand = scene.obstacle(point, 0.1, pushes, 5e3);
            scene.run(&hand, 1000);
            assert_eq!(scene.said, SafeState::Normal);
            scene.pushes_with(&mut hand, 65.0);
            let named_ms = scene.named_ms(&hand).expect("named");
            let reason = scene.said.reason().expect("a reason").name();
            assert_eq!(reason, "unexpected_contact", "{point} {pushes}");
            let most_n = scene.most_n(&hand, 3000);
            let end_n = scene.force_n;
            println!("{point} {pushes}: {named_ms} ms, at most {most_n:.1} N, then {end_n:.1}");
            // What loads no joint by 3 % of its largest torque may stay.
            assert!(most_n < 75.0 && end_n < 40.0);
        }
    }
}

/// An obstacle stays where the link has to be: the arm comes back after a longer time each time.
#[test]
fn an_arm_that_is_pushed_again_waits_longer_each_time() {
    let mut scene = Scene::new();
    let pushes = DVec3::Y;
    let mut obstacle = scene.obstacle(2.0, 0.1, pushes, 5e3);
    scene.run(&obstacle, 1000);
    // A person leans in by 40 mm at 0.1 m/s, and stays.
    let rests_m = scene.point_m(&home(), 2.0);
    let (mut began_s, mut most_n) = (Vec::new(), Vec::new());
    let mut was = scene.said;
    for k in 0..40_000 {
        obstacle.at_m = rests_m + pushes * (1e-4 * f64::from(k)).min(0.04);
        scene.step(&obstacle);
        let goes = |said| matches!(said, SafeState::Normal | SafeState::Slowed { .. });
        if goes(was) && !goes(scene.said) {
            began_s.push(scene.now_s);
            most_n.push(0.0_f64);
        }
        if let Some(most_n) = most_n.last_mut() {
            *most_n = most_n.max(scene.force_n);
        }
        was = scene.said;
    }
    // Each return to the obstacle is softer than what a face may feel, and the waits double up to 5 s.
    println!("{began_s:?} {most_n:?}");
    assert!(most_n[0] < 120.0 && most_n[1..].iter().all(|most_n| *most_n < 65.0));
    let waits_s: Vec<_> = began_s.windows(2).map(|pair| pair[1] - pair[0]).collect();
    assert!(waits_s.len() > 6 && waits_s[5..].iter().all(|wait_s| *wait_s > 5.0));
}

/// At 20 mm/s the push falls below what is named, and is named again, all the time.
#[test]
fn a_person_who_leans_slowly_is_given_way_to_all_the_way() {
    for n_per_m in [1e3, 5e3, 1e4] {
        let mut scene = Scene::new();
        let rests_m = scene.point_m(&home(), 3.0);
        let mut person = scene.obstacle(3.0, 0.1, DVec3::Y, n_per_m);
        scene.run(&person, 1000);
        let mut most_n = 0.0_f64;
        for cycle in 1..=5000 {
            person.at_m = rests_m + DVec3::Y * (2e-5 * f64::from(cycle));
            scene.step(&person);
            most_n = most_n.max(scene.force_n);
        }
        println!("{n_per_m} N/m: at most {most_n:.1} N");
        assert!(most_n < 65.0);
    }
}

/// A person leans on the arm at a random place from the elbow to the board by 40 mm, then stands. Leaning that loads no joint is not named.
#[test]
#[ignore = "minutes"]
fn a_person_who_leans_on_a_link_is_let_go_in_many_ways() {
    let (mut named, mut free, mut worst_n) = (0, 0, 0.0_f64);
    for seed in seeds(0..20) {
        let mut random = Sampler::new(seed);
        let mut scene = Scene::at(near_home(&mut random));
        let (point, pushes) = (random.uniform(2.0, 3.9), random.unit_vector());
        let rests_m = scene.point_m(&scene.home, point);
        let mut person = scene.obstacle(point, 0.1, pushes, random.uniform(1e3, 1e4));
        scene.run(&person, 1000);
        let cycles = (0.04 / (random.uniform(0.02, 0.1) * DT_S)) as u32;
        let mut is_named = false;
        for cycle in 1..=cycles {
            person.at_m = rests_m + pushes * (0.04 * f64::from(cycle) / f64::from(cycles));
            scene.step(&person);
            is_named |= scene.said != SafeState::Normal;
        }
        if !is_named {
            continue;
        }
        let leant_n = scene.force_n;
        scene.run(&person, 500);
        named += 1;
        worst_n = worst_n.max(scene.force_n);
        let left_n = scene.force_n;
        if left_n < 65.0 {
            free += 1;
        } else {
            println!("seed {seed}: at {point:.2}: {leant_n:.0} N, {left_n:.0} N left");
        }
    }
    let percent = 100.0 * f64::from(free) / f64::from(named);
    println!(
        "goal: (b) a person of 1 to 10 N/mm who leans on elbow, forearm or board by 40 mm at 0.02 to 0.1 m/s feels less than 65 N 0.5 s later \
         | - | {percent:.1} %, at most {worst_n:.0} N | {named} people whose leaning is named"
    );
    assert!(percent >= 90.0);
}

/// At random places from the shoulder to the board, in random directions. A push that moves no joint shows in no torque.
#[test]
#[ignore = "minutes"]
fn many_pushes_on_links_are_named() {
    let (mut count, mut turning, mut named, mut latest_ms) = (0, 0, 0, 0);
    for seed in seeds(0..20) {
        let mut random = Sampler::new(seed);
        let mut scene = Scene::at(near_home(&mut random));
        let (point, pushes) = (random.uniform(1.0, 3.9), random.unit_vector());
        let mut hand = scene.obstacle(point, 0.1, pushes, 5e3);
        scene.run(&hand, 1000);
        assert_eq!(scene.said, SafeState::Normal);
        scene.pushes_with(&mut hand, 65.0);
        scene.step(&hand);
        let torque = scene.state.external_torque.unwrap_or_default();
        let shares = (0..7).map(|i| torque[i].abs() / LARGEST_N_M[i]);
        let share = shares.fold(0.0, f64::max);
        let named_ms = (1..50).find(|_| {
            let is_named = scene.said != SafeState::Normal;
            scene.step(&hand);
            is_named
        });
        count += 1;
        if share < TURNS {
            continue;
        }
        turning += 1;
        match named_ms {
            Some(ms) => (named, latest_ms) = (named + 1, latest_ms.max(ms)),
            None => println!("seed {seed}: {point:.2} {pushes}: {share:.3} of a torque, not named"),
        }
    }
    let percent = 100.0 * f64::from(named) / f64::from(turning);
    println!(
        "goal: (c) 65 N on a link named within 50 ms, of the pushes that load a joint with more than 4 % of its largest torque \
         | 99.9 % | {percent:.2} %, the last after {latest_ms} ms | {turning} such pushes of {count}"
    );
    assert!(percent >= 99.9);
}

/// On a link, while a hand presses the board: also reported within 50 ms. The hand alone is not reported.
#[test]
fn a_push_on_a_link_is_named_while_a_hand_is_at_the_board() {
    let directions = [DVec3::X, DVec3::Y, -DVec3::Y, DVec3::new(0.6, 0.0, -0.8)];
    for point in [2.0, 3.0] {
        for pushes in directions {
            let mut scene = Scene::new();
            let at_board = scene.obstacle(FACE, -0.015, -scene.normal(), 2e3);
            let away = Hand {
                n_per_m: 0.0,
                ..at_board
            };
            scene.run(&away, 1000);
            scene.is_touched = true;
            scene.run(&at_board, 500);
            assert_eq!(scene.said, SafeState::Normal, "the hand alone");
            let mut on_link = scene.obstacle(point, 0.0, pushes, 5e3);
            scene.pushes_with(&mut on_link, 65.0);
            scene.other = Some(on_link);
            let named_ms = scene.named_ms(&at_board);
            let reason = scene.said.reason().map(|reason| reason.name());
            println!("{point} {pushes}: {named_ms:?} ms, {reason:?}");
            assert!(named_ms.is_some(), "{point} {pushes}");
        }
    }
}

/// A sensor bias is not a push: a retreat goes back and does not follow the bias, whether that is known or not.
#[test]
fn a_retreat_does_not_follow_sensors_that_are_off() {
    for rested in [10, 1500] {
        let mut scene = Scene::new();
        scene.bias_n_m = 8.0;
        let normal = scene.normal();
        let nobody = scene.obstacle(FACE, 9.0, -DVec3::X, 0.0);
        scene.run(&nobody, rested);
        let from_m = scene.point_m(&scene.state.q, FACE);
        scene.fingertip_stamp_s = Some(scene.now_s);
        scene.run(&nobody, 4000);
        let way_m = scene.point_m(&scene.state.q, FACE) - from_m;
        let back_m = -way_m.dot(normal);
        assert!(back_m > 0.01, "{rested}: {way_m}");
        let aside_m = way_m.reject_from_normalized(normal).length();
        assert!(aside_m < 2e-3, "{rested}: {way_m}");
    }
}
