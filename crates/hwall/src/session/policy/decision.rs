//! When the board goes where: wait, be ready behind a surface, present it.

use super::config::PolicyConfig;
use super::edge::Weighed;
use super::hand_course::{HandCourse, MeanVelocity};
use super::looks::{LookFrame, Looks};
use super::sight::Sight;
use crate::error::SessionError;
use glam::{DMat3, DVec3};
use hwall_contact::{ContactPrediction, PredictionSource, SteadyPoint};
use hwall_geometry::Pose;
use hwall_hand::HandState;
use hwall_haptics::{Board, PlaceTolerance, surface_axes};
use hwall_scene::SurfaceId;

/// Where the board shall be.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(in crate::session) enum Decision {
    /// Nothing is about to be touched.
    Wait,
    /// Something may be: the arm waits nearer to it.
    Lean(ContactPrediction),
    /// Behind the place that is looked at, or that will probably be touched again.
    Ready(ContactPrediction),
    /// On the place that is about to be touched.
    Present(ContactPrediction),
}

impl Decision {
    /// The same some time later, s.
    fn aged(self, dt_s: f64) -> Self {
        let older = |mut contact: ContactPrediction| {
            if let Some(time) = &mut contact.time_to_contact_s {
                time.mean_s = (time.mean_s - dt_s).max(0.0);
            }
            contact
        };
        match self {
            Self::Wait => Self::Wait,
            Self::Lean(contact) => Self::Lean(older(contact)),
            Self::Ready(contact) => Self::Ready(older(contact)),
            Self::Present(contact) => Self::Present(older(contact)),
        }
    }
}

/// A place that was predicted for a while.
#[derive(Debug, Clone, Copy)]
struct Candidate {
    surface: SurfaceId,
    point_m: DVec3,
    since_s: f64,
}

/// What the hand is doing with regard to a prediction.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Motion {
    Rests,
    Reaches,
    Leaves,
}

/// Standard deviation of the predicted point, m; zero for one that comes without, NaN for a covariance that is none.
fn spread_m(contact: &ContactPrediction) -> f64 {
    let variance_m2 = |c: DMat3| c.x_axis.x + c.y_axis.y + c.z_axis.z;
    contact.covariance_m2.map_or(0.0, variance_m2).sqrt()
}

/// A reach of minimum jerk still takes so many times the way left over its speed when it ends, and fewer before.
const SLOWS_DOWN: f64 = 3.0;

/// The contact no later than at the end of a reach that slows down as people do: what was learnt from all people is late for the
/// fast ones.
fn in_time(mut contact: ContactPrediction, hand: &HandState) -> ContactPrediction {
    let way = contact.point_m - hand.point_m;
    let closing_m_per_s = hand.velocity_m_per_s.dot(way.normalize_or_zero());
    if closing_m_per_s > SLOWEST_M_PER_S
        && let Some(time) = &mut contact.time_to_contact_s
    {
        let latest_s = SLOWS_DOWN * way.length() / closing_m_per_s;
        time.mean_s = time.mean_s.min(latest_s);
    }
    contact
}

/// Of a slower hand the speed tells nothing, m/s.
const SLOWEST_M_PER_S: f64 = 0.1;

/// What a board covers about its middle, m.
const COVERED_M: f64 = 0.075;

/// The ranked contacts, starting with the one that a board is most likely to cover: of a place touched before and of what else is predicted, the
/// more probable one may be so vague that hardly any place of the board serves it.
fn worth_a_board(ranked: &[ContactPrediction]) -> &[ContactPrediction] {
    let Some(repeat) = (ranked.iter()).position(|p| p.source == PredictionSource::TouchedBefore)
    else {
        return ranked;
    };
    let other = usize::from(repeat == 0);
    let covered = |p: &ContactPrediction| p.probability * covered_share(p);
    match ranked.get(other) {
        Some(other) if covered(other) > covered(&ranked[repeat]) => {
            if repeat == 0 {
                &ranked[1..]
            } else {
                ranked
            }
        }
        _ => &ranked[repeat..=repeat],
    }
}

