//! Models of sensation: growth with the stimulus, and the just noticeable difference.

mod psychometric;
mod stevens;

pub use psychometric::{PairAnswers, Psychometric, Sigmoid, fit_psychometric};
pub use stevens::{MagnitudeAnswer, PowerLaw, stevens_fit};
