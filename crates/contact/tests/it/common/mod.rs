//! Rooms and hands for the tests of predictions, and an estimator with a known error.
#![allow(dead_code)] // benches use a part

use glam::{DMat3, DVec3};
use hwall_contact::{
    ContactEstimate, ContactEstimator, ContactPrediction, FusedConfig, FusedPredictor, Predictor,
    PredictorInput, ReachPhase, TimeToContact,
};
use hwall_hand::{Fixation, Gaze, GazeRay, HandFrame, HandPoint, HandState};
use hwall_scene::{Scene, SurfaceId};
use hwall_testkit::Sampler;

pub(crate) type Quad = [[f64; 3]; 4];

/// Named quads, corners counter-clockwise from outside.
pub(crate) fn scene(quads: &[(&str, Quad)], sidecar: Option<&str>) -> Scene {
    let mut obj = String::new();
    for (i, (name, corners)) in quads.iter().enumerate() {
        obj += &format!("o {name}\n");
        for [x, y, z] in corners {
            obj += &format!("v {x} {y} {z}\n");
        }
        let first = 4 * i + 1;
        obj += &format!("f {} {} {} {}\n", first, first + 1, first + 2, first + 3);
    }
    Scene::from_obj_str(&obj, sidecar).unwrap().0
}

/// The same of plain walls.
pub(crate) fn plain_scene(quads: &[(&str, Quad)]) -> Scene {
    scene(quads, None)
}

/// A rectangle in the plane of a given x that faces smaller x.
pub(crate) fn front(x: f64, [y0, y1]: [f64; 2], [z0, z1]: [f64; 2]) -> Quad {
    [[x, y1, z0], [x, y0, z0], [x, y0, z1], [x, y1, z1]]
}

/// A rectangle in the plane of a given y.
pub(crate) fn side(y: f64, [x0, x1]: [f64; 2], [z0, z1]: [f64; 2]) -> Quad {
    [[x0, y, z0], [x1, y, z0], [x1, y, z1], [x0, y, z1]]
}

/// A rectangle in the plane of a given z.
pub(crate) fn top(z: f64, [x0, x1]: [f64; 2], [y0, y1]: [f64; 2]) -> Quad {
    [[x0, y0, z], [x1, y0, z], [x1, y1, z], [x0, y1, z]]
}

/// Rooms of 1, 3, 6 and 12 surfaces, all in front of a hand at about (0, 0, 1.2).
pub(crate) fn room(surfaces: usize) -> Vec<(&'static str, Quad)> {
    let all = [
        ("wall", front(0.7, [-1.0, 0.5], [0.3, 2.0])),
        ("side", side(0.5, [-0.2, 0.7], [0.3, 2.0])),
        ("shelf", front(0.45, [-0.4, -0.1], [1.0, 1.15])),
        ("board", top(1.15, [0.45, 0.7], [-0.4, -0.1])),
        ("picture", front(0.65, [-0.1, 0.3], [1.35, 1.7])),
        ("post", side(-0.6, [0.2, 0.6], [0.6, 1.8])),
        ("tile1", front(0.6, [-0.05, 0.1], [1.05, 1.2])),
        ("tile2", front(0.6, [0.1, 0.25], [1.05, 1.2])),
        ("tile3", front(0.6, [0.25, 0.4], [1.05, 1.2])),
        ("tile4", front(0.6, [-0.05, 0.1], [0.9, 1.05])),
        ("tile5", front(0.6, [0.1, 0.25], [0.9, 1.05])),
        ("tile6", front(0.6, [0.25, 0.4], [0.9, 1.05])),
    ];
    all[..surfaces].to_vec()
}