/// The share of the touches meant by a contact that a board on its point covers.
fn covered_share(contact: &ContactPrediction) -> f64 {
    let Ok(axes) = surface_axes(contact.normal) else {
        return 0.0;
    };
    // One that comes without is exact.
    let Some(c) = contact.covariance_m2 else {
        return 1.0;
    };
    let variances_m2 = axes.map(|axis| (c * axis).dot(axis));
    // NaN covers nothing.
    if !variances_m2.iter().all(|v| *v >= 0.0) {
        return 0.0;
    }
    let sds_m2 = (variances_m2[0] * variances_m2[1]).sqrt();
    1.0 - (-0.5 * COVERED_M * COVERED_M / sds_m2).exp()
}

/// A hand that moves away this fast in the mean of 0.1 s leaves, m/s.
const LEAVES_M_PER_S: f64 = 0.1;
/// A hand that moves along a surface may move away from it by this share of what it comes nearer to a point on it: ways are bent.
const ALONG_SHARE: f64 = 0.2;
/// A place is out of the question that is so many standard deviations from where the touch is expected.
const OUT_OF_QUESTION_SDS: f64 = 2.0;
/// How far from the eyes a place is that can be touched, m: an arm's length and some. The slack of a place that is looked at takes the
/// error of the line of sight on a wall that is faced from there, whatever the real distance and angle. What a grazing line of
/// sight would add is left to the hand to correct; counted in full it would leave a door seen from the side hardly any slack, and the board would follow every
/// wavering of the eyes.
const USUAL_LOOK_M: f64 = 1.0;

/// The memory of the decisions.
#[derive(Debug, Clone)]
pub(in crate::session) struct Policy {
    config: PolicyConfig,
    steady: SteadyPoint,
    candidate: Option<Candidate>,
    decision: Decision,
    /// When the hand was last seen to reach, s.
    reached_s: f64,
    /// When the hand was last seen not to rest, s.
    moved_s: f64,
    last_s: f64,
    looks: Looks,
    course: HandCourse,
    /// The surface of the contact that is held, and how far its prediction is from the point that is held, m.
    off: Option<(SurfaceId, DVec3)>,
}

impl Policy {
    pub(in crate::session) fn new(config: PolicyConfig) -> Result<Self, SessionError> {
        config.validate()?;
        Ok(Self {
            steady: SteadyPoint::new(config.steady_m)?,
            config,
            candidate: None,
            decision: Decision::Wait,
            reached_s: f64::NEG_INFINITY,
            moved_s: f64::NEG_INFINITY,
            last_s: f64::NEG_INFINITY,
            looks: Looks::default(),
            course: HandCourse::default(),
            off: None,
        })
    }

    /// Forgets everything, for a world that leapt.
    pub(in crate::session) fn reset(&mut self) {
        self.steady.reset();
        self.candidate = None;
        self.decision = Decision::Wait;
        [self.reached_s, self.moved_s, self.last_s] = [f64::NEG_INFINITY; 3];
        self.looks.forget_look();
        self.course = HandCourse::default();
    }

