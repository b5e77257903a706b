//! Who foresees the touches of the main job: three predictors on the same samples, one of which
//! leads the board.

use crate::contact_rooms::{self, Condition, Stream};
use crate::demonstrations::hand_frame;
use crate::touches::{self, Touch};
use clap::ValueEnum;
use glam::DVec3;
use hwall_contact::{
    ContactPrediction, DeterministicPredictor, FusedConfig, FusedPredictor, GazeModel, HandFrame,
    HandPoint, LabelledReach, LearnedConfig, LearnedEstimator, LearnedModel, Predictor,
    PredictorConfig, Seen,
};
use hwall_kinematics::SrsArm;
use hwall_scene::{Scene, SurfaceId};
use hwall_sim::{PersonConfig, Population, TouchSequence};
use std::time::Instant;

/// A way to foresee touches.
#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
pub enum Kind {
    /// The learned estimate of where the motion ends, fused with gaze and surfaces
    Fused,
    /// The gaze ray; without a gaze, the ray along the hand's motion
    RayLed,
    /// As the dissertation: the surface that the gaze ray meets, the hand projected onto it
    RayCast,
}

impl Kind {
    /// In the order of tables and legends.
    pub const ALL: [Self; 3] = [Self::Fused, Self::RayLed, Self::RayCast];

    /// For tables and legends.
    #[must_use]
    pub const fn name(self) -> &'static str {
        match self {
            Self::Fused => "fused",
            Self::RayLed => "ray-led",
            Self::RayCast => "ray cast",
        }
    }
}

/// What a tracker sees of a person, and what people like that person are like.
#[derive(Debug, Clone, PartialEq)]
pub struct Company {
    /// Where they stand, and how fast they reach.
    pub person: PersonConfig,
    /// Points of the hand that are tracked.
    pub points: Vec<HandPoint>,
    /// Is the head tracked?
    pub head: bool,
    /// Is the gaze?
    pub gaze: bool,
}

impl Default for Company {
    /// The simulated person's: all different, everything tracked.
    fn default() -> Self {
        Self {
            person: PersonConfig::varied(),
            points: HandPoint::ALL.to_vec(),
            head: true,
            gaze: true,
        }
    }
}

impl Company {
    /// People like the one in a recording: tracked as that one is, with a hand that starts where
    /// that one's starts on average, and about as fast. Nothing else of the recording.
    #[must_use]
    pub fn like(frames: &[HandFrame], touches: &[Touch]) -> Self {
        let seen = |has: &dyn Fn(&HandFrame) -> bool| frames.iter().any(has);
        let mut company = Self {
            points: HandPoint::ALL
                .into_iter()
                .filter(|p| seen(&|f| f.point(*p).is_some()))
                .collect(),
            head: seen(&|f| f.head_m.is_some()),
            gaze: seen(&|f| f.gaze_ray().is_some()),
            ..Self::default()
        };
        let starts: Vec<(DVec3, f64)> = touches
            .iter()
            .filter_map(|touch| {
                let at = frames.partition_point(|f| f.t_s < touch.start_s);
                let (_, start_m) = frames.get(at)?.contact_point()?;
                // The pace is stated for the reference distance.
                let share = start_m.distance(touch.point_m) / PersonConfig::REFERENCE_M;
                let took_s = (touch.contact_s - touch.start_s).max(0.1);
                Some((start_m, took_s / share.max(0.1).powf(0.5)))
            })
            .collect();
        if starts.is_empty() {
            return company;
        }
        let count = starts.len() as f64;
        let rest_m = starts.iter().map(|s| s.0).sum::<DVec3>() / count;
        let reach_s = starts.iter().map(|s| s.1).sum::<f64>() / count;
        let person = &mut company.person;
        person.head_m += rest_m - person.hand_rest_m;
        person.hand_rest_m = rest_m;
        person.mean_reach_s = PACE.map(|share| share * reach_s);
        company
    }
}

/// The slowest and the fastest of people like one, as shares of that one's duration.
const PACE: [f64; 2] = [0.7, 1.4];

/// People to learn from, and touches of each.
const PEOPLE: u64 = 12;
const TOUCHES: usize = 12;
/// Seed of these people; that of who touches is drawn in another way, so that nobody is both.
const SEED: u64 = 0x0005_EED0_FD15_7A4C;

/// Period of their tracker, s.
const TRACKER_S: f64 = 1.0 / 90.0;

/// What the predictors said to one sample: surface and point of the most probable answer.
#[derive(Debug, Clone, Copy)]
pub struct Said {
    /// Time of the sample, s.
    pub t_s: f64,
    /// In the order of [`Kind::ALL`]; `None`: nothing in sight.
    pub first: [Option<(SurfaceId, DVec3)>; 3],
    /// Time that each took, ns; 0 where there is no such predictor.
    pub took_ns: [f64; 3],
}

/// The three predictors, those that there are.
pub struct Foresight {
    predictors: [Option<Box<dyn Predictor>>; 3],
    leader: Kind,
    answers: Vec<ContactPrediction>,
}

