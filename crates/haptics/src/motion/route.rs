//! Which path the board takes to its goal: straight, or through a place behind the surfaces.

use super::approach_config::ApproachConfig;
use super::barrier::links::LinkInFront;
use super::barrier::tree::{BarrierTree, Barriers};
use super::barrier::{Footprint, Plane, corners_and_middle};
use super::goal::{Destination, Goal};
use super::search::{Behind, Search, Surroundings};
use super::solver::{Place, Solver};
use super::way::{Check, Clear, PLACES, SPARE_M, Way};
use crate::board::{Board, board_pose, surface_axes};
use crate::body::{PersonBody, Separation};
use crate::error::HapticsError;
use glam::DVec3;
use hwall_geometry::Pose;
use hwall_kinematics::JointPositions;
use hwall_motion::ReferenceMotion;

/// A current path with a bend is replaced only by one that arrives earlier by this, s.
const SOONER_S: f64 = 0.02;
/// A timer may end this share of a step early: sums of steps are rounded, and the rounding depends on where the clock starts.
pub(super) const ROUNDING_STEPS: f64 = 0.1;

/// The role of a place for the board's path.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Role {
    /// The destination.
    Ahead,
    /// The current motion leads there.
    UnderWay,
    /// The last place that the board served or was moving to.
    LeftLast,
    /// The board left it earlier, and is still over it.
    LeftBefore,
}

impl Role {
    /// Does the plane of the place count even without a barrier there? Unknown surfaces of places left long ago would hem the board in.
    const fn has_plane(self) -> bool {
        !matches!(self, Self::LeftBefore)
    }
}

/// What the board must stay behind, and whether it is on a detour.
#[derive(Debug, Clone)]
pub(super) struct Route {
    config: ApproachConfig,
    board: Option<Board>,
    barriers: Barriers,
    /// What paths keep clear of besides the surfaces, and the last known position of the person.
    separation: Option<Separation>,
    person: PersonBody,
    /// The last places that the board served or was moving to, the newest first.
    left: [Option<Place>; PLACES],
    /// The place that the current motion leads to: the motion continues while no path leads to a new destination.
    under_way: Option<Place>,
    /// The goal whose surface was known when it was set: if it is left without that surface, it is no longer a place.
    on_known: Option<Place>,
    /// The face where its path was last planned, if it was in front of a surface there: a goal may change while the board is in a shelf.
    departed: Option<Footprint>,
    /// The face at the destination of the last planned path.
    ends: Option<Pose>,
    /// How far behind the goal the current detour ends, m; infinite for one behind the departure. `None`: no detour.
    detour_m: Option<f64>,
    /// No path behind the surfaces leads to the destination.
    is_blocked: bool,
    retry_in_s: f64,
    /// The current search.
    search: Option<Search>,
    /// Samples checked in this step, and the number after which no further path is begun.
    samples: usize,
    most_samples: usize,
}

impl Route {
    pub(super) fn new(config: ApproachConfig, board: Option<Board>) -> Self {
        Self {
            config,
            board,
            barriers: Barriers::default(),
            separation: None,
            person: PersonBody::default(),
            left: [None; PLACES],
            under_way: None,
            on_known: None,
            departed: None,
            ends: None,
            detour_m: None,
            is_blocked: false,
            retry_in_s: 0.0,
            search: None,
            samples: 0,
            most_samples: 0,
        }
    }

    pub(super) fn keep_clear(&mut self, separation: Separation) {
        self.separation = Some(separation);
    }

    pub(super) fn fit(&mut self, q: &JointPositions) {
        if let Some(separation) = &mut self.separation {
            separation.fit(q);
        }
    }

    /// Sets the surfaces after the world moved. Places move along; a place whose surface is gone (a door opened, the world jumped) is forgotten.
    pub(super) fn move_barriers(&mut self, barriers: BarrierTree, moved: &Pose) {
        let known = |barriers: &Barriers, place: Option<Place>| {
            place.is_some_and(|place| barriers.have(place.point_m, place.normal))
        };
        let were_known = self.left.map(|place| known(&self.barriers, place));
        let was_known = known(&self.barriers, self.under_way);
        if *moved != Pose::IDENTITY {
            let carried = |place: Option<Place>| place.map(|place| place.carried(moved));
            self.left = self.left.map(carried);
            self.under_way = carried(self.under_way);
            self.departed = self.departed.map(|face| face.carried(moved));
            self.ends = self.ends.map(|face| *moved * face);
        }
        self.barriers.set(barriers);
        for (place, was_known) in self.left.iter_mut().zip(were_known) {
            if was_known && !known(&self.barriers, *place) {
                *place = None;
            }
        }
        if was_known && !known(&self.barriers, self.under_way) {
            self.under_way = None;
        }
    }

