//! The study's figures: error against time to contact, and stated against observed probability.

use crate::contact::candidates::Role;
use crate::contact::scores::{REGIONS, Scores};
use hwall_contact::score::{BEFORE_S, Moment};
use hwall_stage::figures::{COLOURS, TEXT, TITLE, legend, plot_error};
use hwall_stage::report::figure_file::FigureFile;
use plotters::coord::Shift;
use plotters::coord::types::RangedCoordf64;
use plotters::prelude::*;
use std::ops::Range;
use std::path::Path;

/// Errors below this are drawn at it, mm: a logarithmic axis has no zero.
const SMALLEST_MM: f64 = 2.0;

/// A line of errors over the time to contact.
pub struct ErrorLine {
    /// For the legend.
    pub name: String,
    /// Time to contact, s, and error, m.
    pub points: Vec<(f64, f64)>,
    /// Colour and width.
    pub style: ShapeStyle,
    /// For estimators that do not say how sure they are.
    pub dashed: bool,
}

/// Colours of the competitors in every figure of the study, in their order.
fn colours() -> impl Iterator<Item = RGBColor> {
    COLOURS.into_iter().chain([BLACK]).cycle()
}

/// All but bounds, with a colour each.
fn competitors(scores: &[Scores]) -> impl Iterator<Item = (&Scores, RGBColor)> {
    let competing = scores.iter().filter(|s| s.role != Role::Bound);
    competing.zip(colours())
}

/// Median error over the time to contact of all but bounds; a full line where covariances are stated.
///
/// # Errors
/// A file that cannot be written.
pub fn error_over_time(path: &Path, title: &str, scores: &[Scores]) -> anyhow::Result<()> {
    let line = |(s, colour): (&Scores, RGBColor)| {
        let at = |before_s: f64| {
            let summary = s.at_moment(Moment::Before(before_s));
            (summary.count > 0).then_some((before_s, summary.median_m))
        };
        let wide = if s.role == Role::Learned { 4 } else { 2 };
        ErrorLine {
            name: s.name.clone(),
            points: BEFORE_S.into_iter().filter_map(at).collect(),
            style: colour.stroke_width(wide),
            dashed: s.under_way().intervals.is_none(),
        }
    };
    let lines: Vec<ErrorLine> = competitors(scores).map(line).collect();
    errors(path, title, &lines)
}

/// Errors over the time to contact, the names to the right of the contact.
///
/// # Errors
/// A file that cannot be written.
pub fn errors(path: &Path, title: &str, lines: &[ErrorLine]) -> anyhow::Result<()> {
    let points = || lines.iter().flat_map(|line| &line.points);
    let largest_mm = points().fold(100.0, |m: f64, p| m.max(1e3 * p.1));
    let earliest_ms = points().fold(100.0, |m: f64, p| m.max(1e3 * p.0));
    let file = FigureFile::create(path)?;
    let root = SVGBackend::new(file.path(), (980, 540)).into_drawing_area();
    root.fill(&WHITE).map_err(plot_error)?;
    let y = 0.9 * SMALLEST_MM..1.2 * largest_mm;
    let (drawing, beside) = root.split_horizontally(690);
    // Time runs to the right, towards the contact.
    let mut chart = ChartBuilder::on(&drawing)
        .caption(title, TITLE)
        .margin(14)
        .x_label_area_size(52)
        .y_label_area_size(70)
        .build_cartesian_2d(
            -earliest_ms * 1.02..0.0,
            y.clone().log_scale().with_key_points(error_ticks(&y)),
        )
        .map_err(plot_error)?;
    chart
        .configure_mesh()
        .disable_x_mesh()
        .x_desc("time to contact, ms")
        .y_desc(format!(
            "median error of the predicted point, mm (at least {SMALLEST_MM})"
        ))
        .x_label_formatter(&|x| format!("{:.0}", x.abs()))
        .y_label_formatter(&|y| format!("{y:.0}"))
        .label_style(TEXT)
        .light_line_style(WHITE)
        .draw()
        .map_err(plot_error)?;
    for (line, y) in lines.iter().zip((64..).step_by(24)) {
        let style = line.style;
        let points = line
            .points
            .iter()
            .map(|(before_s, error_m)| (-1e3 * before_s, (1e3 * error_m).max(SMALLEST_MM)));
        let key = |from: i32, to: i32| beside.draw(&PathElement::new([(from, y), (to, y)], style));
        if line.dashed {
            chart
                .draw_series(DashedLineSeries::new(points, 6, 5, style))
                .map_err(plot_error)?;
            key(8, 17).and(key(25, 34)).map_err(plot_error)?;
        } else {
            chart
                .draw_series(LineSeries::new(points, style).point_size(3))
                .map_err(plot_error)?;
            key(8, 34).map_err(plot_error)?;
        }
        let text = TextStyle::from(TEXT);
        beside
            .draw_text(&line.name, &text, (44, y - 9))
            .map_err(plot_error)?;
    }
    root.present().map_err(plot_error)?;
    file.finish()
}

