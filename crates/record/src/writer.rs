//! The writing thread: takes values, writes messages.

use crate::error::RecordError;
use crate::file::GrowingFile;
use crate::input::Input;
use crate::message::look::{self, Level, MovingFrame};
use crate::message::session;
use crate::recorder_config::RecorderConfig;
use crate::schema::descriptor_set;
use crate::setup::Setup;
use crate::skeleton::Skeleton;
use crate::view::View;
use hwall::geometry::Pose;
use hwall::hand::Tracking;
use hwall::scene::{Scene, SurfaceId};
use hwall::{Event, EventKind, objects_of};
use hwall_protobuf::Writer as Message;
use mcap::records::MessageHeader;
use mcap::{WriteOptions, Writer as McapWriter};
use std::collections::BTreeMap;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, AtomicU64, Ordering};
use std::sync::mpsc::{Receiver, TryRecvError};
use std::time::{Duration, Instant};

/// Sleep of the thread when there is nothing to do. The loop does not wake it, because that would cost the
/// loop a system call.
const NAP: Duration = Duration::from_millis(2);
/// Pause between two sessions of a recording, ns.
const PAUSE_NS: u64 = 1_000_000_000;
/// Larger times are invalid, s: 30 years.
const LONGEST_S: f64 = 1e9;

/// An item for the writing thread. `sequence` counts the messages of the session, so that a reader sees gaps.
// Boxing the large variants would allocate in the loop.
#[allow(clippy::large_enum_variant)]
#[derive(Debug)]
pub(crate) enum Item {
    Input(u64, Input),
    View(View),
    Event(Event),
}

/// The static part of the drawing.
pub(crate) struct Stage {
    skeleton: Skeleton,
    scene: Scene,
    moving: Vec<MovingFrame>,
    surfaces: Vec<(SurfaceId, String)>,
}

impl Stage {
    pub(crate) fn new(skeleton: Skeleton, scene: &Scene) -> Result<Self, RecordError> {
        let mut scene = scene.clone();
        let (mut moving, mut surfaces) = (Vec::new(), Vec::new());
        for object in objects_of(&scene)? {
            let name = format!("surface/{}", scene.surface(object.surface).name);
            surfaces.push((object.surface, name.clone()));
            moving.push(MovingFrame {
                name,
                path: object.path,
            });
        }
        // Surfaces are drawn in their own frames, in which they are at opening zero.
        for (surface, _) in &surfaces {
            scene.set_opening(*surface, 0.0)?;
        }
        Ok(Self {
            skeleton,
            scene,
            moving,
            surfaces,
        })
    }
}

/// The channels by number in [`CHANNELS`].
#[derive(Clone, Copy)]
enum Topic {
    Setup,
    Run,
    Frame,
    World,
    Request,
    Cycle,
    End,
    Transforms,
    FixedTransforms,
    Scene,
    SceneNow,
    Hand,
    State,
    Log,
}

/// Topic and schema, in the order of [`Topic`].
const CHANNELS: [(&str, &str); 14] = [
    (session::SETUP, "hwall.Setup"),
    (session::RUN, "hwall.Run"),
    (session::FRAME, "hwall.Frame"),
    (session::WORLD, "hwall.World"),
    (session::REQUEST, "hwall.Request"),
    (session::CYCLE, "hwall.Cycle"),
    (session::END, "hwall.End"),
    ("/tf", "foxglove.FrameTransforms"),
    ("/tf_static", "foxglove.FrameTransforms"),
    ("/scene", "foxglove.SceneUpdate"),
    ("/scene/now", "foxglove.SceneUpdate"),
    ("/hand", "foxglove.PosesInFrame"),
    ("/state", "hwall.State"),
    ("/log", "foxglove.Log"),
];

