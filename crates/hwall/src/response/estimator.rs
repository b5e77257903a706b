//! Position of the board from the posterior over the joints.

use super::filter::{JointMoments, JointPosterior, ResponseFilter};
use super::model::ResponseModel;
use crate::error::SessionError;
use glam::{DMat3, DVec3};
use hwall_contact::{ContactEstimate, ContactEstimator, TimeToContact};
use hwall_hand::HandFrame;
use hwall_kinematics::ArmKinematics;
use std::sync::Arc;

/// Less probable components are left out of the covariance.
const IMPROBABLE: f64 = 0.01;

/// A response as an estimate of the contact: the middle of the presented face, by forward kinematics.
#[derive(Debug, Clone)]
pub struct ResponseEstimator {
    filter: ResponseFilter,
    arm: Arc<dyn ArmKinematics>,
    posterior: Option<JointPosterior>,
}

impl ResponseEstimator {
    /// For the demonstrated arm, with the face of the board as its tool.
    #[must_use]
    pub fn new(model: &ResponseModel, arm: Arc<dyn ArmKinematics>) -> Self {
        Self {
            filter: model.filter(),
            arm,
            posterior: None,
        }
    }

    /// The posterior after the last sample; `None` before the first one.
    #[must_use]
    pub const fn posterior(&self) -> Option<&JointPosterior> {
        self.posterior.as_ref()
    }

    /// Is the reach like the training reaches? See [`ResponseFilter::is_familiar`].
    #[must_use]
    pub const fn is_familiar(&self) -> bool {
        self.filter.is_familiar()
    }

    /// The arm, with the face of the board as its tool.
    #[must_use]
    pub const fn arm(&self) -> &Arc<dyn ArmKinematics> {
        &self.arm
    }

    /// Takes the next sample of the reach; `None` while no point of the hand was seen.
    ///
    /// # Errors
    /// As [`ResponseFilter::step`] and [`ResponseFilter::posterior`].
    pub fn follow(&mut self, frame: &HandFrame) -> Result<Option<ContactEstimate>, SessionError> {
        self.filter.step(frame)?;
        if !self.filter.has_seen() {
            return Ok(None);
        }
        let posterior = self.filter.posterior()?;
        let face = self.arm.forward(&posterior.q);
        let point_m = face.position_m();
        let covariance_m2 = self.covariance_m2(&posterior, point_m)?;
        self.posterior = Some(posterior);
        Ok(Some(ContactEstimate {
            covariance_m2: Some(covariance_m2),
            normal: Some(face.rotation().z_axis),
            time_to_contact_s: posterior.time_to_end.map(|time| TimeToContact {
                mean_s: time.mean.max(0.0),
                sd_s: Some(time.sd),
            }),
            ..ContactEstimate::of_point(frame.t_s, point_m)
        }))
    }

    /// Covariance of the middle of the face about a point, over all components, to first order in each.
    fn covariance_m2(
        &mut self,
        posterior: &JointPosterior,
        about_m: DVec3,
    ) -> Result<DMat3, SessionError> {
        let mut sum = DMat3::ZERO;
        for component in 0..self.filter.components() {
            let share = self.filter.component_probability(component);
            if share < IMPROBABLE {
                continue;
            }
            let moments = match component == posterior.component {
                true => Some(posterior.moments()),
                false => self.filter.of_component(component)?,
            };
            let Some(moments) = moments else { continue };
            let off = self.arm.forward(&moments.q).position_m() - about_m;
            sum += share * (outer(off, off) + self.carried(&moments));
        }
        Ok(sum)
    }

    /// `J Σ Jᵀ` of the middle of the face.
    fn carried(&self, moments: &JointMoments) -> DMat3 {
        let columns = self.arm.jacobian(&moments.q).linear;
        let mut sum = DMat3::ZERO;
        for (a, row) in columns.iter().zip(&moments.covariance_rad2) {
            for (b, value) in columns.iter().zip(row) {
                sum += *value * outer(*a, *b);
            }
        }
        // Symmetric up to rounding.
        (sum + sum.transpose()) * 0.5
    }
}

fn outer(a: DVec3, b: DVec3) -> DMat3 {
    DMat3::from_cols(a * b.x, a * b.y, a * b.z)
}

impl ContactEstimator for ResponseEstimator {
    fn begin(&mut self) {
        self.filter.begin();
        self.posterior = None;
    }

    /// It does not learn from touches, so a reach that may have begun is treated as begun.
    fn begin_tentatively(&mut self) -> bool {
        self.begin();
        true
    }

    /// Also `None` for a sample with an invalid time.
    fn step(&mut self, frame: &HandFrame) -> Option<ContactEstimate> {
        let finite = |e: &ContactEstimate| {
            e.point_m.is_finite() && e.covariance_m2.is_none_or(|c| c.is_finite())
        };
        self.follow(frame).ok().flatten().filter(finite)
    }
}
