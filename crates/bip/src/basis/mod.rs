//! Functions of the phase that a motion is composed of.

mod functions;
mod orthonormal;

pub use functions::Basis;
pub(crate) use orthonormal::OrthonormalBasis;