    /// The contact that counts after a frame and what is done about it: the ranked contacts, the hand and the place between the
    /// eyes, all in one frame. `None` without a contact in sight.
    pub(in crate::session) fn step(
        &mut self,
        t_s: f64,
        ranked: &[ContactPrediction],
        hand: Option<&HandState>,
        eye_m: Option<DVec3>,
        arrival_s: impl Fn(&ContactPrediction) -> Option<f64>,
    ) -> Option<(ContactPrediction, Decision)> {
        if t_s < self.last_s {
            // The clock was set back.
            self.reset();
        }
        let dt_s = t_s - self.last_s;
        self.last_s = t_s;
        // A place that is kept comes nearer in time.
        self.decision = self.decision.aged(dt_s);
        self.course.step(t_s, hand.map(|hand| hand.point_m));
        let sight = eye_m.map(|eye_m| self.sight(eye_m));
        let told = ranked;
        let ranked = worth_a_board(ranked);
        let weighed = Weighed::at_edge(ranked, arrival_s);
        let ranked = weighed.as_ref().map_or(ranked, Weighed::contacts);
        // The first guesses of a hand that sets off are no better than a look, whatever they say themselves.
        let held = self.steady.step_ranked_known(ranked, |prediction| {
            let own_m = spread_m(prediction);
            match (prediction.looked_at_since_s, sight) {
                (Some(_), Some(sight)) => own_m.min(sight.spread_m(prediction)),
                _ => own_m,
            }
        });
        self.off = held.and_then(|held| {
            let newest = ranked.iter().find(|p| p.surface == held.surface)?;
            let off = newest.point_m - held.point_m;
            Some((held.surface, off * self.told_share(newest, off)))
        });
        let Some(contact) = held else {
            self.steady.reset();
            self.candidate = None;
            self.decision = Decision::Wait;
            return None;
        };
        if !(contact.point_m.is_finite() && contact.normal.is_finite()) {
            // The control side holds for it, and says so.
            self.steady.reset();
            self.candidate = None;
            self.decision = Decision::Present(contact);
            return Some((contact, self.decision));
        }
        let same =
            |p: &&ContactPrediction| (p.surface, p.source) == (contact.surface, contact.source);
        let contact = ContactPrediction {
            probability: told
                .iter()
                .find(same)
                .map_or(contact.probability, |p| p.probability),
            ..contact
        };
        let contact = hand.map_or(contact, |hand| in_time(contact, hand));
        self.decision = self.decide(t_s, &contact, hand);
        Some((contact, self.decision))
    }

    fn decide(
        &mut self,
        t_s: f64,
        contact: &ContactPrediction,
        hand: Option<&HandState>,
    ) -> Decision {
        let c = self.config;
        let stays = self.candidate.filter(|candidate| {
            candidate.surface == contact.surface
                && candidate.point_m.distance(contact.point_m) <= c.settle_m
        });
        let motion = hand.map_or(Motion::Rests, |hand| self.motion(contact, hand));
        // What was looked at before anything was known is no look either.
        let is_still = hand.is_none_or(|hand| hand.velocity_m_per_s.length() < c.still_m_per_s);
        if !is_still || self.moved_s == f64::NEG_INFINITY {
            self.moved_s = t_s;
        }
        let candidate = Candidate {
            surface: contact.surface,
            point_m: contact.point_m,
            since_s: stays.map_or(t_s, |candidate| candidate.since_s),
        };
        self.candidate = Some(candidate);
        let is_sent = matches!(self.decision, Decision::Present(_) | Decision::Ready(_));
        let reaches = motion == Motion::Reaches
            && (is_sent || hand.is_none_or(|hand| self.sets_off(contact, hand)));
        if reaches {
            self.reached_s = t_s;
        } else if is_still && stays.is_none() {
            // That was for another place.
            self.reached_s = f64::NEG_INFINITY;
        }
        let look = contact
            .looked_at_since_s
            .filter(|since_s| is_still && *since_s >= self.moved_s + c.still_s);
        self.looks.step(&LookFrame {
            t_s,
            since_s: look,
            reaches,
            is_still,
        });
        let reaching = t_s - self.reached_s <= c.pause_s && motion != Motion::Leaves;
        let settled = t_s - candidate.since_s >= c.settle_s;
        let enough_m = match self.decision {
            // To leave a place that was looked at takes more than a guess.
            Decision::Present(last) | Decision::Ready(last) if last.looked_at_since_s.is_some() => {
                c.sure_m
            }
            _ => c.unsure_m,
        };
        // NaN is unsure.
        let spread_m = spread_m(contact);
        let leaves_place = match self.decision {
            Decision::Present(last) | Decision::Ready(last) => {
                last.point_m.distance(contact.point_m) > OUT_OF_QUESTION_SDS * spread_m
            }
            Decision::Wait | Decision::Lean(_) => false,
        };
        let is_sure = spread_m <= enough_m || (leaves_place && spread_m <= c.unsure_m);
        let is_unsure = contact.looked_at_since_s.is_none() && !is_sure;
        // Where people look while the hand comes back is not yet where it goes next.
        let is_look =
            look.is_some_and(|since_s| t_s - since_s <= c.look_s) && motion != Motion::Leaves;
        // Nobody's eyes are seen; where the last touches were is all that is known before the hand sets off.
        let is_again = contact.source == PredictionSource::TouchedBefore
            && contact.probability >= c.again_share
            && motion != Motion::Leaves;
        match (self.decision, motion) {
            (Decision::Present(_) | Decision::Ready(_), Motion::Leaves) if settled => {
                Decision::Wait
            }
            (Decision::Wait, _) if is_unsure => Decision::Wait,
            (last, _) if is_unsure && reaching => last,
            _ if settled && reaching => Decision::Present(*contact),
            (Decision::Present(last), _) if reaching => {
                // Another place is named, not for long enough.
                Decision::Present(if stays.is_some() { *contact } else { last })
            }
            _ if settled && is_look && is_still => match self.looks.share() >= c.trusted_share {
                true => Decision::Ready(*contact),
                false => Decision::Lean(*contact),
            },
            _ if settled && is_again && is_still => Decision::Ready(*contact),
            _ if settled => Decision::Wait,
            (last, _) => last,
        }
    }

