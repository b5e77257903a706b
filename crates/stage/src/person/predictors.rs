//! Predictors of the main job: all run on the same samples, one of them leads the board.

use crate::input::arms::BoardArm;
use crate::input::floor_pose::FloorPose;
use crate::person::standing_anywhere::StandingAnywhere;
use crate::person::touches::{self, Standing};
use crate::person::training::{self, Stream};
use clap::ValueEnum;
use glam::DVec3;
use hwall::response::EndToEnd;
use hwall_contact::{
    ContactPrediction, DeterministicConfig, DeterministicPredictor, FusedConfig, FusedPredictor,
    LearnedConfig, LearnedEstimator, LearnedModel, Predictor, PredictorInput,
};
use hwall_hand::{HandFrame, HandPoint};
use hwall_scene::{Scene, SurfaceId};
use hwall_sim::{PersonConfig, Population, TouchSequence};
use std::ops::Range;
use std::time::Instant;

named! {
    /// A predictor of touches.
    #[derive(Default, ValueEnum)]
    pub enum PredictorKind {
        /// The learned estimate of where the motion ends, fused with gaze and surfaces
        #[default]
        Fused = "fused",
        /// The gaze ray; without a gaze, the ray along the hand's motion
        RayLed = "ray-led",
        /// The dissertation's method: the surface that the gaze ray hits, with the hand projected onto it
        RayCast = "ray cast",
        /// The dissertation's end-to-end response: from the hand to the joints of the arm, without surfaces or inverse kinematics;
        /// only trained if asked for
        EndToEnd = "end-to-end",
    }
}

/// Number of predictors.
pub const PREDICTORS: usize = PredictorKind::ALL.len();

impl PredictorKind {
    /// The ray settings of a ray predictor.
    #[must_use]
    pub fn ray_config(self) -> DeterministicConfig {
        match self {
            Self::RayCast => DeterministicConfig::default(),
            _ => DeterministicConfig::ray_led(),
        }
    }
}

/// The people the predictor learns from, and what the tracker sees of them.
#[derive(Debug, Clone, PartialEq)]
pub struct TrainingPeople {
    /// Standing place and reaching speed.
    pub person: PersonConfig,
    /// Points of the hand that are tracked.
    pub points: Vec<HandPoint>,
    /// Is the head tracked?
    pub head: bool,
    /// Is the gaze tracked?
    pub gaze: bool,
    /// Will later people stand elsewhere and face other directions? Needs the head.
    pub elsewhere: bool,
}

impl Default for TrainingPeople {
    /// Simulated people, all different, everything tracked.
    fn default() -> Self {
        Self {
            person: PersonConfig::varied(),
            points: HandPoint::ALL.to_vec(),
            head: true,
            gaze: true,
            elsewhere: false,
        }
    }
}

impl TrainingPeople {
    /// The same people seen from a moved arm base; they stay where they stand.
    #[must_use]
    pub fn seen_from(self, base: FloorPose) -> Self {
        Self {
            person: base.person_seen(self.person),
            ..self
        }
    }

    /// The simulated people of [`TrainingPeople::default`], tracked no better than the hand in a recording, and standing where it is
    /// first seen. Uses nothing else of the recording, neither places nor speeds, which are unknown before the predicted touches.
    #[must_use]
    pub fn tracked_as(frames: &[HandFrame]) -> Self {
        let seen = |has: &dyn Fn(&HandFrame) -> bool| frames.iter().any(has);
        let people = Self {
            points: HandPoint::ALL
                .into_iter()
                .filter(|p| seen(&|f| f.point(*p).is_some()))
                .collect(),
            head: seen(&|f| f.head_m.is_some()),
            gaze: seen(&|f| f.gaze_ray().is_some()),
            ..Self::default()
        };
        match frames.iter().find_map(Standing::seen_in) {
            Some(standing) => people.standing(&standing),
            None => people,
        }
    }

    /// The same people at another place.
    #[must_use]
    pub fn standing(mut self, at: &Standing) -> Self {
        (self.person.head_m, self.person.hand_rest_m) = (at.head_m, at.hand_m);
        self
    }
}

/// Number of training people, and touches of each.
const PEOPLE: u64 = 12;
const TOUCHES: usize = 12;
/// Seed of these people. Test people's seeds are drawn differently, so nobody is in both sets.
const SEED: u64 = 0x0005_EED0_FD15_7A4C;

/// Least distance of a resting hand from the surface to touch, m; the place of rest scatters.
const CLEAR_M: f64 = 0.1;

/// Period of their tracker, s.
const TRACKER_S: f64 = 1.0 / 90.0;

/// A point on a surface.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct SurfacePlace {
    /// The surface.
    pub surface: SurfaceId,
    /// The point, m.
    pub point_m: DVec3,
}

/// All predictors' output for one sample.
#[derive(Debug, Clone, Copy)]
pub struct PredictionRecord {
    /// Time of the sample, s.
    pub t_s: f64,
    /// The most probable contact, in the order of [`PredictorKind::ALL`]; `None`: no prediction.
    pub likeliest: [Option<SurfacePlace>; PREDICTORS],
    /// Computing time of each, ns; 0 for a missing predictor.
    pub took_ns: [f64; PREDICTORS],
}

