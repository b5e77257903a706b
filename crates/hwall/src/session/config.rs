//! Settings of a session.

use super::policy::PolicyConfig;
use hwall_hand::{GazeFilterConfig, HandFilterConfig};
use hwall_haptics::safety::{ChannelWatch, LoadLimits, SupervisorConfig, TimingConfig};
use hwall_haptics::{ObjectCommand, PlaceTolerance, RendererConfig};

/// Settings of a [`Session`](crate::Session).
#[derive(Debug, Clone, PartialEq)]
pub struct SessionConfig {
    /// When a force counts as a touch, how the arm moves, how old inputs may be.
    pub renderer: RendererConfig,
    /// How frames of the hand are smoothed, and when a hand is lost.
    pub hand: HandFilterConfig,
    /// What counts as a fixation, and how the line of sight is averaged over it.
    pub gaze: GazeFilterConfig,
    /// When the board goes where.
    pub policy: PolicyConfig,
    /// Is the predictor told of every touch that the board feels, so that it adapts to the person and the room? Default yes.
    /// Then it matters in which order frames and steps come, as it does for the rest of a session.
    pub adapts: bool,
    /// What is added to the time of the tracker to get that of the arm, s; default 0.
    pub arm_minus_tracker_s: f64,
    /// When the board counts as in place.
    pub in_place: PlaceTolerance,
    /// Does the board present the roughness of surfaces? Default yes; needs the feature `texture`.
    pub texture: bool,
    /// Do doors, panels, drawers and buttons yield under the hand? Default yes; otherwise they stand still as walls do.
    pub objects: bool,
    /// How the arm goes along with them; default by positions, which any arm understands.
    pub object_command: ObjectCommand,
    /// What stands between renderer and arm; `None`: nothing, for an arm that is supervised elsewhere. Default
    /// [`session_supervisor`]. Where it names no room, the floor is where the scene is lowest, but not above the arm's base.
    pub supervisor: Option<SupervisorConfig>,
}

impl Default for SessionConfig {
    fn default() -> Self {
        Self {
            renderer: RendererConfig::default(),
            hand: HandFilterConfig::default(),
            gaze: GazeFilterConfig::default(),
            policy: PolicyConfig::default(),
            adapts: true,
            arm_minus_tracker_s: 0.0,
            in_place: PlaceTolerance::default(),
            texture: true,
            objects: true,
            object_command: ObjectCommand::default(),
            supervisor: Some(session_supervisor()),
        }
    }
}

/// The supervisor of a session: as by default, but for what the session watches itself or cannot tell.
///
/// - Points of the hand may stand still: [`HandFilterConfig::freeze`] finds frozen ones, and such a hand is lost. A head may
///   stand still, too, for in a simulation it does; where a headset always trembles, set `head.frozen_s`.
/// - The edge of the face is 15 mm wide, for a touch in place keeps 20 mm away from it ([`PlaceTolerance`]); only pushes above 20 N
///   are located, and those to some millimetres.
/// - Inputs count as sound again after 0.1 s: a board that comes back later meets a hand that is in the wall already.
#[must_use]
pub fn session_supervisor() -> SupervisorConfig {
    let usual = SupervisorConfig::default();
    let still = |watch: ChannelWatch| ChannelWatch {
        frozen_s: None,
        ..watch
    };
    SupervisorConfig {
        hand: still(usual.hand),
        head: still(usual.head),
        load: LoadLimits {
            edge_m: 0.015,
            least_n: 20.0,
            ..usual.load
        },
        timing: TimingConfig {
            recovery_s: 0.1,
            ..usual.timing
        },
        ..usual
    }
}