pub(crate) struct Writer {
    mcap: McapWriter<GrowingFile>,
    is_last: Arc<AtomicBool>,
    channels: [u16; CHANNELS.len()],
    counts: [u32; CHANNELS.len()],
    buffer: Vec<u8>,
    stage: Stage,
    base_from_world: Pose,
    scene_every: u32,
    views: u32,
    most_triangles: usize,
    chunk_bytes: usize,
    flush_after: Duration,
    /// Messages since the last flush.
    pending: usize,
    flushed: Instant,
    /// Time of the arm's zero in the file, ns.
    zero_ns: u64,
    /// The newest time in the file, ns.
    newest_ns: u64,
    begun: bool,
    /// Number of the next message of the session.
    expected: u64,
    dropped: Arc<AtomicU64>,
}

impl Writer {
    pub(crate) fn new(
        file: GrowingFile,
        is_last: Arc<AtomicBool>,
        stage: Stage,
        config: &RecorderConfig,
        dropped: Arc<AtomicU64>,
    ) -> Result<Self, RecordError> {
        let options = WriteOptions::new()
            .compression(None)
            .library(concat!("hwall-record ", env!("CARGO_PKG_VERSION")))
            .chunk_size(None)
            .disable_seeking(true);
        let mut mcap = options.create(file)?;
        let mut channels = [0; CHANNELS.len()];
        for (id, (topic, schema)) in channels.iter_mut().zip(CHANNELS) {
            let schema = mcap.add_schema(schema, "protobuf", &descriptor_set(schema))?;
            *id = mcap.add_channel(schema, topic, "protobuf", &BTreeMap::new())?;
        }
        Ok(Self {
            mcap,
            is_last,
            channels,
            counts: [0; CHANNELS.len()],
            buffer: Vec::with_capacity(4096),
            stage,
            base_from_world: Pose::IDENTITY,
            scene_every: config.scene_every,
            views: 0,
            most_triangles: config.most_triangles,
            chunk_bytes: config.chunk_bytes,
            flush_after: Duration::from_secs_f64(config.flush_s),
            pending: 0,
            flushed: Instant::now(),
            zero_ns: config.epoch_ns,
            newest_ns: config.epoch_ns,
            begun: false,
            expected: 0,
            dropped,
        })
    }

    /// Writes the setup of the session immediately.
    pub(crate) fn setup(&mut self, setup: &Setup) -> Result<(), RecordError> {
        let t_ns = self.zero_ns;
        self.write(Topic::Setup, t_ns, |m, _| session::write_setup(m, setup))?;
        self.flush()
    }

    /// Runs until the recorder is finished or dropped. Returns the size of the file, bytes.
    pub(crate) fn run(mut self, items: &Receiver<Item>) -> Result<u64, RecordError> {
        loop {
            match items.try_recv() {
                Ok(item) => {
                    self.item(item)?;
                    if self.pending >= self.chunk_bytes {
                        self.flush()?;
                    }
                }
                Err(TryRecvError::Empty) => {
                    if self.pending > 0 && self.flushed.elapsed() >= self.flush_after {
                        self.flush()?;
                    }
                    std::thread::sleep(NAP);
                }
                Err(TryRecvError::Disconnected) => return self.end(),
            }
        }
    }

    fn end(mut self) -> Result<u64, RecordError> {
        let dropped = self.dropped.load(Ordering::Relaxed);
        self.input(self.expected, &Input::End { dropped })?;
        self.flush()?;
        self.is_last.store(true, Ordering::Relaxed);
        self.mcap.finish()?;
        let mut file = self.mcap.into_inner();
        let flushed = std::io::Write::flush(&mut file);
        flushed.map_err(mcap::McapError::Io)?;
        let end = std::io::Seek::stream_position(&mut file);
        Ok(end.map_err(mcap::McapError::Io)?)
    }

    fn flush(&mut self) -> Result<(), RecordError> {
        self.mcap.flush()?;
        self.pending = 0;
        self.flushed = Instant::now();
        Ok(())
    }

