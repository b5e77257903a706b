#![doc = include_str!("../README.md")]

mod arm;
mod body;
mod error;
mod film;
mod frame;
mod glb;
mod hand;
mod marker;
mod page;
mod scene;
mod scene_json;
mod state;
mod wire;

// What is shown.
pub use arm::{ViewArm, ViewCapsule, ViewJoint};
pub use body::{MOST_PARTS, ViewPart};
pub use frame::{ViewFrame, ViewPrediction};
pub use hand::{HAND_BONES, HAND_JOINTS, ViewHand};
pub use marker::{ViewMarker, ViewMarkerKind};
pub use scene::{MOST_MOVING, ViewScene, ViewSurface};
pub use state::ViewState;

// Outputs.
pub use film::film_strip;
pub use glb::glb;
pub use page::{live_page, replay_page};

pub use error::ViewError;
