//! OpenEXR pictures from another program, without metadata.

use exr::prelude::{AnyChannel, AnyChannels, FlatSamples, Image, WritableImage};

/// The bytes of a picture with these channels.
pub(crate) fn picture(size: (usize, usize), channels: &[(&str, Vec<f32>)]) -> Vec<u8> {
    let channel = |(name, samples): &(&str, Vec<f32>)| {
        AnyChannel::new(*name, FlatSamples::F32(samples.clone()))
    };
    let list = channels.iter().map(channel).collect();
    let mut file = std::io::Cursor::new(Vec::new());
    let image = Image::from_channels(size, AnyChannels::sort(list));
    image.write().to_buffered(&mut file).unwrap();
    file.into_inner()
}
