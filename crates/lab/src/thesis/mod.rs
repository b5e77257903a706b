//! The dissertation chapter by chapter: each figure and table redone by the library, next to the published numbers.

pub mod document;
mod html;
mod job;
mod maps;
mod outlook;
mod prediction;
mod roughness;
mod system;

pub use document::Chapter;
