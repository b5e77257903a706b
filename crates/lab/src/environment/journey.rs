//! A simulated person's way through an environment, from touch to touch.

use crate::environment::participant::RealPerson;
use crate::environment::ways::{Avatar, Stand, Way, is_free};
use crate::spans::ends;
use anyhow::{anyhow, bail, ensure};
use glam::{DVec2, DVec3};
use hwall_scene::{Facet, Scene, SurfaceId};
use hwall_sim::{PersonConfig, minimum_jerk};
use hwall_testkit::Sampler;

/// Heights at which walls are touched, above the floor, m.
const TOUCH_HEIGHTS_M: [f64; 2] = [0.9, 1.5];
/// How far a touch is from the sides of a facet, m.
const INSET_M: f64 = 0.1;
/// How far before the touched place a person stands, horizontally, m.
const STANDS_M: [f64; 2] = [0.5, 0.68];
/// How obliquely, standard deviation and most, rad.
const OBLIQUE_RAD: [f64; 2] = [0.4, 0.9];
/// How much the body faces past the place, standard deviation, rad.
const FACING_RAD: f64 = 0.15;
/// Speeds of the avatar, m/s.
const SPEEDS_M_PER_S: [f64; 2] = [1.0, 2.0];
/// The hand at rest: before the body, to its left, above the floor, m; scatter of each, standard deviation, m.
const HAND_M: DVec3 = DVec3::new(0.33, -0.15, 1.25);
const HAND_SCATTER_M: f64 = 0.04;
/// A reach brings the hand at least this much nearer to the wall, m.
const LEAST_REACH_M: f64 = 0.08;
/// When the hand starts, from when the avatar stops, s: people reach while they still roll.
const STARTS_S: [f64; 2] = [-0.4, 0.3];
/// Time the gaze takes to land, s.
const SACCADE_S: f64 = 0.06;
/// Touches of one person before the pace changes.
const TOUCHES_EACH: usize = 12;
/// Draws for one touch before giving up, and those after which a way without a touch is taken.
const MOST_DRAWS: usize = 4000;
const DRAWS_BEFORE_VIA: usize = 60;
/// Places to start from that are tried.
const STARTS: usize = 20;
/// Facets smaller than this are not aimed at, m² and m.
const LEAST_FACET: [f64; 2] = [0.3, 0.4];

/// One touch of the virtual world.
#[derive(Debug, Clone)]
pub(super) struct Encounter {
    pub(super) place: Place,
    /// The avatar since the touch before.
    pub(super) instants: Vec<Avatar>,
    /// When the joystick is let go, the gaze has landed, the avatar stops, the hand starts, meets the surface, leaves it, s.
    pub(super) release_s: f64,
    pub(super) landed_s: f64,
    pub(super) stop_s: f64,
    pub(super) start_s: f64,
    pub(super) contact_s: f64,
    pub(super) leaves_s: f64,
}

/// All of it.
#[derive(Debug, Clone)]
pub(super) struct Journey {
    pub(super) encounters: Vec<Encounter>,
    pub(super) person: RealPerson,
    pub(super) floor_m: f64,
    pub(super) length_m: f64,
}

impl Encounter {
    /// Share of the reach that is done at a time.
    pub(super) fn done(&self, t_s: f64) -> f64 {
        minimum_jerk((t_s - self.start_s) / (self.contact_s - self.start_s))
    }
}

struct Planner<'a> {
    scene: &'a Scene,
    facets: Vec<Facet>,
    floor_m: f64,
    sampler: Sampler,
}

/// What is touched, and from where. World frame, unless said otherwise.
#[derive(Debug, Clone, Copy)]
pub(super) struct Place {
    pub(super) surface: SurfaceId,
    pub(super) point_m: DVec3,
    /// Towards the person, horizontal.
    pub(super) normal: DVec3,
    /// Where the avatar stands.
    pub(super) stand: Stand,
    /// The hand at rest, in the frame of the body: forward, left, above the floor, m.
    pub(super) hand_m: DVec3,
}

/// So many touches from a random place on.
///
/// People of other paces take the same way: only the times differ.
///
/// # Errors
/// No vertical surface to touch, or no free way to one.
pub(super) fn of_seed(
    scene: &Scene,
    config: &PersonConfig,
    touches: usize,
    seed: u64,
) -> anyhow::Result<Journey> {
    let floor_m = scene.bounds().min_m.z;
    let [low_m, high_m] = TOUCH_HEIGHTS_M;
    let [least_m2, least_m] = LEAST_FACET;
    let mut facets = scene.vertical_facets();
    facets.retain(|f| {
        let is_large = f.area_m2 >= least_m2 && f.width_m >= least_m;
        is_large && f.lowest_m < floor_m + high_m && f.highest_m > floor_m + low_m
    });
    ensure!(
        !facets.is_empty(),
        "the scene has no vertical surface between {low_m} and {high_m} m above its lowest point"
    );
    let mut sampler = Sampler::new(seed ^ 0x7761_6c6b);
    let person = RealPerson::new(&mut sampler);
    let mut planner = Planner {
        scene,
        facets,
        floor_m,
        sampler,
    };
    planner.journey(person, touches, config)
}

