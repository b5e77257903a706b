//! Dispatches of the board during a run, with its reversals and false dispatches.

use crate::person::touches::Touch;
use crate::run::logs::tick::Tick;
use hwall::reachability::Target;
use hwall_haptics::{Board, PlaceTolerance};
use hwall_kinematics::JointPositions;
use std::f64::consts::SQRT_2;

/// A command to the board, from a time on.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Sent {
    /// Time of the command, s.
    pub t_s: f64,
    /// The target on a wall; `None` while the board waits or holds.
    pub target: Option<Target>,
    /// The goal configuration, rad.
    pub goal: Option<JointPositions>,
}

/// Targets on one wall within this distance count as the same, m: half of the board.
const SAME_M: f64 = 0.1;
/// Walls count as the same if their normals differ by less, rad, ...
const SAME_RAD: f64 = 0.2;
/// ... and the target is this close to the plane, m.
const SAME_PLANE_M: f64 = 0.05;

/// Are two places on a wall at most this far apart, m?
fn are_within(distance_m: f64, a: &Target, b: &Target) -> bool {
    let between_m = b.point_m - a.point_m;
    between_m.length() <= distance_m
        && between_m.dot(a.normal).abs() <= SAME_PLANE_M
        && a.normal.angle_between(b.normal) <= SAME_RAD
}

/// Are the two targets less than half of the board apart?
fn are_near(a: &Target, b: &Target) -> bool {
    are_within(SAME_M, a, b)
}

/// Can a board with its middle at a place cover another place, at some roll?
fn holds(place: &Target, other: &Target) -> bool {
    are_within(SAME_M * SQRT_2, place, other)
}

/// A dispatch to a place on a wall: from the first target there until a target elsewhere or none.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Course {
    /// The first target of the course.
    pub place: Target,
    /// Start, s.
    pub from_s: f64,
    /// End, s; infinite for the last of a run.
    pub until_s: f64,
    /// Did the board move by at least 20 mm?
    pub moved: bool,
    /// Was the board still moving, not in place, when the course ended?
    pub cut_short: bool,
}

/// Least motion of the board on a course that counts as a dispatch, m.
const SENT_M: f64 = 0.02;
/// Below this speed the board counts as at rest, m/s.
const STANDING_M_PER_S: f64 = 0.02;

/// The courses of a run, in order of time.
#[must_use]
pub fn courses(sent: &[Sent], ticks: &[Tick], board: &Board) -> Vec<Course> {
    let mut courses: Vec<Course> = Vec::new();
    let mut under_way: Option<(Target, f64)> = None;
    let mut end = |place: Target, from_s: f64, until_s: f64| {
        courses.push(course(place, from_s, until_s, ticks, board));
    };
    for change in sent {
        let goes_on = matches!(
            (&under_way, &change.target),
            (Some((place, _)), Some(target)) if are_near(place, target)
        );
        if goes_on {
            continue;
        }
        if let Some((place, from_s)) = under_way.take() {
            end(place, from_s, change.t_s);
        }
        under_way = change.target.map(|place| (place, change.t_s));
    }
    if let Some((place, from_s)) = under_way {
        end(place, from_s, f64::INFINITY);
    }
    courses
}

fn course(place: Target, from_s: f64, until_s: f64, ticks: &[Tick], board: &Board) -> Course {
    let first = ticks.partition_point(|tick| tick.t_s < from_s);
    let last = ticks.partition_point(|tick| tick.t_s < until_s).max(first);
    let during = &ticks[first..last];
    let at_m = |tick: &Tick| tick.base_from_board.position_m();
    let moved = during.first().is_some_and(|start| {
        let from_m = at_m(start);
        during
            .iter()
            .any(|tick| at_m(tick).distance(from_m) >= SENT_M)
    });
    let cut_short = match during {
        [.., before, last] if until_s.is_finite() => {
            let speed = at_m(last).distance(at_m(before)) / (last.t_s - before.t_s);
            let pose = &last.base_from_board;
            let in_place =
                PlaceTolerance::default().holds(board, pose, place.point_m, place.normal);
            moved && speed >= STANDING_M_PER_S && !in_place
        }
        _ => false,
    };
    Course {
        place,
        from_s,
        until_s,
        moved,
        cut_short,
    }
}

/// Useless courses before a touch.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct Detours {
    /// Reversals since the previous touch: a moving board was sent to another wall, further than 0.1 m away, or back.
    pub reversals: usize,
    /// False dispatches since the previous contact: motions of at least 20 mm to a place without a touch.
    pub in_vain: usize,
    /// Those of them that went to the place of this touch, and were called back or moved on before it.
    pub called_back: usize,
}

