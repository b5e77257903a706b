//! What a hand is about to do, inferred from its shape, its attitude to the surface and its motion before the contact.
//!
//! A mixture of motion primitives with one component for each [`Task`] follows every reach: the fingertips relative to the palm and the velocity
//! of the palm, both in the axes of the predicted surface, so that place and wall do not matter. A session answers a stroke, a push and a grasp
//! differently, see [`Perception::infer_gestures`](crate::Perception::infer_gestures).

use crate::error::SessionError;
use crate::response::Task;
use glam::DVec3;
use hwall_bip::{Bank, BankConfig, Basis, Covariance, Demonstration, Group, Mixture};
use hwall_bip::{Observation, TrainingConfig};
use hwall_hand::{HandFrame, HandState, ReachWatch, WatchConfig, WatchUpdate};
use hwall_haptics::surface_axes;

/// Values of a sample: five fingertips in three axes, speed along the surface and velocity towards it.
const VALUES: usize = 17;
/// Deviation of each value from the demonstrated range, m. Larger than the noise of a tracker, because a new person deviates in the same direction
/// for many samples.
const NOISE_M: f64 = 0.04;
/// Velocities count as the distance covered in this time, s.
const AHEAD_S: f64 = 0.2;
/// Time constant of the low pass on the velocity, s.
const SMOOTH_S: f64 = 0.03;
/// A task is inferred from this probability on.
const LIKELY: f64 = 0.5;

/// A reach to learn from.
#[derive(Debug, Clone, Copy)]
pub struct GestureDemonstration<'a> {
    /// What the hand did.
    pub task: Task,
    /// Samples up to the contact, in order of time; only those with palm and all fingertips count.
    pub frames: &'a [HandFrame],
    /// Normal of the touched surface, in the frame of the samples.
    pub normal: DVec3,
}

/// One component for each task. Immutable; [`filter`](Self::filter) follows a hand with it.
#[derive(Debug, Clone)]
pub struct GestureModel {
    bank: Bank,
    tasks: Vec<Task>,
}

impl GestureModel {
    /// Learns from at least two reaches of each task that occurs.
    ///
    /// # Errors
    /// No reach with palm and fingertips; a single one of a task; times that do not increase.
    pub fn train(reaches: &[GestureDemonstration<'_>]) -> Result<Self, SessionError> {
        let (mut shown, mut labels) = (Vec::new(), Vec::new());
        for reach in reaches {
            let (mut motion, mut times_s, mut values) =
                (PalmMotion::default(), Vec::new(), Vec::new());
            for frame in reach.frames {
                if let Some(row) = motion.sample(frame, reach.normal) {
                    times_s.push(frame.t_s);
                    values.extend(row);
                }
            }
            if times_s.len() > 1 {
                shown.push(Demonstration::from_timestamps(times_s, VALUES, values)?);
                labels.push(reach.task as usize);
            }
        }
        if shown.is_empty() {
            let count = reaches.len();
            return Err(SessionError::UnseenHand { count });
        }
        let hand = Group::observed("hand", VALUES, Basis::Legendre { count: 7 });
        let config = TrainingConfig::new(vec![hand]);
        let mixture = Mixture::train(&shown, &config, &labels, Covariance::Own)?;
        let bank = mixture.bank(&BankConfig::default())?;
        let occurs = |task: &Task| labels.contains(&(*task as usize));
        let tasks = Task::ALL.into_iter().filter(occurs).collect();
        Ok(Self { bank, tasks })
    }

    /// A filter that follows reaches, one after the other.
    ///
    /// # Errors
    /// None with the built-in settings.
    pub fn filter(&self) -> Result<GestureFilter, SessionError> {
        Ok(GestureFilter {
            watch: ReachWatch::new(WatchConfig::default())?,
            reach: Reach {
                bank: self.bank.clone(),
                motion: PalmMotion::default(),
                last_s: None,
            },
            fresh: self.clone(),
        })
    }
}

/// Follows a hand. Steps do not allocate.
#[derive(Debug, Clone)]
pub struct GestureFilter {
    fresh: GestureModel,
    watch: ReachWatch,
    reach: Reach,
}

#[derive(Debug, Clone)]
struct Reach {
    bank: Bank,
    motion: PalmMotion,
    last_s: Option<f64>,
}

impl GestureFilter {
    /// Takes the next frame, the filtered hand unless it is lost, and the normal of the surface that is probably touched. Without a normal, or
    /// without palm or a fingertip, the frame changes nothing.
    ///
    /// # Errors
    /// Arithmetic that overflowed; the reach is then forgotten.
    pub fn step(
        &mut self,
        frame: &HandFrame,
        hand: Option<&HandState>,
        normal: Option<DVec3>,
    ) -> Result<(), SessionError> {
        let update = self.watch.step(frame, hand);
        let done = match (update, normal) {
            (WatchUpdate::Begun { samples }, _) => {
                self.forget_reach();
                let normal = normal.unwrap_or(DVec3::ZERO);
                let mut seen = self.watch.latest(samples);
                seen.try_for_each(|frame| self.reach.follow(frame, normal))
            }
            // A frame that the hand's filter rejects is not evidence.
            (WatchUpdate::UnderWay, Some(normal)) if hand.is_some() => {
                self.reach.follow(frame, normal)
            }
            _ => Ok(()),
        };
        done.inspect_err(|_| self.reset())
    }

