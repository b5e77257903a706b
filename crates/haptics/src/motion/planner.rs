//! Finds goals and paths outside the control step, which has no time for it.

use super::barrier::links::LinkInFront;
use super::barrier::tree::BarrierTree;
use super::goal::Destination;
use super::goals::Goals;
use super::link::{Aim, Answer, Asked, Link};
use super::preposition::Preposition;
use super::route::{ROUNDING_STEPS, Route};
use crate::board::BoardTarget;
use crate::body::Separation;
use crate::error::HapticsError;
use hwall_geometry::Pose;
use hwall_kinematics::{JointPositions, Unreachable};
use hwall_motion::{ReferenceMotion, UnderWay};

/// Shortest time between two plans for a goal that only drifts, s: a plan costs as much as ten steps.
const DRIFT_S: f64 = 0.01;

/// How much a planner does per call, and how far ahead its plans begin.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct PlannerConfig {
    /// Samples after which a call of [`Planner::plan`] checks no further path; default 400, some 0.5 ms. The call still finishes the path that it is
    /// checking: [`Planner::MOST_SAMPLES`] more.
    pub samples: usize,
    /// Steps of the control loop after which a plan begins; default 0, for a planner that is called between two steps. A planner on its own thread
    /// needs as many as planning takes.
    pub lead_steps: u32,
}

impl Default for PlannerConfig {
    fn default() -> Self {
        Self {
            samples: 400,
            lead_steps: 0,
        }
    }
}

impl PlannerConfig {
    /// For a planner on its own thread: a search runs for some 5 ms before it reads the state of the arm again.
    #[must_use]
    pub const fn on_thread() -> Self {
        Self {
            samples: 2000,
            lead_steps: 0,
        }
    }
}

/// Finds goals and paths for a [`Follower`](super::Follower), which asks for them after each of its steps.
///
/// A goal is a configuration that presents the target; the path to it stays behind the surfaces. A plan begins on the current motion, where that will
/// be by then. The follower refuses a plan that comes too late or was made for a motion that has changed since; the next plan then begins later.
#[derive(Debug)]
pub struct Planner {
    link: Link,
    config: PlannerConfig,
    goals: Goals,
    route: Route,
    preposition: Preposition,
    /// A copy of the motion, for trying out paths.
    reference: ReferenceMotion,
    destination: Option<Destination>,
    /// The destination is new, or something else moved the arm.
    is_to_plan: bool,
    /// Has only the destination drifted since the last plan? And the time since then, s.
    has_drifted: bool,
    since_plan_s: f64,
    /// The share of the speeds that the last path was planned with, or could have been since.
    share: f64,
    asked: Asked,
    /// The previous question.
    seen: Asked,
    answer: Answer,
    /// Plans offered so far; whether the last answer was a plan; extra lead steps because plans were refused.
    offered: u64,
    has_moved: bool,
    later_steps: u32,
    knows_surfaces: bool,
    link_in_front: Option<LinkInFront>,
    /// The number that the caller gave the surfaces.
    surfaces: u64,
}

/// Most extra lead steps after refused plans.
const MOST_LATER_STEPS: u32 = 20;

impl Planner {
    /// Most samples that a call checks beyond [`PlannerConfig::samples`].
    pub const MOST_SAMPLES: usize = super::search::SAMPLES_OF_LAST;

    pub(super) fn new(link: Link, goals: Goals, route: Route, reference: ReferenceMotion) -> Self {
        Self {
            link,
            config: PlannerConfig::default(),
            goals,
            route,
            preposition: Preposition::default(),
            reference,
            destination: None,
            is_to_plan: false,
            has_drifted: false,
            since_plan_s: f64::INFINITY,
            share: 1.0,
            asked: Asked::default(),
            seen: Asked::default(),
            answer: Answer::default(),
            offered: 0,
            has_moved: false,
            later_steps: 0,
            knows_surfaces: true,
            link_in_front: None,
            surfaces: 0,
        }
    }

    /// Sets how much a call does.
    pub const fn set_config(&mut self, config: PlannerConfig) {
        self.config = config;
    }

    pub(super) const fn route_mut(&mut self) -> &mut Route {
        &mut self.route
    }

