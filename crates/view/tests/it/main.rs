//! Integration tests of the crate, one program.

mod arm;
mod common;
mod encoding;
mod film_strip;
mod gltf;
mod khronos;
mod pages;
mod session;
