//! The pages: one viewer, with a timeline or with a connection.

use crate::frame::ViewFrame;
use crate::marker::ViewMarker;
use crate::scene::ViewScene;
use data_encoding::BASE64;
use serde_json::{Value, json};

/// The parts of the viewer, in order of dependency.
const VIEWER: [&str; 8] = [
    include_str!("math.js"),
    include_str!("frame.js"),
    include_str!("shaders.js"),
    include_str!("meshes.js"),
    include_str!("camera.js"),
    include_str!("scene.js"),
    include_str!("viewer.js"),
    include_str!("panel.js"),
];
const REPLAY: [&str; 1] = [include_str!("replay.js")];
const LIVE: [&str; 9] = [
    include_str!("stop.js"),
    include_str!("reach.js"),
    include_str!("pointer.js"),
    include_str!("connection.js"),
    include_str!("plate.js"),
    include_str!("headset.js"),
    include_str!("checks.js"),
    include_str!("calibrate.js"),
    include_str!("live.js"),
];
const STYLE: &str = include_str!("style.css");
const PANEL: &str = include_str!("panel.html");

/// The page of a server: viewer, connection, mouse as a hand, WebXR hands. One file without outside resources.
///
/// It requests a WebSocket at `/ws` from the server that it came from.
#[must_use]
pub fn live_page() -> String {
    filled(
        include_str!("live.html"),
        &[
            ("style", STYLE),
            ("panel", &filled(PANEL, &[("more", CONNECTION_ROWS)])),
            ("script", &script(&LIVE)),
        ],
    )
}

/// Rows of the panel that only the live page has.
const CONNECTION_ROWS: &str = concat!(
    "<dl id=\"connection\"><dt>server</dt><dd id=\"server\">–</dd><dt>round trip</dt><dd id=\"trip\">–</dd>",
    "<dt class=\"wide\">hand samples</dt><dd id=\"counts\" class=\"wide\">–</dd></dl>\n"
);

/// A page that replays frames: one file that needs no network. Frames and markers in order of time, on one clock.
#[must_use]
pub fn replay_page(scene: &ViewScene, frames: &[ViewFrame], markers: &[ViewMarker]) -> String {
    let mut bytes = Vec::new();
    for frame in frames {
        frame.encode(&mut bytes);
    }
    let markers: Vec<Value> = markers
        .iter()
        .filter(|marker| marker.t_s.is_finite())
        .map(|marker| json!({ "t": marker.t_s, "kind": marker.kind.name(), "text": marker.text }))
        .collect();
    filled(
        include_str!("replay.html"),
        &[
            ("style", STYLE),
            ("panel", &filled(PANEL, &[("more", "")])),
            ("script", &script(&REPLAY)),
            ("scene", &inert(&scene.to_json())),
            ("markers", &inert(&Value::from(markers).to_string())),
            ("frames", &BASE64.encode(&bytes)),
        ],
    )
}

fn script(own: &[&str]) -> String {
    [&VIEWER[..], own].concat().concat()
}

/// JSON that cannot close the HTML element that contains it.
fn inert(json: &str) -> String {
    json.replace('<', "\\u003c")
}

/// A page with names in double braces replaced by parts. Inserted text is not searched again.
fn filled(page: &str, parts: &[(&str, &str)]) -> String {
    let mut out = String::new();
    let mut rest = page;
    while let Some((before, after)) = rest.split_once("{{") {
        out.push_str(before);
        let (name, after) = after.split_once("}}").unwrap_or((after, ""));
        let part = parts.iter().find(|part| part.0 == name);
        out.push_str(part.map_or("", |part| part.1));
        rest = after;
    }
    out.push_str(rest);
    out
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn parts_come_in_their_places_and_are_not_searched_again() {
        let page = filled("a{{b}}c{{d}}e", &[("b", "{{d}}"), ("d", "x")]);
        assert_eq!(page, "a{{d}}cxe");
    }
}
