//! The optimum for each touch, and the cause of a miss.
//!
//! Uses only the ground truth about the person, the log of the run and the limits of the arm, by
//! [`LeastTime`]; nothing of the code that steers the board.

use crate::person::touches::Touch;
use crate::run::evaluation::courses::{self, Detours};
use crate::run::evaluation::judge::Outcome;
use crate::run::evaluation::least_time::{LeastTime, Quickest};
use crate::run::logs::log::Run;
use crate::run::logs::tick::{Led, Stop, Tick};
use anyhow::Context;
use hwall_haptics::{PlaceTolerance, board_pose};
use hwall_kinematics::JointPositions;
use hwall_scene::Scene;

/// Time from the landing of the gaze (or the start of the hand) until the target can be known, s.
pub const NOTICE_S: f64 = 0.1;

named! {
    /// Why the board was not in place.
    pub enum Miss {
        /// The arm cannot hold the board there.
        Unreachable = "unreachable",
        /// Impossible for any policy: from the instant at which the target could be known, the least time from the waiting
        /// posture exceeds the time left until the contact.
        Impossible = "impossible",
        /// At the contact the board was led to another surface, or to a place from which it does not cover the touched
        /// point.
        PredictionWrong = "prediction_wrong",
        /// The board was led to the right place without a break until the contact, but less than the least time before it, both
        /// from the waiting posture and from the arm's posture then.
        PredictionLate = "prediction_late",
        /// The board was led to the right place early enough, but dispatched there too late: it waited, had another goal, or had
        /// been sent too far away to return in time.
        Policy = "policy",
        /// A suitable configuration was the goal early enough, but the motion took longer than the least time.
        Arm = "arm",
    }
}

/// The optimum for one touch. Least times are from rest to rest, without the delay of the arm.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Regret {
    /// When the target could be known, s: [`NOTICE_S`] after the gaze lands on it, or, if it never does, after the
    /// hand starts to move.
    pub known_s: f64,
    /// Available time from `known_s` to the contact, less the delay of the arm, s.
    pub budget_s: f64,
    /// Least time from the waiting posture, s; `None` if there is no motion.
    pub from_waiting_s: Option<f64>,
    /// Least time from the arm's posture at `known_s`, as if it were at rest there, s.
    pub from_there_s: Option<f64>,
    /// Could the board have been there in time? Depends only on the person, the arm and its waiting posture.
    pub possible: bool,
    /// Why the board was not in place; `None` if it was.
    pub miss: Option<Miss>,
    /// The last stop of the arm between `known_s` and the contact, for a missed touch.
    pub stopped_by: Option<Stop>,
    /// Time before the contact from which the board was continuously led to the right place, s; `None`: not at the contact.
    pub foreseen_s: Option<f64>,
    /// Reversals and false dispatches.
    pub detours: Detours,
}

/// Computes the regret of touches.
pub struct Regrets<'a> {
    /// Least times of the arm.
    pub least: &'a LeastTime<'a>,
    /// The scene.
    pub scene: &'a Scene,
    /// The waiting posture, rad.
    pub waiting: JointPositions,
    /// From a command to its first effect, s.
    pub delay_s: f64,
}

/// Goals with a larger joint difference are not the same goal, rad.
const SAME_GOAL_RAD: f64 = 0.3;

