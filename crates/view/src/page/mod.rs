//! The pages.

use crate::frame::ViewFrame;
use crate::marker::ViewMarker;
use crate::scene::ViewScene;

/// The page of a server: viewer, connection, mouse as a hand, WebXR hands. One file without outside resources.
#[must_use]
pub fn live_page() -> String {
    String::new()
}

/// A page that shows frames again: one file that needs no network.
#[must_use]
pub fn replay_page(scene: &ViewScene, frames: &[ViewFrame], markers: &[ViewMarker]) -> String {
    let _ = (scene, frames, markers);
    String::new()
}
