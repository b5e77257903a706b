//! Commands within all limits.

use super::Supervisor;
use crate::arm::ArmCommand;
use crate::render::{beyond, distance_and_closing, is_push};
use crate::safety::cycle::{Sent, SupervisorInput};
use crate::safety::limits::braking::Braking;
use crate::safety::state::SafeReason;
use hwall_kinematics::{JointPositions, JointTorques, JointVelocities};

impl Supervisor {
    /// A torque within its limits, relative to the last one sent, and what was cut.
    pub(super) fn limited_torque(
        &self,
        wanted: &JointTorques,
        dt_s: f64,
    ) -> (JointTorques, Option<SafeReason>) {
        let last = match self.sent {
            Sent::Torque(torque) => torque,
            _ => JointTorques::default(),
        };
        self.guard.limited_torque(&last, wanted, dt_s)
    }

    /// The renderer's command within all limits. `retreat`: the speed of a retreat, m/s.
    pub(super) fn limited(
        &mut self,
        input: &SupervisorInput<'_>,
        dt_s: f64,
        retreat: Option<f64>,
    ) -> (ArmCommand, Option<(f64, SafeReason)>) {
        match input.command {
            ArmCommand::Position(wanted) => self.limited_position(input, &wanted, dt_s, retreat),
            ArmCommand::Torque(wanted) => {
                let (torque, cut) = self.limited_torque(&wanted, dt_s);
                let (q, qd) = (&input.state.q, &input.state.qd);
                if let Some(reason) = self.too_near(input.now_s, q, qd, false) {
                    return (ArmCommand::Hold, Some((0.0, reason)));
                }
                let near = self.near(input, q, qd, retreat);
                let slowed = near.or(cut.map(|reason| (1.0, reason)));
                (ArmCommand::Torque(torque), slowed)
            }
            other => (other, None),
        }
    }

    /// Cuts slow the arm down as hard as its joints may, but no harder; the returned share is the allowed one.
    fn limited_position(
        &mut self,
        input: &SupervisorInput<'_>,
        wanted: &JointPositions,
        dt_s: f64,
        retreat: Option<f64>,
    ) -> (ArmCommand, Option<(f64, SafeReason)>) {
        let (wanted, cut) = self.guard.within(wanted);
        let mut slowed = cut.map(|reason| (1.0, reason));
        let state = input.state;
        let last = match (self.braking, self.sent) {
            (Some(braking), Sent::Position(_)) => braking,
            _ => Braking::from_state(&state.q, &state.qd.0, &self.guard.velocity_rad_per_s),
        };
        if dt_s <= 0.0 {
            // No time has passed: repeat the last position.
            self.braking = Some(last);
            return (ArmCommand::Position(*last.sent()), slowed);
        }
        let most = self.guard.acceleration_rad_per_s2;
        let rates = last.rates_rad_per_s(&wanted, &most, dt_s);
        let (mut share, joint_cut) = self.guard.share_of_rates(&rates);
        if let Some(reason) = joint_cut {
            slowed = Some((share, reason));
        }
        let qd = JointVelocities(rates.map(|rate| share * rate));
        if let Some((less, reason)) = self.near(input, last.sent(), &qd, retreat) {
            share *= less;
            slowed = Some((share, reason));
        }
        // A retreat begins at rest, wherever the arm was going.
        let is_cut = share < 1.0 || retreat.is_some();
        let mut next = last.next(&wanted, &rates, is_cut.then_some(share), &most, dt_s);
        // Nothing is safer than braking, so braking is not checked again.
        let (at, qd) = (next.sent(), next.rates());
        if let Some(reason) = self.too_near(input.now_s, at, qd, retreat.is_some()) {
            next = last.next(&wanted, &rates, Some(0.0), &most, dt_s);
            slowed = Some((next.share_of(&rates), reason));
        }
        // While the arm catches up after a cut, the same reason still applies, without a further reduction.
        self.cut_for = match slowed {
            Some((_, reason)) => Some(reason),
            None => self.cut_for.filter(|_| next.sent() != &wanted),
        };
        let slowed = slowed.or(self.cut_for.map(|reason| (1.0, reason)));
        let (sent, _) = self.guard.within(next.sent());
        self.braking = Some(next.sending(sent));
        (ArmCommand::Position(sent), slowed)
    }

