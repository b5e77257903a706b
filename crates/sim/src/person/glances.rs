//! Glances at untouched points between touches.

use super::config::PersonConfig;
use super::draw::{Draw, scrambled};
use super::gaze::{Fixation, LookAt, SACCADE_S};
use super::habits::Person;
use glam::DVec3;

/// Separate stream of random numbers, so that glances do not change the other habits of a person.
const GLANCES: u64 = 0x6A09_E667_F3BC_C909;

const MOST_GLANCES: usize = PersonConfig::MOST_GLANCES;

/// Least distance of a glance from the next touched point and from the last glance, m: at a closer point, the gaze
/// would already be there. An assumption: the width of a spread hand.
const APART_M: f64 = 0.2;

/// A glance at an untouched point in the pause before a touch. Times in s from the start of the sequence.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Glance {
    /// The point, base frame, m; the gaze deviates from it by the person's offset.
    pub at_m: DVec3,
    /// The gaze shift to it starts.
    pub from_s: f64,
    /// The gaze lands on it.
    pub landed_s: f64,
    /// The gaze leaves it.
    pub until_s: f64,
}

/// The glances in a pause, in order, before their times are known.
#[derive(Debug, Clone, Default)]
pub(super) struct Glances(Vec<Look>);

#[derive(Debug, Clone, Copy)]
struct Look {
    at_m: DVec3,
    off_rad: [f64; 2],
    rest_s: f64,
}

impl Glances {
    /// Draws the glances of the pause before reach `index`.
    ///
    /// `in_view_m`: points to glance at. `kept_clear_m`: points touched next. `touched_m`: the point touched before, to
    /// which the gaze may also return.
    pub(super) fn drawn(
        person: &Person,
        index: usize,
        in_view_m: &[DVec3],
        kept_clear_m: &[DVec3],
        touched_m: Option<DVec3>,
    ) -> Self {
        let config = person.config();
        let [fewest, most] = config.glances;
        if most == 0 {
            return Self::default();
        }
        // Each pause has its own stream, so that pauses are independent.
        let mut draw = Draw::new(person.seed(), GLANCES ^ scrambled(index as u64));
        let count = fewest + draw.index(most - fewest + 1);
        let goes_back = draw.chance(config.glances_back);
        let mut looks: Vec<Look> = Vec::with_capacity(MOST_GLANCES);
        let mut look = |looks: &mut Vec<Look>, places_m: &[DVec3]| {
            let resting_m = looks.last().map(|look| look.at_m);
            let suits = |place_m: &&DVec3| {
                let mut others = kept_clear_m.iter().chain(&resting_m);
                others.all(|other_m| place_m.distance(*other_m) >= APART_M)
            };
            let suited: Vec<DVec3> = places_m.iter().filter(suits).copied().collect();
            // Draw the same numbers whether or not there is a point.
            let (choice, rest_s) = (draw.within([0.0, 1.0]), draw.within(config.glance_s));
            let off_rad = [draw.normal(), draw.normal()].map(|x| x * config.gaze_offset_rad);
            let chosen = (choice * suited.len() as f64) as usize;
            looks.extend(suited.get(chosen).map(|&at_m| Look {
                at_m,
                off_rad,
                rest_s,
            }));
        };
        for _ in 0..count {
            look(&mut looks, in_view_m);
        }
        if goes_back {
            let earlier: Vec<DVec3> = looks.iter().map(|l| l.at_m).chain(touched_m).collect();
            look(&mut looks, &earlier);
        }
        Self(looks)
    }

    /// Total duration, s.
    pub(super) fn duration_s(&self) -> f64 {
        self.0.iter().map(|look| SACCADE_S + look.rest_s).sum()
    }

    /// The glances in sequence; the last ends at `end_s`, when the gaze leaves for the target.
    pub(super) fn ending_at(&self, end_s: f64) -> [Option<Glance>; MOST_GLANCES] {
        let mut glances = [None; MOST_GLANCES];
        let mut until_s = end_s;
        for (glance, look) in glances[..self.0.len()].iter_mut().zip(&self.0).rev() {
            let landed_s = until_s - look.rest_s;
            let from_s = landed_s - SACCADE_S;
            *glance = Some(Glance {
                at_m: look.at_m,
                from_s,
                landed_s,
                until_s,
            });
            until_s = from_s;
        }
        glances
    }

    /// The glances as fixations.
    pub(super) fn fixations(
        &self,
        glances: &[Option<Glance>; MOST_GLANCES],
    ) -> impl Iterator<Item = Fixation> {
        let timed = glances.iter().flatten().zip(&self.0);
        timed.map(|(glance, look)| Fixation {
            from_s: glance.from_s,
            on: LookAt::Point {
                at_m: look.at_m,
                off_rad: look.off_rad,
            },
        })
    }
}
