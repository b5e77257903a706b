//! Basis functions of the phase.

mod functions;
mod orthonormal;

pub use functions::Basis;
pub(crate) use orthonormal::OrthonormalBasis;
