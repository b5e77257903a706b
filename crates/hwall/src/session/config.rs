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
    /// When to dispatch the board, and where to.
    pub policy: PolicyConfig,
    /// Does the predictor learn from each touch that the board feels, to adapt to the person and the room? Default yes. Results then depend
    /// on the order of frames and steps, as they do for the rest of a session.
    pub adapts: bool,
    /// Clock offset: arm time minus tracker time, s; default 0.
    pub arm_minus_tracker_s: f64,
    /// When the board counts as in place.
    pub in_place: PlaceTolerance,
    /// Does the board present the roughness of surfaces? Default yes; needs the feature `texture`.
    pub texture: bool,
    /// Do doors, panels, drawers and buttons move when pushed? Default yes; otherwise they are rigid, like walls.
    pub objects: bool,
    /// How the arm follows a pushed object; default by positions, which any arm understands.
    pub object_command: ObjectCommand,
    /// Supervisor between renderer and arm; `None` for an arm that is supervised elsewhere. Default [`session_supervisor`]. If it sets no
    /// room, the floor is the lowest point of the scene, but not above the arm's base.
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

/// The default supervisor, adapted to a session:
///
/// - Points of the hand may stand still: [`HandFilterConfig::freeze`] detects frozen ones and reports the hand as lost. A head may stand
///   still, too, because a simulated head does; if your headset always shows tremor, set `head.frozen_s`.
/// - The edge of the face is 15 mm wide, because a touch on a board in place is at least 20 mm from the border ([`PlaceTolerance`]); only
///   pushes above 20 N are located, to within a few millimetres.
/// - Inputs count as sound again after 0.1 s: a board that returns later meets a hand that is already in the wall.
#[must_use]
pub fn session_supervisor() -> SupervisorConfig {
    let nominal = SupervisorConfig::default();
    let still = |watch: ChannelWatch| ChannelWatch {
        frozen_s: None,
        ..watch
    };
    SupervisorConfig {
        hand: still(nominal.hand),
        head: still(nominal.head),
        load: LoadLimits {
            edge_m: 0.015,
            least_n: 20.0,
            ..nominal.load
        },
        timing: TimingConfig {
            recovery_s: 0.1,
            ..nominal.timing
        },
        ..nominal
    }
}
