//! Where and when a reach ends, learnt from reaches: regressions, trees and an interaction primitive, weighed by
//! their errors on reaches that were held out.
//!
//! # How the learned estimator works
//!
//! Five sources say where a reach ends. Two are ridge regressions of the distance and the time that are left, with their own
//! coefficients in each of 16 to 128 soft regions of progress: one knows where in the room the hand is, the other sees everything
//! from the start of the reach. Trees correct the second. The fourth is a Bayesian interaction primitive (`hwall-bip`). The fifth
//! says that the hand stays where it is, which is right once it has arrived. All see the same samples, so their errors are
//! correlated; they are weighted by the joint moments of their errors on held-out people (or reaches, with fewer than three people),
//! region by region. The combination is then drawn to places where others have touched, as far as that has helped.
//!
//! A reach starts at its onset (`ReachOnset` of `hwall-hand`): a rest before it, or a cut that somebody else made, changes little.
//!
//! The number of regions is chosen on held-out groups, and in each region which inputs are used: place in the room, place and
//! motion of the head, place and motion of every other point of the hand, gaze. `LearnedModel::account` returns what was chosen and
//! how well it did, as tables.
//!
//! The stated covariance is that of the combination, with factors that make 90 % regions (ellipsoids,
//! `ContactEstimate::distance_squared` at most 6.251) hold 90 % of held-out ends in every region of progress and, as far as progress
//! and the estimated time left distinguish them, at every moment of a reach; it is wider where the sources disagree. These errors
//! are those that remain when a held-out group hardly counts in the weights. A hand that has all but stopped near the expected place
//! is taken to have arrived, as far as that was right on held-out reaches.
//!
//! # Feedback from touches
//!
//! Give the estimator each touch (`ContactEstimator::touched`, then `begin` as usual) and it adapts to this person and this room:
//! how far and to which side of the predicted end this person ends, and how that follows the way left, as three numbers and a matrix
//! at each time left; how much later (both only in so far as people differed in that among those learnt from); what has moved in the
//! room; the weights of the sources, the places, and the spread at each time left. `LearnedEstimator::surprise` is about 1 while all
//! is as it was and far larger after something has moved; a screen that stands elsewhere is followed within a few touches. Call
//! `forget` when somebody else comes.
//!
//! # Data and time
//!
//! Eight reaches are the minimum; some fifty reaches of several people make a good model, and more people help more than more
//! reaches. Training takes seconds. A model learnt from few people meets others who are slower or faster than all of them, and would
//! take their hands for hands that have nearly arrived. With `LearnedConfig::other_pace` each reach is therefore also learnt from at
//! another speed.
//!
//! The time of a step depends on `LearnedConfig::rank` (directions of the primitive, above all with all points of the hand), on the
//! regions and on the points tracked, and hardly on `lags` (the window that the regression looks back over).
//!
//! With the feature `serde` (on by default) `write_json` and `read_json` of `LearnedModel` and of `RegionModel` keep a model in a
//! file with version and digest. The model read back gives the same estimates to the last bit; a file that was cut off or edited is
//! an error. `LearnedModel` also has `reaches()`, `people()`, `median_duration_s()`, `touching_point()` and `combination()`.

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
