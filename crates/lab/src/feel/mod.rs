//! What a hand feels: doors, panels and buttons under simulated pushes, with both control modes of an arm.

pub mod document;
pub mod identify;
pub mod push;
pub mod rig;
pub mod single;
pub mod stability;
pub mod study;
pub mod subject;
