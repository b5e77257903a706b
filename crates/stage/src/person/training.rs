//! Reaches that a predictor learns from: people as the live filters see them.

use glam::DVec3;
use hwall_hand::{
    GazeFilter, HandFilter, HandFilterConfig, HandFrame, HandPoint, LabelledReach, ReachWatch,
    WatchConfig, WatchUpdate,
};
use hwall_scene::SurfaceId;

/// One touch that is judged.
#[derive(Debug, Clone, Copy)]
pub struct SurfaceTouch {
    /// The surface touched.
    pub surface: SurfaceId,
    /// The point touched, m.
    pub target_m: DVec3,
    /// Unit normal towards the person.
    pub normal: DVec3,
    /// When the hand starts, s.
    pub start_s: f64,
    /// When the hand touches, s.
    pub contact_s: f64,
}

/// A person's samples and touches.
pub struct Stream {
    /// As the tracker saw them.
    pub frames: Vec<HandFrame>,
    /// In order of time.
    pub touches: Vec<SurfaceTouch>,
}

impl Stream {
    /// Both in order of time.
    #[must_use]
    pub const fn new(frames: Vec<HandFrame>, touches: Vec<SurfaceTouch>) -> Self {
        Self { frames, touches }
    }
}

/// The filters in front of every predictor.
pub struct Filters {
    /// Smooths the hand.
    pub hand: HandFilter,
    /// Tells fixations from saccades.
    pub gaze: GazeFilter,
}

impl Filters {
    /// For simulated people.
    ///
    /// # Errors
    /// Settings that a filter refuses.
    pub fn new() -> anyhow::Result<Self> {
        Ok(Self {
            hand: HandFilter::new(HandFilterConfig::simulated())?,
            gaze: GazeFilter::default(),
        })
    }
}

/// Reaches to learn from, each with the samples that a live estimator would see of it, and with the
/// filtered gaze in them.
///
/// # Errors
/// Settings that a filter refuses.
pub fn reaches(streams: &[Stream]) -> anyhow::Result<Vec<LabelledReach>> {
    let mut all = Vec::new();
    for (person, stream) in streams.iter().enumerate() {
        let mut filters = Filters::new()?;
        let mut watch = ReachWatch::new(WatchConfig::default())?;
        // The samples of the reach under way.
        let mut so_far: Vec<HandFrame> = Vec::new();
        let mut due = stream.touches.iter();
        let mut next = due.next();
        for frame in &stream.frames {
            let Some(touch) = next else { break };
            if frame.t_s >= touch.contact_s {
                let reach = LabelledReach {
                    person: Some(person.to_string()),
                    trial: Some(all.len().to_string()),
                    point: HandPoint::Index,
                    frames: so_far.clone(),
                    contact_m: touch.target_m,
                    contact_s: touch.contact_s,
                    normal: Some(touch.normal),
                };
                let begun = reach
                    .frames
                    .first()
                    .is_some_and(|f| f.t_s > touch.start_s - 0.2);
                if begun && reach.validate().is_ok() {
                    all.push(reach);
                }
                next = due.next();
            }
            let tracking = filters.hand.step(frame);
            let gaze = filters.gaze.step(frame.t_s, frame.gaze_ray().as_ref());
            let mut kept = *frame;
            kept.gaze = gaze.ray().map(|ray| ray.direction);
            match watch.step(&kept, tracking.state()) {
                WatchUpdate::Begun { samples } => {
                    so_far.clear();
                    so_far.extend(watch.latest(samples));
                }
                WatchUpdate::UnderWay => so_far.push(kept),
                WatchUpdate::AtRest | WatchUpdate::Repeated => {}
            }
        }
    }
    Ok(all)
}