    pub(super) fn keep_clear(&mut self, separation: Separation) {
        self.route.keep_clear(separation);
        // The separation still has to be fitted to the configuration known to be free.
        self.seen.began = None;
    }

    /// Sets surfaces that the board stays behind, besides the one that it serves.
    pub fn set_barriers(&mut self, barriers: impl Into<BarrierTree>) {
        self.move_barriers(barriers, &Pose::IDENTITY);
    }

    /// Sets the surfaces after the world has moved by `moved` in the base frame: places that the board served move with their surfaces. Triggers no
    /// new plan.
    pub fn move_barriers(&mut self, barriers: impl Into<BarrierTree>, moved: &Pose) {
        self.knows_surfaces = true;
        self.route.move_barriers(barriers.into(), moved);
    }

    /// Sets the number of the current surfaces, so that the log shows which surfaces a plan used.
    pub const fn number_surfaces(&mut self, number: u64) {
        self.surfaces = number;
    }

    /// Declares the surfaces unknown.
    pub const fn lose_barriers(&mut self) {
        self.knows_surfaces = false;
    }

    /// Plans for the newest step, within [`PlannerConfig::samples`]; was there one? A longer search continues with the next step.
    pub fn plan(&mut self) -> bool {
        if self.listen().is_none() {
            return false;
        }
        self.work();
        self.tell();
        true
    }

    /// The three parts of [`plan`](Self::plan), for callers that control their timing, such as a replay. First: the number of the newest step, if a
    /// step asks.
    pub fn listen(&mut self) -> Option<u64> {
        let is_asked = self.link.take_asked(&mut self.asked);
        // The last plan must begin or be refused first.
        (is_asked && self.offered <= self.asked.answered).then_some(self.asked.number)
    }

    /// Is this the newest step that asks?
    #[must_use]
    pub fn is_asked_about(&self, step: u64) -> bool {
        self.link.newest() == Some(step)
    }

    /// Second: plans for that step.
    pub fn work(&mut self) {
        let clock_s = self.seen.clock_s;
        let Asked {
            under_way, dt_s, ..
        } = self.asked;
        let is_refused = self.has_moved && under_way.plan() != self.offered;
        let is_late = is_refused && self.seen.counts == self.asked.counts;
        self.later_steps = match is_late {
            true => (2 * self.later_steps + 1).min(MOST_LATER_STEPS),
            false => self.later_steps / 2,
        };
        self.is_to_plan |= is_refused;
        let lead_steps = self.config.lead_steps + self.later_steps;
        self.reference.follow(&under_way, lead_steps, dt_s);
        let begins = self.reference.under_way();
        if self.asked.began != self.seen.began
            && let Some(q) = &self.asked.began
        {
            self.route.fit(q);
        }
        self.route
            .begin_step(self.config.samples, &self.asked.person);
        self.forget();
        if self.asked.goes {
            let aimed = self.aim();
            // `set_target` has already returned this error.
            self.answer.unreachable = aimed.unwrap_or(None);
            self.find_way(self.asked.clock_s - clock_s);
        }
        self.answer(&begins);
    }

    /// Third: sends the answer to the follower.
    pub fn tell(&mut self) {
        self.link.answer(&mut self.answer);
    }

    /// Handles what has happened to the motion since the last call.
    fn forget(&mut self) {
        let (asked, seen) = (self.asked.counts, self.seen.counts);
        if asked.forgets != seen.forgets {
            let face = (self.goals.solver.arm()).forward(&self.reference.state().q);
            self.route.restart(self.goals.goal(), &face);
            self.goals.forget();
            self.destination = None;
        }
        if (asked.stops, asked.slides) != (seen.stops, seen.slides) {
            // Before the search could continue, the board would be elsewhere.
            self.route.end_search();
        }
        self.is_to_plan |= asked.slides != seen.slides;
        self.seen = self.asked;
    }

