//! Height fields and normal maps as OpenEXR pictures.
//!
//! The picture's comment states the units, one line `name = value` each: `pixel_pitch_mm` and
//! `height_unit`. The standard density (pixels per inch) is set as well, in single precision.

use super::field::HeightField;
use crate::error::{Result, TextonError};
use crate::picture::{channels, choose, failed, read_bounded};
use exr::meta::attribute::AttributeValue;
use exr::prelude::{
    AnyChannel, AnyChannels, Encoding, FlatSamples, Image, ImageAttributes, Layer, LayerAttributes,
    SmallVec, Text, WritableImage,
};
use hwall_numeric::check::positive;
use std::io::Cursor;
use std::path::Path;

const INCH_MM: f64 = 25.4;
const PITCH: &str = "pixel_pitch_mm";
const UNIT: &str = "height_unit";

/// How to read a picture.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct HeightSource {
    /// The channel with the heights. By default the only channel, or the one named `height`, `Z` or `Y`.
    pub channel: Option<String>,
    /// Distance of neighbouring pixels, mm. By default as the picture states.
    pub pitch_mm: Option<f64>,
    /// Millimetres per unit of height. By default as the picture states.
    pub unit_mm: Option<f64>,
}

impl HeightField {
    /// Writes an EXR picture with the channel `height` (32-bit float, mm), the highest row (largest y) on top.
    /// The same heights give the same bytes.
    ///
    /// # Errors
    /// A file that cannot be written.
    pub fn write_exr(&self, path: impl AsRef<Path>) -> Result<()> {
        let heights = self
            .downward()
            .map(|(i, j)| self.pixel_mm(i as i64, j as i64) as f32);
        let channels = [("height", heights.collect())];
        self.write(path.as_ref(), channels, "height = mm above the plate")
    }

    /// Writes an EXR picture of the unit normals: R along x (the long axis of the bumps), G along y, B away
    /// from the plate, each from -1 to 1 (32-bit float, not shifted to 0 to 1).
    ///
    /// # Errors
    /// A file that cannot be written.
    pub fn write_normal_exr(&self, path: impl AsRef<Path>) -> Result<()> {
        let normals: Vec<[f64; 3]> = self.downward().map(|(i, j)| self.normal(i, j)).collect();
        let channel = |axis: usize| normals.iter().map(|n| n[axis] as f32).collect();
        let channels = [("R", channel(0)), ("G", channel(1)), ("B", channel(2))];
        self.write(
            path.as_ref(),
            channels,
            "normal = R along x, G along y, B away from the plate, -1 to 1",
        )
    }

    /// Pixels in the order of pictures: the highest row first.
    fn downward(&self) -> impl Iterator<Item = (usize, usize)> {
        let [columns, rows] = self.size();
        (0..rows)
            .rev()
            .flat_map(move |j| (0..columns).map(move |i| (i, j)))
    }

    fn write<const N: usize>(
        &self,
        path: &Path,
        channels: [(&str, Vec<f32>); N],
        what: &str,
    ) -> Result<()> {
        let mut attributes = LayerAttributes::named("patch");
        attributes.software_name = Some(Text::from(concat!(
            "hwall-texton ",
            env!("CARGO_PKG_VERSION")
        )));
        let pitch_mm = self.pitch_mm();
        // One comment, because the order of several attributes would change from run to run.
        let comment = format!("{PITCH} = {pitch_mm}\n{UNIT} = mm\n{what}\n");
        attributes.comments = Some(Text::from(comment.as_str()));
        attributes.horizontal_density = Some((INCH_MM / pitch_mm) as f32);
        let channels: SmallVec<[AnyChannel<FlatSamples>; 4]> = channels
            .into_iter()
            .map(|(name, samples)| AnyChannel::new(name, FlatSamples::F32(samples)))
            .collect();
        let [columns, rows] = self.size();
        let layer = Layer::new(
            (columns, rows),
            attributes,
            Encoding::SMALL_FAST_LOSSLESS,
            AnyChannels::sort(channels),
        );
        let image = Image::from_layers(ImageAttributes::with_size((columns, rows)), vec![layer]);
        let mut bytes = Cursor::new(Vec::new());
        // On one thread, to keep the order of the blocks.
        let written = image.write().non_parallel().to_buffered(&mut bytes);
        written.map_err(|error| failed(path.display(), &error))?;
        hwall_files::write(path, bytes.into_inner()).map_err(|error| TextonError::io(path, &error))
    }

    /// Reads heights from an EXR picture, written by this crate or measured: one channel of any sample type, square
    /// pixels, the highest row on top.
    ///
    /// # Errors
    /// A file that is missing, truncated, too large or not an EXR picture; no such channel; a pitch or unit that
    /// is neither stated nor given; a pixel that is not finite.
    pub fn read_exr(path: impl AsRef<Path>, source: &HeightSource) -> Result<Self> {
        let path = path.as_ref();
        let file = std::fs::File::open(path).map_err(|error| TextonError::io(path, &error))?;
        let image = read_bounded(std::io::BufReader::new(file), path.display())?;
        let all = channels(&image);
        let names = ["height", "z", "y"];
        let chosen = choose(&all, source.channel.as_deref(), &names)?;
        let units = PictureUnits::of(&chosen.layer.attributes);
        let pitch_mm = source
            .pitch_mm
            .or(units.pitch_mm)
            .ok_or(TextonError::Attribute {
                name: "pixel pitch",
            })?;
        let unit_mm = source
            .unit_mm
            .or(units.unit_mm)
            .ok_or(TextonError::Attribute {
                name: "height unit",
            })?;
        positive("height unit, mm", unit_mm)?;
        let (columns, rows) = (chosen.layer.size.0, chosen.layer.size.1);
        let mut heights_mm = vec![0.0; columns * rows];
        for (k, value) in chosen.channel.sample_data.values_as_f32().enumerate() {
            let (column, row) = (k % columns, k / columns);
            if !value.is_finite() {
                let value = f64::from(value);
                return Err(TextonError::Pixel { column, row, value });
            }
            let scaled = f64::from(value) * unit_mm;
            heights_mm[(rows - 1 - row) * columns + column] = scaled as f32;
        }
        Self::new(columns, pitch_mm, heights_mm)
    }
}

/// Units stated in a picture.
struct PictureUnits {
    pitch_mm: Option<f64>,
    unit_mm: Option<f64>,
}

impl PictureUnits {
    /// From attributes of these names, from this crate's comment, or from the density.
    fn of(attributes: &LayerAttributes) -> Self {
        let comments = attributes.comments.as_ref().map(Text::to_string);
        let line = |name: &str| {
            let text = comments.as_deref()?;
            text.lines().find_map(|line| {
                let (left, right) = line.split_once('=')?;
                (left.trim() == name).then(|| right.trim().to_owned())
            })
        };
        let free = |name: &str| match attributes.other.get(&Text::from(name))? {
            AttributeValue::F32(x) => Some(x.to_string()),
            AttributeValue::F64(x) => Some(x.to_string()),
            AttributeValue::Text(x) => Some(x.to_string()),
            _ => None,
        };
        let word = |name: &str| free(name).or_else(|| line(name));
        let density = || {
            attributes
                .horizontal_density
                .map(|d| INCH_MM / f64::from(d))
        };
        let unit = word(UNIT);
        Self {
            pitch_mm: word(PITCH).and_then(|w| w.parse().ok()).or_else(density),
            unit_mm: unit.and_then(|unit| match unit.as_str() {
                "mm" => Some(1.0),
                "m" => Some(1000.0),
                "um" | "µm" => Some(1e-3),
                _ => None,
            }),
        }
    }
}
