//! A session: tracked hand in, arm commands out.

mod config;
mod control;
mod drive;
mod event;
mod handover;
mod perceiving;
mod perception;
mod planner;
mod policy;
mod response;
mod target_control;
mod waiting;
mod worker;
mod world;

pub use config::{SessionConfig, session_supervisor};
pub use control::{Control, MovingSurface, SessionState};
pub use drive::{Controller, Cycle, Surroundings, drive};
pub use event::{Event, EventKind, Goal, PredictedContact};
pub use perception::Perception;
pub use planner::Planner;
use planner::Planning;
pub use policy::{
    Explanation, Explanations, PolicyConfig, SlackConfig, WeighedChoice, WeighedPlace,
};
pub use target_control::TargetControl;
pub use world::WorldPose;

use crate::error::SessionError;
use crate::objects::objects_of;
#[cfg(feature = "texture")]
use crate::texture::{BoardTexture, Presenter, TextureLevels};
use crate::walls::Walls;
use control::Safety;
use event::EventQueue;
use handover::{Guidance, WorldBarriers, felt_touches, handover, openings};
use hwall_contact::{ContactPrediction, Predictor};
use hwall_hand::{GazeFilter, HandFilter, HandFrame, Tracking};
use hwall_haptics::body::Room;
use hwall_haptics::{
    Arm, ArmCommand, ArmState, Board, MovingObject, ObjectCommand, ObjectRenderingConfig,
    PlannerConfig, RenderedObject, Renderer, SafeReason,
};
use hwall_kinematics::ArmKinematics;
use hwall_scene::{Scene, SurfaceId};
use perceiving::{Apart, Input, Perceiving};
use perception::Newest;
use policy::Policy;
use std::io;
use std::ops::{Deref, DerefMut};
use std::sync::Arc;
use waiting::Waiting;
use worker::Worker;
use world::World;

/// Turns a tracked hand into commands for the arm that carries the board.
///
/// Works with any [`ArmKinematics`] (closed form for S-R-S arms, numeric for any other chain of up to seven joints) and any [`Predictor`].
/// The session sees the arm only through [`ArmState`], so a simulated and a real arm look the same. The session reads no clock; all times
/// come with the inputs.
///
/// Call [`Session::frame`] at the rate of the tracker, [`Session::step`] at that of the control loop, and [`Session::plan`] after each
/// step, once the command has been sent: a step alone never searches for a path. [`Session::split`] gives the three parts, one for each
/// thread. [`drive`] runs the loop for you.
pub struct Session<P> {
    perceiving: Perceiving<P>,
    control: Control,
    planning: Planning,
}

