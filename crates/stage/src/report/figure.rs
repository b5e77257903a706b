//! Figures: a white sheet, axes, and drawing within them, with a single error type.

use crate::input::output::write_file;
use crate::report::figures::{TEXT, TITLE, plot_error};
use plotters::chart::SeriesAnno;
use plotters::coord::ranged1d::{AsRangedCoord, Ranged, ValueFormatter};
use plotters::coord::{CoordTranslate, Shift};
use plotters::element::{CoordMapper, Drawable, PointCollection};
use plotters::prelude::*;
use std::borrow::Borrow;
use std::ops::Range;
use std::path::Path;

/// A sheet, or a part of one.
pub type Area<'a> = DrawingArea<SVGBackend<'a>, Shift>;

/// Axes on a sheet.
pub type Chart<'a, 'p, X, Y> = ChartContext<'a, SVGBackend<'p>, Cartesian2d<X, Y>>;

/// Default size of a sheet without a legend beside it, pixels.
pub const DEFAULT_SIZE: (u32, u32) = (860, 520);

/// Draws a figure of a size in pixels; the file gets its name when complete.
///
/// # Errors
/// A file that cannot be written, or errors of `content`.
pub fn figure(
    path: &Path,
    size: (u32, u32),
    content: impl FnOnce(&Area<'_>) -> anyhow::Result<()>,
) -> anyhow::Result<()> {
    let mut text = String::new();
    {
        let root = SVGBackend::with_string(&mut text, size).into_drawing_area();
        root.fill(&WHITE).map_err(plot_error)?;
        content(&root)?;
        root.present().map_err(plot_error)?;
    }
    write_file(path, text)
}

/// Drawing on a sheet, in pixels.
pub trait Draw<'p> {
    /// The sheet.
    fn area(&self) -> &Area<'p>;

    /// Writes a title and returns the area below it.
    ///
    /// # Errors
    /// Any error of the drawing.
    fn below(&self, title: &str) -> anyhow::Result<Area<'p>> {
        self.area().titled(title, TITLE).map_err(plot_error)
    }

    /// Draws one element.
    ///
    /// # Errors
    /// Any error of the drawing.
    fn put<'e, E, B>(&self, element: &'e E) -> anyhow::Result<()>
    where
        B: CoordMapper,
        &'e E: PointCollection<'e, (i32, i32), B>,
        E: Drawable<SVGBackend<'p>, B>,
    {
        self.area().draw(element).map_err(plot_error)
    }

    /// Writes text.
    ///
    /// # Errors
    /// Any error of the drawing.
    fn write<'t>(
        &self,
        text: &str,
        style: impl Into<TextStyle<'t>>,
        at: (i32, i32),
    ) -> anyhow::Result<()> {
        let drawn = self.area().draw_text(text, &style.into(), at);
        drawn.map_err(plot_error)
    }
}

impl<'p> Draw<'p> for Area<'p> {
    fn area(&self) -> &Self {
        self
    }
}

/// Drawing between axes, in their units.
pub trait Plot<'a, 'p, CT: CoordTranslate> {
    /// The axes.
    fn chart(&mut self) -> &mut ChartContext<'a, SVGBackend<'p>, CT>;

    /// Draws elements, which may then be named for the legend.
    ///
    /// # Errors
    /// Any error of the drawing.
    fn series<B, E, R, S>(
        &mut self,
        elements: S,
    ) -> anyhow::Result<&mut SeriesAnno<'a, SVGBackend<'p>>>
    where
        CT: 'a,
        B: CoordMapper,
        for<'b> &'b E: PointCollection<'b, CT::From, B>,
        E: Drawable<SVGBackend<'p>, B>,
        R: Borrow<E>,
        S: IntoIterator<Item = R>,
    {
        self.chart().draw_series(elements).map_err(plot_error)
    }

    /// Draws a line, which may then be named.
    ///
    /// # Errors
    /// Any error of the drawing.
    fn line(
        &mut self,
        points: impl IntoIterator<Item = (f64, f64)>,
        style: impl Into<ShapeStyle>,
    ) -> anyhow::Result<&mut SeriesAnno<'a, SVGBackend<'p>>>
    where
        CT: CoordTranslate<From = (f64, f64)> + 'a,
    {
        self.series(LineSeries::new(points, style))
    }
}

impl<'a, 'p, CT: CoordTranslate> Plot<'a, 'p, CT> for ChartContext<'a, SVGBackend<'p>, CT> {
    fn chart(&mut self) -> &mut Self {
        self
    }
}

/// Names a series as a line in the legend.
pub fn named_line<'a, 'p>(
    series: &mut SeriesAnno<'a, SVGBackend<'p>>,
    name: impl Into<String>,
    style: ShapeStyle,
) where
    'p: 'a,
{
    series
        .label(name)
        .legend(move |(x, y)| PathElement::new(vec![(x, y), (x + 18, y)], style));
}

/// Grid lines at the ticks.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Mesh {
    /// At all ticks.
    All,
    /// At numbered ticks.
    Numbered,
    /// At numbered ticks, faint.
    Faint,
    /// At numbered ticks, along x only.
    Across,
    /// At numbered ticks, without minor ticks.
    Single,
    /// Nowhere.
    None,
}