    pub(in crate::session) const fn ready_m(&self) -> f64 {
        self.config.ready_m
    }

    fn motion(&self, contact: &ContactPrediction, hand: &HandState) -> Motion {
        let way = contact.point_m - hand.point_m;
        let course = self.course.velocity();
        // Of a hand that was just found only a fast motion is told from the noise.
        let is_fast = hand.velocity_m_per_s.length() >= self.config.still_m_per_s;
        let found_m_per_s = hand.velocity_m_per_s * f64::from(u8::from(is_fast));
        let mean_m_per_s = course.map_or(found_m_per_s, |course| course.mean_m_per_s);
        let off_m_per_s = mean_m_per_s.dot(contact.normal);
        if contact.distance_m <= self.config.near_m {
            // Beside the surface the way to a point on it says little.
            let most_m_per_s = match self.decision {
                Decision::Present(_) | Decision::Ready(_) => LEAVES_M_PER_S,
                // One that has left does not come back because it trembles.
                Decision::Wait | Decision::Lean(_) => self.config.reach_m_per_s,
            };
            return if off_m_per_s > most_m_per_s {
                Motion::Leaves
            } else {
                Motion::Reaches
            };
        }
        let closing_m_per_s = mean_m_per_s.dot(way.normalize_or_zero());
        // A hand that comes back upwards comes nearer to what is looked at above it, but not to its surface.
        let along_m_per_s = ALONG_SHARE * closing_m_per_s;
        if closing_m_per_s >= self.config.reach_m_per_s && off_m_per_s <= along_m_per_s {
            Motion::Reaches
        } else if closing_m_per_s <= -LEAVES_M_PER_S || off_m_per_s >= LEAVES_M_PER_S {
            Motion::Leaves
        } else {
            Motion::Rests
        }
    }

    /// Does a hand that approaches set off? One that comes to rest, after a touch, approaches something, too.
    fn sets_off(&self, contact: &ContactPrediction, hand: &HandState) -> bool {
        let is_fast = hand.velocity_m_per_s.length() >= self.config.still_m_per_s;
        let is_near = contact.distance_m <= self.config.near_m;
        let way = (contact.point_m - hand.point_m).normalize_or_zero();
        let gains = |course: MeanVelocity| course.gained_m_per_s.dot(way) >= 0.0;
        is_fast || is_near || self.course.velocity().is_none_or(gains)
    }

