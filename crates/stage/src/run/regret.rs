//! What was possible at each touch, and whose fault a miss is.
//!
//! Everything follows from the truth about the person, the log of the run and the limits of the arm, by
//! [`LeastTime`]; nothing from what steers the board.

use crate::person::touches::Touch;
use crate::run::courses::{self, Detours, Sent, TouchedPlace, WallPlace};
use crate::run::judge::Outcome;
use crate::run::least_time::{LeastTime, Quickest};
use crate::run::tick::{Led, Tick};
use anyhow::Context;
use hwall_haptics::{Board, PlaceTolerance, board_pose};
use hwall_kinematics::{ArmKinematics, JointPositions};
use hwall_scene::Scene;

/// From the landing of the gaze, or from the start of a hand without one, until the target can be known, s.
pub const NOTICE_S: f64 = 0.1;

/// Why the board was not in place.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub enum Miss {
    /// The arm cannot hold the board there.
    Unreachable,
    /// Nobody could have been in time: from the instant at which the target could be known, the least time from the waiting
    /// posture is longer than what was left until the contact.
    Impossible,
    /// At the contact the board was led to another surface, or to a place from which the board does not cover the touched
    /// point.
    PredictionWrong,
    /// The board was led to the right place without a break until the contact, but only since the least time was over: too late
    /// from the waiting posture, and from where the arm stood.
    PredictionLate,
    /// The board was led to the right place early enough, but not sent there early enough: it waited, had another goal, or had
    /// been sent away so far before that it could no longer come back.
    Policy,
    /// A configuration that serves the touch was the goal early enough, but the way to it took longer than the least time.
    Arm,
}

impl Miss {
    /// In the order of the enumeration.
    pub const ALL: [Self; 6] = [
        Self::Unreachable,
        Self::Impossible,
        Self::PredictionWrong,
        Self::PredictionLate,
        Self::Policy,
        Self::Arm,
    ];

    /// For tables and files.
    #[must_use]
    pub const fn name(self) -> &'static str {
        match self {
            Self::Unreachable => "unreachable",
            Self::Impossible => "impossible",
            Self::PredictionWrong => "prediction_wrong",
            Self::PredictionLate => "prediction_late",
            Self::Policy => "policy",
            Self::Arm => "arm",
        }
    }
}

/// What was possible at one touch. Least times are from rest to rest, without the delay of the arm.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Regret {
    /// When the target could be known, s: [`NOTICE_S`] after the gaze has landed on it, or, where it never does, after the
    /// hand has started.
    pub known_s: f64,
    /// What was left of the time then until the contact, less the delay of the arm, s.
    pub budget_s: f64,
    /// Least time from the waiting posture, s; `None` if there is no way.
    pub from_waiting_s: Option<f64>,
    /// Least time from where the arm stood when the target could be known, as if it stood still there, s.
    pub from_there_s: Option<f64>,
    /// Could the board have been there in time? Depends on the person, the arm and its waiting posture alone.
    pub possible: bool,
    /// Why the board was not in place; `None` if it was.
    pub miss: Option<Miss>,
    /// How long before the contact the board was led to the right place without a break, s; `None`: not at the contact.
    pub foreseen_s: Option<f64>,
    /// Boards that turned back or went in vain.
    pub detours: Detours,
}

/// What a run left behind, in order of time.
#[derive(Debug, Clone, Copy)]
pub struct RunLog<'a> {
    /// One entry for each control step.
    pub ticks: &'a [Tick],
    /// Where the board was led, frame by frame.
    pub led: &'a [Led],
    /// Where it was sent, change by change.
    pub sent: &'a [Sent],
}

/// Works out what was possible.
pub struct Regrets<'a> {
    /// Least times of the arm.
    pub least: &'a LeastTime<'a>,
    /// The arm, with the face of the board as its tool.
    pub arm: &'a dyn ArmKinematics,
    /// The board.
    pub board: &'a Board,
    /// What is touched.
    pub scene: &'a Scene,
    /// Where the arm waits, rad.
    pub waiting: JointPositions,
    /// From a command to its first effect, s.
    pub delay_s: f64,
}

/// A goal that was replaced by another turn of the arm, with joints further away than this, is not the same goal, rad.
const SAME_GOAL_RAD: f64 = 0.3;

