//! How the orientation of a virtual wall reaches the arm: snapped, snapped with a turned avatar, or as it is.

use crate::environment::journey::{Encounter, Journey};
use crate::environment::ways::{Avatar, STEP_S};
use crate::report::named;
use glam::{DVec2, DVec3};
use hwall_redirection::{AvatarTurn, PersonMotion, SampledOrientations, TurnConfig, wrapped_rad};
use hwall_scene::Scene;

/// A fixation is told from a saccade after this, s.
pub(super) const NOTICE_S: f64 = 0.1;
/// The arm's base stands this far above the floor, m, as in the built-in room.
pub(super) const BASE_ABOVE_FLOOR_M: f64 = 0.6;
/// A wall further ahead than this is not turned towards, m.
const AHEAD_M: f64 = 4.0;
/// Height above the floor at which walls ahead are looked for, m.
const LOOK_M: f64 = 1.2;

named! {
    /// How orientations are presented.
    pub enum Mode {
        /// The nearest sampled orientation; the wall is seen where it is.
        Snapped = "snapped",
        /// The same, and the avatar is turned towards it while the person moves, by joystick or really.
        Turned = "snapped, avatar turned",
        /// The same, but only real movements hide a turn.
        TurnedUnsteered = "snapped, turned by real steps only",
        /// Any orientation.
        Exact = "exact",
    }
}

impl Mode {
    pub(super) fn turn_config(self) -> Option<TurnConfig> {
        let config = TurnConfig::default();
        match self {
            Self::Snapped | Self::Exact => None,
            Self::Turned => Some(config),
            Self::TurnedUnsteered => Some(TurnConfig {
                steered_share: 0.0,
                ..config
            }),
        }
    }
}

/// A touch in the arm's base frame.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Placed {
    pub(super) point_m: DVec3,
    /// Normal of the board that presents it.
    pub(super) normal: DVec3,
    /// Where the hand is before it reaches.
    pub(super) hand_m: DVec3,
    /// From the board's heading to that of the wall, rad.
    pub(super) residual_rad: f64,
    /// Is there an orientation for the wall?
    pub(super) is_served: bool,
    /// By how much the avatar was turned, rad.
    pub(super) turned_rad: f64,
}

/// When a touch can be known: the gaze has landed and was noticed, and the joystick is let go, so that it is clear where the avatar
/// will stand.
pub(super) fn known_s(encounter: &Encounter) -> f64 {
    (encounter.landed_s + NOTICE_S).max(encounter.release_s)
}

/// All touches as the arm meets them.
pub(super) fn placed(
    scene: &Scene,
    journey: &Journey,
    orientations: &SampledOrientations,
    mode: Mode,
) -> anyhow::Result<Vec<Placed>> {
    let mut turn = mode.turn_config().map(AvatarTurn::new).transpose()?;
    let mut placed = Vec::with_capacity(journey.encounters.len());
    for encounter in &journey.encounters {
        if let Some(turn) = &mut turn {
            approach(scene, journey, orientations, encounter, turn)?;
        }
        let turned_rad = turn.map_or(0.0, |turn| turn.turned_rad());
        let touch = at_touch(journey, orientations, encounter, mode, turned_rad)?;
        placed.push(touch);
    }
    Ok(placed)
}

/// Turns the avatar on its way to a touch, towards the orientation nearest to that of the wall ahead; once the touch is known,
/// towards that of the touched wall as it will be seen. The avatar then rolls out in a known way, so the arm may set out for where
/// the wall will be after the turns still to come.
fn approach(
    scene: &Scene,
    journey: &Journey,
    orientations: &SampledOrientations,
    encounter: &Encounter,
    turn: &mut AvatarTurn,
) -> anyhow::Result<()> {
    let known_s = known_s(encounter);
    let place = &encounter.place;
    let touched_rad = place.normal.truncate().to_angle() - place.stand.heading_rad;
    let at_touch_rad = journey.person.at(encounter.stop_s).heading_rad + touched_rad;
    for avatar in &encounter.instants {
        let body = journey.person.at(avatar.t_s);
        let seen_rad = if avatar.t_s >= known_s {
            Some(at_touch_rad)
        } else {
            let wall_rad = heading_ahead(scene, journey.floor_m, avatar)?;
            wall_rad.map(|wall_rad| body.heading_rad + wall_rad - avatar.stand.heading_rad)
        };
        let wanted_rad = match seen_rad {
            Some(seen_rad) => orientations.snap(seen_rad)?.turn_rad,
            // Nothing near: back to where the avatar would be by itself.
            None => 0.0,
        };
        let motion = PersonMotion {
            turn_rad_per_s: body.turn_rad_per_s,
            speed_m_per_s: body.speed_m_per_s,
            steered_turn_rad_per_s: avatar.turn_rad_per_s,
            steered_speed_m_per_s: avatar.speed_m_per_s,
        };
        turn.step(wanted_rad, &motion, STEP_S)?;
    }
    Ok(())
}