    pub(super) const fn is_detour(&self) -> bool {
        self.detour_m.is_some()
    }

    /// Does every path to the destination come in front of a surface?
    pub(super) const fn is_blocked(&self) -> bool {
        self.is_blocked
    }

    /// No motion was found.
    pub(super) const fn block(&mut self) {
        (self.is_blocked, self.detour_m) = (true, None);
        self.retry_in_s = self.config.retry_s;
        self.search = None;
    }

    /// The motion begins anew where the board is, at `face`. Only the places that it is still over count on: a board that was stopped in a shelf
    /// must come out of it.
    pub(super) fn restart(&mut self, goal: Option<&Goal>, face: &Pose) {
        let goal = goal.map(Goal::on_surface);
        let places = || [goal, self.under_way].into_iter().chain(self.left);
        let newest = places().find(Option::is_some).flatten();
        let (mut left, mut older) = ([None; PLACES], 1);
        for place in places().flatten() {
            if left.contains(&Some(place)) || self.is_gone(&place) || !self.is_over(&place, face) {
                continue;
            }
            if Some(place) == newest {
                left[0] = newest;
            } else if let Some(slot) = left.get_mut(older) {
                *slot = Some(place);
                older += 1;
            }
        }
        (self.left, self.under_way, self.departed) = (left, None, None);
        (self.on_known, self.ends) = (None, None);
        (self.detour_m, self.is_blocked) = (None, false);
        self.search = None;
    }

    /// Is a search in progress?
    pub(super) const fn is_searching(&self) -> bool {
        self.search.is_some()
    }

    /// Is a search in progress that serves this destination?
    pub(super) fn is_searching_for(&self, destination: &Destination) -> bool {
        let serves = |search: &Search| search.destination.serves(destination);
        self.search.as_ref().is_some_and(serves)
    }

    /// Is a search in progress for a new path, not only for a shorter one?
    pub(super) fn is_searching_anew(&self) -> bool {
        self.search.as_ref().is_some_and(|search| search.is_new)
    }

    /// Gives up the search.
    pub(super) const fn end_search(&mut self) {
        self.search = None;
    }

    /// Samples checked since [`begin_step`](Self::begin_step).
    pub(super) const fn samples(&self) -> usize {
        self.samples
    }

    /// Boxes and rectangles tested since then.
    pub(super) const fn tests(&self) -> usize {
        self.barriers.tests()
    }

    /// Begins a step: resets the counters.
    pub(super) fn begin_step(&mut self, most_samples: usize, person: &PersonBody) {
        (self.samples, self.most_samples) = (0, most_samples);
        self.person = *person;
        self.barriers.begin();
    }

    /// Advances the timer; is it time to look for a shorter path? `is_bent`: the motion still has to pass a bend.
    pub(super) fn is_retry_due(&mut self, dt_s: f64, is_bent: bool) -> bool {
        self.retry_in_s -= dt_s;
        let is_due = self.retry_in_s <= ROUNDING_STEPS * dt_s;
        (self.is_detour() || self.is_blocked || is_bent) && is_due
    }

    /// A goal is set.
    pub(super) fn set_goal(&mut self, goal: &Goal) {
        let place = goal.on_surface();
        let is_known = self.barriers.have(place.point_m, place.normal);
        self.on_known = is_known.then_some(place);
    }

    /// Leaves the place of a goal for another destination; `face`: where the board is.
    pub(super) fn leave(&mut self, goal: &Goal, face: &Pose) {
        self.keep(goal.on_surface(), face);
    }

    /// Was its surface known once and is no more, as of a door that has opened?
    fn is_gone(&self, place: &Place) -> bool {
        self.on_known == Some(*place) && !self.barriers.have(place.point_m, place.normal)
    }

    /// Is a board with this face still over a place?
    fn is_over(&self, place: &Place, face: &Pose) -> bool {
        let at = board_pose(place.point_m, place.normal, place.roll_rad);
        self.board.zip(at.ok()).is_some_and(|(board, at)| {
            Footprint::new(at, &board, self.config.footprint_m).is_under(&board, face)
        })
    }

