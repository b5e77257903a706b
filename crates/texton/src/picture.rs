//! Reading channels of OpenEXR pictures.

use crate::error::{Result, TextonError};
use crate::height::MOST_PIXELS;
use exr::error::Error;
use exr::meta::header::Header;
use exr::prelude::{
    AnyChannel, AnyChannels, FlatSamples, Image, Layer, Layers, MetaData, ReadChannels, ReadLayers,
    read,
};
use hwall_numeric::check::that;
use std::fmt::Display;
use std::io::{BufRead, ErrorKind, Seek, SeekFrom};

/// Deflate yields at most 516 half-precision samples per byte, other compressions fewer; this bound has a margin.
const MOST_SAMPLES_A_BYTE: u64 = 2_048;

/// A picture with all of its layers.
type Picture = Image<Layers<AnyChannels<FlatSamples>>>;
/// A channel and the layer that it belongs to.
#[derive(Clone, Copy)]
pub(crate) struct PictureChannel<'a> {
    pub(crate) layer: &'a Layer<AnyChannels<FlatSamples>>,
    pub(crate) channel: &'a AnyChannel<FlatSamples>,
}

/// A failure of reading or writing a picture of this name.
pub(crate) fn failed(name: impl Display, error: &Error) -> TextonError {
    let kind = match error {
        Error::Io(error) => error.kind(),
        _ => ErrorKind::InvalidData,
    };
    TextonError::file(name, kind, error)
}

/// Reads a picture, unless its headers claim more samples than are allowed or than its size can hold. `name`: for errors.
pub(crate) fn read_bounded(mut file: impl BufRead + Seek, name: impl Display) -> Result<Picture> {
    let meta = MetaData::read_from_buffered(&mut file, false);
    let meta = meta.map_err(|error| failed(&name, &error))?;
    let pixels =
        |header: &Header| (header.layer_size.0 as u64).saturating_mul(header.layer_size.1 as u64);
    // Every channel of every layer needs memory.
    let samples = meta.headers.iter().fold(0_u64, |sum, header| {
        let channels = header.channels.list.len() as u64;
        sum.saturating_add(pixels(header).saturating_mul(channels))
    });
    that(
        samples <= MOST_PIXELS,
        "samples of all layers and channels",
        samples as f64,
        "at most 268435456",
    )?;
    let end = file.seek(SeekFrom::End(0));
    let bytes = end.map_err(|error| TextonError::file(&name, error.kind(), error))?;
    that(
        samples <= bytes.saturating_mul(MOST_SAMPLES_A_BYTE),
        "samples of all layers and channels",
        samples as f64,
        "at most 2048 for each byte of the file",
    )?;
    let rewound = file.rewind();
    rewound.map_err(|error| TextonError::file(&name, error.kind(), error))?;
    read()
        .no_deep_data()
        .largest_resolution_level()
        .all_channels()
        .all_layers()
        .all_attributes()
        .non_parallel()
        .from_buffered(file)
        .map_err(|error| failed(&name, &error))
}

/// The channels of all layers.
pub(crate) fn channels(picture: &Picture) -> Vec<PictureChannel<'_>> {
    let of = |layer| move |channel| PictureChannel { layer, channel };
    let layers = picture.layer_data.iter();
    layers
        .flat_map(|layer| layer.channel_data.list.iter().map(of(layer)))
        .collect()
}

/// The channel asked for; by default the only one, or the first with a known name.
pub(crate) fn choose<'a>(
    all: &[PictureChannel<'a>],
    wanted: Option<&str>,
    known: &[&str],
) -> Result<PictureChannel<'a>> {
    let named = |name: &str| {
        all.iter()
            .find(|c| c.channel.name.eq_case_insensitive(name))
    };
    let chosen = match (wanted, all) {
        (Some(name), _) => named(name),
        (None, [only]) => Some(only),
        (None, _) => known.iter().find_map(|name| named(name)),
    };
    chosen.copied().ok_or_else(|| {
        let found: Vec<String> = all.iter().map(|c| c.channel.name.to_string()).collect();
        TextonError::Channel {
            wanted: wanted.map_or_else(|| known.join(" or "), str::to_owned),
            found: found.join(", "),
        }
    })
}