impl Regrets<'_> {
    /// One for each outcome, in order of time.
    ///
    /// # Errors
    /// A touch before the run began, or with a normal that has no direction.
    pub fn of_run(&self, log: &RunLog<'_>, outcomes: &[Outcome]) -> anyhow::Result<Vec<Regret>> {
        let touched: Vec<TouchedPlace> = outcomes
            .iter()
            .map(|Outcome { touch, .. }| TouchedPlace {
                place: place(touch),
                contact_s: touch.contact_s,
                end_s: touch.end_s,
            })
            .collect();
        let courses = courses::courses(log.sent, log.ticks, self.board);
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
        log: &RunLog<'_>,
        outcome: &Outcome,
        since_s: f64,
        detours: Detours,
    ) -> anyhow::Result<Regret> {
        let touch = &outcome.touch;
        let known_s = touch.landed_s.unwrap_or(touch.start_s) + NOTICE_S;
        let budget_s = touch.contact_s - known_s - self.delay_s;
        let foreseen_s = self.foreseen_s(log.led, touch, since_s)?;
        // Where the arm stood when the target could be known, and when it was known.
        let there = at(log.ticks, known_s)?.q;
        let told = at(log.ticks, touch.contact_s - foreseen_s.unwrap_or(0.0))?.q;
        let starts = [self.waiting, there, told];
        let [waiting, there, told] = if outcome.unreachable.is_some() {
            [None; 3]
        } else {
            let ways = self.least.to_touch(touch.point_m, touch.normal, &starts)?;
            ways.map(|way: Option<Quickest>| way.map(|way| way.time_s))
        };
        let fits = |way: Option<f64>, left_s: f64| way.is_some_and(|time_s| time_s <= left_s);
        let possible = outcome.unreachable.is_none() && fits(waiting, budget_s);
        let miss = if outcome.in_place() {
            None
        } else if outcome.unreachable.is_some() {
            Some(Miss::Unreachable)
        } else if !possible {
            Some(Miss::Impossible)
        } else {
            Some(match foreseen_s {
                None => Miss::PredictionWrong,
                Some(foreseen_s) => {
                    let left_s = foreseen_s - self.delay_s;
                    if !fits(waiting, left_s) && !fits(told, left_s) {
                        Miss::PredictionLate
                    } else if self.sent_in_time(log, touch)? {
                        Miss::Arm
                    } else {
                        Miss::Policy
                    }
                }
            })
        };
        Ok(Regret {
            known_s,
            budget_s,
            from_waiting_s: waiting,
            from_there_s: there,
            possible,
            miss,
            foreseen_s,
            detours,
        })
    }

    /// How long before the contact the led place was on the touched surface, and so near that a board whose middle is
    /// there holds the touched point.
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

    /// Was the goal in force at the contact one that serves the touch, and did it become the goal early enough for the least
    /// time of the way to it?
    fn sent_in_time(&self, log: &RunLog<'_>, touch: &Touch) -> anyhow::Result<bool> {
        let place = PlaceTolerance::default();
        let serves = |goal: &JointPositions| {
            let pose = self.arm.forward(goal);
            place.holds(self.board, &pose, touch.point_m, touch.normal)
        };
        let until = log.sent.partition_point(|sent| sent.t_s <= touch.contact_s);
        let Some(last) = log.sent[..until].last().and_then(|sent| sent.goal) else {
            return Ok(false);
        };
        let same = |sent: &&Sent| {
            sent.goal.is_some_and(|goal| {
                serves(&goal) && goal.max_abs_difference(&last) <= SAME_GOAL_RAD
            })
        };
        let Some(first) = log.sent[..until].iter().rev().take_while(same).last() else {
            return Ok(false);
        };
        let Some(goal) = first.goal else {
            return Ok(false);
        };
        let from = at(log.ticks, first.t_s)?.q;
        let needed_s = self.least.limits().travel_time_s(&from, &goal) + self.delay_s;
        Ok(needed_s <= touch.contact_s - first.t_s)
    }
}

fn place(touch: &Touch) -> WallPlace {
    WallPlace {
        point_m: touch.point_m,
        normal: touch.normal,
    }
}

