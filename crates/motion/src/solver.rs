//! The solver that plans motions of all joints, and its trajectories.

use crate::joint::{JointBounds, JointPoint};
use crate::joint_state::JointState;
use crate::limits::MotionLimits;
use hwall_kinematics::{JointPositions, MOST_JOINTS};
use rsruckig::prelude::*;
use std::panic::{AssertUnwindSafe, catch_unwind};

/// A state this close to the largest speed counts as at the limit, as a share of it.
const SPEED_EDGE: f64 = 1e-9;

/// How the joints share the time of a motion.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
#[non_exhaustive]
pub enum JointTiming {
    /// All arrive at the same time, determined by the slowest.
    #[default]
    Together,
    /// As [`Together`](Self::Together), and on a straight line between configurations if the start allows it.
    Straight,
    /// Each as soon as it can, independently.
    Soonest,
}

/// The trajectory of all joints.
#[derive(Clone)]
pub(crate) struct Way(pub(crate) Trajectory<MOST_JOINTS>);

impl Way {
    /// Reserves memory for a trajectory with one intermediate configuration.
    pub(crate) fn reserved() -> Self {
        let mut trajectory = Trajectory::new(None);
        trajectory.reserve_sections(2);
        Self(trajectory)
    }

    pub(crate) fn duration_s(&self) -> f64 {
        self.0.duration
    }

    /// The state at a time, s.
    pub(crate) fn at(&self, t_s: f64) -> JointState {
        let mut state = JointState::default();
        self.0
            .state_to_integrate_from(t_s, &mut 0, |i, t, p, v, a, j| {
                let from = JointPoint::new(p, v, a);
                state.set_joint(i, &from.jerked(j, t));
            });
        state
    }
}

/// The planner of [Berscheid and Kröger 2021] from the crate `rsruckig`, with its memory.
#[derive(Clone)]
pub(crate) struct Solver {
    otg: Ruckig<MOST_JOINTS, ThrowErrorHandler>,
    input: InputParameter<MOST_JOINTS>,
}

impl Solver {
    pub(crate) fn new(limits: &MotionLimits) -> Self {
        let mut otg = Ruckig::with_waypoints(None, 1e-3, 1);
        // Refinement takes milliseconds and saves one percent of the duration.
        otg.waypoint_refinement_sweeps = 0;
        let mut input = InputParameter::with_waypoints(None, 1);
        for i in 0..MOST_JOINTS {
            input.max_acceleration[i] = limits.acceleration_rad_per_s2[i];
            input.max_jerk[i] = limits.jerk_rad_per_s3[i];
        }
        input.max_position = Some(DataArrayOrVec::new(None, f64::INFINITY));
        input.min_position = Some(DataArrayOrVec::new(None, f64::NEG_INFINITY));
        Self { otg, input }
    }

    pub(crate) fn set_timing(&mut self, timing: JointTiming) {
        self.input.synchronization = match timing {
            JointTiming::Together => Synchronization::Time,
            JointTiming::Straight => Synchronization::Phase,
            JointTiming::Soonest => Synchronization::None,
        };
    }

    /// Plans a trajectory from a state, within bounds and, if possible, within ranges, rad. Returns whether one was found.
    pub(crate) fn plan(
        &mut self,
        from: &JointState,
        (goal, by_way_of): (&JointPositions, Option<&JointPositions>),
        bounds: &[JointBounds; MOST_JOINTS],
        range_rad: &[[f64; 2]; MOST_JOINTS],
        way: &mut Way,
    ) -> bool {
        let input = &mut self.input;
        input.intermediate_positions.clear();
        if let Some(q) = by_way_of {
            let mut passed = DataArrayOrVec::new(None, 0.0);
            for i in 0..MOST_JOINTS {
                passed[i] = q[i];
            }
            input.intermediate_positions.push(passed);
        }
        for i in 0..MOST_JOINTS {
            let (joint, bounds) = (from.joint(i), &bounds[i]);
            // At the speed limit the solver may misread rounding as excess speed, and stop first.
            let v = bounds.velocity_rad_per_s();
            let coming = joint.coming_velocity_rad_per_s(bounds);
            let is_edge = (coming.abs() - v).abs() < SPEED_EDGE * v;
            input.max_velocity[i] = match is_edge {
                true => v * (1.0 + 2.0 * SPEED_EDGE),
                false => v,
            };
            input.current_position[i] = joint.q_rad;
            input.current_velocity[i] = joint.qd_rad_per_s;
            input.current_acceleration[i] = joint.qdd_rad_per_s2;
            input.target_position[i] = goal[i];
            // Only a joint that can stop inside its limits can stay inside them.
            let [least, most] = range_rad[i];
            let places = [joint.q_rad, joint.stopping_point_rad(bounds)];
            let [least, most] = match places.iter().all(|q| (least..=most).contains(q)) {
                true => [least, most],
                false => [f64::NEG_INFINITY, f64::INFINITY],
            };
            if let Some(position) = input.min_position.as_mut() {
                position[i] = least;
            }
            if let Some(position) = input.max_position.as_mut() {
                position[i] = most;
            }
        }
        // The solver's root finder panics on NaN, which inputs near their limits can cause.
        let (otg, way) = (&mut self.otg, &mut way.0);
        let found = catch_unwind(AssertUnwindSafe(|| otg.calculate(&self.input, way).is_ok()));
        found.unwrap_or(false) && way.duration.is_finite()
    }
}