impl Foresight {
    /// Trains for a scene and for people like those to come; `leader` leads the board, by default the
    /// fused predictor, or the ray-led one where nobody can be learnt from. Also says what was learnt
    /// from whom, for people.
    ///
    /// # Errors
    /// The fused predictor is asked for, but in this scene there is nobody to learn from.
    pub fn train(
        scene: &Scene,
        arm: &SrsArm,
        company: &Company,
        leader: Option<Kind>,
    ) -> anyhow::Result<(Self, String)> {
        let began = Instant::now();
        let (fused, leader, remark) = match fused(scene, arm, company) {
            Ok((fused, reaches)) => {
                let remark = format!(
                    "the fused predictor learnt from {reaches} simulated reaches of {PEOPLE} other people, in {:.1} s",
                    began.elapsed().as_secs_f64()
                );
                (Some(fused), leader.unwrap_or(Kind::Fused), remark)
            }
            Err(error) if leader == Some(Kind::Fused) => {
                return Err(error.context("the fused predictor cannot be trained"));
            }
            Err(error) => {
                let remark = format!("no fused predictor, nobody to learn from: {error:#}");
                (None, leader.unwrap_or(Kind::RayLed), remark)
            }
        };
        let ray = |config| -> anyhow::Result<Option<Box<dyn Predictor>>> {
            Ok(Some(Box::new(DeterministicPredictor::new(config)?)))
        };
        let predictors = [
            fused.map(|fused| Box::new(fused) as Box<dyn Predictor>),
            ray(PredictorConfig::ray_led())?,
            ray(PredictorConfig::default())?,
        ];
        let answers = Vec::with_capacity(16);
        let all = Self {
            predictors,
            leader,
            answers,
        };
        Ok((all, remark))
    }

    /// Who leads the board.
    #[must_use]
    pub const fn leader(&self) -> Kind {
        self.leader
    }

    /// Asks all of them; the answers are the leader's.
    pub fn step(&mut self, scene: &Scene, seen: &Seen<'_>) -> (&[ContactPrediction], Said) {
        let mut said = Said {
            t_s: seen.frame.t_s,
            first: [None; 3],
            took_ns: [0.0; 3],
        };
        for (i, predictor) in self.predictors.iter_mut().enumerate() {
            let Some(predictor) = predictor else { continue };
            let began = Instant::now();
            let answers = predictor.predict(scene, seen);
            said.took_ns[i] = began.elapsed().as_secs_f64() * 1e9;
            said.first[i] = answers.first().map(|p| (p.surface, p.point_m));
            if i == self.leader as usize {
                self.answers.clear();
                self.answers.extend_from_slice(answers);
            }
        }
        (&self.answers, said)
    }
}

/// The fused predictor, and how many reaches it learnt from.
fn fused(
    scene: &Scene,
    arm: &SrsArm,
    company: &Company,
) -> anyhow::Result<(FusedPredictor<LearnedEstimator>, usize)> {
    let reaches = demonstrations(scene, arm, company)?;
    let model = LearnedModel::train(&reaches, &LearnedConfig::default())?;
    let mut gaze = GazeModel::default();
    if company.gaze {
        gaze = gaze.fit(&reaches)?;
    }
    let config = FusedConfig {
        gaze,
        ..FusedConfig::default()
    };
    Ok((
        FusedPredictor::new(model.estimator(), config)?,
        reaches.len(),
    ))
}

/// Reaches of other people for places in the scene, as the live filters see them.
fn demonstrations(
    scene: &Scene,
    arm: &SrsArm,
    company: &Company,
) -> anyhow::Result<Vec<LabelledReach>> {
    let condition = Condition {
        person: company.person,
        ..Condition::usual()
    };
    let population = Population::new(condition.person, SEED)?;
    let streams = (0..PEOPLE)
        .map(|number| {
            let person = population.person(number);
            let places = (person.head_m(), condition.person.hand_rest_m);
            let plans = touches::plan(scene, arm, places, TOUCHES, SEED ^ number)?;
            stream(scene, &person.plan(&plans)?, company)
        })
        .collect::<anyhow::Result<Vec<_>>>()?;
    contact_rooms::reaches(&streams, &condition)
}

fn stream(scene: &Scene, hand: &TouchSequence, company: &Company) -> anyhow::Result<Stream> {
    let count = (hand.duration_s() / TRACKER_S) as usize;
    let frames = (0..count)
        .map(|i| {
            let tracked = hand.tracked(i as f64 * TRACKER_S);
            let mut frame = hand_frame(&tracked, &company.points, company.gaze);
            frame.head_m = frame.head_m.filter(|_| company.head);
            frame
        })
        .collect();
    let touches = hand
        .touches()
        .iter()
        // The outline of a patch spans its holes: a place in one of them is on no surface.
        .filter_map(|truth| {
            let closest = scene.closest_touchable(truth.target_m, 0.05).transpose()?;
            Some(closest.map(|closest| contact_rooms::Touch {
                surface: closest.surface,
                target_m: truth.target_m,
                normal: truth.normal,
                start_s: truth.start_s,
                contact_s: truth.contact_s,
            }))
        })
        .collect::<Result<Vec<_>, _>>()?;
    Ok(Stream::new(frames, touches))
}
