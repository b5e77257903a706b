//! A proposal for the roughness of a material from its picture.
//!
//! # What the proposal rests on
//!
//! - A height picture gives relief `Sq` (rms height) and slope `Sdq` (rms gradient), for periods from the finest that its
//!   pixels resolve up to 10 mm, the width of a fingertip. The law is `ln R = a + p ln Sq + q ln Sdq`.
//! - The law is fitted to synthesized surfaces of known geometry whose roughness was published: sandpapers of the FEPA grades
//!   (magnitude proportional to the 1.5th power of the grain size, [Stevens 1962]) and gratings ([Yoshioka 2001]).
//!   The two studies disagree about the exponent; [`MaterialScale::error`] states by how much.
//! - A colour picture shows no relief. Its contrast is read as shading by a light 45 degrees high; the error under other lights is
//!   measured on shaded pictures of the same surfaces. A printed pattern looks the same and feels smooth.
//! - No photographs of materials with published roughness were available: the errors refer to synthesized surfaces.

mod picture;
#[cfg(feature = "png")]
mod png_file;
mod relief;
mod samples;
mod scale;

pub use picture::{MaterialPicture, PictureKind};
#[cfg(feature = "png")]
pub use png_file::PngSource;
pub use relief::Relief;
pub use samples::{MaterialSample, MaterialSeries};
pub use scale::{Caveat, MaterialScale, RoughnessProposal, ScaleError};