impl<P: Predictor> Session<P> {
    /// Takes an arm (its tool is replaced by the face of the board), a scene in the arm's base frame, prior knowledge of the walls, and a
    /// contact predictor. [`Walls::of`] computes that knowledge; [`Walls::default`] is empty, so that the arm's solver decides alone; maps
    /// without an atlas are enough, too.
    ///
    /// # Errors
    /// A setting outside its range; more roughnesses in the scene than the board has levels;
    /// [`SessionError::TooManyUprightPieces`], above 2,048 of them.
    pub fn new(
        arm: &dyn ArmKinematics,
        board: &Board,
        scene: Scene,
        walls: impl Into<Walls>,
        predictor: P,
        config: SessionConfig,
    ) -> Result<Self, SessionError> {
        #[cfg(feature = "texture")]
        let max_guidance_age_s = config.renderer.watchdog.max_target_age_s;
        let mut renderer = Renderer::new(arm, board, config.renderer)?;
        let walls = walls.into();
        walls.validate(&**renderer.arm())?;
        let (barriers, barrier_receiver) = WorldBarriers::new(&scene)?;
        renderer.set_barriers(barriers.all().clone());
        let objects = if config.objects {
            touchable_objects(&scene, &mut renderer, config.object_command)?
        } else {
            Vec::new()
        };
        let (sender, receiver) = handover();
        let (opening_sender, opening_receiver) = openings(&objects);
        let (feeler, felt) = felt_touches();
        #[cfg(feature = "texture")]
        let levels = match config.texture {
            true => TextureLevels::for_scene(&scene, board)?,
            false => None,
        };
        config.in_place.validate()?;
        let safety = match config.supervisor {
            Some(mut supervisor) => {
                let given = supervisor.room.is_some();
                if !given {
                    // People and the support of the arm stand on the scene's floor.
                    let lowest_m = scene.bounds().min_m.z;
                    supervisor.room = Some(Room::with_floor(lowest_m.min(0.0))?);
                }
                let safety = Safety::new(arm, board, supervisor)?;
                if let (true, Some(q), Some(separation)) =
                    (given, &walls.waiting, safety.separation())
                {
                    separation.body().stands_outside(q)?;
                }
                safety
            }
            None => Safety::none(),
        };
        let mut perception = Perception {
            #[cfg(feature = "texture")]
            presenter: Presenter::new(Arc::clone(renderer.arm())),
            scene,
            policy: Policy::new(
                config.policy,
                walls.budget_s,
                config.policy.slack.reach_m(board, &config.in_place),
            )?,
            slack: config.policy.slack,
            waiting: Waiting::of(&walls),
            walls,
            predictor,
            hand: HandFilter::new(config.hand)?,
            gaze: GazeFilter::new(config.gaze)?,
            scratch: renderer.arm().scratch(),
            arm: Arc::clone(renderer.arm()),
            board: *board,
            in_place: config.in_place,
            world: World::default(),
            #[cfg(feature = "texture")]
            levels: levels.clone(),
            arm_minus_tracker_s: 0.0,
            sender,
            untold: None,
            barriers,
            openings: opening_receiver,
            gestures: None,
            felt: config.adapts.then_some(felt),
            events: EventQueue::new(),
            newest: Newest::default(),
        };
        perception.set_clock_offset_s(config.arm_minus_tracker_s)?;
        #[cfg(feature = "texture")]
        let texture = levels
            .as_ref()
            .map(|levels| BoardTexture::new(levels, Arc::clone(renderer.arm())));
        if let Some(separation) = safety.separation() {
            renderer.keep_clear(separation);
        }
        let scratch = renderer.arm().scratch();
        let planner = renderer.take_planner();
        let control = Control {
            renderer,
            board: *board,
            in_place: config.in_place,
            #[cfg(feature = "texture")]
            texture,
            receiver,
            openings: opening_sender,
            feeler,
            objects,
            touched_object: None,
            #[cfg(feature = "texture")]
            touched_at: 0.0,
            guidance: Guidance::default(),
            scratch,
            events: EventQueue::new(),
            safety,
            state: SessionState::Holding(hwall_haptics::HoldReason::NoTarget),
            step: None,
            contact: None,
            late: false,
            late_announced: false,
            short: false,
            link_in_front: None,
            rested_short: false,
            stays_until_s: None,
            #[cfg(feature = "texture")]
            max_guidance_age_s,
            unreachable: None,
        };
        Ok(Self {
            perceiving: Perceiving::Here(Box::new(perception)),
            control,
            planning: Planning::Here(Box::new(Planner {
                parts: planner.map(|planner| (planner, barrier_receiver)),
            })),
        })
    }
}

/// Gives the moving surfaces of a scene to the renderer.
fn touchable_objects(
    scene: &Scene,
    renderer: &mut Renderer,
    command: ObjectCommand,
) -> Result<Vec<SurfaceId>, SessionError> {
    let mut surfaces = Vec::new();
    let mut rendered = Vec::new();
    for found in objects_of(scene)? {
        let mut object = MovingObject::new(found.config)?;
        object.set_state(scene.opening(found.surface).unwrap_or(0.0), 0.0)?;
        // The scene has the surface at its current opening; the path starts at opening zero.
        rendered.push(RenderedObject {
            object,
            path: found.path,
        });
        surfaces.push(found.surface);
    }
    renderer.set_objects(command, ObjectRenderingConfig::default(), rendered)?;
    Ok(surfaces)
}

impl<P: Predictor> Session<P> {
    /// Takes one frame of the tracker, see [`Perception::frame`].
    pub fn frame(&mut self, frame: &HandFrame) {
        match &mut self.perceiving {
            Perceiving::Here(perception) => perception.frame(frame),
            Perceiving::Apart(apart) => apart.put(Input::Frame(*frame)),
        }
    }

    /// Sets the pose of the virtual world, see [`Perception::world`].
    ///
    /// # Errors
    /// As for [`Perception::world`]. If perception runs on its own thread, only the event [`EventKind::WorldRefused`] reports them.
    pub fn world(&mut self, pose: &WorldPose) -> Result<(), SessionError> {
        match &mut self.perceiving {
            Perceiving::Here(perception) => perception.world(pose),
            Perceiving::Apart(apart) => {
                apart.put(Input::World(*pose));
                Ok(())
            }
        }
    }