    /// Puts a place before the left ones; of those, only the ones that the board is still over are kept.
    fn keep(&mut self, place: Place, face: &Pose) {
        if self.is_gone(&place) {
            return;
        }
        let mut kept = [None; PLACES];
        kept[0] = Some(place);
        let left = self.left.into_iter().flatten();
        let others = left.filter(|left| *left != place && self.is_over(left, face));
        for (slot, left) in kept.iter_mut().skip(1).zip(others) {
            *slot = Some(left);
        }
        self.left = kept;
    }

    /// How far a face is in front of the surfaces that count on the path to a goal, m.
    pub(super) fn protrusion_m(&self, face: &Pose, goal: Option<&Goal>) -> Option<f64> {
        let check = self.check(self.board.as_ref()?, goal).ok()?;
        Some(check.most_in_front(face)?.in_front_m)
    }

    /// See [`LinkInFront::find`].
    pub(super) fn link_in_front(
        &self,
        before: Option<LinkInFront>,
        q: &JointPositions,
        goal: Option<&Goal>,
    ) -> Option<LinkInFront> {
        let capsules = self.separation.as_ref()?.body().at(q);
        let board = self.board.as_ref()?;
        // A goal whose surface has moved on hides nothing.
        let goal = goal.map(Goal::on_surface).and_then(|place| {
            if !self.barriers.have(place.point_m, place.normal) {
                return None;
            }
            let face = board_pose(place.point_m, place.normal, place.roll_rad).ok()?;
            Some(Footprint::new(face, board, self.config.footprint_m))
        });
        LinkInFront::find(before, &capsules, &self.person, &self.barriers, goal)
    }

    /// The places that count on the path to a goal, with their roles: at most [`PLACES`] and two more.
    fn places(&self, goal: Option<&Goal>) -> impl Iterator<Item = (Role, Place)> {
        let ahead = goal.map(Goal::on_surface);
        let under_way = self.under_way.filter(|place| ahead != Some(*place));
        let roles = std::iter::once(Role::LeftLast).chain(std::iter::repeat(Role::LeftBefore));
        let left = roles.zip(self.left);
        [(Role::Ahead, ahead), (Role::UnderWay, under_way)]
            .into_iter()
            .chain(left)
            .filter_map(|(role, place)| Some((role, place?)))
    }

