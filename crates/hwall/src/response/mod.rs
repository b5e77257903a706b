//! The end-to-end response: from the motion of a hand straight to the joints of the arm.
//!
//! An interaction primitive is learnt from demonstrations of hand *and* joints. In a new reach the hand is observed, and the arm goes to
//! the posterior over the joints at the end of the reach. Neither surfaces nor inverse kinematics take part. A mixture separates
//! demonstrations of several tasks, and of configurations on several branches. Source: \[H-Wall\], chapter VI.
//!
//! [`EndToEnd`] leads a [`Session`](crate::Session); what keeps the arm safe there (limits, surfaces as barriers, proximity, supervisor)
//! does not depend on it. docs/END-TO-END.md in the repository compares joints as targets with a predicted point and exact inverse
//! kinematics.

mod components;
mod demonstration;
mod demonstrator;
mod estimator;
mod familiarity;
mod filter;
mod model;
mod predictor;

pub use demonstration::{ResponseDemonstration, Task};
pub use demonstrator::Demonstrator;
pub use estimator::ResponseEstimator;
pub use filter::{JointMoments, JointPosterior, ResponseFilter};
pub use model::{ResponseConfig, ResponseModel};
pub use predictor::{EndToEnd, ResponseState};
