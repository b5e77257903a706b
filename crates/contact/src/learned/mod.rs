//! Where and when a reach ends, learned from recorded reaches: regressions, trees and an interaction primitive, weighted by their errors on
//! held-out reaches.
//!
//! # How the learned estimator works
//!
//! Five sources predict the end of a reach. Two are ridge regressions of the remaining displacement and time, with their own coefficients in each
//! of 16 to 128 soft regions of progress. The first uses the place in the room, the second only quantities relative to the start of the reach. The
//! third source corrects the second by trees. The fourth is a Bayesian interaction primitive (`hwall-bip`). The fifth predicts that the hand stays
//! where it is, which is right once it has arrived. All use the same samples, so their errors are correlated; they are weighted by the joint
//! moments of their errors on held-out people (or reaches, with fewer than three people), region by region. The combination is then shifted
//! towards places where others have touched, as far as that helped on held-out reaches.
//!
//! A reach starts at its onset (`ReachOnset` of `hwall-hand`), so a rest before it, or a different segmentation, changes little.
//!
//! The number of regions is chosen on held-out groups, as are the inputs in each region: place in the room, place and motion of the head, place
//! and motion of every other point of the hand, gaze.
//!
//! The stated covariance is that of the combination, times factors that make 90 % regions contain 90 % of held-out ends in every region of
//! progress. (A 90 % region is the ellipsoid with `ContactEstimate::distance_squared` at most 6.251.) As far as progress and the estimated time
//! left distinguish the moments of a reach, the regions contain 90 % at every moment, too. The covariance is wider where the sources disagree. The
//! factors are learned from errors that remain when a held-out group hardly influences the weights. A hand that has almost stopped near the
//! predicted place counts as arrived, to the extent that this was right on held-out reaches.
//!
//! # Feedback from touches
//!
//! After each touch, call `ContactEstimator::touched`, then `begin` for the next reach. The estimator then adapts to this person and this room. It
//! learns the offset of this person's ends from the predictions, its dependence on the remaining displacement (three numbers and a matrix at each
//! time left), and the delay, but only as far as people differed in these in training. It also learns what has moved in the room, the weights of
//! the sources, the places, and the spread at each time left. `LearnedEstimator::surprise` is normally about 1 and far larger after something has
//! moved; the estimator follows a moved screen within a few touches. Call `forget` when the person changes.
//!
//! # Data and time
//!
//! Eight reaches are the minimum; about fifty reaches of several people make a good model, and more people help more than more reaches. Training
//! takes seconds. Users may be slower or faster than all of the few people a model was trained on; the model would then mistake a slow hand for
//! one that has nearly arrived. With `LearnedConfig::other_speed`, training therefore adds each reach again at another speed.
//!
//! The time of a step depends on `LearnedConfig::rank` (the rank of the primitive, which costs most with all points of the hand), on the number of
//! regions and on the number of tracked points. It hardly depends on `lags` (the window of the regression).
//!
//! With the feature `serde` (on by default) `write_json` and `read_json` of `LearnedModel` store a model in a file with
//! version and digest. The model read back gives bit-identical estimates; a truncated or edited file is an error. `LearnedModel` also has
//! `reaches()`, `people()`, `median_duration_s()`, `touching_point()` and `combination()`.

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

pub use config::{Combination, Frame, LearnedConfig};
pub use estimator::LearnedEstimator;
pub use held_out::{HeldOutEstimator, HeldOutReach};
pub use model::LearnedModel;
