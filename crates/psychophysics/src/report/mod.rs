//! An analysis as text and as Markdown.

mod document;
mod sections;