/// Ticks of a logarithmic axis of errors: 1, 2 and 5 of each decade, or decades alone where these are many.
fn error_ticks(range: &Range<f64>) -> Vec<f64> {
    let (low, high) = (range.start.log10(), range.end.log10());
    let digits: &[f64] = if high - low < 3.0 {
        &[1.0, 2.0, 5.0]
    } else {
        &[1.0]
    };
    (low.floor() as i32..=high.ceil() as i32)
        .flat_map(|decade| digits.iter().map(move |digit| digit * 10_f64.powi(decade)))
        .filter(|tick| range.contains(tick))
        .collect()
}

/// A chart from 0 to 1 both ways.
pub type Square<'a, 'path> =
    ChartContext<'a, SVGBackend<'path>, Cartesian2d<RangedCoordf64, RangedCoordf64>>;

/// Axes of observed over stated probability, with the diagonal on which the two are the same.
///
/// # Errors
/// A file that cannot be written.
pub fn unit_square<'a, 'path>(
    root: &'a DrawingArea<SVGBackend<'path>, Shift>,
    title: &str,
    [stated, observed]: [&str; 2],
) -> anyhow::Result<Square<'a, 'path>> {
    root.fill(&WHITE).map_err(plot_error)?;
    // Room for dots at 1.
    let mut chart = ChartBuilder::on(root)
        .caption(title, TITLE)
        .margin(14)
        .margin_right(26)
        .x_label_area_size(52)
        .y_label_area_size(64)
        .build_cartesian_2d(0.0..1.02, 0.0..1.02)
        .map_err(plot_error)?;
    chart
        .configure_mesh()
        .x_desc(stated)
        .y_desc(observed)
        .x_labels(6)
        .y_labels(6)
        .x_label_formatter(&|x| format!("{x:.1}"))
        .y_label_formatter(&|y| format!("{y:.1}"))
        .label_style(TEXT)
        .light_line_style(WHITE)
        .draw()
        .map_err(plot_error)?;
    let honest = LineSeries::new([(0.0, 0.0), (1.0, 1.0)], BLACK.mix(0.4));
    chart.draw_series(honest).map_err(plot_error)?;
    Ok(chart)
}

/// Observed over stated probability of the regions in space, from 30 to 90 % of the time. Draws nothing and
/// returns `false` where no estimator states any.
///
/// # Errors
/// A file that cannot be written.
pub fn reliability(path: &Path, title: &str, scores: &[Scores]) -> anyhow::Result<bool> {
    let lines: Vec<(RGBColor, &str, [f64; REGIONS.len()])> = competitors(scores)
        .filter_map(|(s, colour)| Some((colour, s.name.as_str(), s.under_way().regions?)))
        .collect();
    if lines.is_empty() {
        return Ok(false);
    }
    let file = FigureFile::create(path)?;
    let root = SVGBackend::new(file.path(), (680, 640)).into_drawing_area();
    let axes = [
        "stated probability of the region",
        "share of the contacts in it",
    ];
    let mut chart = unit_square(&root, title, axes)?;
    for (colour, name, observed) in lines {
        let style = colour.stroke_width(3);
        let points = REGIONS
            .iter()
            .zip(observed)
            .map(|(r, o)| (r.probability, o));
        chart
            .draw_series(LineSeries::new(points, style).point_size(3))
            .map_err(plot_error)?
            .label(name)
            .legend(move |(x, y)| PathElement::new(vec![(x, y), (x + 18, y)], style));
    }
    legend(&mut chart, SeriesLabelPosition::UpperLeft)?;
    root.present().map_err(plot_error)?;
    file.finish()?;
    Ok(true)
}