/// The last step not later than this; the first one for what was before.
fn at(ticks: &[Tick], t_s: f64) -> anyhow::Result<&Tick> {
    let after = ticks.partition_point(|tick| tick.t_s <= t_s);
    ticks
        .get(after.saturating_sub(1))
        .context("a run without a step")
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::input::arms::BoardArm;
    use crate::person::predictors::SurfacePlace;
    use crate::setting::load_scene;
    use glam::DVec3;
    use hwall_kinematics::Unreachable;
    use hwall_motion::{MotionConfig, MotionLimits};
    use hwall_scene::SurfaceId;

    /// A touch of the front wall at 2 s, within reach, about 0.59 s from the waiting posture.
    const POINT_M: DVec3 = DVec3::new(0.62, -0.29, 0.8856);
    const CONTACT_S: f64 = 2.0;
    const DELAY_S: f64 = 0.022;

    struct Planted {
        arm: BoardArm,
        board: Board,
        scene: Scene,
    }

    impl Planted {
        fn new() -> Self {
            let board = Board::default();
            Self {
                arm: BoardArm::named("iiwa7", &board).unwrap(),
                board,
                scene: load_scene(None).unwrap().0,
            }
        }

        fn surface(&self, name: &str) -> SurfaceId {
            let surfaces = self.scene.surfaces();
            SurfaceId(surfaces.iter().position(|s| s.name == name).unwrap())
        }

        fn least(&self) -> LeastTime<'_> {
            let limits = MotionConfig::default();
            let limits = MotionLimits::of_arm(&**self.arm.kinematics(), &limits).unwrap();
            LeastTime::new(&self.arm, &self.board, &PlaceTolerance::default(), limits).unwrap()
        }

        fn regret(&self, story: &Story) -> Regret {
            let least = self.least();
            let regrets = Regrets {
                least: &least,
                arm: &**self.arm.kinematics(),
                board: &self.board,
                scene: &self.scene,
                waiting: self.arm.waiting(),
                delay_s: DELAY_S,
            };
            let ticks: Vec<Tick> = (0..300)
                .map(|i| {
                    let t_s = 0.01 * f64::from(i);
                    let q = (story.q)(t_s);
                    Tick {
                        t_s,
                        base_from_board: self.arm.kinematics().forward(&q),
                        q,
                        in_contact: false,
                    }
                })
                .collect();
            let led: Vec<Led> = (0..270)
                .map(|i| {
                    let t_s = f64::from(i) / 90.0;
                    Led {
                        t_s,
                        place: (story.led)(t_s),
                    }
                })
                .collect();
            let mut outcome = Outcome {
                touch: Touch {
                    surface: "front_wall".to_owned(),
                    point_m: POINT_M,
                    normal: DVec3::X,
                    start_s: story.start_s,
                    contact_s: CONTACT_S,
                    end_s: 2.5,
                    landed_s: story.landed_s,
                },
                unreachable: None,
                lead_s: story.in_place.then_some(0.1),
                offset_m: 0.0,
                gap_m: 0.0,
                tilt_rad: 0.0,
                felt_after_s: None,
            };
            if story.out_of_reach {
                outcome.unreachable = Some(Unreachable::TooFar { gap_m: 0.1 });
            }
            let log = RunLog {
                ticks: &ticks,
                led: &led,
                sent: &story.sent,
            };
            regrets.of_run(&log, &[outcome]).unwrap()[0]
        }
    }

    /// What happened, planted.
    struct Story {
        landed_s: Option<f64>,
        start_s: f64,
        in_place: bool,
        out_of_reach: bool,
        q: Box<dyn Fn(f64) -> JointPositions>,
        led: Box<dyn Fn(f64) -> Option<SurfacePlace>>,
        sent: Vec<Sent>,
    }

    /// The gaze lands at 1 s, the board is led to the touch from 1.1 s on, and never moves.
    fn story(planted: &Planted) -> Story {
        let (waiting, surface) = (planted.arm.waiting(), planted.surface("front_wall"));
        Story {
            landed_s: Some(1.0),
            start_s: 1.4,
            in_place: false,
            out_of_reach: false,
            q: Box::new(move |_| waiting),
            led: Box::new(move |t_s| {
                (t_s >= 1.1).then_some(SurfacePlace {
                    surface,
                    point_m: POINT_M + DVec3::new(0.0, 0.07, -0.07),
                })
            }),
            sent: Vec::new(),
        }
    }

    fn sent(t_s: f64, goal: Option<JointPositions>) -> Sent {
        Sent {
            t_s,
            target: None,
            goal,
        }
    }

    #[test]
    fn what_was_possible_depends_on_gaze_and_waiting_posture_alone() {
        let planted = Planted::new();
        let regret = planted.regret(&story(&planted));
        assert!((regret.known_s - 1.1).abs() < 1e-12);
        assert!((regret.budget_s - (0.9 - DELAY_S)).abs() < 1e-12);
        let from_waiting_s = regret.from_waiting_s.unwrap();
        assert!((0.4..0.7).contains(&from_waiting_s) && regret.possible);
        // Just in time, and just too late.
        for (spare_s, possible) in [(0.005, true), (-0.005, false)] {
            let landed_s = CONTACT_S - NOTICE_S - DELAY_S - from_waiting_s - spare_s;
            let mut story = story(&planted);
            story.landed_s = Some(landed_s);
            let regret = planted.regret(&story);
            assert_eq!(regret.possible, possible);
            assert_eq!(regret.miss == Some(Miss::Impossible), !possible);
            // Wherever the policy has taken the arm.
            let there = planted.arm.start();
            story.q = Box::new(move |_| there);
            assert_eq!(planted.regret(&story).possible, possible);
        }
        // A gaze that never lands: the hand tells, once it moves.
        for (start_s, possible) in [(1.0, true), (1.7, false)] {
            let mut story = story(&planted);
            (story.landed_s, story.start_s) = (None, start_s);
            let regret = planted.regret(&story);
            assert!((regret.known_s - start_s - NOTICE_S).abs() < 1e-12);
            assert_eq!(regret.possible, possible);
        }
        let mut story = story(&planted);
        story.out_of_reach = true;
        let regret = planted.regret(&story);
        assert_eq!(
            (regret.possible, regret.miss),
            (false, Some(Miss::Unreachable))
        );
        assert_eq!(regret.from_waiting_s, None);
    }

    #[test]
    fn a_board_in_place_is_no_miss_even_if_it_was_impossible() {
        let planted = Planted::new();
        let mut story = story(&planted);
        (story.in_place, story.landed_s) = (true, Some(1.9));
        let regret = planted.regret(&story);
        assert_eq!((regret.possible, regret.miss), (false, None));
    }

    #[test]
    fn a_prediction_that_is_wrong_at_the_contact_or_right_too_late_is_named() {
        let planted = Planted::new();
        let right = planted.surface("front_wall");
        let led = |surface: SurfaceId, off_m: DVec3, from_s: f64, until_s: f64| {
            let mut story = story(&planted);
            story.led = Box::new(move |t_s| {
                let place = SurfacePlace {
                    surface,
                    point_m: POINT_M + off_m,
                };
                (from_s..until_s).contains(&t_s).then_some(place)
            });
            planted.regret(&story)
        };
        let zero = DVec3::ZERO;
        let wrong = [
            led(planted.surface("door"), zero, 0.0, 3.0),
            // The touched point would lie beyond the edge of the board.
            led(right, DVec3::Y * 0.09, 0.0, 3.0),
            led(right, DVec3::Z * 0.09, 0.0, 3.0),
            // Right for long, and then no longer.
            led(right, zero, 0.0, 1.95),
        ];
        for regret in wrong {
            assert_eq!(regret.miss, Some(Miss::PredictionWrong));
            assert_eq!(regret.foreseen_s, None);
        }
        let late = led(right, zero, 1.8, 3.0);
        assert_eq!(late.miss, Some(Miss::PredictionLate));
        assert!((late.foreseen_s.unwrap() - 0.2).abs() < 1.0 / 90.0);
    }

    #[test]
    fn an_arm_that_stood_near_could_have_used_a_late_prediction() {
        let planted = Planted::new();
        let least = planted.least();
        let waiting = planted.arm.waiting();
        let ways = least.to_touch(POINT_M, DVec3::X, &[waiting]).unwrap();
        let near = ways[0].unwrap().q;
        let surface = planted.surface("front_wall");
        let mut late = story(&planted);
        late.led = Box::new(move |t_s| {
            (t_s >= 1.8).then_some(SurfacePlace {
                surface,
                point_m: POINT_M,
            })
        });
        assert_eq!(planted.regret(&late).miss, Some(Miss::PredictionLate));
        late.q = Box::new(move |_| near);
        assert_eq!(planted.regret(&late).miss, Some(Miss::Policy));
    }

    #[test]
    fn the_policy_is_blamed_for_what_it_did_not_order_and_the_arm_for_what_it_did_not_do() {
        let planted = Planted::new();
        let least = planted.least();
        let waiting = planted.arm.waiting();
        let ways = least.to_touch(POINT_M, DVec3::X, &[waiting]).unwrap();
        let (goal, time_s) = (ways[0].unwrap().q, ways[0].unwrap().time_s);
        let latest_s = CONTACT_S - DELAY_S - time_s;
        let told = |orders: Vec<Sent>| {
            let mut story = story(&planted);
            story.sent = orders;
            planted.regret(&story).miss
        };
        assert_eq!(told(vec![]), Some(Miss::Policy));
        assert_eq!(told(vec![sent(0.0, Some(waiting))]), Some(Miss::Policy));
        assert_eq!(
            told(vec![sent(latest_s - 0.02, Some(goal))]),
            Some(Miss::Arm)
        );
        let late = sent(latest_s + 0.02, Some(goal));
        assert_eq!(told(vec![late]), Some(Miss::Policy));
        // In time, but withdrawn for a while.
        let between = vec![
            sent(latest_s - 0.1, Some(goal)),
            sent(latest_s - 0.05, Some(waiting)),
            late,
        ];
        assert_eq!(told(between), Some(Miss::Policy));
        let gone = vec![sent(latest_s - 0.02, Some(goal)), sent(1.99, None)];
        assert_eq!(told(gone), Some(Miss::Policy));
    }

    #[test]
    fn names_are_those_of_the_files() {
        let names = Miss::ALL.map(Miss::name);
        let listed = [
            "unreachable",
            "impossible",
            "prediction_wrong",
            "prediction_late",
            "policy",
            "arm",
        ];
        assert_eq!(names, listed);
    }
}
