//! Reaches that a predictor learns from: people as the live filters see them.

use glam::DVec3;
use hwall_hand::{
    GazeFilter, HandFilter, HandFilterConfig, HandFrame, HandPoint, LabelledReach, ReachWatch,
    WatchConfig, WatchUpdate,
};
use hwall_scene::SurfaceId;

/// A leap of the gaze beyond this is a saccade, in standard deviations of its noise.
const SACCADE_SDS: f64 = 3.5;

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
    /// Smooths the gaze.
    pub gaze: GazeFilter,
}

impl Filters {
    /// For a gaze of this noise, rad.
    ///
    /// # Errors
    /// Settings that a filter refuses.
    pub fn new(gaze_noise_rad: f64) -> anyhow::Result<Self> {
        let saccade_rad = (SACCADE_SDS * gaze_noise_rad).clamp(0.07, 0.35);
        Ok(Self {
            hand: HandFilter::new(HandFilterConfig::simulated())?,
            gaze: GazeFilter::new(0.15, saccade_rad)?,
        })
    }
}

/// Reaches to learn from, each with the samples that a live estimator would see of it, and with the
/// filtered gaze in them.
///
/// # Errors
/// Settings that a filter refuses.
pub fn reaches(streams: &[Stream], gaze_noise_rad: f64) -> anyhow::Result<Vec<LabelledReach>> {
    let mut all = Vec::new();
    for (person, stream) in streams.iter().enumerate() {
        let mut filters = Filters::new(gaze_noise_rad)?;
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
            let gaze = frame
                .gaze_ray()
                .and_then(|ray| filters.gaze.step(frame.t_s, &ray));
            let mut kept = *frame;
            kept.gaze = gaze.map(|ray| ray.direction);
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