/// A predictor that can be cloned.
trait CopiedPredictor: Predictor + Sync {
    fn copied(&self) -> Box<dyn CopiedPredictor>;
}

impl<P: Predictor + Clone + Sync + 'static> CopiedPredictor for P {
    fn copied(&self) -> Box<dyn CopiedPredictor> {
        Box::new(self.clone())
    }
}

/// The predictors that could be created.
pub struct Predictors {
    predictors: [Option<Box<dyn CopiedPredictor>>; PREDICTORS],
    leader: PredictorKind,
    adapts: bool,
    answers: Vec<ContactPrediction>,
    records: Vec<PredictionRecord>,
}

impl Predictors {
    /// Trains for a scene and for people like those to come. `leader` leads the board, by default the
    /// fused predictor, or the ray-led one without training data. Also returns a line for the user about
    /// the training.
    ///
    /// # Errors
    /// The fused predictor is requested, but this scene yields no training data.
    pub fn train(
        scene: &Scene,
        arm: &BoardArm,
        people: &TrainingPeople,
        leader: Option<PredictorKind>,
    ) -> anyhow::Result<(Self, String)> {
        let began = Instant::now();
        let (learnt, stood) = match fused(scene, arm, people) {
            // Possibly nothing is within reach where the hand was first seen, because the person walks later.
            Err(error) => match fused(scene, arm, &people.clone().standing(&Standing::nominal())) {
                Ok(learnt) => (Ok(learnt), ", who stand elsewhere"),
                Err(_) => (Err(error), ""),
            },
            learnt => (learnt, ""),
        };
        let (fused, leader, remark) = match learnt {
            Ok((fused, reaches)) => {
                let remark = format!(
                    "training: the fused predictor learnt from {reaches} simulated reaches of {PEOPLE} people of seed {SEED:#x}{stood}, none of whom is judged, in {:.1} s",
                    began.elapsed().as_secs_f64()
                );
                (Some(fused), leader.unwrap_or(PredictorKind::Fused), remark)
            }
            Err(error) if leader == Some(PredictorKind::Fused) => {
                return Err(error.context("the fused predictor cannot be trained"));
            }
            Err(error) => {
                let remark = format!("no fused predictor, nobody to learn from: {error:#}");
                (None, leader.unwrap_or(PredictorKind::RayLed), remark)
            }
        };
        Ok((Self::of(fused, leader)?, remark))
    }

    /// A fused predictor, if there is one, with the ray predictors.
    ///
    /// # Errors
    /// Settings that a ray predictor refuses.
    pub fn of<P: Predictor + Clone + Sync + 'static>(
        fused: Option<P>,
        leader: PredictorKind,
    ) -> anyhow::Result<Self> {
        let ray = |kind: PredictorKind| -> anyhow::Result<Option<Box<dyn CopiedPredictor>>> {
            Ok(Some(Box::new(DeterministicPredictor::new(
                kind.ray_config(),
            )?)))
        };
        Ok(Self {
            predictors: [
                fused.map(|fused| Box::new(fused) as Box<dyn CopiedPredictor>),
                ray(PredictorKind::RayLed)?,
                ray(PredictorKind::RayCast)?,
                None,
            ],
            leader,
            adapts: true,
            answers: Vec::with_capacity(16),
            records: Vec::new(),
        })
    }

    /// The same trained predictors for another person, without any samples.
    #[must_use]
    pub fn for_another_person(&self) -> Self {
        let copied = |p: &Option<Box<dyn CopiedPredictor>>| {
            let mut copy = (**p.as_ref()?).copied();
            copy.reset();
            Some(copy)
        };
        Self {
            predictors: std::array::from_fn(|i| copied(&self.predictors[i])),
            leader: self.leader,
            adapts: self.adapts,
            answers: Vec::with_capacity(16),
            records: Vec::new(),
        }
    }

    /// The same, with the end-to-end response.
    #[must_use]
    pub fn with_response(mut self, response: EndToEnd) -> Self {
        self.predictors[PredictorKind::EndToEnd as usize] = Some(Box::new(response));
        self
    }

    /// The same, with or without feedback about felt touches. Default: with feedback.
    #[must_use]
    pub fn with_adapting(self, adapts: bool) -> Self {
        Self { adapts, ..self }
    }

    /// Do they learn from touches that the board feels?
    #[must_use]
    pub const fn adapts(&self) -> bool {
        self.adapts
    }

    /// The predictor that leads the board.
    #[must_use]
    pub const fn leader(&self) -> PredictorKind {
        self.leader
    }

    /// All predictions of the leader from the last sample, the most probable first, in the frame of the scene.
    #[must_use]
    pub fn ranked(&self) -> &[ContactPrediction] {
        &self.answers
    }

    /// The predictions of each predictor, for every sample so far.
    #[must_use]
    pub fn records(&self) -> &[PredictionRecord] {
        &self.records
    }
}