    /// The share of its way that a place that was looked at is moved by a newer prediction. One of another look counts in full; of one
    /// by the hand's motion as much as its variance says: two estimates of one place.
    fn told_share(&self, newest: &ContactPrediction, off: DVec3) -> f64 {
        if newest.looked_at_since_s.is_some() {
            return 1.0;
        }
        let along = off.normalize_or_zero();
        let Some(variance_m2) = newest.covariance_m2.map(|c| (c * along).dot(along)) else {
            return 1.0;
        };
        let looked_m2 = (self.config.looked_rad * USUAL_LOOK_M).powi(2);
        // NaN counts in full.
        if variance_m2 >= 0.0 {
            looked_m2 / (looked_m2 + variance_m2)
        } else {
            1.0
        }
    }

    const fn sight(&self, eye_m: DVec3) -> Sight {
        Sight {
            eye_m,
            error_rad: self.config.looked_rad,
        }
    }

    /// How far the middle of the board may be from a predicted point along the axes of the surface, the half axes of an
    /// ellipse, m. The contact is in the base frame; what was predicted was in
    /// that of the world.
    pub(in crate::session) fn slack_m(
        &self,
        contact: &ContactPrediction,
        base_from_world: &Pose,
        board: &Board,
        place: &PlaceTolerance,
    ) -> [f64; 2] {
        let Ok(axes) = surface_axes(contact.normal) else {
            return [0.0; 2];
        };
        // Of a face turned about its normal at least the disc about its middle is there.
        let half_m = board.half_width_m.min(board.half_height_m);
        let looked_sd_m = self.config.looked_rad * USUAL_LOOK_M;
        let off = self
            .off
            .map(|(surface, off)| (surface, base_from_world.transform_vector(off)));
        std::array::from_fn(|i| {
            let variance_m2 = contact
                .covariance_m2
                .map_or(self.config.default_sd_m.powi(2), |c| {
                    (c * axes[i]).dot(axes[i])
                });
            // A covariance that holds other places too says little about the one that is looked at. But a point that was held while
            // its prediction moved on is that much further from the touch.
            let (most_m, off_m) = match (contact.looked_at_since_s, off) {
                (Some(_), Some((surface, off))) if surface == contact.surface => {
                    (looked_sd_m, off.dot(axes[i]).abs())
                }
                (Some(_), _) => (looked_sd_m, 0.0),
                // A covariance is that about the point that is held; without one nothing tells how far the newest is off.
                (None, Some((surface, off)))
                    if surface == contact.surface && contact.covariance_m2.is_none() =>
                {
                    (f64::INFINITY, off.dot(axes[i]).abs())
                }
                (None, _) => (f64::INFINITY, 0.0),
            };
            let sd_m = if variance_m2 >= 0.0 {
                variance_m2.sqrt().min(most_m) + off_m
            } else {
                f64::NAN
            };
            let taken_m = place.inset_m + self.config.margin_m + self.config.deviations * sd_m;
            // NaN counts as no slack.
            (half_m - taken_m).max(0.0)
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use hwall_hand::HandPoint;

    /// Nobody knows how soon the board is there.
    fn nobody(_: &ContactPrediction) -> Option<f64> {
        None
    }

    fn contact(covariance_m2: Option<DMat3>) -> ContactPrediction {
        let point_m = DVec3::new(0.6, 0.0, 0.5);
        ContactPrediction {
            covariance_m2,
            distance_m: 0.3,
            source: PredictionSource::Gaze,
            ..ContactPrediction::of_place(SurfaceId(0), point_m, DVec3::X)
        }
    }

    #[test]
    fn what_is_known_of_a_point_is_the_slack_and_nan_is_none() {
        let policy = Policy::new(PolicyConfig::default()).expect("the defaults");
        let slack_m = |variance_m2: f64| {
            let covariance = DMat3::from_diagonal(DVec3::splat(variance_m2));
            let (board, place) = (Board::default(), PlaceTolerance::default());
            policy.slack_m(&contact(Some(covariance)), &Pose::IDENTITY, &board, &place)[0]
        };
        // Half a face less 20 mm of inset, 5 mm of margin and one standard deviation.
        assert!((slack_m(0.0) - 0.075).abs() < 1e-12);
        assert!((slack_m(0.03_f64.powi(2)) - 0.045).abs() < 1e-12);
        assert_eq!(slack_m(1.0), 0.0);
        assert_eq!([slack_m(f64::NAN), slack_m(-1.0)], [0.0; 2]);
    }

    #[test]
    fn a_point_that_is_held_while_its_prediction_moves_on_leaves_less_slack() {
        let mut policy = Policy::new(PolicyConfig::default()).expect("the defaults");
        let (board, place) = (Board::default(), PlaceTolerance::default());
        let newest = |y: f64| {
            let mut newest = contact(None);
            newest.point_m.y += y;
            newest
        };
        let mut slack_m = |y: f64| {
            let (held, _) = policy
                .step(0.1, &[newest(y)], None, None, nobody)
                .expect("a contact");
            assert_eq!(held.point_m, contact(None).point_m);
            policy.slack_m(&held, &Pose::IDENTITY, &board, &place)
        };
        let [free, _] = slack_m(0.0);
        let [near_x, near_y] = slack_m(0.03);
        let least = near_x.min(near_y);
        assert!((free - least - 0.03).abs() < 1e-12, "{free} {least}");
        assert!((near_x.max(near_y) - free).abs() < 1e-12);
    }

    #[test]
    fn a_vague_guess_takes_next_to_no_slack_from_a_place_that_was_looked_at() {
        let slack_m = |newest: ContactPrediction| {
            let mut policy = Policy::new(PolicyConfig::default()).expect("the defaults");
            let vague = Some(DMat3::from_diagonal(DVec3::splat(0.15 * 0.15)));
            let looked_at = ContactPrediction {
                looked_at_since_s: Some(0.0),
                ..contact(vague)
            };
            let (held, _) = policy
                .step(0.1, &[looked_at], None, None, nobody)
                .expect("a contact");
            policy.step(0.11, &[newest], None, None, nobody);
            let (board, place) = (Board::default(), PlaceTolerance::default());
            let slack_m = policy.slack_m(&held, &Pose::IDENTITY, &board, &place);
            slack_m[0].min(slack_m[1])
        };
        let away = |sd_m: f64, looked_at_since_s| {
            let mut p = contact(Some(DMat3::from_diagonal(DVec3::splat(sd_m * sd_m))));
            p.point_m.y += 0.04;
            ContactPrediction {
                looked_at_since_s,
                ..p
            }
        };
        let here = slack_m(ContactPrediction {
            looked_at_since_s: Some(0.0),
            ..contact(Some(DMat3::from_diagonal(DVec3::splat(0.15 * 0.15))))
        });
        assert!((here - 0.049).abs() < 1e-12, "{here}");
        // For one frame the motion of a hand that sets off speaks for a place further on.
        assert!(here - slack_m(away(0.15, None)) < 2e-3);
        // A sure one counts, half at the error of the look; another look in full; NaN as well.
        assert!((here - slack_m(away(0.026, None)) - 0.02).abs() < 1e-12);
        assert!((here - slack_m(away(0.15, Some(0.0))) - 0.04).abs() < 1e-12);
        assert!((here - slack_m(away(f64::NAN, None)) - 0.04).abs() < 1e-12);
    }

    #[test]
    fn at_an_edge_the_surface_is_served_on_which_the_board_is_in_time() {
        let of = |surface: usize, y: f64, probability: f64| {
            let mut p = contact(Some(DMat3::from_diagonal(DVec3::splat(1e-4))));
            p.point_m.y += y;
            ContactPrediction {
                surface: SurfaceId(surface),
                probability,
                ..p
            }
        };
        let soon_on_the_wall =
            |p: &ContactPrediction| Some(if p.surface.0 == 0 { 0.4 } else { 1.0 });
        let served = |ledge: f64, at_m: f64, wall: f64| {
            let mut policy = Policy::new(PolicyConfig::default()).expect("the defaults");
            let ranked = [of(1, at_m, ledge), of(0, 0.0, wall)];
            let (contact, _) = policy
                .step(0.1, &ranked, None, None, soon_on_the_wall)
                .expect("a contact");
            // What is told is what was predicted.
            let told = if contact.surface.0 == 1 { ledge } else { wall };
            assert_eq!(contact.probability, told);
            contact.surface.0
        };
        assert_eq!(served(0.7, 0.05, 0.3), 0);
        // Surer than it is late, or no edge.
        assert_eq!(served(0.85, 0.05, 0.15), 1);
        assert_eq!(served(0.95, 0.05, 0.05), 1);
        assert_eq!(served(0.7, 0.3, 0.3), 1);
    }

    #[test]
    fn a_fast_hand_is_expected_when_it_would_have_slowed_down() {
        let time = hwall_contact::TimeToContact {
            mean_s: 0.6,
            sd_s: None,
        };
        let foreseen = ContactPrediction {
            time_to_contact_s: Some(time),
            ..contact(None)
        };
        let point_m = foreseen.point_m + DVec3::X * 0.2;
        let hand = |speed_m_per_s: f64| HandState {
            t_s: 0.0,
            point: HandPoint::Index,
            point_m,
            velocity_m_per_s: DVec3::NEG_X * speed_m_per_s,
            direction: None,
            smoothed_m: [point_m; 2],
            delay_s: 0.0,
            unseen_s: 0.0,
            palm_m: None,
        };
        let expected_s = |speed_m_per_s: f64| {
            let time = in_time(foreseen, &hand(speed_m_per_s)).time_to_contact_s;
            time.expect("a time").mean_s
        };
        assert!((expected_s(2.0) - 0.3).abs() < 1e-12);
        for slow in [0.5, 0.05, 0.0, -1.0, f64::NAN] {
            assert_eq!(expected_s(slow), 0.6, "{slow}");
        }
    }

    #[test]
    fn a_place_that_is_kept_comes_nearer_in_time() {
        let time = hwall_contact::TimeToContact {
            mean_s: 0.6,
            sd_s: None,
        };
        let foreseen = ContactPrediction {
            time_to_contact_s: Some(time),
            ..contact(None)
        };
        let left_s = |decision: Decision| match decision {
            Decision::Present(contact) => contact.time_to_contact_s.map(|time| time.mean_s),
            _ => None,
        };
        let kept = Decision::Present(foreseen).aged(0.25);
        assert!((left_s(kept).expect("a time") - 0.35).abs() < 1e-12);
        assert_eq!(left_s(kept.aged(1.0)), Some(0.0));
    }

    /// What is decided in the end about a place 0.3 m before a hand that has come so near to it over time, m.
    fn decided(frames: usize, come_m: impl Fn(f64) -> f64) -> Decision {
        let mut policy = Policy::new(PolicyConfig::default()).expect("the defaults");
        let place = contact(Some(DMat3::from_diagonal(DVec3::splat(1e-4))));
        let tip_m = |t_s: f64| place.point_m + DVec3::X * (0.3 - come_m(t_s));
        for frame in 0..frames {
            let t_s = 0.01 * frame as f64;
            let hand = HandState {
                t_s,
                point: HandPoint::Index,
                point_m: tip_m(t_s),
                velocity_m_per_s: (tip_m(t_s) - tip_m(t_s - 0.01)) / 0.01,
                direction: None,
                smoothed_m: [tip_m(t_s); 2],
                delay_s: 0.0,
                unseen_s: 0.0,
                palm_m: None,
            };
            policy.step(t_s, &[place], Some(&hand), None, nobody);
        }
        policy.decision
    }

    #[test]
    fn a_hand_that_sets_off_brings_the_board_and_one_that_trembles_or_comes_to_rest_does_not() {
        let sets_off = |t: f64| (t - 0.5).max(0.0).powi(2);
        assert!(matches!(decided(70, sets_off), Decision::Present(_)));
        let trembles = |t: f64| 0.002 * (std::f64::consts::TAU * 12.0 * t).sin();
        assert_eq!(decided(70, trembles), Decision::Wait);
        let comes_to_rest = |t: f64| -0.2 * (0.7 - t).max(0.0).powi(2);
        assert_eq!(decided(70, comes_to_rest), Decision::Wait);
    }

    #[test]
    fn a_guess_leaves_a_place_that_was_looked_at_only_once_that_is_out_of_the_question() {
        let after = |off_m: f64| {
            let mut policy = Policy::new(PolicyConfig::default()).expect("the defaults");
            let looked_at = ContactPrediction {
                looked_at_since_s: Some(0.2),
                ..contact(Some(DMat3::from_diagonal(DVec3::splat(1e-4))))
            };
            (0..60).for_each(|frame| {
                policy.step(0.01 * f64::from(frame), &[looked_at], None, None, nobody);
            });
            assert!(matches!(policy.decision, Decision::Ready(_)));
            policy.reached_s = 0.6;
            let mut guess = contact(Some(DMat3::from_diagonal(DVec3::splat(
                0.1_f64.powi(2) / 3.0,
            ))));
            guess.point_m.y += off_m;
            (60..80).for_each(|frame| {
                policy.step(0.01 * f64::from(frame), &[guess], None, None, nobody);
                policy.reached_s = 0.6;
            });
            match policy.decision {
                Decision::Present(c) | Decision::Ready(c) => c.point_m.y,
                _ => f64::NAN,
            }
        };
        assert_eq!([after(0.15), after(0.4)], [0.0, 0.4]);
    }

    #[test]
    fn a_hand_that_rests_is_awaited_where_it_probably_comes_again() {
        let of = |source, y: f64, sd_m: f64, probability| {
            let mut p = contact(Some(DMat3::from_diagonal(DVec3::splat(sd_m * sd_m))));
            p.point_m.y += y;
            ContactPrediction {
                source,
                probability,
                ..p
            }
        };
        let decided = |again: f64, elsewhere_sd_m: f64| {
            let mut policy = Policy::new(PolicyConfig::default()).expect("the defaults");
            let mut ranked = [
                of(PredictionSource::TouchedBefore, 0.0, 0.04, again),
                of(PredictionSource::Motion, 0.5, elsewhere_sd_m, 1.0 - again),
            ];
            ranked.sort_by(|a, b| b.probability.total_cmp(&a.probability));
            let mut last = None;
            for frame in 0..30 {
                last = policy.step(0.01 * f64::from(frame), &ranked, None, None, nobody);
            }
            last.expect("a contact")
        };
        // What else may come is too vague for any place of a board, although it is more probable.
        assert!(matches!(decided(0.45, 0.18), (c, Decision::Ready(_)) if c.point_m.y == 0.0));
        // Hardly ever again: the arm waits for what the hand says.
        assert!(matches!(decided(0.1, 0.18), (_, Decision::Wait)));
        let (elsewhere, _) = decided(0.45, 0.03);
        assert_eq!(elsewhere.point_m.y, 0.5);
    }

    #[test]
    fn a_prediction_that_is_unsure_moves_nothing() {
        for variance_m2 in [0.09, f64::NAN] {
            let mut policy = Policy::new(PolicyConfig::default()).expect("the defaults");
            let guess = contact(Some(DMat3::from_diagonal(DVec3::splat(variance_m2))));
            for frame in 0..50 {
                let step = policy.step(0.01 * f64::from(frame), &[guess], None, None, nobody);
                assert!(matches!(step, Some((_, Decision::Wait))), "{step:?}");
            }
        }
    }
}
