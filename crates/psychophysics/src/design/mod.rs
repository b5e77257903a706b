//! Design of a study: orders of conditions, session scripts, and the number of subjects.

mod latin;
mod power;
mod random;
mod schedule;

pub use latin::balanced_latin_square;
pub use power::{EffectPower, PowerStudy, PowerTest, power};
pub use schedule::{Schedule, ScheduledTrial, TrialOrder};
