//! Where and when a reach ends, learned from recorded reaches: regressions, trees and an interaction primitive, weighted by their errors on
//! held-out reaches.
//!
//! # How the learned estimator works
//!
//! Five sources predict the end of a reach. Two are ridge regressions of the remaining displacement and time, with their own coefficients in each
//! of 16 to 128 soft regions of progress: one uses the place in the room, the other everything relative to the start of the reach. Trees correct
//! the second. The fourth is a Bayesian interaction primitive (`hwall-bip`). The fifth predicts that the hand stays where it is, which is right
//! once it has arrived. All use the same samples, so their errors are correlated; they are weighted by the joint moments of their errors on
//! held-out people (or reaches, with fewer than three people), region by region. The combination is then shifted towards places where others have
//! touched, as far as that helped on held-out reaches.
//!
//! A reach starts at its onset (`ReachOnset` of `hwall-hand`), so a rest before it, or a different segmentation, changes little.
//!
//! The number of regions is chosen on held-out groups, as are the inputs in each region: place in the room, place and motion of the head, place
//! and motion of every other point of the hand, gaze. `LearnedModel::account` returns these choices and their errors as tables.
//!
//! The stated covariance is that of the combination, with factors that make 90 % regions (ellipsoids, `ContactEstimate::distance_squared` at most
//! 6.251) hold 90 % of held-out ends in every region of progress and, as far as progress and the estimated time left distinguish them, at every
//! moment of a reach; it is wider where the sources disagree. The errors used are those that remain when a held-out group hardly counts in the
//! weights. A hand that has almost stopped near the predicted place is taken to have arrived, as far as that was right on held-out reaches.
//!
//! # Feedback from touches
//!
//! Report each touch to the estimator (`ContactEstimator::touched`, then `begin` as usual) and it adapts to this person and this room: the offset
//! of this person's ends from the predictions and its dependence on the remaining displacement (three numbers and a matrix at each time left); the
//! delay (both only as far as people differed in training); what has moved in the room; the weights of the sources, the places, and the spread at
//! each time left. `LearnedEstimator::surprise` is normally about 1 and far larger after something has moved; a moved screen is followed within a
//! few touches. Call `forget` when the person changes.
//!
//! # Data and time
//!
//! Eight reaches are the minimum; some fifty reaches of several people make a good model, and more people help more than more reaches. Training
//! takes seconds. A model trained on few people meets users who are slower or faster than all of them, and would take a slow hand for one that has
//! nearly arrived. `LearnedConfig::other_pace` therefore adds each reach again at another speed.
//!
//! The time of a step depends on `LearnedConfig::rank` (of the primitive; most with all points of the hand), on the number of regions and on the
//! points tracked, and hardly on `lags` (the window of the regression).
//!
//! With the feature `serde` (on by default) `write_json` and `read_json` of `LearnedModel` and of `RegionModel` store a model in a file with
//! version and digest. The model read back gives bit-identical estimates; a truncated or edited file is an error. `LearnedModel` also has
//! `reaches()`, `people()`, `median_duration_s()`, `touching_point()` and `combination()`.

mod account;
mod alone;
mod blend;
mod config;
mod estimator;
#[cfg(feature = "serde")]
mod file;
mod held_out;
mod model;
mod primitive;
mod quantiles;
mod reaches;
mod regression;

pub use account::{Account, InputUse, StageAccount};
pub use config::{Combination, Frame, LearnedConfig};
pub use estimator::LearnedEstimator;
pub use held_out::{HeldOutEstimator, HeldOutReach};
pub use model::LearnedModel;
