//! A page that asks one question after the other: large buttons, a number, one of two.

mod question;
mod server;

pub use question::{Answering, Question};
pub use server::QuestionServer;