    /// Sets the clock offset, s, see [`Perception::set_clock_offset_s`].
    ///
    /// # Errors
    /// NaN or infinity.
    pub fn set_clock_offset_s(&mut self, arm_minus_tracker_s: f64) -> Result<(), SessionError> {
        hwall_numeric::check::finite("arm_minus_tracker_s", arm_minus_tracker_s)?;
        match &mut self.perceiving {
            Perceiving::Here(perception) => perception.set_clock_offset_s(arm_minus_tracker_s),
            Perceiving::Apart(apart) => {
                apart.put(Input::ClockOffset(arm_minus_tracker_s));
                Ok(())
            }
        }
    }

    /// The command for the coming cycle, see [`Control::step`].
    pub fn step(&mut self, now_s: f64, state: &ArmState) -> ArmCommand {
        if let Perceiving::Apart(apart) = &mut self.perceiving {
            apart.hear();
        }
        let command = self.control.step(now_s, state);
        if let Perceiving::Here(perception) = &mut self.perceiving {
            perception.take_openings();
        }
        command
    }

    /// Searches for goals and paths, after the command of a step was sent; takes about 0.5 ms at most, see [`Planner::plan`]. Without it
    /// the arm stays where it is.
    pub fn plan(&mut self) {
        match &mut self.planning {
            Planning::Here(planner) => {
                planner.plan();
            }
            Planning::OnThread(thread) => thread.wake(),
        }
        if self.has_lost_thread() {
            self.control.stop_for(SafeReason::LostThread);
        }
    }

    /// Has a thread of this session panicked? [`plan`](Self::plan) then stops the session, again after each reset.
    #[must_use]
    pub fn has_lost_thread(&self) -> bool {
        let planner = match &self.planning {
            Planning::Here(_) => false,
            Planning::OnThread(thread) => thread.is_over(),
        };
        planner || matches!(&self.perceiving, Perceiving::Apart(apart) if apart.is_lost())
    }

    /// Processes frames on a separate thread from now on: [`frame`](Self::frame) then only hands them over, and the first
    /// [`step`](Self::step) after processing uses the result, usually the next step. If the thread panics, a session with a supervisor
    /// stops, latched.
    ///
    /// # Errors
    /// The system cannot start a thread.
    pub fn perceive_on_thread(self) -> io::Result<Self>
    where
        P: Send + 'static,
    {
        let mut session = self.perceive_when_told();
        if let Perceiving::Apart(apart) = &mut session.perceiving {
            apart.spawn()?;
        }
        Ok(session)
    }

    /// Like [`perceive_on_thread`](Self::perceive_on_thread), but without a thread; steps use the results after
    /// [`take_perceived`](Self::take_perceived): for a replay.
    #[must_use]
    pub fn perceive_when_told(mut self) -> Self {
        self.perceiving = match self.perceiving {
            Perceiving::Here(perception) => Perceiving::Apart(Box::new(Apart::new(*perception))),
            apart => apart,
        };
        self
    }

    /// For a recording: how many times a step received new results; `None` unless frames are processed on their own thread.
    #[must_use]
    pub fn perceived(&self) -> Option<u64> {
        match &self.perceiving {
            Perceiving::Here(_) => None,
            Perceiving::Apart(apart) => apart.taken(),
        }
    }

    /// Gives the results so far to the next step: for a replay.
    pub fn take_perceived(&mut self) {
        if let Perceiving::Apart(apart) = &mut self.perceiving {
            apart.take_without_thread();
        }
    }

    /// Processes one pending input; returns whether there was one. For a replay.
    pub fn perceive_next(&mut self) -> bool {
        match &self.perceiving {
            Perceiving::Here(_) => false,
            Perceiving::Apart(apart) => apart.perceive_next(),
        }
    }

    /// Searches for goals and paths on a separate thread from now on; [`plan`](Self::plan) then only wakes it. [`planned`](Self::planned)
    /// reports which plan a step used. If the thread panics, a session with a supervisor stops, latched.
    ///
    /// # Errors
    /// The system cannot start a thread; the session is then dropped.
    pub fn plan_on_thread(mut self) -> io::Result<Self> {
        if let Planning::Here(mut planner) = self.planning {
            planner.set_config(PlannerConfig::on_thread());
            let thread = Worker::spawn("planner", *planner, Planner::plan)?;
            self.planning = Planning::OnThread(thread);
        }
        Ok(self)
    }