    fn item(&mut self, item: Item) -> Result<(), RecordError> {
        match item {
            Item::Input(sequence, input) => self.input(sequence, &input),
            Item::View(view) => self.view(&view),
            Item::Event(event) => self.event(&event),
        }
    }

    fn input(&mut self, sequence: u64, input: &Input) -> Result<(), RecordError> {
        self.gap(sequence)?;
        let (topic, t_ns) = match input {
            Input::Run(_) => {
                if self.begun {
                    self.zero_ns = self.newest_ns.saturating_add(PAUSE_NS);
                }
                self.begun = true;
                (Topic::Run, self.zero_ns)
            }
            // Its time stamp is from the tracker's clock; in the file, the frame has its time of arrival.
            Input::Frame(_) => (Topic::Frame, self.newest_ns),
            Input::World(_) => (Topic::World, self.newest_ns),
            Input::Request(_) => (Topic::Request, self.newest_ns),
            Input::Cycle(cycle) => (Topic::Cycle, self.time_ns(cycle.t_s)),
            Input::End { .. } => (Topic::End, self.newest_ns),
        };
        self.write(topic, t_ns, |m, _| session::write(m, sequence, input))?;
        match input {
            Input::Run(_) => {
                self.base_from_world = Pose::IDENTITY;
                self.draw_stage(t_ns)
            }
            Input::Frame(frame) => self.write(Topic::Hand, t_ns, |m, _| look::hand(m, t_ns, frame)),
            Input::World(world) => {
                self.base_from_world = world.base_from_world;
                self.draw_fixed(t_ns)
            }
            _ => Ok(()),
        }
    }

    fn view(&mut self, view: &View) -> Result<(), RecordError> {
        let t_ns = self.time_ns(view.t_s);
        let finite = view.q.iter().all(|q| q.is_finite());
        if finite {
            self.write(Topic::Transforms, t_ns, |m, stage| {
                look::transforms(m, t_ns, &stage.skeleton, &stage.moving, view);
            })?;
        }
        self.write(Topic::State, t_ns, |m, _| look::state(m, view))?;
        let drawn = self.scene_every > 0 && self.views.is_multiple_of(self.scene_every);
        self.views = self.views.wrapping_add(1);
        if drawn && finite {
            self.write(Topic::SceneNow, t_ns, |m, stage| {
                look::scene_now(m, t_ns, &stage.skeleton, view);
            })?;
        }
        Ok(())
    }

    fn event(&mut self, event: &Event) -> Result<(), RecordError> {
        let t_ns = self.time_ns(event.t_s);
        let (level, text) = said(&event.kind);
        self.log(t_ns, level, &text)
    }

    fn log(&mut self, t_ns: u64, level: Level, text: &str) -> Result<(), RecordError> {
        self.write(Topic::Log, t_ns, |m, _| look::log(m, t_ns, level, text))
    }

    /// Draws arm, board and surfaces at the start of a session.
    fn draw_stage(&mut self, t_ns: u64) -> Result<(), RecordError> {
        let triangles = self.stage.scene.triangle_count();
        let shown = triangles <= self.most_triangles;
        let mut drawn = Ok(());
        self.write(Topic::Scene, t_ns, |m, stage| {
            let scene = shown.then_some(&stage.scene);
            drawn = look::scene(m, t_ns, &stage.skeleton, scene, &stage.surfaces);
        })?;
        drawn?;
        if !shown {
            let text = format!("the scene is not drawn: it has {triangles} triangles");
            self.log(t_ns, Level::Warning, &text)?;
        }
        self.draw_fixed(t_ns)
    }

    fn draw_fixed(&mut self, t_ns: u64) -> Result<(), RecordError> {
        let world = self.base_from_world;
        self.write(Topic::FixedTransforms, t_ns, |m, stage| {
            look::fixed_transforms(m, t_ns, &stage.skeleton, &world);
        })
    }

