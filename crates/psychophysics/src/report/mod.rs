//! An analysis as text and as Markdown.

mod document;
mod numbers;
mod sections;
mod warnings;
