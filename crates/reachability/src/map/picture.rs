//! Maps as multi-layer OpenEXR pictures: one layer for each plane.

use super::reachability_map::{LineIndex, ReachabilityMap};
use crate::error::{ReachabilityError, Result};
use crate::line::{Interval, size_m};
use exr::prelude::{
    AnyChannel, AnyChannels, Encoding, FlatSamples, Image, ImageAttributes, Layer, LayerAttributes,
    SmallVec, Text, WritableImage,
};
use hwall_numeric::check::{finite, positive};
use std::io::Cursor;
use std::path::Path;

/// Maximum number of pixels in all layers together: a gigabyte per channel.
const MOST_PIXELS: u128 = 1 << 28;

/// Settings of a picture of a map.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct PictureConfig {
    /// Length along the wall per pixel, m; default 0.01.
    pub pixel_m: f64,
    /// Range along the wall, m; by default the length of the stretched arm to both sides.
    pub span_m: Option<Interval>,
}

impl Default for PictureConfig {
    fn default() -> Self {
        Self {
            pixel_m: 0.01,
            span_m: None,
        }
    }
}

impl ReachabilityMap {
    /// The map as an OpenEXR file in memory: a layer `wall1.plane00` and so on for each plane
    /// (walls count from 1, planes from 0), with a row for each height, the highest on top.
    ///
    /// Channels (f32): `reachable`, the reachable fraction of the pixel's stretch of the wall, and
    /// `unproven`, the unproven fraction. Each layer's comment has lines `name = value` with its
    /// location (heading_rad, distance_m, first_height_m, height_step_m, first_s_m, s_step_m;
    /// metres and radians). The same map gives the same bytes.
    ///
    /// # Errors
    /// A pixel that is not positive, an empty or NaN span, too many pixels.
    pub fn to_exr(&self, config: &PictureConfig) -> Result<Vec<u8>> {
        let pixel_m = positive("pixel_m", config.pixel_m)?;
        let longest = size_m(self.arm());
        let span = config.span_m.unwrap_or(Interval::new(-longest, longest));
        finite("start of the picture", span.lo_m)?;
        positive("length of the picture", span.length_m())?;
        // Omit a last pixel whose width is only rounding.
        let columns = finite("pixels", (span.length_m() / pixel_m - 1e-9).ceil().max(1.0))?;
        let rows: u128 = self.walls().map(|wall| wall.line_count() as u128).sum();
        let count = (columns as u128).saturating_mul(rows);
        if count > MOST_PIXELS {
            return Err(ReachabilityError::TooMany {
                what: "pixels",
                count,
                limit: MOST_PIXELS,
            });
        }
        let grid = Raster {
            first_m: span.lo_m,
            pixel_m,
            columns: columns as usize,
        };
        let mut layers = Vec::new();
        let mut tallest = 1;
        for (wall, walls) in self.walls().enumerate() {
            tallest = tallest.max(walls.heights.count());
            for plane in 0..walls.distances.count() {
                layers.push(self.layer(wall, plane, &grid));
            }
        }
        let attributes = ImageAttributes::with_size((grid.columns, tallest));
        let image = Image::from_layers(attributes, layers);
        let mut bytes = Cursor::new(Vec::new());
        // Written by one thread, so that the blocks are always in the same order.
        let written = image.write().non_parallel().to_buffered(&mut bytes);
        written.map_err(|error| ReachabilityError::Picture {
            message: error.to_string(),
        })?;
        Ok(bytes.into_inner())
    }

    /// Writes [`to_exr`](Self::to_exr) to a file.
    ///
    /// # Errors
    /// As [`to_exr`](Self::to_exr), or a file that cannot be written.
    pub fn write_exr(&self, path: impl AsRef<Path>, config: &PictureConfig) -> Result<()> {
        let path = path.as_ref();
        hwall_files::write(path, self.to_exr(config)?)
            .map_err(|error| ReachabilityError::file(path, &error))
    }

    fn layer(&self, wall: usize, plane: usize, raster: &Raster) -> Layer<AnyChannels<FlatSamples>> {
        let grid = self.grid(wall);
        let heights = &grid.heights;
        let rising = heights.count() < 2 || heights.at(1) > heights.at(0);
        let mut order: Vec<usize> = (0..heights.count()).collect();
        // The first row of a picture is the top one.
        if rising {
            order.reverse();
        }
        let mut reachable = Vec::with_capacity(order.len() * raster.columns);
        let mut unproven = Vec::with_capacity(order.len() * raster.columns);
        for &height in &order {
            let index = LineIndex {
                wall,
                plane,
                height,
            };
            let spans: Vec<Interval> = self.intervals(index).iter().map(|i| i.span).collect();
            raster.draw(&spans, &mut reachable);
            raster.draw(self.unknown(index), &mut unproven);
        }
        let mut attributes =
            LayerAttributes::named(format!("wall{}.plane{plane:02}", wall + 1).as_str());
        attributes.software_name = Some(Text::from(concat!(
            "hwall-reachability ",
            env!("CARGO_PKG_VERSION")
        )));
        // One text, because the order of separate attributes in the file would change between runs.
        let step = heights.spacing_m() * if rising { 1.0 } else { -1.0 };
        let comment = format!(
            "heading_rad = {}\ndistance_m = {}\nfirst_height_m = {}\nheight_step_m = {step}\n\
             first_s_m = {}\ns_step_m = {}\naccuracy_m = {}\n",
            grid.heading_rad,
            grid.distances.at(plane),
            heights.at(0),
            raster.first_m,
            raster.pixel_m,
            self.config().accuracy_m,
        );
        attributes.comments = Some(Text::from(comment.as_str()));
        let channels: SmallVec<[AnyChannel<FlatSamples>; 4]> = [
            AnyChannel::new("reachable", FlatSamples::F32(reachable)),
            AnyChannel::new("unproven", FlatSamples::F32(unproven)),
        ]
        .into_iter()
        .collect();
        Layer::new(
            (raster.columns, order.len()),
            attributes,
            Encoding::SMALL_FAST_LOSSLESS,
            AnyChannels::sort(channels),
        )
    }
}

/// The pixels of a row.
struct Raster {
    first_m: f64,
    pixel_m: f64,
    columns: usize,
}

impl Raster {
    /// Appends the fraction of each pixel covered by sorted, disjoint spans.
    fn draw(&self, spans: &[Interval], row: &mut Vec<f32>) {
        let start = row.len();
        row.resize(start + self.columns, 0.0);
        for span in spans {
            let from = (span.lo_m - self.first_m) / self.pixel_m;
            let to = (span.hi_m - self.first_m) / self.pixel_m;
            let first = from.floor().max(0.0) as usize;
            let last = (to.ceil().max(0.0) as usize).min(self.columns);
            for column in first..last {
                let covered = to.min(column as f64 + 1.0) - from.max(column as f64);
                row[start + column] += covered.max(0.0) as f32;
            }
        }
    }
}
