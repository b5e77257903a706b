//! Values as shades, and their key beside a figure.

use hwall_stage::figures::TEXT;
use hwall_stage::report::figure::{Area, Draw};
use plotters::prelude::*;

/// From dark (0) to light (1), readable without colours too.
pub(super) fn shade(share: f64) -> RGBColor {
    let stops = [
        (68, 1, 84),
        (59, 82, 139),
        (33, 145, 140),
        (94, 201, 98),
        (253, 231, 37),
    ];
    let at = share.clamp(0.0, 1.0) * 4.0;
    let i = (at as usize).min(3);
    let mix = |a: u8, b: u8| (f64::from(a) + (f64::from(b) - f64::from(a)) * (at - i as f64)) as u8;
    let ((r, g, b), (s, h, c)) = (stops[i], stops[i + 1]);
    RGBColor(mix(r, s), mix(g, h), mix(b, c))
}

/// A key: symbols between two x pixels, text from a third one on.
pub(super) struct Key<'a, 'p> {
    pub(super) area: &'a Area<'p>,
    pub(super) signs: [i32; 2],
    pub(super) words: i32,
}

impl Key<'_, '_> {
    pub(super) fn label(&self, text: &str, y: i32) -> anyhow::Result<()> {
        self.area.write(text, TEXT, (self.words, y))
    }

    /// A bar between two pixels of y.
    pub(super) fn bar(&self, [top, bottom]: [i32; 2], colour: RGBColor) -> anyhow::Result<()> {
        let [left, right] = self.signs;
        let corners = [(left, top), (right, bottom)];
        self.area.put(&Rectangle::new(corners, colour.filled()))
    }

    /// A line from one pixel of y to another.
    pub(super) fn line(&self, [from, to]: [i32; 2], style: ShapeStyle) -> anyhow::Result<()> {
        let [left, right] = self.signs;
        let ends = vec![(left, from), (right, to)];
        self.area.put(&PathElement::new(ends, style))
    }
}
