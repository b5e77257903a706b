//! The end-to-end response: from the motion of a hand straight to the joints of the arm.
//!
//! An interaction primitive is learnt from demonstrations of hand *and* joints; of a new reach the hand is observed, and the
//! posterior over the joints at its end is where the arm goes. Neither surfaces nor inverse kinematics take part. Demonstrations of
//! several tasks, and of configurations on several branches, are told apart by a mixture. Source: \[H-Wall\], chapter VI.
//!
//! [`EndToEnd`] leads a [`Session`](crate::Session); what keeps the arm safe there (limits, surfaces as barriers, proximity,
//! supervisor) does not depend on it. What joints as targets cost beside a predicted point and exact inverse kinematics:
//! docs/END-TO-END.md in the repository.

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
