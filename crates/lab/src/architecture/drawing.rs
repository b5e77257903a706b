//! The crates as boxes in layers, with arrows down to their dependencies.

use super::graph::{Crate, CrateGraph};
use crate::report::{Gap, fill};
use anyhow::Context;
use std::fmt::Write;

/// Width of a box, and horizontal step between boxes.
const WIDTH_PX: f64 = 184.0;
const STEP_PX: f64 = 216.0;
/// Characters per line of text in a box, and line height.
const LETTERS: usize = 26;
const LINE_PX: f64 = 15.0;
/// Gap between layers, for the arrows.
const RISE_PX: f64 = 58.0;
const MARGIN_PX: f64 = 24.0;
const LEGEND_PX: f64 = 64.0;
/// Least width, for the legend.
const LEAST_WIDTH_PX: f64 = 900.0;

/// The box of a crate.
#[derive(Clone, Default)]
struct Place {
    lines: Vec<String>,
    middle_px: f64,
    top_px: f64,
}

/// Draws the crates; arrows implied by a longer path are left out.
///
/// # Errors
/// Cyclic dependencies.
pub fn svg(graph: &CrateGraph) -> anyhow::Result<String> {
    let layers = layers(graph).context("crates use each other in a circle")?;
    let most = layers.iter().map(Vec::len).max().unwrap_or(0) as f64;
    let width_px = (2.0 * MARGIN_PX + WIDTH_PX + (most - 1.0) * STEP_PX).max(LEAST_WIDTH_PX);
    let mut places = vec![Place::default(); graph.crates.len()];
    let mut top_px = MARGIN_PX;
    for layer in layers.iter().rev() {
        let first_px = 0.5 * (width_px - (layer.len() as f64 - 1.0) * STEP_PX);
        let mut highest_px: f64 = 0.0;
        for (column, &node) in layer.iter().enumerate() {
            let lines = lines(&graph.crates[node].about);
            let middle_px = first_px + column as f64 * STEP_PX;
            places[node] = Place {
                lines,
                middle_px,
                top_px,
            };
            highest_px = highest_px.max(places[node].height_px());
        }
        top_px += highest_px + RISE_PX;
    }
    let (mut arrows, mut boxes) = (String::new(), String::new());
    for one in graph.needed() {
        let (from, to) = (&places[one.from], &places[one.to]);
        let class = if one.optional { " option" } else { "" };
        writeln!(
            arrows,
            "  <path class=\"arrow{class}\" d=\"M{} {} L{} {}\"/>",
            from.middle_px,
            from.top_px + from.height_px(),
            to.middle_px,
            to.top_px - 1.0
        )?;
    }
    for (node, place) in graph.crates.iter().zip(&places) {
        place.draw(node, &mut boxes)?;
    }
    let (height_px, legend_px) = (top_px - RISE_PX + LEGEND_PX, top_px - RISE_PX + 10.0);
    let gaps: [Gap<'_>; 5] = [
        ("width", &width_px),
        ("height", &height_px),
        ("legend", &legend_px),
        ("arrows", &arrows),
        ("boxes", &boxes),
    ];
    fill(include_str!("frame.svg"), &gaps)
}

/// The crates of each layer, from the lowest up, each above the middle of its dependencies.
fn layers(graph: &CrateGraph) -> Option<Vec<Vec<usize>>> {
    let depths = graph.layers()?;
    let count = depths.iter().max().map_or(0, |most| most + 1);
    let mut layers: Vec<Vec<usize>> = vec![Vec::new(); count];
    let mut share = vec![0.0; depths.len()];
    for (depth, layer) in layers.iter_mut().enumerate() {
        let mut keyed: Vec<(f64, usize)> = Vec::new();
        for node in (0..depths.len()).filter(|&node| depths[node] == depth) {
            let used = graph.needed().filter(|u| u.from == node);
            let used: Vec<f64> = used.map(|u| share[u.to]).collect();
            let mean = used.iter().sum::<f64>() / used.len().max(1) as f64;
            keyed.push((mean, node));
        }
        keyed.sort_by(|a, b| a.0.total_cmp(&b.0));
        layer.extend(keyed.iter().map(|(_, node)| *node));
        for (place, &node) in layer.iter().enumerate() {
            share[node] = (place as f64 + 0.5) / layer.len() as f64;
        }
    }
    Some(layers)
}

fn lines(about: &str) -> Vec<String> {
    let mut lines: Vec<String> = Vec::new();
    for word in about.split_whitespace() {
        match lines.last_mut() {
            Some(line) if line.chars().count() + 1 + word.chars().count() <= LETTERS => {
                *line += &format!(" {word}");
            }
            _ => lines.push(word.to_owned()),
        }
    }
    lines
}

impl Place {
    fn height_px(&self) -> f64 {
        32.0 + LINE_PX * self.lines.len() as f64
    }

    fn draw(&self, node: &Crate, out: &mut String) -> std::fmt::Result {
        let (middle_px, top_px) = (self.middle_px, self.top_px);
        writeln!(
            out,
            "  <rect class=\"{}\" x=\"{}\" y=\"{top_px}\" width=\"{WIDTH_PX}\" height=\"{}\" rx=\"6\"/>",
            node.class,
            middle_px - 0.5 * WIDTH_PX,
            self.height_px()
        )?;
        let mut text = |class: &str, down_px: f64, text: &str| {
            let text = text.replace('&', "&amp;").replace('<', "&lt;");
            let y_px = top_px + down_px;
            writeln!(
                out,
                "  <text class=\"{class}\" x=\"{middle_px}\" y=\"{y_px}\">{text}</text>"
            )
        };
        text("name", 20.0, &node.name)?;
        for (line, down) in self.lines.iter().zip(1..) {
            text("what", 22.0 + LINE_PX * f64::from(down), line)?;
        }
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::architecture::read;
    use std::path::Path;

    #[test]
    fn the_tracked_picture_shows_the_crates_as_they_are() {
        let root = Path::new(env!("CARGO_MANIFEST_DIR")).join("../..");
        let tracked = root.join("docs/figures/architecture/house.svg");
        let tracked = std::fs::read_to_string(tracked).unwrap();
        let drawn = svg(&read(&root).unwrap()).unwrap();
        assert!(
            tracked == drawn,
            "house.svg is out of date: cargo run --release --example architecture -- --docs"
        );
    }

    #[test]
    fn every_arrow_points_down() {
        let graph = read(&Path::new(env!("CARGO_MANIFEST_DIR")).join("../..")).unwrap();
        let layers = layers(&graph).unwrap();
        let layer = |node| layers.iter().position(|l| l.contains(&node)).unwrap();
        assert!(graph.uses.iter().all(|u| layer(u.from) > layer(u.to)));
        assert_eq!(layers.concat().len(), graph.crates.len());
    }
}
