//! The common style of figures.

use anyhow::anyhow;
use plotters::coord::{CoordTranslate, Shift};
use plotters::prelude::*;
use plotters::style::text_anchor::{HPos, Pos, VPos};

/// Colours distinguishable by colour-blind readers (Okabe and Ito 2008).
pub const COLOURS: [RGBColor; 7] = [
    RGBColor(0, 114, 178),
    RGBColor(213, 94, 0),
    RGBColor(0, 158, 115),
    RGBColor(204, 121, 167),
    RGBColor(230, 159, 0),
    RGBColor(86, 180, 233),
    RGBColor(60, 60, 60),
];

/// Text of titles and labels, in pixels.
pub const TITLE: (&str, u32) = ("sans-serif", 20);
/// Text of axes and legends.
pub const TEXT: (&str, u32) = ("sans-serif", 15);

/// Plotting errors have backend types; keep only the text.
pub fn plot_error(error: impl std::fmt::Display) -> anyhow::Error {
    anyhow!("figure: {error}")
}

/// The standard legend in a corner.
///
/// # Errors
/// Any error of the drawing.
pub fn legend<'a, DB: DrawingBackend + 'a, CT: CoordTranslate>(
    chart: &mut ChartContext<'a, DB, CT>,
    position: SeriesLabelPosition,
) -> anyhow::Result<()> {
    chart
        .configure_series_labels()
        .position(position)
        .background_style(WHITE.mix(0.85))
        .border_style(BLACK.mix(0.3))
        .label_font(TEXT)
        .draw()
        .map_err(plot_error)
}

/// The legend symbol of a series.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Sign {
    /// A line with a width in pixels.
    Line(u32),
    /// A full dot.
    Dot,
    /// A small circle.
    Ring,
}

/// Line width of one of `count` series that may overlap, pixels: series drawn first are wider, so that
/// they show on both sides of later ones.
#[must_use]
pub const fn width_of(place: u32, count: usize) -> u32 {
    let below = (count as u32).saturating_sub(place + 1);
    2 + 3 * below
}

/// A legend beside the axes instead of over the lines: one row per series, from a pixel of `area` down.
///
/// # Errors
/// Any error of the drawing.
pub fn legend_beside<'n, DB: DrawingBackend, C: Color>(
    area: &DrawingArea<DB, Shift>,
    from: (i32, i32),
    keys: impl IntoIterator<Item = (Sign, C, &'n str)>,
) -> anyhow::Result<()> {
    for (row, (sign, colour, name)) in (0..).zip(keys) {
        let (x, y) = (from.0, from.1 + 22 * row);
        let middle = (x + 10, y);
        match sign {
            Sign::Line(width) => area.draw(&PathElement::new(
                [(x, y), (x + 20, y)],
                colour.stroke_width(width),
            )),
            Sign::Dot => area.draw(&Circle::new(middle, 5, colour.filled())),
            Sign::Ring => area.draw(&Circle::new(middle, 3, colour.stroke_width(1))),
        }
        .map_err(plot_error)?;
        let style = TextStyle::from(TEXT).color(&BLACK);
        let style = style.pos(Pos::new(HPos::Left, VPos::Center));
        area.draw_text(name, &style, (x + 28, y))
            .map_err(plot_error)?;
    }
    Ok(())
}