    /// Reports messages that are missing before this one.
    fn gap(&mut self, sequence: u64) -> Result<(), RecordError> {
        let missing = sequence.saturating_sub(self.expected);
        self.expected = sequence + 1;
        if missing == 0 {
            return Ok(());
        }
        let text = format!("{missing} messages of the session left out: writing fell behind");
        self.log(self.newest_ns, Level::Warning, &text)
    }

    /// Time in the file; an invalid time becomes the newest one.
    fn time_ns(&mut self, t_s: f64) -> u64 {
        if t_s.is_finite() && (0.0..LONGEST_S).contains(&t_s) {
            let t_ns = self.zero_ns.saturating_add((t_s * 1e9).round() as u64);
            self.newest_ns = self.newest_ns.max(t_ns);
            t_ns
        } else {
            self.newest_ns
        }
    }

    fn write(
        &mut self,
        topic: Topic,
        t_ns: u64,
        body: impl FnOnce(&mut Message<'_>, &Stage),
    ) -> Result<(), RecordError> {
        self.buffer.clear();
        let mut message = Message::to_vec(&mut self.buffer);
        body(&mut message, &self.stage);
        // Field numbers are fixed and a `Vec` grows, so this cannot fail.
        let _ = message.finish();
        let number = topic as usize;
        let header = MessageHeader {
            channel_id: self.channels[number],
            sequence: self.counts[number],
            log_time: t_ns,
            publish_time: t_ns,
        };
        self.counts[number] = self.counts[number].wrapping_add(1);
        self.mcap.write_to_known_channel(&header, &self.buffer)?;
        self.pending += self.buffer.len();
        Ok(())
    }
}

/// An event as a log line.
fn said(event: &EventKind) -> (Level, String) {
    let text = match event {
        EventKind::Frame(Tracking::Tracked(_)) => "the hand is tracked",
        EventKind::Arrived => "the board is in place",
        EventKind::Late => "the board is late",
        EventKind::Released => "released",
        EventKind::Resumed => "resumed",
        EventKind::WorldMovedWhileTouched => "the world moved under the hand that touches",
        EventKind::WorldRefused => "a place of the world was refused",
        EventKind::HandUnfamiliar => "the hand moves unlike all that was learnt: the board waits",
        EventKind::SurfacesUnknown => "where the surfaces are is not known: the board holds",
        EventKind::Frame(Tracking::Lost { reason, .. }) => &format!("the hand is lost: {reason:?}"),
        EventKind::GoalSet(goal) => {
            let (at, surface) = (goal.target.point_m, goal.surface.0);
            &format!(
                "the board is sent to {:.3}, {:.3}, {:.3} m on surface {surface}",
                at.x, at.y, at.z
            )
        }
        EventKind::LinkInFront(found) => &format!(
            "link {} of the arm is {:.3} m in front of a surface",
            found.link, found.in_front_m
        ),
        EventKind::LinksBehind => "the arm is behind the surfaces again",
        EventKind::Unreachable(why) => &format!("the goal cannot be held: {why:?}"),
        EventKind::Touched { normal_force_n } => &format!("touched, {normal_force_n:.1} N"),
        EventKind::Held(reason) => &format!("the arm holds: {reason:?}"),
        EventKind::Safe(state) => &format!("the supervisor: {state:?}"),
        other => &format!("{other:?}"),
    };
    let level = match event {
        EventKind::Frame(Tracking::Lost { .. })
        | EventKind::Late
        | EventKind::Unreachable(_)
        | EventKind::Held(_)
        | EventKind::Safe(_)
        | EventKind::WorldMovedWhileTouched
        | EventKind::WorldRefused
        | EventKind::HandUnfamiliar
        | EventKind::LinkInFront(_)
        | EventKind::SurfacesUnknown => Level::Warning,
        _ => Level::Info,
    };
    (level, text.to_owned())
}