/// The detours before each touch; touches are in order of time.
///
/// Leaving the place of a touch, to wait or for the next one, is not a detour.
#[must_use]
pub fn detours(courses: &[Course], touches: &[&Touch]) -> Vec<Detours> {
    let served = |course: &Course| {
        touches.iter().any(|touch| {
            (course.from_s..=course.until_s).contains(&touch.contact_s)
                && holds(&course.place, &touch.place())
        })
    };
    let ended: Vec<&Course> = courses.iter().filter(|course| !served(course)).collect();
    let mut before = (f64::NEG_INFINITY, f64::NEG_INFINITY);
    touches
        .iter()
        .map(|touch| {
            let (contact_s, end_s) = before;
            before = (touch.contact_s, touch.end_s);
            let count = |since_s: f64, what: &dyn Fn(&Course) -> bool| {
                let until = |c: &&&Course| since_s < c.until_s && c.until_s <= touch.contact_s;
                ended.iter().filter(until).filter(|c| what(c)).count()
            };
            Detours {
                reversals: count(end_s, &|c| c.cut_short),
                in_vain: count(contact_s, &|c| c.moved),
                called_back: count(contact_s, &|c| c.moved && holds(&c.place, &touch.place())),
            }
        })
        .collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use glam::DVec3;
    use hwall_haptics::board_pose;

    const WALL: DVec3 = DVec3::X;

    fn place(y: f64) -> Target {
        Target {
            point_m: DVec3::new(0.6, y, 0.5),
            normal: WALL,
        }
    }

    fn to(t_s: f64, y: Option<f64>) -> Sent {
        Sent {
            t_s,
            target: y.map(place),
            goal: None,
        }
    }

    /// A board on the wall at `y(t)`, every 10 ms until 4 s.
    fn ticks(y: impl Fn(f64) -> f64) -> Vec<Tick> {
        let tick = |i: i32| {
            let t_s = f64::from(i) * 0.01;
            Tick {
                t_s,
                base_from_board: board_pose(place(y(t_s)).point_m, WALL, 0.0).unwrap(),
                q: JointPositions::default(),
                in_contact: false,
                pressed_m_per_s: None,
                stop: None,
            }
        };
        (0..400).map(tick).collect()
    }

    fn touch(y: f64, contact_s: f64, end_s: f64) -> Touch {
        let Target { point_m, normal } = place(y);
        Touch {
            surface: String::new(),
            point_m,
            normal,
            start_s: contact_s,
            contact_s,
            end_s,
            landed_s: None,
        }
    }

    fn counted(sent: &[Sent], ticks: &[Tick], touches: &[Touch]) -> Vec<[usize; 2]> {
        let courses = courses(sent, ticks, &Board::default());
        let detours = detours(&courses, &touches.iter().collect::<Vec<_>>());
        detours.iter().map(|d| [d.reversals, d.in_vain]).collect()
    }

    #[test]
    fn a_board_that_goes_once_and_waits_has_no_detours() {
        let sent = [to(0.5, Some(0.3)), to(2.0, None), to(2.5, Some(-0.2))];
        let ticks = ticks(|t| 0.3 * (t - 0.5).clamp(0.0, 1.0) - 0.5 * (t - 2.2).clamp(0.0, 1.0));
        // To the first touch, back to waiting, to the second touch.
        let touches = [touch(0.32, 1.6, 1.9), touch(-0.2, 3.3, 3.6)];
        assert_eq!(counted(&sent, &ticks, &touches), [[0, 0], [0, 0]]);
    }

    #[test]
    fn a_board_that_turns_back_on_its_way_is_a_reversal_and_in_vain() {
        // Sent to the left, then while moving to the right, where the touch is.
        let sent = [to(0.5, Some(0.5)), to(1.0, Some(-0.2))];
        let ticks = ticks(|t| 0.5 * (t - 0.5).clamp(0.0, 0.5) - 0.5 * (t - 1.0).clamp(0.0, 0.9));
        assert_eq!(counted(&sent, &ticks, &[touch(-0.2, 2.2, 2.6)]), [[1, 1]]);
        // The board had not moved yet: a change of plan, not a reversal.
        let still = super::tests::ticks(|t| -0.2 * (t - 1.0).clamp(0.0, 1.0));
        assert_eq!(counted(&sent, &still, &[touch(-0.2, 2.2, 2.6)]), [[0, 0]]);
        // It had arrived and stopped: a false dispatch, but not a reversal.
        let stood = super::tests::ticks(|t| {
            0.5 * (5.0 * (t - 0.5)).clamp(0.0, 1.0) - 0.7 * (t - 1.0).clamp(0.0, 1.0)
        });
        assert_eq!(counted(&sent, &stood, &[touch(-0.2, 2.2, 2.6)]), [[0, 1]]);
    }

    #[test]
    fn a_target_that_drifts_is_one_course_until_it_is_far_from_where_it_began() {
        let drifting: Vec<Sent> = (0..30)
            .map(|i| to(0.5 + 0.02 * f64::from(i), Some(0.01 * f64::from(i))))
            .collect();
        let ticks = ticks(|t| 0.4 * (t - 0.5).clamp(0.0, 0.7));
        let courses = courses(&drifting, &ticks, &Board::default());
        // 0 to 0.1 m, 0.11 to 0.21 m, 0.22 m on.
        assert_eq!(courses.len(), 3);
        assert_eq!(courses[0].until_s, courses[1].from_s);
    }

    #[test]
    fn going_back_to_wait_before_a_touch_is_a_reversal_and_after_one_it_is_not() {
        let ticks = ticks(|t| 0.3 * (t - 0.5).clamp(0.0, 1.0) - 0.3 * (t - 1.5).clamp(0.0, 1.0));
        let sent = [to(0.5, Some(0.6)), to(1.2, None), to(3.0, Some(0.0))];
        assert_eq!(counted(&sent, &ticks, &[touch(0.0, 3.4, 3.6)]), [[1, 1]]);
        let touched = [touch(0.6, 1.1, 1.15), touch(0.0, 3.4, 3.6)];
        assert_eq!(counted(&sent, &ticks, &touched), [[0, 0], [0, 0]]);
    }

    #[test]
    fn two_walls_of_a_corner_are_two_places() {
        let [here, mut other, mut behind] = [place(0.0); 3];
        other.normal = DVec3::Y;
        behind.point_m.x -= 0.06;
        assert!(are_near(&here, &place(0.09)) && !are_near(&here, &place(0.11)));
        assert!(!are_near(&here, &other) && !are_near(&here, &behind));
    }
}