/// A point drawn uniformly from the quads, among those that the straight path from a hand meets first.
pub(crate) fn target(
    sampler: &mut Sampler,
    scene: &Scene,
    quads: &[(&str, Quad)],
    hand_m: DVec3,
) -> (SurfaceId, DVec3) {
    let corner = |q: &Quad, i: usize| DVec3::from_array(q[i]);
    let edges = |q: &Quad| (corner(q, 1) - corner(q, 0), corner(q, 3) - corner(q, 0));
    let area = |q: &Quad| edges(q).0.cross(edges(q).1).length();
    let total: f64 = quads.iter().map(|(_, q)| area(q)).sum();
    loop {
        let mut left = sampler.uniform(0.0, total);
        let chosen = quads.iter().find(|(_, q)| {
            left -= area(q);
            left <= 0.0
        });
        let Some((name, quad)) = chosen else { continue };
        let (u, v) = edges(quad);
        let point_m =
            corner(quad, 0) + u * sampler.uniform(0.0, 1.0) + v * sampler.uniform(0.0, 1.0);
        let surface = scene.find(name).unwrap();
        let hit = scene.ray_cast(hand_m, point_m - hand_m).unwrap();
        if hit.is_some_and(|h| h.surface == surface && h.point_m.distance(point_m) < 1e-6) {
            return (surface, point_m);
        }
    }
}

/// Replays scripted estimates.
#[derive(Debug, Clone, Default)]
pub(crate) struct Scripted(pub(crate) std::rc::Rc<std::cell::Cell<Option<ContactEstimate>>>);

impl ContactEstimator for Scripted {
    fn begin(&mut self) {}

    fn step(&mut self, _: &HandFrame) -> Option<ContactEstimate> {
        self.0.get()
    }
}

/// A fused predictor with given estimates.
pub(crate) struct Fused {
    pub(crate) predictor: FusedPredictor<Scripted>,
    script: Scripted,
    t_s: f64,
}

impl Fused {
    pub(crate) fn new(config: FusedConfig) -> Self {
        let script = Scripted::default();
        Self {
            predictor: FusedPredictor::new(script.clone(), config).unwrap(),
            script,
            t_s: 0.0,
        }
    }

    /// One sample, 0.01 s after the last one.
    pub(crate) fn see(
        &mut self,
        scene: &Scene,
        state: (DVec3, DVec3),
        estimate: Option<(DVec3, DMat3)>,
        gaze: Option<GazeRay>,
    ) -> &[ContactPrediction] {
        let gaze = fixed(self.t_s + 0.01, gaze);
        self.see_with(scene, state, estimate, gaze)
    }

    /// Time of the last sample, s.
    pub(crate) fn now_s(&self) -> f64 {
        self.t_s
    }

    /// One sample, 0.01 s after the last one, with this gaze.
    pub(crate) fn see_with(
        &mut self,
        scene: &Scene,
        (hand_m, velocity): (DVec3, DVec3),
        estimate: Option<(DVec3, DMat3)>,
        gaze: Gaze,
    ) -> &[ContactPrediction] {
        self.t_s += 0.01;
        let state = hand(self.t_s, hand_m, velocity);
        self.script
            .0
            .set(estimate.map(|(point_m, covariance)| ContactEstimate {
                covariance_m2: Some(covariance),
                time_to_contact_s: Some(TimeToContact {
                    mean_s: 0.3,
                    sd_s: Some(0.05),
                }),
                ..ContactEstimate::of_point(self.t_s, point_m)
            }));
        let frame = HandFrame {
            palm_m: Some(hand_m),
            ..HandFrame::empty(self.t_s)
        };
        let input = PredictorInput {
            frame: &frame,
            hand: Some(&state),
            gaze,
        };
        self.predictor.predict(scene, &input)
    }
}

/// Predictions for a hand and a gaze.
pub(crate) fn see<'a>(
    predictor: &'a mut (impl Predictor + ?Sized),
    scene: &Scene,
    hand: &HandState,
    gaze: Gaze,
) -> &'a [ContactPrediction] {
    let input = PredictorInput {
        frame: &HandFrame::empty(hand.t_s),
        hand: Some(hand),
        gaze,
    };
    predictor.predict(scene, &input)
}

