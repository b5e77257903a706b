//! Shared parts of the main job's runs, and the settings of a session.

use crate::person::predictors::Predictors;
use crate::person::responses::Scenery;
use crate::run::simulated_arm::ArmLevel;
use hwall::gesture::GestureModel;
use hwall::haptics::body::Room;
use hwall::haptics::safety::PersonPart;
use hwall::haptics::{ProximityConfig, RendererConfig};
use hwall::{PolicyConfig, Session, SessionConfig, session_supervisor};
use hwall_contact::Predictor;
use hwall_fri::controller::FaultConfig;
use hwall_hand::HandFilterConfig;

/// Shared parts of all runs, created once.
#[derive(Clone, Copy)]
pub struct Stage<'a> {
    /// Arm, scene and walls. Regret is computed from the walls' default waiting posture, or, if they have none, from the arm's
    /// start posture.
    pub scenery: Scenery<'a>,
    /// The trained predictors; every person gets a fresh copy.
    pub predictors: &'a Predictors,
    /// How much of the arm is simulated.
    pub level: ArmLevel,
    /// Faults of FRI; `None`: the arm is not behind FRI.
    pub fri: Option<FaultConfig>,
    /// When the board is sent.
    pub policy: PolicyConfig,
    /// How fast the board may move near the hand.
    pub proximity: ProximityConfig,
    /// Tells gestures apart; `None`: all touches are answered alike.
    pub gestures: Option<&'a GestureModel>,
    /// Prints decisions of the policy: of the frame at this time, s, or each one that changes.
    pub explain: Option<Option<f64>>,
    /// Control period, s.
    pub period_s: f64,
}

impl<'a> Stage<'a> {
    /// At servo level, the default for many touches.
    #[must_use]
    pub fn of(scenery: &Scenery<'a>, predictors: &'a Predictors, period_s: f64) -> Self {
        Self {
            scenery: *scenery,
            predictors,
            level: ArmLevel::Servo,
            fri: None,
            policy: PolicyConfig::default(),
            proximity: ProximityConfig::default(),
            gestures: None,
            explain: None,
            period_s,
        }
    }
}

/// A watched head without tremor counts as lost after this, s.
pub const HEAD_FROZEN_S: f64 = 0.5;

/// Settings of a session of the main job, besides the predictor. The same settings, predictor and inputs give the
/// same commands bit by bit.
#[derive(Clone, Copy)]
pub struct SessionSettings<'a> {
    /// Arm, scene and walls.
    pub scenery: Scenery<'a>,
    /// The real room around the arm; `None`: a floor.
    pub room: Option<&'a Room>,
    /// How much of the arm is simulated; determines how objects are rendered.
    pub level: ArmLevel,
    /// Filter for frames of the hand.
    pub filter: HandFilterConfig,
    /// Is the head tracked? Otherwise the arm does not wait for a head, and does not avoid one.
    pub sees_head: bool,
    /// Does a head that stands quite still count as lost? The heads of scripts and of a mouse do, those of headsets do not.
    pub watches_head: bool,
    /// Longest time by which the link to the arm delays a command, s.
    pub link_s: f64,
    /// Offset from the tracker's time to the arm's, s.
    pub arm_minus_tracker_s: f64,
    /// When the board is sent.
    pub policy: PolicyConfig,
    /// How fast the board may move near the hand.
    pub proximity: ProximityConfig,
}

impl<'a> SessionSettings<'a> {
    /// For a simulated person who stands on a floor, with a tracked head and the arm's clock.
    #[must_use]
    pub fn of(scenery: Scenery<'a>) -> Self {
        Self {
            scenery,
            room: None,
            level: ArmLevel::Servo,
            filter: HandFilterConfig::simulated(),
            sees_head: true,
            watches_head: false,
            link_s: 0.0,
            arm_minus_tracker_s: 0.0,
            policy: PolicyConfig::default(),
            proximity: ProximityConfig::default(),
        }
    }

    /// A fresh session.
    ///
    /// # Errors
    /// A configuration that a crate refuses.
    pub fn session<P: Predictor>(&self, predictor: P) -> anyhow::Result<Session<P>> {
        let mut supervisor = session_supervisor();
        supervisor.room = self.room.cloned();
        if let Some(obedience) = &mut supervisor.obedience {
            obedience.delay_s += self.link_s;
        }
        supervisor.head.frozen_s = self.watches_head.then_some(HEAD_FROZEN_S);
        let required = &mut supervisor.required;
        required.retain(|part| self.sees_head || *part != PersonPart::Head);
        let Scenery {
            arm, scene, walls, ..
        } = self.scenery;
        let config = SessionConfig {
            supervisor: Some(supervisor),
            renderer: RendererConfig {
                proximity: self.proximity,
                ..RendererConfig::default()
            },
            hand: self.filter,
            arm_minus_tracker_s: self.arm_minus_tracker_s,
            policy: self.policy,
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