    fn check<'a>(
        &'a self,
        board: &'a Board,
        goal: Option<&Goal>,
    ) -> Result<Check<'a>, HapticsError> {
        let mut check = Check {
            board,
            barriers: &self.barriers,
            footprints: [None; PLACES + 3],
            planes: [None; PLACES + 2],
            clear: None,
            samples: 0,
        };
        for (i, (role, place)) in self.places(goal).enumerate() {
            let face = board_pose(place.point_m, place.normal, place.roll_rad)?;
            check.footprints[i] = Some(Footprint::new(face, board, self.config.footprint_m));
            let unknown = !self.barriers.have(place.point_m, place.normal);
            let plane = Plane {
                point_m: place.point_m,
                normal: place.normal,
                radius_m: self.config.extent_m,
            };
            // The extent of that surface is unknown. A destination in front of its plane shows that it ends before: no path there could stay behind
            // the plane, and the board would stand for good.
            let ends_behind = self.ends.is_none_or(|ends| {
                let most_m = plane.most_in_front_m(&corners_and_middle(board, &ends));
                role == Role::Ahead || most_m <= self.config.allowed_m
            });
            check.planes[i] = (role.has_plane() && unknown && ends_behind).then_some(plane);
        }
        check.footprints[PLACES + 2] = self.departed;
        Ok(check)
    }

    /// Starts the search for a path to the destination, and the motion if the search ends in this step; `is_new`: not a retry.
    pub(super) fn head_for(
        &mut self,
        destination: &Destination,
        is_new: bool,
        reference: &mut ReferenceMotion,
        solver: &mut Solver,
    ) -> Result<(), HapticsError> {
        self.retry_in_s = self.config.retry_s;
        self.search = None;
        // The bend was found from an earlier place: from here there may be a shorter one.
        let bends_again =
            !is_new && !self.is_detour() && !self.is_blocked && reference.by_way_of().is_some();
        if self.board.is_none() {
            (self.is_blocked, self.detour_m) = (false, None);
            reference.set_goal(destination.q())?;
            reference.plan_anew();
            return Ok(());
        }
        self.ends = Some(solver.arm().forward(destination.q()));
        if bends_again {
            // No path is shorter than the straight one.
            let least_s = reference.consider(destination.q(), None)?;
            if least_s + SOONER_S >= reference.left_s() {
                return Ok(());
            }
        }
        self.search = Some(Search::new(*destination, is_new, bends_again));
        self.search_on(reference, solver)
    }

    /// Continues the search, and begins the motion once it is over. Until then the current motion continues.
    pub(super) fn search_on(
        &mut self,
        reference: &mut ReferenceMotion,
        solver: &mut Solver,
    ) -> Result<(), HapticsError> {
        // An error ends the search.
        let (Some(mut search), Some(board)) = (self.search.take(), self.board) else {
            return Ok(());
        };
        let config = self.config;
        let destination = search.destination;
        let goal = destination.goal();
        let here = solver.arm().forward(&reference.state().q);
        if !search.bends_again {
            self.departed = None;
            if self.check(&board, goal)?.protrusion_m(&here) > config.allowed_m {
                self.departed = Some(Footprint::new(here, &board, config.footprint_m));
            }
        }
        // Only a shorter detour replaces the current one.
        let keeps = !search.is_new && self.is_detour() && reference.left_s() > config.retry_s;
        let under_way_m = self.detour_m.filter(|_| keeps);
        let shorter_than_m = under_way_m.unwrap_or(f64::INFINITY);
        let before_goal = goal.map(|goal| Behind {
            place: goal.place(0.0),
            near: goal.q,
            is_goal: true,
        });
        let left = self.left[0].or_else(|| place_of(&here));
        let behind_here = left.filter(|_| !keeps).map(|left| Behind {
            place: Place {
                point_m: here.position_m(),
                ..left
            },
            near: reference.state().q,
            is_goal: false,
        });
        let mut check = self.check(&board, goal)?;
        let person = &self.person;
        check.clear = (self.separation.as_ref())
            .map(|separation| Clear::of(separation, person, &reference.state().q));
        // Repeatedly allowing a little more than at the board's place would add up.
        let allowed_m = match search.bends_again {
            true => config.allowed_m,
            false => config
                .allowed_m
                .max(check.tolerated_m(&here, reference, solver) - SPARE_M),
        };
        let mut around = Surroundings {
            check,
            most_samples: self.most_samples,
            allowed_m,
            detours_m: config.detours_m,
            shorter_than_m,
            behind: [before_goal, behind_here],
        };
        let found = search.go_on(&mut around, reference, solver);
        self.samples += around.check.samples;
        let Some(best) = found? else {
            self.search = Some(search);
            return Ok(());
        };
        self.retry_in_s = config.retry_s;
        let stays_behind = best.protrusion_m <= allowed_m;
        if search.bends_again {
            // The current path is safe.
            if stays_behind && best.duration_s + SOONER_S < reference.left_s() {
                return self.take(best, goal, &here, reference);
            }
            return Ok(());
        }
        if keeps && best.detour_m.is_none_or(|m| m >= shorter_than_m) && !stays_behind {
            return Ok(());
        }
        if best.protrusion_m > allowed_m + SPARE_M {
            // The current motion is safe, and there may be a path from further on; from rest, the board stands still.
            (self.is_blocked, self.detour_m) = (true, None);
            return Ok(());
        }
        self.take(best, goal, &here, reference)
    }

    fn take(
        &mut self,
        way: Way,
        goal: Option<&Goal>,
        here: &Pose,
        reference: &mut ReferenceMotion,
    ) -> Result<(), HapticsError> {
        // After a detour without a better path, the goal is next.
        (self.is_blocked, self.detour_m) = (false, way.detour_m);
        let passes_bend = way.by_way_of.is_some() || reference.by_way_of().is_some();
        let is_at_other_speed = reference.planned_share() != reference.speed_share();
        if reference.goal() != Some(&way.q) || passes_bend || is_at_other_speed {
            reference.consider(&way.q, way.by_way_of.as_ref())?;
            reference.accept();
        }
        let leads_to = goal.map(Goal::on_surface);
        if let Some(place) = self.under_way.filter(|place| leads_to != Some(*place))
            && self.left[0] != Some(place)
        {
            self.keep(place, here);
        }
        self.under_way = leads_to;
        Ok(())
    }
}

/// The place that a face is on.
fn place_of(face: &Pose) -> Option<Place> {
    let [across, _, normal] = face.rotation().to_cols_array_2d().map(DVec3::from_array);
    let [x, y] = surface_axes(normal).ok()?;
    Some(Place {
        point_m: face.position_m(),
        normal,
        roll_rad: across.dot(y).atan2(across.dot(x)),
    })
}

#[cfg(test)]
mod tests;