impl Planner<'_> {
    fn journey(
        &mut self,
        person: RealPerson,
        touches: usize,
        config: &PersonConfig,
    ) -> anyhow::Result<Journey> {
        let [fast_s, slow_s] = config.mean_reach_s;
        let mut at = self.start()?;
        let (mut t_s, mut length_m, mut mean_s) = (0.0, 0.0, 0.0);
        let mut encounters = Vec::with_capacity(touches);
        for number in 0..touches {
            if number % TOUCHES_EACH == 0 {
                mean_s = self.sampler.uniform(fast_s, slow_s);
            }
            let (ways, place) = self.next(at)?;
            let (mut instants, mut release_s) = (Vec::new(), t_s);
            for way in &ways {
                let [slow, fast] = SPEEDS_M_PER_S;
                let speed = self.sampler.uniform(slow, fast);
                let travelled = way.travelled(t_s, at.heading_rad, speed);
                release_s = travelled.1;
                instants.extend(travelled.0);
                length_m += way.length_m();
                if let Some(last) = instants.last() {
                    (t_s, at) = (last.t_s, last.stand);
                }
            }
            let encounter = self.touch(place, instants, release_s, mean_s, config);
            t_s = encounter.leaves_s;
            encounters.push(encounter);
        }
        Ok(Journey {
            encounters,
            person,
            floor_m: self.floor_m,
            length_m,
        })
    }

    /// When things happen in a touch.
    fn touch(
        &mut self,
        place: Place,
        instants: Vec<Avatar>,
        release_s: f64,
        mean_s: f64,
        config: &PersonConfig,
    ) -> Encounter {
        let stop_s = instants.last().map_or(release_s, |last| last.t_s);
        let [early, late] = STARTS_S;
        let start_s = stop_s + self.sampler.uniform(early, late);
        let reach_s = mean_s * self.scattered(0.1);
        let [short, long] = config.gaze_lead_s;
        let lead_s = self.sampler.uniform(short, long) * self.scattered(0.15);
        // The hand wants to go a little beyond the surface and meets it on the way.
        let [least, most] = config.press_depth_m;
        let depth_m = self.sampler.uniform(least, most);
        let length_m = PersonConfig::REFERENCE_M;
        let contact_share = (1..1000)
            .map(|i| f64::from(i) * 1e-3)
            .find(|tau| minimum_jerk(*tau) * (length_m + depth_m) >= length_m)
            .unwrap_or(1.0);
        // Never before the avatar stands: the world would move under the hand.
        let contact_s = (start_s + contact_share * reach_s).max(stop_s + 0.05);
        let [brief, lasting] = config.hold_s;
        Encounter {
            place,
            instants,
            release_s,
            landed_s: start_s - lead_s + SACCADE_S,
            stop_s,
            start_s,
            contact_s,
            leaves_s: contact_s + self.sampler.uniform(brief, lasting),
        }
    }

    /// A factor about 1 with a standard deviation.
    fn scattered(&mut self, sd: f64) -> f64 {
        (1.0 + sd * self.sampler.normal()).clamp(0.6, 1.6)
    }

    /// A place before a wall from which there is a way to another.
    fn start(&mut self) -> anyhow::Result<Stand> {
        let mut last = None;
        for _ in 0..STARTS {
            let stand = self.first()?;
            match self.next(stand) {
                Ok(_) => return Ok(stand),
                Err(error) => last = Some(error),
            }
        }
        Err(last.unwrap_or_else(|| anyhow!("nowhere to start")))
    }

    fn first(&mut self) -> anyhow::Result<Stand> {
        for _ in 0..MOST_DRAWS {
            if let Some(place) = self.place()? {
                return Ok(place.stand);
            }
        }
        bail!("no place before a wall is free: nobody can stand there")
    }

    /// The next touch and the ways to it.
    fn next(&mut self, from: Stand) -> anyhow::Result<(Vec<Way>, Place)> {
        let (mut at, mut ways) = (from.position_m, Vec::new());
        for draw in 1..=MOST_DRAWS {
            if let Some(place) = self.place()? {
                let far_m = place.stand.position_m.distance(at);
                let way = Way::new(at, place.stand);
                if far_m > 0.8 && far_m < 9.0 && way.is_free(self.scene, self.floor_m)? {
                    ways.push(way);
                    return Ok((ways, place));
                }
            }
            if draw % DRAWS_BEFORE_VIA == 0
                && let Some(way) = self.stroll(at)?
            {
                at = way.end.position_m;
                ways.push(way);
            }
        }
        bail!("no free way from ({:.2}, {:.2}) to a wall", at.x, at.y)
    }

    /// A straight way to anywhere.
    fn stroll(&mut self, from: DVec2) -> anyhow::Result<Option<Way>> {
        for _ in 0..40 {
            let heading_rad = self.sampler.uniform(-3.2, 3.2);
            let way_m = self.sampler.uniform(1.0, 6.0);
            let to = Stand {
                position_m: from + DVec2::from_angle(heading_rad) * way_m,
                heading_rad,
            };
            let way = Way::new(from, to);
            if way.is_free(self.scene, self.floor_m)? {
                return Ok(Some(way));
            }
        }
        Ok(None)
    }

    /// Any place of any facet that can be touched from where nothing is in the way.
    fn place(&mut self) -> anyhow::Result<Option<Place>> {
        let facet = &self.facets[self.sampler.index(self.facets.len())];
        let normal = DVec3::new(facet.normal.x, facet.normal.y, 0.0).normalize();
        let along = DVec3::Z.cross(normal);
        let (least, most) = ends(facet.outline_m.iter().map(|corner| along.dot(*corner)));
        if most - least < 2.0 * INSET_M {
            return Ok(None);
        }
        let [low, high] = TOUCH_HEIGHTS_M.map(|h| self.floor_m + h);
        let low = low.max(facet.lowest_m + INSET_M);
        let high = high.min(facet.highest_m - INSET_M);
        if low >= high {
            return Ok(None);
        }
        let s = self.sampler.uniform(least + INSET_M, most - INSET_M);
        let foot = normal * normal.dot(facet.point_m) + along * s;
        let point_m = DVec3::new(foot.x, foot.y, self.sampler.uniform(low, high));
        let surface = facet.surface;
        let before_m = point_m + normal * 0.01;
        let near = self.scene.closest_touchable(before_m, 0.02)?;
        if near.is_none_or(|c| c.surface != surface || c.normal.dot(normal) < 0.99) {
            return Ok(None);
        }
        let [sd, limit] = OBLIQUE_RAD;
        let aside = (sd * self.sampler.normal()).clamp(-limit, limit);
        let [near_m, far_m] = STANDS_M;
        let away = DVec2::from_angle(aside).rotate(normal.truncate());
        let position_m = point_m.truncate() + away * self.sampler.uniform(near_m, far_m);
        let heading_rad = (-away).to_angle() + FACING_RAD * self.sampler.normal();
        let mut scattered = |middle: f64| middle + HAND_SCATTER_M * self.sampler.normal();
        let hand_m = DVec3::from(HAND_M.to_array().map(&mut scattered));
        let hand = position_m + DVec2::from_angle(heading_rad).rotate(hand_m.truncate());
        let before_m = (hand - point_m.truncate()).dot(normal.truncate());
        if before_m < LEAST_REACH_M || !is_free(self.scene, self.floor_m, position_m, 0.25)? {
            return Ok(None);
        }
        let eyes = position_m.extend(self.floor_m + 1.6);
        if !self.scene.visible(eyes, point_m)? {
            return Ok(None);
        }
        let stand = Stand {
            position_m,
            heading_rad,
        };
        Ok(Some(Place {
            surface,
            point_m,
            normal,
            stand,
            hand_m,
        }))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::environment::gym;

    #[test]
    fn touches_are_on_walls_in_order_of_time_and_the_same_for_a_seed() {
        for seed in [1, 2] {
            let scene = gym::of_seed(seed).unwrap();
            let journey = of_seed(&scene, &PersonConfig::default(), 30, seed).unwrap();
            assert_eq!(journey.encounters.len(), 30);
            let mut last_s = 0.0;
            for e in &journey.encounters {
                let point_m = e.place.point_m;
                let on = scene.closest_touchable(point_m, 1e-6).unwrap().unwrap();
                assert_eq!(on.surface, e.place.surface);
                assert!(last_s <= e.instants[0].t_s && e.instants[0].t_s < e.release_s);
                assert!(
                    e.release_s < e.stop_s && e.stop_s < e.contact_s && e.contact_s < e.leaves_s
                );
                assert!(e.landed_s < e.start_s && e.start_s < e.contact_s);
                last_s = e.leaves_s;
                let away_m = e.place.stand.position_m.distance(point_m.truncate());
                assert!((0.45..0.75).contains(&away_m));
            }
            let again = of_seed(&scene, &PersonConfig::default(), 30, seed).unwrap();
            for (a, b) in again.encounters.iter().zip(&journey.encounters) {
                assert_eq!(a.place.point_m, b.place.point_m);
            }
        }
    }

    #[test]
    fn a_scene_without_a_way_is_an_error() {
        let floor = "v 0 0 0\nv 1 0 0\nv 1 1 0\nf 1 2 3\n";
        let (scene, _) = Scene::from_obj_str(floor, None).unwrap();
        let error = of_seed(&scene, &PersonConfig::default(), 1, 1)
            .unwrap_err()
            .to_string();
        assert!(error.contains("no vertical surface"), "{error}");
    }
}