    /// For a recording: the step that the planner's newest result is for, and the number of the set of surfaces it used; `None` unless the
    /// planner runs on its own thread.
    #[must_use]
    pub const fn planned(&self) -> Option<[u64; 2]> {
        match self.planning {
            Planning::Here(_) => None,
            Planning::OnThread(_) => Some(self.control.renderer().follower().planned()),
        }
    }

    /// The planner, unless it runs on its own thread: for a replay.
    pub fn planner_mut(&mut self) -> Option<&mut Planner> {
        match &mut self.planning {
            Planning::Here(planner) => Some(planner),
            Planning::OnThread(_) => None,
        }
    }

    /// Runs the loop for an arm until the surroundings end it, see [`drive`].
    ///
    /// # Errors
    /// As for [`drive`].
    pub fn drive<R: Arm, S: Surroundings<R> + ?Sized>(
        &mut self,
        arm: &mut R,
        surroundings: &mut S,
        after: impl FnMut(&mut Self, &mut R, &mut S, &Cycle) -> Result<(), R::Error>,
    ) -> Result<(), R::Error> {
        drive(self, arm, surroundings, after)
    }

    /// Presents these levels instead of the scene's, from the next touch on: for studies, where a condition is an orientation and a speed.
    /// Call it between touches only; it allocates.
    #[cfg(feature = "texture")]
    pub fn set_texture_levels(&mut self, levels: TextureLevels) {
        let arm = Arc::clone(self.control.renderer.arm());
        self.control.texture = Some(BoardTexture::new(&levels, arm));
        self.perception_mut().levels = Some(levels);
    }

    /// What the board is doing, as of the last step.
    #[must_use]
    pub const fn state(&self) -> SessionState {
        self.control.state()
    }

    /// The hand in the base frame, as of the newest frame known to a step; `None` before the first.
    #[must_use]
    pub fn tracking(&self) -> Option<&Tracking> {
        match &self.perceiving {
            Perceiving::Here(perception) => perception.tracking(),
            Perceiving::Apart(apart) => apart.tracking(),
        }
    }

    /// The contact that the board serves, in the base frame, as of the newest frame known to a step.
    #[must_use]
    pub fn contact(&self) -> Option<ContactPrediction> {
        match &self.perceiving {
            Perceiving::Here(perception) => perception.contact(),
            Perceiving::Apart(apart) => apart.contact(),
        }
    }

    /// The next event not yet taken: first those of frames, then those of steps, each in order of time.
    pub fn next_event(&mut self) -> Option<Event> {
        let event = match &mut self.perceiving {
            Perceiving::Here(perception) => perception.next_event(),
            Perceiving::Apart(apart) => apart.next_event(),
        };
        event.or_else(|| self.control.next_event())
    }

    /// The tracker's half. If it runs on its own thread, this blocks until the thread has processed its inputs, and blocks the thread until
    /// the returned guard is dropped.
    #[must_use]
    pub fn perception(&self) -> impl Deref<Target = Perception<P>> + '_ {
        self.perceiving.access()
    }

    /// The tracker's half; as [`perception`](Self::perception).
    pub fn perception_mut(&mut self) -> impl DerefMut<Target = Perception<P>> + '_ {
        self.perceiving.access_mut()
    }

    /// The arm's half.
    #[must_use]
    pub const fn control(&self) -> &Control {
        &self.control
    }

    /// Stops the arm, latched, see [`Control::stop`].
    pub fn stop(&mut self) {
        self.control.stop();
    }

    /// Reports that the arm did not take the last command, see [`Control::refused`].
    pub fn refused(&mut self) {
        self.control.refused();
    }

    /// Ends a latched fault, see [`Control::reset`].
    pub fn reset(&mut self) {
        self.control.reset();
    }

    /// Splits the session into three parts, one for each thread. Results of the tracker's part reach the arm's by a hand-over in which the
    /// newest wins and neither side waits. Door openings, world poses and plans are handed over in the same way.
    #[must_use]
    pub fn split(self) -> (Perception<P>, Planner, Control) {
        let planner = match self.planning {
            Planning::Here(planner) => *planner,
            Planning::OnThread(mut thread) => thread.end().unwrap_or_default(),
        };
        let perception = match self.perceiving {
            Perceiving::Here(perception) => *perception,
            Perceiving::Apart(apart) => apart.end(),
        };
        (perception, planner, self.control)
    }
}
