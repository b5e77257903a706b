//! The tracked figures can be read: no label lies over another or is cut off, and colours beside each other differ.

use crate::common::files::{files_below, root, text};
use hwall_stage::figures::COLOURS;

/// Width of a letter and height of a line, as shares of the size of the font: narrow, so that only what certainly overlaps counts.
const LETTER: f64 = 0.5;
const LINE: f64 = 0.8;
/// What may overlap or stick out, pixels.
const HAIR_PX: f64 = 2.0;

/// A level text and the box that it fills, pixels.
struct Label {
    text: String,
    x: [f64; 2],
    y: [f64; 2],
}

impl Label {
    fn overlaps(&self, other: &Self) -> bool {
        let common = |a: [f64; 2], b: [f64; 2]| a[1].min(b[1]) - a[0].max(b[0]) > HAIR_PX;
        common(self.x, other.x) && common(self.y, other.y)
    }
}

/// The value of an attribute in the text of a tag.
fn attribute<'a>(tag: &'a str, name: &str) -> Option<&'a str> {
    let rest = tag.split_once(&format!(" {name}=\""))?.1;
    rest.split_once('"').map(|(value, _)| value)
}

fn number(tag: &str, name: &str) -> Option<f64> {
    let value = attribute(tag, name)?;
    value.trim_end_matches("px").parse().ok()
}

/// Labels of a picture; upright ones are left out.
fn labels(svg: &str) -> Vec<Label> {
    let mut labels = Vec::new();
    for rest in svg.split("<text").skip(1) {
        let Some((tag, rest)) = rest.split_once('>') else {
            continue;
        };
        let text = rest.split('<').next().unwrap_or_default().trim();
        let (Some(x), Some(y)) = (number(tag, "x"), number(tag, "y")) else {
            continue;
        };
        if text.is_empty() || attribute(tag, "transform").is_some() {
            continue;
        }
        let size = number(tag, "font-size").unwrap_or(12.0);
        let dy = attribute(tag, "dy").unwrap_or("0");
        let share = |unit: &str| dy.strip_suffix(unit).and_then(|n| n.parse::<f64>().ok());
        let down = share("em").or_else(|| share("ex").map(|x| 0.5 * x));
        let base = y + size * down.unwrap_or_default();
        let width = LETTER * size * text.chars().count() as f64;
        let left = match attribute(tag, "text-anchor") {
            Some("middle") => x - 0.5 * width,
            Some("end") => x - width,
            _ => x,
        };
        labels.push(Label {
            text: text.to_owned(),
            x: [left, left + width],
            y: [base - LINE * size, base],
        });
    }
    labels
}

/// Legends lay over labels, and labels over each other.
#[test]
fn no_label_lies_over_another_or_is_cut_off() {
    let (mut pictures, mut all) = (0, 0);
    for path in files_below(&root().join("docs/figures"), "svg") {
        let (name, svg) = (path.display(), text(&path));
        // A strip of pictures in a picture has places of its own in each.
        if svg.matches("<svg").count() > 1 || svg.contains("<g transform") {
            continue;
        }
        let head = svg.split_once("<svg").unwrap().1;
        let head = head.split('>').next().unwrap();
        let size = ["width", "height"].map(|side| number(head, side).unwrap());
        let labels = labels(&svg);
        for (i, label) in labels.iter().enumerate() {
            let inside = |[low, high]: [f64; 2], most: f64| low > -HAIR_PX && high < most + HAIR_PX;
            let is_inside = inside(label.x, size[0]) && inside(label.y, size[1]);
            assert!(is_inside, "{name}: {} is cut off", label.text);
            for other in &labels[..i] {
                let (a, b) = (&label.text, &other.text);
                assert!(!label.overlaps(other), "{name}: {a} lies over {b}");
            }
        }
        (pictures, all) = (pictures + 1, all + labels.len());
    }
    assert!(pictures >= 8 && all > 500, "{all} labels in {pictures}");
}

/// Two greys could not be told apart.
#[test]
fn colours_of_curves_differ() {
    for (i, a) in COLOURS.iter().enumerate() {
        for b in &COLOURS[..i] {
            let channels = [(a.0, b.0), (a.1, b.1), (a.2, b.2)];
            let squares = channels.map(|(a, b)| (f64::from(a) - f64::from(b)).powi(2));
            let apart = squares.iter().sum::<f64>().sqrt();
            assert!(apart > 60.0, "{a:?} and {b:?}: {apart:.0}");
        }
    }
}
