//! A touched object that moves, by positions and by torques.

pub(in crate::render) mod face_slide;
mod felt_stiffness;
pub(in crate::render) mod force_lead;
pub(in crate::render) mod impedance;
pub(in crate::render) mod joint_guard;
pub(in crate::render) mod object_port;
pub(in crate::render) mod object_rendering;
pub(in crate::render) mod objects;
pub(in crate::render) mod path_follower;