/// Heading of the normal of the wall ahead of the avatar, rad, world frame.
pub(super) fn heading_ahead(
    scene: &Scene,
    floor_m: f64,
    avatar: &Avatar,
) -> anyhow::Result<Option<f64>> {
    let origin_m = avatar.stand.position_m.extend(floor_m + LOOK_M);
    let ahead = DVec2::from_angle(avatar.stand.heading_rad).extend(0.0);
    let hit = scene.ray_cast(origin_m, ahead)?;
    let wall = hit.filter(|hit| {
        let upright = hit.normal.z.abs() < 0.02;
        hit.distance_m <= AHEAD_M && upright && scene.surface(hit.surface).touchable()
    });
    Ok(wall.map(|hit| hit.normal.truncate().to_angle()))
}

fn at_touch(
    journey: &Journey,
    orientations: &SampledOrientations,
    encounter: &Encounter,
    mode: Mode,
    turned_rad: f64,
) -> anyhow::Result<Placed> {
    let body = journey.person.at(encounter.stop_s);
    let (place, stand) = (&encounter.place, &encounter.place.stand);
    // An avatar that was turned is led by a person who turned the other way to go where they wanted.
    let base_from_world_rad = body.heading_rad - turned_rad - stand.heading_rad;
    let base_from_world = DVec2::from_angle(base_from_world_rad);
    let seen = base_from_world.rotate(place.point_m.truncate() - stand.position_m);
    let base_m = journey.floor_m + BASE_ABOVE_FLOOR_M;
    let facing = DVec2::from_angle(body.heading_rad - turned_rad);
    let hand = facing.rotate(place.hand_m.truncate());
    let wall_rad = wrapped_rad(place.normal.truncate().to_angle() + base_from_world_rad);
    let (heading_rad, residual_rad, is_served) = match mode {
        Mode::Exact => (wall_rad, 0.0, true),
        Mode::Snapped | Mode::Turned | Mode::TurnedUnsteered => {
            let snapped = orientations.snap(wall_rad)?;
            (snapped.heading_rad, snapped.turn_rad, snapped.sampled)
        }
    };
    Ok(Placed {
        point_m: (body.position_m + seen).extend(place.point_m.z - base_m),
        normal: DVec2::from_angle(heading_rad).extend(0.0),
        hand_m: (body.position_m + hand).extend(place.hand_m.z - BASE_ABOVE_FLOOR_M),
        residual_rad,
        is_served,
        turned_rad,
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::environment::{gym, journey};
    use hwall_sim::PersonConfig;

    #[test]
    fn turned_avatars_leave_less_over_and_exact_ones_nothing() {
        let scene = gym::of_seed(3).unwrap();
        let journey = journey::of_seed(&scene, &PersonConfig::default(), 60, 3).unwrap();
        let orientations = SampledOrientations::default();
        let all = Mode::ALL.map(|mode| placed(&scene, &journey, &orientations, mode).unwrap());
        let [snapped, turned, _, exact] = &all;
        assert!(exact.iter().all(|p| p.residual_rad == 0.0 && p.is_served));
        let mean = |all: &[Placed]| {
            let kept = || all.iter().filter(|p| p.is_served);
            kept().map(|p| p.residual_rad.abs()).sum::<f64>() / kept().count() as f64
        };
        assert!(mean(turned) < 0.9 * mean(snapped));
        for (s, e) in snapped.iter().zip(exact) {
            // Board and residual make the wall.
            let wall_rad = s.normal.truncate().to_angle() + s.residual_rad;
            let same = wrapped_rad(wall_rad - e.normal.truncate().to_angle());
            assert!(same.abs() < 1e-12 && s.point_m == e.point_m);
            let half_rad = 0.5 * orientations.step_rad();
            assert!(!s.is_served || s.residual_rad.abs() <= half_rad + 1e-9);
        }
        let most = TurnConfig::default().most_rad;
        assert!(turned.iter().all(|p| p.turned_rad.abs() <= most + 1e-12));
        // Turning keeps distances from the person, so the hand stays as near to the touched point.
        for (t, e) in turned.iter().zip(exact) {
            let reach = |p: &Placed| p.point_m.distance(p.hand_m);
            assert!((reach(t) - reach(e)).abs() < 1e-12);
        }
    }
}