/// Format of the number at a tick.
pub type Format<'a> = Option<&'a dyn Fn(&f64) -> String>;

/// Labels and margins of axes.
pub struct Axes<'a> {
    /// Above.
    pub title: &'a str,
    /// Along x and along y, with units.
    pub names: [&'a str; 2],
    /// Numbers along x and along y; `None`: the axis' format.
    pub formats: [Format<'a>; 2],
    /// Approximate count of numbers along x and along y; `None`: default.
    pub numbers: [Option<usize>; 2],
    /// Space left of and below the axes, for numbers and names, pixels.
    pub labels: [u32; 2],
    /// Outer margin, pixels.
    pub margin: u32,
    /// Additional space on the right, for a legend, pixels.
    pub beside: u32,
    /// Additional space above, pixels.
    pub above: u32,
    /// Grid lines.
    pub mesh: Mesh,
    /// Size of the title and of all other text.
    pub text: [(&'static str, u32); 2],
}

impl Default for Axes<'_> {
    /// Settings for a figure of [`DEFAULT_SIZE`] size.
    fn default() -> Self {
        Self {
            title: "",
            names: [""; 2],
            formats: [None; 2],
            numbers: [None; 2],
            labels: [64, 52],
            margin: 14,
            beside: 0,
            above: 0,
            mesh: Mesh::Numbered,
            text: [TITLE, TEXT],
        }
    }
}

impl Axes<'_> {
    /// Draws the axes; ranges are plotters' ranges.
    ///
    /// # Errors
    /// Any error of the drawing.
    pub fn on<'a, 'p, X, Y>(
        &self,
        area: &'a Area<'p>,
        x: X,
        y: Y,
    ) -> anyhow::Result<Chart<'a, 'p, X::CoordDescType, Y::CoordDescType>>
    where
        X: AsRangedCoord<Value = f64>,
        Y: AsRangedCoord<Value = f64>,
        X::CoordDescType: Ranged<ValueType = f64> + ValueFormatter<f64>,
        Y::CoordDescType: Ranged<ValueType = f64> + ValueFormatter<f64>,
    {
        let [left, below] = self.labels;
        let mut builder = ChartBuilder::on(area);
        builder
            .margin(self.margin)
            .margin_right(self.margin + self.beside)
            .margin_top(self.margin + self.above)
            .x_label_area_size(below)
            .y_label_area_size(left);
        if !self.title.is_empty() {
            builder.caption(self.title, self.text[0]);
        }
        let mut chart = builder.build_cartesian_2d(x, y).map_err(plot_error)?;
        let mut mesh = chart.configure_mesh();
        mesh.x_desc(self.names[0])
            .y_desc(self.names[1])
            .label_style(self.text[1]);
        if let Some(format) = self.formats[0] {
            mesh.x_label_formatter(format);
        }
        if let Some(format) = self.formats[1] {
            mesh.y_label_formatter(format);
        }
        if let Some(count) = self.numbers[0] {
            mesh.x_labels(count);
        }
        if let Some(count) = self.numbers[1] {
            mesh.y_labels(count);
        }
        match self.mesh {
            Mesh::All => &mut mesh,
            Mesh::Numbered => mesh.light_line_style(WHITE),
            Mesh::Faint => mesh
                .bold_line_style(BLACK.mix(0.08))
                .light_line_style(WHITE),
            Mesh::Across => mesh.disable_x_mesh().light_line_style(WHITE),
            Mesh::Single => mesh.max_light_lines(0),
            Mesh::None => mesh.disable_mesh(),
        }
        .draw()
        .map_err(plot_error)?;
        Ok(chart)
    }
}

/// Ticks of a logarithmic axis that do not crowd: 1, 2, 5 of each decade, or only decades if there are `many` or more.
pub fn log_ticks(range: &Range<f64>, many: f64) -> Vec<f64> {
    let (low, high) = (range.start.log10(), range.end.log10());
    let digits: &[u8] = if high - low < many { &[1, 2, 5] } else { &[1] };
    let decades = low.floor() as i32..=high.ceil() as i32;
    decades
        .flat_map(|e| digits.iter().map(move |d| format!("{d}e{e}")))
        // Via text, because 10^-2 as a power is not exactly 0.01.
        .filter_map(|text| text.parse().ok())
        .filter(|tick| range.contains(tick))
        .collect()
}

/// `12`.
pub fn whole(value: &f64) -> String {
    format!("{value:.0}")
}

/// `1.2`.
pub fn tenths(value: &f64) -> String {
    format!("{value:.1}")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_figure_that_is_given_up_leaves_the_good_one() {
        let folder = std::env::temp_dir().join(format!("hwall_figure_{}", std::process::id()));
        std::fs::create_dir_all(&folder).unwrap();
        let path = folder.join("f.svg");
        std::fs::write(&path, "good").unwrap();
        let draw = |fails: bool| {
            figure(&path, (10, 10), |_| {
                anyhow::ensure!(!fails, "no more");
                Ok(())
            })
        };
        let read = || std::fs::read_to_string(&path).unwrap();
        assert!(draw(true).is_err());
        assert_eq!(read(), "good");
        draw(false).unwrap();
        assert!(read().ends_with("</svg>\n"));
        assert_eq!(std::fs::read_dir(&folder).unwrap().count(), 1);
    }
}
