//! The crates as boxes in layers, every arrow down to what is used.

use super::graph::{CrateGraph, CrateKind, CrateNode};
use super::layout::{Layout, Place, Widths};
use anyhow::Context;
use std::fmt::Write;

const WIDTHS: Widths = Widths {
    crate_px: 184.0,
    arrow_px: 6.0,
    gap_px: 16.0,
};
/// Letters of a line of text in a box.
const LETTERS: usize = 26;
const LINE_PX: f64 = 15.0;
/// Between layers, for the arrows.
const RISE_PX: f64 = 58.0;
const MARGIN_PX: f64 = 24.0;
const LEGEND_PX: f64 = 64.0;
/// Between the ends of two arrows at one box.
const PORT_PX: f64 = 14.0;

const HEAD: &str = r##"  <defs>
    <marker id="head" viewBox="0 0 10 10" refX="9" refY="5" markerWidth="8" markerHeight="8" orient="auto">
      <path d="M0 1 L9 5 L0 9 z" fill="#334155"/>
    </marker>
  </defs>
  <style>
    .published { fill: #dbeafe; stroke: #1d4ed8; stroke-width: 1.5; }
    .product { fill: #93c5fd; stroke: #1e3a8a; stroke-width: 2; }
    .unpublished { fill: #f1f5f9; stroke: #64748b; stroke-width: 1.5; stroke-dasharray: 6 4; }
    .arrow { stroke: #334155; stroke-width: 1.3; fill: none; marker-end: url(#head); }
    .option { stroke-dasharray: 5 4; }
    .name { font-size: 15px; font-weight: bold; fill: #0f172a; }
    .what { font-size: 12px; fill: #334155; }
    text { text-anchor: middle; }
    .note { font-size: 12px; fill: #334155; text-anchor: start; }
  </style>
"##;

/// Draws the crates; arrows that a longer way says as well are left out.
///
/// # Errors
/// Crates that use each other in a circle.
pub fn svg(graph: &CrateGraph) -> anyhow::Result<String> {
    let graph = graph.reduced();
    let shown = |node: usize| graph.nodes[node].kind != CrateKind::TestKit;
    let layout =
        Layout::new(&graph, &WIDTHS, shown).context("crates use each other in a circle")?;
    let boxes: Vec<Box> = graph.nodes.iter().map(Box::new).collect();
    let drawing = Drawing::new(&graph, &layout, &boxes);
    Ok(drawing.text())
}

/// A crate's text.
struct Box {
    lines: Vec<String>,
    height_px: f64,
}

impl Box {
    fn new(node: &CrateNode) -> Self {
        let mut lines: Vec<String> = Vec::new();
        for word in node.about.split_whitespace() {
            match lines.last_mut() {
                Some(line) if line.chars().count() + 1 + word.chars().count() <= LETTERS => {
                    line.push(' ');
                    line.push_str(word);
                }
                _ => lines.push(word.to_owned()),
            }
        }
        let height_px = 32.0 + LINE_PX * lines.len() as f64;
        Self { lines, height_px }
    }
}

struct Drawing<'a> {
    graph: &'a CrateGraph,
    layout: &'a Layout,
    boxes: &'a [Box],
    /// Upper and lower edge of each layer.
    bands_px: Vec<[f64; 2]>,
    left_px: f64,
    width_px: f64,
    height_px: f64,
}

impl<'a> Drawing<'a> {
    fn new(graph: &'a CrateGraph, layout: &'a Layout, boxes: &'a [Box]) -> Self {
        let tallest = |layer: &Vec<(Place, f64)>| {
            let heights = layer.iter().filter_map(|&(place, _)| match place {
                Place::Crate(node) => Some(boxes[node].height_px),
                Place::Arrow(_) => None,
            });
            heights.fold(0.0, f64::max)
        };
        let mut bands_px = vec![[0.0; 2]; layout.layers.len()];
        let mut top_px = MARGIN_PX;
        for (band, layer) in bands_px.iter_mut().zip(&layout.layers).rev() {
            *band = [top_px, top_px + tallest(layer)];
            top_px = band[1] + RISE_PX;
        }
        let middles = layout.layers.iter().flatten().map(|place| place.1);
        let (low, high) = middles.fold((f64::INFINITY, f64::NEG_INFINITY), |ends, at| {
            (ends.0.min(at), ends.1.max(at))
        });
        let left_px = low - 0.5 * WIDTHS.crate_px - MARGIN_PX;
        Self {
            graph,
            layout,
            boxes,
            bands_px,
            left_px,
            width_px: (high + 0.5 * WIDTHS.crate_px + MARGIN_PX - left_px).max(900.0),
            height_px: top_px - RISE_PX + LEGEND_PX,
        }
    }

    fn text(&self) -> String {
        let (width, height) = (self.width_px.ceil(), self.height_px.ceil());
        let mut out = format!(
            "<svg xmlns=\"http://www.w3.org/2000/svg\" viewBox=\"0 0 {width} {height}\" width=\"{width}\" height=\"{height}\" \
             font-family=\"Helvetica, Arial, sans-serif\" role=\"img\" aria-labelledby=\"title description\">\n  \
             <title id=\"title\">The crates of H-Wall and who uses whom</title>\n  \
             <desc id=\"description\">Crates in layers; every arrow points down to what a crate uses. Published crates are blue, \
             unpublished ones grey with a dashed border. An arrow is left out where a longer way down says the same.</desc>\n"
        );
        out.push_str(HEAD);
        let white = format!("  <rect width=\"{width}\" height=\"{height}\" fill=\"#ffffff\"/>\n");
        out.push_str(&white);
        for arrow in 0..self.layout.uses.len() {
            self.arrow(&mut out, arrow);
        }
        for (layer, places) in self.layout.layers.iter().enumerate() {
            for &(place, at_px) in places {
                if let Place::Crate(node) = place {
                    let height_px = self.boxes[node].height_px;
                    let [top_px, bottom_px] = self.bands_px[layer];
                    let box_top_px = 0.5 * (top_px + bottom_px - height_px);
                    self.draw_box(&mut out, node, at_px - self.left_px, box_top_px);
                }
            }
        }
        self.legend(&mut out);
        out.push_str("</svg>\n");
        out
    }

    fn draw_box(&self, out: &mut String, node: usize, middle_px: f64, top_px: f64) {
        let (text, node) = (&self.boxes[node], &self.graph.nodes[node]);
        let class = match node.kind {
            CrateKind::Product => "product",
            CrateKind::Published => "published",
            CrateKind::Unpublished | CrateKind::TestKit => "unpublished",
        };
        // Writing to a string does not fail.
        let _ = writeln!(
            out,
            "  <rect class=\"{class}\" x=\"{:.1}\" y=\"{top_px:.1}\" width=\"{}\" height=\"{}\" rx=\"6\"/>\n  \
             <text class=\"name\" x=\"{middle_px:.1}\" y=\"{:.1}\">{}</text>",
            middle_px - 0.5 * WIDTHS.crate_px,
            WIDTHS.crate_px,
            text.height_px,
            top_px + 20.0,
            escaped(&node.name),
        );
        for (index, line) in text.lines.iter().enumerate() {
            let y_px = top_px + 22.0 + LINE_PX * (index + 1) as f64;
            let line = escaped(line);
            let _ = writeln!(
                out,
                "  <text class=\"what\" x=\"{middle_px:.1}\" y=\"{y_px:.1}\">{line}</text>"
            );
        }
    }

    /// From the lower edge of a box, straight through layers in between, to the upper edge of the other.
    fn arrow(&self, out: &mut String, arrow: usize) {
        let one = self.layout.uses[arrow];
        let (Some(from), Some(to)) = (
            self.find(Place::Crate(one.from)),
            self.find(Place::Crate(one.to)),
        ) else {
            return;
        };
        let mut points = vec![[self.port_px(from, arrow, true), self.edge_px(from, true)]];
        for layer in (to.0 + 1..from.0).rev() {
            if let Some(index) = self.index(layer, Place::Arrow(arrow)) {
                let x_px = self.layout.layers[layer][index].1 - self.left_px;
                points.extend(self.bands_px[layer].map(|y_px| [x_px, y_px]));
            }
        }
        points.push([
            self.port_px(to, arrow, false),
            self.edge_px(to, false) - 1.0,
        ]);
        let mut path = format!("M{:.1} {:.1}", points[0][0], points[0][1]);
        for pair in points.windows(2) {
            let ([x0, y0], [x1, y1]) = (pair[0], pair[1]);
            let middle = 0.5 * (y0 + y1);
            let _ = match x0 == x1 {
                true => write!(path, " L{x1:.1} {y1:.1}"),
                false => write!(
                    path,
                    " C{x0:.1} {middle:.1} {x1:.1} {middle:.1} {x1:.1} {y1:.1}"
                ),
            };
        }
        let class = if one.optional {
            "arrow option"
        } else {
            "arrow"
        };
        let _ = writeln!(out, "  <path class=\"{class}\" d=\"{path}\"/>");
    }

    fn find(&self, place: Place) -> Option<(usize, usize)> {
        (0..self.layout.layers.len()).find_map(|layer| Some((layer, self.index(layer, place)?)))
    }

    fn index(&self, layer: usize, place: Place) -> Option<usize> {
        self.layout.layers[layer]
            .iter()
            .position(|(other, _)| *other == place)
    }

    /// Lower or upper edge of the box at a place.
    fn edge_px(&self, (layer, index): (usize, usize), lower: bool) -> f64 {
        let [top_px, bottom_px] = self.bands_px[layer];
        let height_px = match self.layout.layers[layer][index].0 {
            Place::Crate(node) => self.boxes[node].height_px,
            Place::Arrow(_) => 0.0,
        };
        let half_px = if lower {
            0.5 * height_px
        } else {
            -0.5 * height_px
        };
        0.5 * (top_px + bottom_px) + half_px
    }

    /// Where an arrow leaves or meets a box: beside the others, in the order in which they come.
    fn port_px(&self, (layer, index): (usize, usize), arrow: usize, lower: bool) -> f64 {
        let (place, middle_px) = self.layout.layers[layer][index];
        let Place::Crate(node) = place else {
            return middle_px - self.left_px;
        };
        let mut ends: Vec<(f64, usize)> = Vec::new();
        for (other, one) in self.layout.uses.iter().enumerate() {
            let (here, there) = if lower {
                (one.from, one.to)
            } else {
                (one.to, one.from)
            };
            if here != node {
                continue;
            }
            let next = if lower {
                layer.wrapping_sub(1)
            } else {
                layer + 1
            };
            let beside = self.layout.layers.get(next).into_iter().flatten();
            let met = beside
                .filter(|(place, _)| [Place::Arrow(other), Place::Crate(there)].contains(place))
                .map(|(_, at_px)| *at_px)
                .next();
            ends.push((met.unwrap_or(middle_px), other));
        }
        ends.sort_by(|a, b| a.0.total_cmp(&b.0));
        let rank = ends.iter().position(|end| end.1 == arrow).unwrap_or(0) as f64;
        let count = ends.len().max(1) as f64;
        let step_px = PORT_PX.min((WIDTHS.crate_px - 24.0) / count);
        middle_px - self.left_px + step_px * (rank - 0.5 * (count - 1.0))
    }

    fn legend(&self, out: &mut String) {
        let y = (self.height_px - LEGEND_PX + 10.0).round();
        let _ = write!(
            out,
            "  <rect class=\"published\" x=\"24\" y=\"{y}\" width=\"26\" height=\"18\" rx=\"3\"/>\n  \
             <text class=\"note\" x=\"58\" y=\"{t}\">published</text>\n  \
             <rect class=\"unpublished\" x=\"140\" y=\"{y}\" width=\"26\" height=\"18\" rx=\"3\"/>\n  \
             <text class=\"note\" x=\"174\" y=\"{t}\">not published</text>\n  \
             <path class=\"arrow\" d=\"M274 {m} H312\"/>\n  \
             <text class=\"note\" x=\"322\" y=\"{t}\">uses (left out where a longer way down says the same)</text>\n  \
             <path class=\"arrow option\" d=\"M690 {m} H728\"/>\n  \
             <text class=\"note\" x=\"738\" y=\"{t}\">uses, behind a feature</text>\n",
            t = y + 14.0,
            m = y + 9.0,
        );
        if self
            .graph
            .nodes
            .iter()
            .any(|node| node.kind == CrateKind::TestKit)
        {
            let _ = writeln!(
                out,
                "  <text class=\"note\" x=\"24\" y=\"{}\">testkit, not drawn, serves the tests and benches of all crates and the \
                 reports of stage and lab; no published crate depends on it outside of its tests.</text>",
                y + 38.0
            );
        }
    }
}

fn escaped(text: &str) -> String {
    text.replace('&', "&amp;")
        .replace('<', "&lt;")
        .replace('>', "&gt;")
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
    fn every_arrow_points_down_and_nothing_is_cut_off() {
        let root = Path::new(env!("CARGO_MANIFEST_DIR")).join("../..");
        let graph = read(&root).unwrap().reduced();
        let shown = |node: usize| graph.nodes[node].kind != CrateKind::TestKit;
        let layout = Layout::new(&graph, &WIDTHS, shown).unwrap();
        let boxes: Vec<Box> = graph.nodes.iter().map(Box::new).collect();
        let drawing = Drawing::new(&graph, &layout, &boxes);
        for one in &layout.uses {
            let layer = |node| drawing.find(Place::Crate(node)).unwrap().0;
            assert!(layer(one.from) > layer(one.to));
        }
        for places in &layout.layers {
            let half = |place: Place| match place {
                Place::Crate(_) => 0.5 * WIDTHS.crate_px,
                Place::Arrow(_) => 0.5 * WIDTHS.arrow_px,
            };
            for pair in places.windows(2) {
                let room = pair[1].1 - pair[0].1 - half(pair[0].0) - half(pair[1].0);
                assert!(room >= WIDTHS.gap_px - 1e-6, "{pair:?}");
            }
            for &(place, at_px) in places {
                let x_px = at_px - drawing.left_px;
                assert!(x_px - half(place) >= 0.0 && x_px + half(place) <= drawing.width_px);
            }
        }
        for text in &boxes {
            assert!(
                text.lines
                    .iter()
                    .all(|line| line.chars().count() <= LETTERS)
            );
        }
    }
}
