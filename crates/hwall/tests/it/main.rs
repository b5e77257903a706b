//! Integration tests of the crate, one program.

mod allocation;
mod bad_input;
mod chains;
mod common;
mod events;
mod felt_touches;
mod gestures;
mod invariances;
mod led_by_joints;
mod loop_attacks;
mod moving_barriers;
mod moving_world;
mod objects;
mod pushed_door;
mod response;
mod speeds;
mod supervisor;
#[cfg(feature = "texture")]
mod textured_door;
#[cfg(feature = "texture")]
mod textured_panel;
#[cfg(feature = "texture")]
mod textured_touch;
mod threads;
mod world;
