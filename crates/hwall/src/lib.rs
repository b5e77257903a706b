#![doc = include_str!("../README.md")]
#![cfg_attr(docsrs, feature(doc_cfg))]

mod error;
mod fingertip;
pub mod gesture;
mod objects;
pub mod response;
pub mod session;
#[cfg(feature = "texture")]
pub mod texture;
mod upright_pieces;
mod walls;

pub use error::SessionError;
pub use objects::{SceneObject, object_of, objects_of};
pub use session::{
    Control, Controller, Cycle, Event, EventKind, Explanation, Explanations, Goal, MovingSurface,
    Perception, Planner, PolicyConfig, PredictedContact, Session, SessionConfig, SessionState,
    SlackConfig, Surroundings, TargetControl, WeighedChoice, WeighedPlace, WorldPose, drive,
    session_supervisor,
};
pub use upright_pieces::barriers_of;
pub use walls::{BudgetAtlas, LikelyTouches, Walls, WallsConfig, facets_of, maps_of};

// The whole system through one dependency.
pub use hwall_arrival as arrival;
pub use hwall_bip as bip;
pub use hwall_contact as contact;
pub use hwall_geometry as geometry;
pub use hwall_geometry::glam;
pub use hwall_hand as hand;
pub use hwall_haptics as haptics;
pub use hwall_kinematics as kinematics;
pub use hwall_numeric as numeric;
#[cfg(feature = "psychophysics")]
pub use hwall_psychophysics as psychophysics;
pub use hwall_reachability as reachability;
pub use hwall_scene as scene;
#[cfg(feature = "sim")]
pub use hwall_sim as sim;
#[cfg(feature = "texture")]
pub use hwall_texton as texton;