impl Regrets<'_> {
    /// One for each outcome, in order of time.
    ///
    /// # Errors
    /// A touch before the run began, or with a normal that has no direction.
    pub fn of_run(&self, log: &Run, outcomes: &[Outcome]) -> anyhow::Result<Vec<Regret>> {
        let touched: Vec<&Touch> = outcomes.iter().map(|outcome| &outcome.touch).collect();
        let courses = courses::courses(&log.sent, &log.ticks, self.least.arm().board());
        let detours = courses::detours(&courses, &touched);
        let mut since_s = f64::NEG_INFINITY;
        outcomes
            .iter()
            .zip(detours)
            .map(|(outcome, detours)| {
                let regret = self.of_touch(log, outcome, since_s, detours);
                since_s = outcome.touch.end_s;
                regret
            })
            .collect()
    }

    fn of_touch(
        &self,
        log: &Run,
        outcome: &Outcome,
        since_s: f64,
        detours: Detours,
    ) -> anyhow::Result<Regret> {
        let touch = &outcome.touch;
        let known_s = touch.landed_s.unwrap_or(touch.start_s) + NOTICE_S;
        let budget_s = touch.contact_s - known_s - self.delay_s;
        let foreseen_s = self.foreseen_s(&log.led, touch, since_s)?;
        // The arm's posture when the target could be known, and when it was predicted.
        let there = at(&log.ticks, known_s)?.q;
        let told = at(&log.ticks, touch.contact_s - foreseen_s.unwrap_or(0.0))?.q;
        let starts = [self.waiting, there, told];
        let [waiting, there, told] = if outcome.unreachable.is_some() {
            [None; 3]
        } else {
            let ways = self.least.to_touch(touch.point_m, touch.normal, &starts)?;
            ways.map(|way: Option<Quickest>| way.map(|way| way.time_s))
        };
        let fits = |way: Option<f64>, left_s: f64| way.is_some_and(|time_s| time_s <= left_s);
        let possible = outcome.unreachable.is_none() && fits(waiting, budget_s);
        let miss = match foreseen_s.map(|foreseen_s| foreseen_s - self.delay_s) {
            _ if outcome.in_place() => None,
            _ if outcome.unreachable.is_some() => Some(Miss::Unreachable),
            _ if !possible => Some(Miss::Impossible),
            None => Some(Miss::PredictionWrong),
            Some(left_s) if !fits(waiting, left_s) && !fits(told, left_s) => {
                Some(Miss::PredictionLate)
            }
            Some(_) if self.sent_in_time(log, touch)? => Some(Miss::Arm),
            Some(_) => Some(Miss::Policy),
        };
        Ok(Regret {
            known_s,
            budget_s,
            from_waiting_s: waiting,
            from_there_s: there,
            possible,
            miss,
            stopped_by: miss.and_then(|_| stop_of(&log.ticks, known_s, touch.contact_s)),
            foreseen_s,
            detours,
        })
    }

    /// Time before the contact from which the led place was on the touched surface, and so near that a board with its middle
    /// there covers the touched point.
    fn foreseen_s(&self, led: &[Led], touch: &Touch, since_s: f64) -> anyhow::Result<Option<f64>> {
        let upright = board_pose(touch.point_m, touch.normal, 0.0)?;
        let [x_m, y_m] = self.least.slack_m();
        let right = |led: &&Led| {
            led.place.is_some_and(|place| {
                let off_m = upright.inverse_transform_point(place.point_m);
                self.scene.surface(place.surface).name == touch.surface
                    && off_m.x.abs() <= x_m
                    && off_m.y.abs() <= y_m
            })
        };
        let from = led.partition_point(|led| led.t_s <= since_s);
        let until = led.partition_point(|led| led.t_s <= touch.contact_s);
        let before = led[from.min(until)..until].iter().rev();
        let first = before.take_while(right).last();
        Ok(first.map(|led| touch.contact_s - led.t_s))
    }

    /// Does the goal in force at the contact serve the touch, and was it set early enough for the least
    /// time of the motion to it?
    fn sent_in_time(&self, log: &Run, touch: &Touch) -> anyhow::Result<bool> {
        let place = PlaceTolerance::default();
        let serves = |goal: &JointPositions| {
            let arm = self.least.arm();
            let pose = arm.kinematics().forward(goal);
            place.holds(arm.board(), &pose, touch.point_m, touch.normal)
        };
        let until = log.sent.partition_point(|sent| sent.t_s <= touch.contact_s);
        let Some(last) = log.sent[..until].last().and_then(|sent| sent.goal) else {
            return Ok(false);
        };
        let same =
            |goal: &JointPositions| serves(goal) && goal.max_abs_difference(&last) <= SAME_GOAL_RAD;
        let before = log.sent[..until].iter().rev();
        let goals = before.map_while(|sent| Some((sent.t_s, sent.goal.filter(same)?)));
        let Some((sent_s, goal)) = goals.last() else {
            return Ok(false);
        };
        let from = at(&log.ticks, sent_s)?.q;
        let needed_s = self.least.limits().travel_time_s(&from, &goal) + self.delay_s;
        Ok(needed_s <= touch.contact_s - sent_s)
    }
}

/// The last stop of the arm in an interval.
fn stop_of(ticks: &[Tick], from_s: f64, until_s: f64) -> Option<Stop> {
    let until = ticks.partition_point(|tick| tick.t_s <= until_s);
    let before = ticks[..until].iter().rev();
    let mut since = before.take_while(|tick| tick.t_s >= from_s);
    since.find_map(|tick| tick.stop)
}

/// The last step not later than `t_s`; the first step for earlier times.
fn at(ticks: &[Tick], t_s: f64) -> anyhow::Result<&Tick> {
    let after = ticks.partition_point(|tick| tick.t_s <= t_s);
    ticks
        .get(after.saturating_sub(1))
        .context("a run without a step")
}

#[cfg(test)]
mod tests;