    /// Forgets the hand: the next frame is of another person, or in another frame of reference.
    pub fn reset(&mut self) {
        self.watch.reset();
        self.forget_reach();
    }

    fn forget_reach(&mut self) {
        // Both banks belong to one model, so their sizes agree.
        if self.reach.bank.restart_from(&self.fresh.bank).is_err() {
            self.reach.bank.clone_from(&self.fresh.bank);
        }
        self.reach.motion = PalmMotion::default();
        self.reach.last_s = None;
    }

    /// Probability of each task in the present or last reach, in the order of [`Task::ALL`].
    #[must_use]
    pub fn probabilities(&self) -> [f64; Task::ALL.len()] {
        let mut all = [0.0; _];
        for (component, task) in self.fresh.tasks.iter().enumerate() {
            all[*task as usize] = self.reach.bank.component_probability(component);
        }
        all
    }

    /// The task of the present or last reach, if one is likely.
    #[must_use]
    pub fn task(&self) -> Option<Task> {
        let probabilities = self.probabilities();
        let is_likely = |task: &Task| probabilities[*task as usize] > LIKELY;
        self.reach.last_s?;
        Task::ALL.into_iter().find(is_likely)
    }
}

impl Reach {
    fn follow(&mut self, frame: &HandFrame, normal: DVec3) -> Result<(), SessionError> {
        let Some(values) = self.motion.sample(frame, normal) else {
            return Ok(());
        };
        if let Some(last_s) = self.last_s {
            self.bank.predict(frame.t_s - last_s)?;
        }
        self.last_s = Some(frame.t_s);
        let variances_m2 = [NOISE_M * NOISE_M; VALUES];
        let each: [usize; VALUES] = std::array::from_fn(|i| i);
        let seen = Observation::new(&each, &values).with_variances(&variances_m2);
        self.bank.observe(&seen)?;
        Ok(())
    }
}

/// The smoothed velocity of the palm.
#[derive(Debug, Clone, Copy, Default)]
struct PalmMotion {
    last: Option<(f64, DVec3)>,
    velocity_m_per_s: DVec3,
}

impl PalmMotion {
    /// The values of a frame, m; `None` without palm or a fingertip, or if the time does not increase.
    fn sample(&mut self, frame: &HandFrame, normal: DVec3) -> Option<[f64; VALUES]> {
        let [right, up] = surface_axes(normal).ok()?;
        let axes = [right, up, normal.normalize_or_zero()];
        let [palm_m, tips_m @ ..] = frame.points();
        let palm_m = palm_m?;
        if let Some((last_s, last_m)) = self.last {
            let dt_s = frame.t_s - last_s;
            if dt_s <= 0.0 {
                return None;
            }
            let share = -(-dt_s / SMOOTH_S).exp_m1();
            self.velocity_m_per_s = self.velocity_m_per_s.lerp((palm_m - last_m) / dt_s, share);
        }
        self.last = Some((frame.t_s, palm_m));
        let mut values = [0.0; VALUES];
        for (three, tip_m) in values.chunks_exact_mut(3).zip(tips_m) {
            let from_palm = tip_m? - palm_m;
            three.copy_from_slice(&axes.map(|axis| from_palm.dot(axis)));
        }
        let towards = self.velocity_m_per_s.dot(axes[2]);
        let along = (self.velocity_m_per_s - axes[2] * towards).length();
        values[VALUES - 2..].copy_from_slice(&[along * AHEAD_S, towards * AHEAD_S]);
        values
            .iter()
            .all(|value| value.is_finite())
            .then_some(values)
    }
}
