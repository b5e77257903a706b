//! Training reaches for predictors, filtered as in a live session.

use glam::DVec3;
use hwall_contact::{
    ContactEstimator, EvidenceModel, LabelledStream, StreamContact, StreamFilters,
};
use hwall_hand::{
    GazeFilter, HandFilter, HandFilterConfig, HandFrame, HandPoint, LabelledReach, ReachWatch,
    WatchConfig, WatchUpdate,
};
use hwall_scene::SurfaceId;
use hwall_sim::{TouchSequence, TouchTruth};

/// One evaluated touch.
#[derive(Debug, Clone, Copy)]
pub struct SurfaceTouch {
    /// The surface touched.
    pub surface: SurfaceId,
    /// The point touched, m.
    pub target_m: DVec3,
    /// Unit normal towards the person.
    pub normal: DVec3,
    /// When the gaze leaves for the target, s.
    pub look_s: f64,
    /// When the gaze lands on the touched point, s; `None` if not before the contact.
    pub landed_s: Option<f64>,
    /// When the hand starts, s.
    pub start_s: f64,
    /// When the hand touches, s.
    pub contact_s: f64,
}

impl SurfaceTouch {
    /// A touch of a simulated person on a surface.
    #[must_use]
    pub fn of(surface: SurfaceId, hand: &TouchSequence, truth: &TouchTruth) -> Self {
        Self {
            surface,
            target_m: truth.target_m,
            normal: truth.normal,
            look_s: truth.look_s,
            landed_s: landed_s(hand, truth),
            start_s: truth.start_s,
            contact_s: truth.contact_s,
        }
    }
}

/// The gaze is on a point if the line of sight passes it within this angle, rad: 4 degrees, four times the
/// standard deviation of the aim of simulated people.
pub const ON_TARGET_RAD: f64 = 0.07;
/// Least duration of a fixation, s; shorter ones are sweeps.
const RESTS_S: f64 = 0.03;

/// When the gaze lands on the target of a touch, s: the first of the times, in order, from which it rests there. `true`: it is on target.
pub fn first_rest_s(looks: impl IntoIterator<Item = (f64, bool)>) -> Option<f64> {
    let mut since_s = None;
    for (t_s, is_on_target) in looks {
        if !is_on_target {
            since_s = None;
        } else if t_s - *since_s.get_or_insert(t_s) >= RESTS_S {
            return since_s;
        }
    }
    None
}

/// When the gaze lands on the target of a simulated touch.
fn landed_s(hand: &TouchSequence, truth: &TouchTruth) -> Option<f64> {
    const STEP_S: f64 = 0.002;
    let on_target = |t_s: f64| {
        let seen = hand.truth(t_s);
        seen.gaze.angle_between(truth.target_m - seen.head_m) < ON_TARGET_RAD
    };
    let steps = ((truth.contact_s - truth.look_s) / STEP_S) as usize;
    let times_s = (0..steps).map(|i| truth.look_s + STEP_S * i as f64);
    first_rest_s(times_s.map(|t_s| (t_s, on_target(t_s))))
}

/// A person's samples and touches.
pub struct Stream {
    /// Frames from the tracker.
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

    /// Places and times of the touches.
    fn contacts(&self) -> Vec<StreamContact> {
        let contact = |touch: &SurfaceTouch| StreamContact {
            point_m: touch.target_m,
            contact_s: touch.contact_s,
        };
        self.touches.iter().map(contact).collect()
    }
}

/// The filters in front of every predictor.
pub struct Filters {
    /// Smooths the hand.
    pub hand: HandFilter,
    /// Separates fixations from saccades.
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

/// Reliability of each source of evidence, learnt from all streams. `estimator`: the one that will be used.
///
/// # Errors
/// Too few touches.
pub fn evidence_model<E: ContactEstimator>(
    streams: &[Stream],
    estimator: impl FnMut(usize) -> E,
) -> anyhow::Result<EvidenceModel> {
    let contacts: Vec<Vec<_>> = streams.iter().map(Stream::contacts).collect();
    let each = streams.iter().zip(&contacts);
    let labelled = each.map(|(stream, contacts)| LabelledStream {
        frames: &stream.frames,
        contacts,
    });
    let filters = StreamFilters {
        hand: HandFilterConfig::simulated(),
        ..StreamFilters::default()
    };
    let labelled: Vec<_> = labelled.collect();
    Ok(EvidenceModel::default().fit_streams(&labelled, estimator, &filters)?)
}

/// Training reaches, each with the samples that a live estimator would see of it, including the
/// filtered gaze.
///
/// # Errors
/// Settings that a filter refuses.
pub fn reaches(streams: &[Stream]) -> anyhow::Result<Vec<LabelledReach>> {
    // Without a tracked fingertip, learn from the tracked points.
    let is_tracked = |point: &HandPoint| {
        let mut frames = streams.iter().flat_map(|stream| &stream.frames);
        frames.any(|frame| frame.point(*point).is_some())
    };
    let Some(point) = HandPoint::BY_CONTACT.into_iter().find(is_tracked) else {
        return Ok(Vec::new());
    };
    let mut all = Vec::new();
    for (person, stream) in streams.iter().enumerate() {
        let mut filters = Filters::new()?;
        let mut watch = ReachWatch::new(WatchConfig::default())?;
        // The samples of the current reach.
        let mut so_far: Vec<HandFrame> = Vec::new();
        let mut due = stream.touches.iter();
        let mut next = due.next();
        for frame in &stream.frames {
            let Some(touch) = next else { break };
            if frame.t_s >= touch.contact_s {
                let reach = LabelledReach {
                    person: Some(person.to_string()),
                    trial: Some(all.len().to_string()),
                    point,
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
