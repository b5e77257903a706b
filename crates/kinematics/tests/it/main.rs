//! Integration tests of the crate in one binary.

mod arms;
mod chain;
mod chain_support;
#[cfg(feature = "dynamics")]
mod dynamics;
mod invariances;
#[cfg(feature = "dynamics")]
mod momentum;
mod numeric;
mod region;
mod srs_from_chain;
mod srs_hard_cases;
mod srs_properties;
mod srs_reference;
#[cfg(feature = "urdf")]
mod urdf;
#[cfg(feature = "urdf")]
mod urdf_text;