    /// What would the arm come too close to before it could stop: itself, the room, head or torso? With `leaves`, the arm may move away from a
    /// person.
    fn too_near(
        &self,
        now_s: f64,
        q: &JointPositions,
        qd: &JointVelocities,
        leaves: bool,
    ) -> Option<SafeReason> {
        let braking = &self.guard.acceleration_rad_per_s2;
        let body = self.separation.body();
        let here = body.at(q);
        if let Some(nearest) = body.meets_from(&here, q, qd, braking) {
            return Some(SafeReason::met(&nearest));
        }
        let gap = (self.separation).gap_from(&here, (q, qd), &self.person, now_s, leaves)?;
        (gap.left_m < 0.0 || gap.left_m.is_nan()).then_some(SafeReason::PersonNear {
            part: gap.part.channel(),
            distance_m: gap.distance_m,
        })
    }

    /// The share of a joint motion that the person's points (and a retreat) allow, and the tightest reason; `None`: all of it.
    fn near(
        &self,
        input: &SupervisorInput<'_>,
        q: &JointPositions,
        qd: &JointVelocities,
        retreat: Option<f64>,
    ) -> Option<(f64, SafeReason)> {
        /// Approach speeds below this are treated as this speed, m/s.
        const SLOWEST_M_PER_S: f64 = 1e-3;
        if input.person.is_empty() && retreat.is_none() {
            return None;
        }
        let (face, jacobian) = self.arm.forward_and_jacobian(q);
        let twist = jacobian.twist(qd);
        let limits = &self.config.person;
        // All joints brake together, no harder than allowed.
        let stop_s = (qd.0.iter().zip(&self.guard.acceleration_rad_per_s2))
            .map(|(qd, most)| qd.abs() / most)
            .fold(0.0, f64::max);
        let mut tightest: Option<(f64, SafeReason)> = None;
        let mut cap = |allowed: f64, speed: f64, reason: SafeReason| {
            let share = allowed / speed.max(SLOWEST_M_PER_S);
            if share < tightest.map_or(1.0, |(share, _)| share) {
                tightest = Some((share, reason));
            }
        };
        for point in input
            .person
            .iter()
            .filter(|point| point.part.is_hand() && point.position_m.is_finite())
        {
            let (distance_m, closing) =
                distance_and_closing(&self.board, &face, &twist, point.position_m);
            let reason = SafeReason::PersonNear {
                part: point.part.channel(),
                distance_m,
            };
            let separation = &limits.separation;
            cap(
                separation.allowed_stopping_m_per_s(distance_m, closing, stop_s),
                closing,
                reason,
            );
            if distance_m <= limits.contact_zone_m {
                cap(self.speed_cap_m_per_s, closing, reason);
            }
        }
        if let (Some(speed), Some(trouble)) = (retreat, self.faults.trouble) {
            let outward = twist.linear_m_per_s.dot(face.rotation().z_axis);
            let reason = trouble.fault.reason;
            let push = (input.state.external_torque).zip(self.push_bias(&trouble.fault));
            let push = push.map(|(torque, bias)| beyond(&torque, &bias));
            let gives_way = push.is_some_and(|push| {
                let power_w: f64 = push.0.iter().zip(&qd.0).map(|(n_m, qd)| n_m * qd).sum();
                is_push(&*self.arm, &push) && power_w > 0.0
            });
            let speed = match gives_way {
                true => self.config.timing.yield_m_per_s,
                false => speed,
            };
            cap(speed, twist.linear_m_per_s.length(), reason);
            // A retreat must not move forward, unless it is pushed there.
            if outward > SLOWEST_M_PER_S && !gives_way {
                cap(0.0, outward, reason);
            }
        }
        tightest
    }
}