pub(crate) fn hand(t_s: f64, point_m: DVec3, velocity_m_per_s: DVec3) -> HandState {
    HandState {
        t_s,
        point: HandPoint::Palm,
        point_m,
        velocity_m_per_s,
        direction: velocity_m_per_s.try_normalize(),
        smoothed_m: [point_m; 2],
        delay_s: 0.0,
        unseen_s: 0.0,
        palm_m: Some(point_m),
    }
}

/// A line of sight fixated for half a second; lost without one.
pub(crate) fn fixed(t_s: f64, ray: Option<GazeRay>) -> Gaze {
    ray.map_or(Gaze::Lost, |ray| {
        Gaze::Fixed(Fixation::of_ray(t_s - 0.5, t_s, ray))
    })
}

pub(crate) fn gaze_at(eye_m: DVec3, target_m: DVec3) -> GazeRay {
    GazeRay {
        origin_m: eye_m,
        direction: (target_m - eye_m).normalize(),
    }
}

/// A direction rotated by normal angles with this spread, rad, about two axes across it.
pub(crate) fn blurred(sampler: &mut Sampler, direction: DVec3, sd_rad: f64) -> DVec3 {
    let (u, v) = direction.any_orthonormal_pair();
    let [a, b] = [sampler.normal() * sd_rad, sampler.normal() * sd_rad];
    let angle = a.hypot(b);
    let aside = (u * a + v * b).normalize_or_zero();
    direction * angle.cos() + aside * angle.sin()
}

/// A covariance with the given standard deviations along random axes, m, and a draw from it.
pub(crate) fn error(sampler: &mut Sampler, sd_m: DVec3) -> (DVec3, DMat3) {
    let turn = sampler.rotation();
    let draw = sampler.normal_vector() * sd_m;
    let covariance = turn * DMat3::from_diagonal(sd_m * sd_m) * turn.transpose();
    (turn * draw, covariance)
}

/// Share of the fixations elsewhere for [`following_the_motion`], and their distance from the target, rad.
pub(crate) const ELSEWHERE: f64 = 0.15;
pub(crate) const ELSEWHERE_RAD: f64 = 0.5;

/// The default settings, for people who always touch at the end of their motion.
pub(crate) fn following_the_motion() -> FusedConfig {
    let mut config = FusedConfig::default();
    let looked_at = [0.1, 0.9, 0.0, 0.0, 0.0, 0.0];
    let elsewhere = [1.0, 0.0, 0.0, 0.0, 0.0, 0.0];
    for phase in [ReachPhase::Onset, ReachPhase::UnderWay, ReachPhase::End] {
        config.evidence.set_shares(phase, [looked_at, elsewhere]);
    }
    config
}

/// Finite, with symmetric positive covariances and times that can be.
pub(crate) fn check(name: &str, estimate: &ContactEstimate) {
    let is_good = |time: TimeToContact| {
        (0.0..f64::INFINITY).contains(&time.mean_s)
            && time.sd_s.is_none_or(|sd| sd > 0.0 && sd.is_finite())
    };
    assert!(
        estimate.t_s.is_finite()
            && estimate.point_m.is_finite()
            && (estimate.covariance_m2)
                .is_none_or(|c| c.is_finite() && c.determinant() > 0.0 && c == c.transpose())
            && estimate.time_to_contact_s.is_none_or(is_good),
        "{name}: {estimate:?}"
    );
}

/// The same of an estimator that states all of it.
pub(crate) fn check_all(estimate: &ContactEstimate) {
    let time = estimate.time_to_contact_s.expect("learnt");
    assert!(estimate.covariance_m2.is_some() && time.sd_s.is_some());
    check("learnt", estimate);
}

pub(crate) const EYE: DVec3 = DVec3::new(-0.25, 0.1, 1.6);

pub(crate) fn fused() -> Fused {
    Fused::new(FusedConfig::default())
}

pub(crate) fn ball(sd_m: f64) -> DMat3 {
    DMat3::from_diagonal(DVec3::splat(sd_m * sd_m))
}

pub(crate) const WALL: Quad = [
    [0.7, 1.0, 0.0],
    [0.7, -1.0, 0.0],
    [0.7, -1.0, 2.0],
    [0.7, 1.0, 2.0],
];
