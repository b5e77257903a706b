//! Design of a study: orders of conditions, session scripts, and the number of subjects.

mod exact_power;
mod latin;
mod power;
mod random;
mod schedule;

pub use exact_power::{RatingTest, for_each_outcome, shares_of_mean};
pub use latin::balanced_latin_square;
pub use power::{EffectPower, PowerStudy, PowerTest, power};
pub use schedule::{Schedule, ScheduledTrial, TrialOrder};
