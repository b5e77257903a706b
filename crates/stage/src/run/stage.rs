//! What the runs of the main job share, and what a session of one is made of.

use crate::person::predictors::Predictors;
use crate::person::responses::Scenery;
use crate::run::simulated_arm::ArmLevel;
use hwall::haptics::RendererConfig;
use hwall::haptics::body::Room;
use hwall::haptics::safety::PersonPart;
use hwall::{Session, SessionConfig, session_supervisor};
use hwall_contact::Predictor;
use hwall_fri::controller::FaultConfig;
use hwall_hand::HandFilterConfig;

/// What all runs share: made once, however many people there are.
#[derive(Clone, Copy)]
pub struct Stage<'a> {
    /// Arm, scene and walls. The usual waiting posture of the walls is the one from which regret asks what was possible; where they
    /// have none, that is the posture in which the arm starts.
    pub scenery: Scenery<'a>,
    /// Who foresees the touches, as trained; every person meets a copy that has seen nobody.
    pub predictors: &'a Predictors,
    /// How much of the arm is simulated.
    pub level: ArmLevel,
    /// The arm is behind FRI, and this goes wrong.
    pub fri: Option<FaultConfig>,
    /// Control period, s.
    pub period_s: f64,
}

impl<'a> Stage<'a> {
    /// At servo level, the usual one for many touches.
    #[must_use]
    pub const fn of(scenery: &Scenery<'a>, predictors: &'a Predictors, period_s: f64) -> Self {
        Self {
            scenery: *scenery,
            predictors,
            level: ArmLevel::Servo,
            fri: None,
            period_s,
        }
    }
}

/// What a session of the main job is made of, besides the predictor. The same settings, predictor and inputs give the
/// same commands bit by bit.
#[derive(Clone, Copy)]
pub struct SessionSettings<'a> {
    /// Arm, scene and walls.
    pub scenery: Scenery<'a>,
    /// What really stands around the arm; `None`: a floor.
    pub room: Option<&'a Room>,
    /// How much of the arm is simulated: says how objects are rendered.
    pub level: ArmLevel,
    /// How frames of the hand are filtered.
    pub filter: HandFilterConfig,
    /// Is the head tracked? Otherwise the arm does not wait for it, and nothing keeps it away from one.
    pub sees_head: bool,
    /// What is added to the time of the tracker to get that of the arm, s.
    pub arm_minus_tracker_s: f64,
}

impl SessionSettings<'_> {
    /// A session that has seen nobody.
    ///
    /// # Errors
    /// A configuration that a crate refuses.
    pub fn session<P: Predictor>(&self, predictor: P) -> anyhow::Result<Session<P>> {
        let mut supervisor = session_supervisor();
        supervisor.room = self.room.cloned();
        let required = &mut supervisor.required;
        required.retain(|part| self.sees_head || *part != PersonPart::Head);
        let Scenery {
            arm, scene, walls, ..
        } = self.scenery;
        let config = SessionConfig {
            supervisor: Some(supervisor),
            renderer: RendererConfig::default(),
            hand: self.filter,
            arm_minus_tracker_s: self.arm_minus_tracker_s,
            texture: self.scenery.textured,
            object_command: self.level.object_command(arm)?,
            ..SessionConfig::default()
        };
        Ok(Session::new(
            &**arm.kinematics(),
            arm.board(),
            scene.clone(),
            walls.clone(),
            predictor,
            config,
        )?)
    }
}
