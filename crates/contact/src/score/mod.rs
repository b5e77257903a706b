//! Evaluation of estimators on reaches of unseen people.
//!
//! ```
//! use hwall_contact::score::{Evaluation, Moment, Split};
//! use hwall_contact::{Hold, hwall_hand::LabelledReach};
//!
//! # fn judged(reaches: &[LabelledReach]) -> Result<(), hwall_contact::ContactError> {
//! // Every person is held out once; touches of earlier reaches are reported to the estimator.
//! let split = Split::of(reaches, &vec![0; reaches.len()]);
//! let evaluation = Evaluation::run(reaches, &split, true, |train| Hold::train(train))?;
//! let half_way = evaluation.at(Moment::Share(0.5));
//! println!("{:.1} mm, {:?} in 90 % regions", 1e3 * half_way.median_m, half_way.covered());
//! # Ok(())
//! # }
//! ```

mod errors;
mod evaluation;
mod folds;
mod moment;
mod summary;

pub use errors::{EstimateError, REGIONS, Region, Spread, TimeError};
pub use evaluation::{Evaluation, JudgedReach};
pub use folds::{Fold, Split};
pub use moment::{BEFORE_S, Moment, SHARES, Span, WRITTEN_EVERY_S, written};
pub use summary::Summary;