    /// Finds the destination.
    fn aim(&mut self) -> Result<Option<Unreachable>, HapticsError> {
        self.answer.target = None;
        match self.asked.aim {
            Aim::Nowhere => Ok(None),
            Aim::Target(target) => {
                self.answer.target = Some(target);
                self.aim_at(&target)
            }
            Aim::Posture { q, prepositions_to } => {
                let (route, arm) = (&self.route, self.goals.solver.arm());
                let protrusion_m = |q: &JointPositions| route.protrusion_m(&arm.forward(q), None);
                let q = match prepositions_to {
                    Some(to) => self.preposition.towards(&q, &to, protrusion_m),
                    None => q,
                };
                if !matches!(self.destination, Some(Destination::Posture(last)) if last == q) {
                    if let Some(goal) = self.goals.goal().copied() {
                        let here = arm.forward(&self.reference.state().q);
                        self.route.leave(&goal, &here);
                    }
                    self.goals.forget();
                    self.destination = Some(Destination::Posture(q));
                    self.is_to_plan = true;
                }
                Ok(None)
            }
        }
    }

    fn aim_at(&mut self, target: &BoardTarget) -> Result<Option<Unreachable>, HapticsError> {
        let before = self.goals.goal().copied();
        let here = self.reference.state().q;
        let verdict = self.goals.set(target, &self.reference)?;
        if let Some(goal) = self.goals.goal() {
            let is_new = match self.destination {
                Some(Destination::Goal(last)) => last != *goal,
                _ => true,
            };
            if is_new {
                let drifted = before.is_some_and(|before| before.is_beside(goal))
                    && matches!(self.destination, Some(Destination::Goal(_)));
                if let Some(before) = before.filter(|_| !drifted) {
                    let face = self.goals.solver.arm().forward(&here);
                    self.route.leave(&before, &face);
                }
                self.route.set_goal(goal);
                self.destination = Some(Destination::Goal(*goal));
                self.has_drifted = true;
                self.is_to_plan |= !drifted;
            }
        }
        Ok(verdict)
    }

    /// Continues the search for a path, or begins one.
    fn find_way(&mut self, elapsed_s: f64) {
        let Some(destination) = &self.destination else {
            return;
        };
        let reference = &mut self.reference;
        // If more speed is allowed than the motion was planned with, plan again.
        let share = reference.speed_share();
        self.is_to_plan |= share > self.share && share > reference.planned_share();
        self.share = share;
        let is_bent = reference.by_way_of().is_some();
        let due = self.route.is_retry_due(elapsed_s, is_bent);
        let stands = reference.goal().is_none() && !self.route.is_blocked();
        self.since_plan_s += elapsed_s;
        let is_due = self.since_plan_s + ROUNDING_STEPS * elapsed_s >= DRIFT_S;
        let drifted = self.has_drifted && is_due;
        // Restarting the search with every drift and change of speed might never end; a search for another place is useless.
        let goes_on = self.route.is_searching_for(destination);
        let is_obsolete = self.route.is_searching() && !goes_on;
        let is_new = self.is_to_plan || stands || drifted || is_obsolete;
        let solver = &mut self.goals.solver;
        let planned = if goes_on {
            self.route.search_on(reference, solver)
        } else if is_new || due {
            (self.is_to_plan, self.has_drifted, self.since_plan_s) = (false, false, 0.0);
            self.route.head_for(destination, is_new, reference, solver)
        } else {
            Ok(())
        };
        if planned.is_err() {
            // No motion was found: the current one ends, and there may be a path from further on.
            self.route.block();
        }
    }

    fn answer(&mut self, begins: &UnderWay) {
        let answer = &mut self.answer;
        self.has_moved = self.reference.is_begun();
        answer.moves = self.has_moved;
        if self.has_moved {
            self.offered += 1;
            self.reference
                .offer(begins, self.offered, &mut answer.motion);
        }
        (answer.to, answer.counts) = (self.asked.number, self.asked.counts);
        answer.destination = self.destination.map(|destination| *destination.q());
        answer.is_blocked = self.route.is_blocked();
        answer.is_detour = self.route.is_detour();
        answer.is_searching_anew = self.route.is_searching_anew();
        answer.knows_surfaces = self.knows_surfaces;
        let face = self.goals.solver.arm().forward(&begins.state().q);
        answer.protrusion_m = self.route.protrusion_m(&face, self.goals.goal());
        answer.surfaces = self.surfaces;
        (answer.samples, answer.tests) = (self.route.samples(), self.route.tests());
        let q = &begins.state().q;
        self.link_in_front = (self.route).link_in_front(self.link_in_front, q, self.goals.goal());
        answer.link_in_front = self.link_in_front;
    }
}