impl Predictor for Predictors {
    /// Runs all predictors and returns the predictions of the leader.
    fn predict(&mut self, scene: &Scene, input: &PredictorInput<'_>) -> &[ContactPrediction] {
        let mut record = PredictionRecord {
            t_s: input.frame.t_s,
            likeliest: [None; PREDICTORS],
            took_ns: [0.0; PREDICTORS],
        };
        for (i, predictor) in self.predictors.iter_mut().enumerate() {
            let Some(predictor) = predictor else { continue };
            let began = Instant::now();
            let answers = predictor.predict(scene, input);
            record.took_ns[i] = began.elapsed().as_secs_f64() * 1e9;
            record.likeliest[i] = answers.first().map(|p| SurfacePlace {
                surface: p.surface,
                point_m: p.point_m,
            });
            if i == self.leader as usize {
                self.answers.clear();
                self.answers.extend_from_slice(answers);
            }
        }
        self.records.push(record);
        &self.answers
    }

    fn response_rad(&self) -> Option<[f64; 7]> {
        self.predictors[self.leader as usize]
            .as_ref()?
            .response_rad()
    }

    fn is_unfamiliar(&self) -> bool {
        let leader = self.predictors[self.leader as usize].as_ref();
        leader.is_some_and(|leader| leader.is_unfamiliar())
    }

    fn touched(&mut self, contact_m: DVec3, contact_s: f64) {
        if self.adapts {
            for predictor in self.predictors.iter_mut().flatten() {
                predictor.touched(contact_m, contact_s);
            }
        }
    }

    fn reset(&mut self) {
        for predictor in self.predictors.iter_mut().flatten() {
            predictor.reset();
        }
    }
}

/// Augmentation factor for reach speed: training people reach in about a second, others may be slower or faster. Slowed down
/// and sped up by this factor, the same reaches take a third of a second to two seconds.
const OTHER_SPEED: f64 = 1.7;

/// The fused predictor, trained for a scene, and the number of training reaches.
///
/// # Errors
/// A scene in which the people find nothing to touch.
pub fn fused(
    scene: &Scene,
    arm: &BoardArm,
    people: &TrainingPeople,
) -> anyhow::Result<(FusedPredictor<StandingAnywhere<LearnedEstimator>>, usize)> {
    let streams = streams_of(scene, arm, people, 0..PEOPLE, TOUCHES)?;
    let reaches = training::reaches(&streams)?;
    let config = LearnedConfig {
        other_speed: Some(OTHER_SPEED),
        gaze: people.gaze,
        ..LearnedConfig::default()
    };
    let model = LearnedModel::train(&reaches, &config)?;
    let evidence = training::evidence_model(&streams, |_| model.estimator())?;
    let config = FusedConfig {
        evidence,
        ..FusedConfig::default()
    };
    let trained = people.elsewhere.then_some(Standing {
        head_m: people.person.head_m,
        hand_m: people.person.hand_rest_m,
    });
    let estimator = StandingAnywhere::new(model.estimator(), trained);
    Ok((FusedPredictor::new(estimator, config)?, reaches.len()))
}

/// Samples and touches of other people in the scene: those with these numbers, with this many touches each.
///
/// # Errors
/// A scene in which they find nothing to touch.
pub fn streams_of(
    scene: &Scene,
    arm: &BoardArm,
    people: &TrainingPeople,
    numbers: Range<u64>,
    touches: usize,
) -> anyhow::Result<Vec<Stream>> {
    let population = Population::new(people.person, SEED)?;
    numbers
        .map(|number| {
            let person = population.person(number);
            let places = Standing {
                head_m: person.head_m(),
                hand_m: people.person.hand_rest_m,
            };
            let plans = touches::plan(scene, arm, &places, CLEAR_M, touches, SEED ^ number)?;
            stream(scene, &person.plan(&plans)?, people)
        })
        .collect()
}

fn stream(scene: &Scene, hand: &TouchSequence, people: &TrainingPeople) -> anyhow::Result<Stream> {
    let count = (hand.duration_s() / TRACKER_S) as usize;
    // Without a tracked fingertip, the point that stands for the contact touches.
    let mut by_contact = HandPoint::BY_CONTACT.into_iter();
    let touching = by_contact.find(|point| people.points.contains(point));
    let frames = (0..count)
        .map(|i| {
            let tracked = hand.tracked(i as f64 * TRACKER_S);
            let mut frame = tracked.limited_to(&people.points, people.gaze);
            if let Some(touching) = touching {
                frame.set_point(touching, tracked.point(HandPoint::Index));
            }
            frame.head_m = frame.head_m.filter(|_| people.head);
            frame
        })
        .collect();
    let touches = hand
        .touches()
        .iter()
        // The outline of a facet encloses its holes: a point in a hole is not on the surface.
        .filter_map(|truth| {
            let closest = scene.closest_touchable(truth.target_m, 0.05).transpose()?;
            Some(closest.map(|c| training::SurfaceTouch::of(c.surface, hand, truth)))
        })
        .collect::<Result<Vec<_>, _>>()?;
    Ok(Stream::new(frames, touches))
}
