//! The steps of a calibration, and their results.

use super::face::{CORNERS, Face};
use super::fit::{CHECK_BOUND_M, Calibration, CalibrationError, apart, level};
use crate::error::BridgeError;
use glam::DVec3;
use hwall::geometry::Pose;
use hwall::hand::PointPair;
use hwall::haptics::Board;
use serde::Deserialize;
use serde_json::json;
use std::collections::VecDeque;
use std::io;
use std::path::{Path, PathBuf};

/// A touch is the mean of the fingertip over this time, s.
const TOUCH_S: f64 = 0.5;
/// Least time from the first to the last sample of a touch, s: less than [`TOUCH_S`], because samples have gaps.
const SHORTEST_S: f64 = 0.4;
/// Fewest samples of a touch: a headset on a busy network has twice as many.
const FEWEST: usize = 6;
/// A fingertip farther than this from its mean is not at rest, m.
const STILL_M: f64 = 0.004;
/// The newest sample of a touch may be this old, s.
const NEWEST_S: f64 = 0.25;

/// The pose of the board expires after this time, s.
const FACE_S: f64 = 0.5;
/// A board whose corners stay within this distance is at rest, m.
const MOVED_M: f64 = 0.0005;
/// Number of corners touched to check a calibration: two, because one does not show a rotation about itself.
const CHECKED: usize = 2;
/// Without the head, exchanged sides would not be noticed.
const NO_HEAD: &str = "the head is not seen: look at the board until the headset tracks it";

/// A step requested by a page.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Deserialize)]
#[serde(rename_all = "lowercase")]
pub(crate) enum Step {
    /// Begin a new calibration.
    Begin,
    /// The fingertip is at the corner now.
    Take,
    /// Stop calibrating.
    Cancel,
    /// The headset has moved its space.
    Recentred,
}

/// Whose hands in a headset's own axes go to the loop.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Served {
    /// No calibration was requested: the space is as configured.
    Any,
    /// The calibrated headset.
    Only(u64),
    /// None is calibrated yet.
    Nobody,
}

impl Served {
    pub(crate) fn has(self, headset: Option<u64>) -> bool {
        match self {
            Self::Any => true,
            Self::Only(calibrated) => headset == Some(calibrated),
            Self::Nobody => false,
        }
    }
}

/// Progress of a calibration.
#[derive(Debug, Clone, PartialEq)]
enum State {
    /// None was requested: the pose is as configured.
    Free,
    /// A file is configured, but contains no calibration yet.
    Needed,
    /// The calibration is from an earlier session; vectors from the corners to their check touches, m.
    Unchecked(Vec<DVec3>),
    /// These corners have been touched.
    Touching(Vec<PointPair>),
    /// Made or checked in this session; error of the check touches, m.
    Good(Option<f64>),
    /// Error of the failed check touches, m.
    Off(f64),
}

/// The face of the board.
#[derive(Debug, Clone, Copy)]
struct Seen {
    face: Face,
    /// Times when it was last seen, and when it last moved, s.
    seen_s: f64,
    moved_s: f64,
}

/// A calibration in progress or done. The arm stands until it is [good](Self::must_stand).
#[derive(Debug)]
pub(crate) struct Procedure {
    file: Option<PathBuf>,
    side: &'static str,
    state: State,
    calibration: Option<Calibration>,
    face: Option<Seen>,
    /// The headset that calibrates: the one whose page asked for it, or the first that shows its hand.
    touches: Option<u64>,
    /// Time, s, and place in the headset's space, m, of the fingertip.
    tips: VecDeque<(f64, DVec3)>,
    /// The last seen position of the head since the calibration began, headset's space, m.
    head_m: Option<DVec3>,
    /// Why the last step failed.
    refused: Option<String>,
}

impl Procedure {
    /// Reads the file, if there is one.
    pub(crate) fn open(file: Option<&Path>, side: &'static str) -> Result<Self, BridgeError> {
        let calibration = match file.map(std::fs::read_to_string) {
            None => None,
            Some(Err(error)) if error.kind() == io::ErrorKind::NotFound => None,
            Some(read) => {
                let path = file.unwrap_or(Path::new("")).to_owned();
                match read {
                    Err(source) => return Err(BridgeError::File { path, source }),
                    Ok(text) => Some(
                        Calibration::from_json(&text)
                            .map_err(|source| BridgeError::Calibration { path, source })?,
                    ),
                }
            }
        };
        let mut opened = Self {
            file: file.map(Path::to_owned),
            side,
            state: State::Free,
            calibration,
            face: None,
            touches: None,
            head_m: None,
            tips: VecDeque::new(),
            refused: None,
        };
        opened.state = opened.at_rest();
        Ok(opened)
    }

    /// The state without a calibration in progress and without a check.
    fn at_rest(&self) -> State {
        match (&self.calibration, &self.file) {
            (Some(_), _) => State::Unchecked(Vec::new()),
            (None, Some(_)) => State::Needed,
            (None, None) => State::Free,
        }
    }

    /// The calibrated pose of the headset's space, base frame.
    pub(crate) fn base_from_headset(&self) -> Option<Pose> {
        self.calibration
            .as_ref()
            .map(Calibration::base_from_headset)
    }

    /// Must the arm stand?
    pub(crate) const fn must_stand(&self) -> bool {
        !matches!(self.state, State::Free | State::Good(_))
    }

    /// Whose hands count.
    pub(crate) fn serves(&self) -> Served {
        match (&self.calibration, &self.state) {
            (Some(calibration), _) => Served::Only(calibration.headset()),
            (None, State::Free) => Served::Any,
            (None, _) => Served::Nobody,
        }
    }

    /// The headset that is calibrated, or being calibrated.
    fn headset(&self) -> Option<u64> {
        match self.state {
            State::Touching(_) => self.touches,
            _ => self.calibration.as_ref().map(Calibration::headset),
        }
    }

    /// Is another headset than this one calibrated, or being calibrated?
    pub(crate) fn is_of_another(&self, headset: Option<u64>) -> bool {
        let both = headset.zip(self.headset());
        both.is_some_and(|(one, other)| one != other)
    }

    /// Stores the current pose of the board. Returns true if the pages must be told.
    pub(crate) fn see_board(&mut self, now_s: f64, base_from_face: &Pose, board: &Board) -> bool {
        let face = Face::of(base_from_face, board);
        match &mut self.face {
            Some(seen) if seen.face.is_at(&face, MOVED_M) => {
                seen.seen_s = now_s;
                false
            }
            _ => {
                self.face = Some(Seen {
                    face,
                    seen_s: now_s,
                    moved_s: now_s,
                });
                self.must_stand()
            }
        }
    }

    /// The face of a board that stood during a touch that ends now.
    fn standing(&self, now_s: f64) -> Result<Face, String> {
        let seen = self.face.filter(|seen| now_s - seen.seen_s < FACE_S);
        let seen = seen.ok_or("the board is not known: wait until the page shows the arm")?;
        match now_s - seen.moved_s < TOUCH_S {
            true => Err("the board moves: touch it once it stands".to_owned()),
            false => Ok(seen.face),
        }
    }

    /// Stores the current fingertip and head of a headset, in its space.
    pub(crate) fn see_tip(
        &mut self,
        now_s: f64,
        headset: u64,
        tip_m: DVec3,
        head_m: Option<DVec3>,
    ) {
        if matches!(self.state, State::Touching(_)) {
            self.touches.get_or_insert(headset);
        }
        if self.headset() != Some(headset) {
            return;
        }
        self.head_m = head_m.or(self.head_m);
        self.tips.push_back((now_s, tip_m));
        while self
            .tips
            .front()
            .is_some_and(|(t_s, _)| now_s - t_s > TOUCH_S)
        {
            self.tips.pop_front();
        }
    }

    /// Mean position of the fingertip, if it was at rest.
    fn touch_m(&self, now_s: f64) -> Result<DVec3, String> {
        let count = self.tips.len();
        let is_new = self
            .tips
            .back()
            .is_some_and(|(t_s, _)| now_s - t_s < NEWEST_S);
        if count < FEWEST || !is_new {
            return Err(format!("no headset shows a {} hand", self.side));
        }
        let first = self.tips.front();
        let is_long = first.is_some_and(|(t_s, _)| now_s - t_s >= SHORTEST_S);
        let mean_m = self.tips.iter().map(|tip| tip.1).sum::<DVec3>() / count as f64;
        match is_long && self.tips.iter().all(|tip| tip.1.distance(mean_m) < STILL_M) {
            true => Ok(mean_m),
            false => Err("hold the finger still for half a second".to_owned()),
        }
    }

    /// Performs a step requested by the page of a headset, or by another page. Returns the text to store, and its file.
    pub(crate) fn act(
        &mut self,
        step: Step,
        from: Option<u64>,
        now_s: f64,
    ) -> Option<(PathBuf, String)> {
        self.refused = None;
        if step != Step::Take {
            // The board or the headset's space may have moved.
            self.tips.clear();
            self.head_m = None;
        }
        match step {
            Step::Begin => {
                self.touches = from;
                self.state = State::Touching(Vec::new());
            }
            Step::Cancel => self.state = self.at_rest(),
            // Without a calibration the space is as configured, wherever it is; the server stops the arm.
            Step::Recentred => self.state = self.at_rest(),
            Step::Take => match self.take(now_s) {
                Ok(true) => {
                    return self
                        .file
                        .clone()
                        .zip(self.calibration.as_ref().map(Calibration::to_json));
                }
                Ok(false) => {}
                Err(refused) => self.refused = Some(refused),
            },
        }
        None
    }

    /// The calibration could not be stored.
    pub(crate) fn not_kept(&mut self, error: &io::Error) {
        self.refused = Some(format!("calibrated, but not kept in a file: {error}"));
    }

    /// Takes a touch; returns true if there is a new calibration.
    fn take(&mut self, now_s: f64) -> Result<bool, String> {
        match self.state {
            State::Free | State::Needed => return Err("press Calibrate first".to_owned()),
            State::Good(_) => return Err("nothing has to be touched now".to_owned()),
            State::Touching(_) | State::Unchecked(_) | State::Off(_) => {}
        }
        let face = self.standing(now_s)?;
        let touched_m = self.touch_m(now_s)?;
        match &mut self.state {
            State::Touching(pairs) => {
                let head_m = self.head_m.ok_or(NO_HEAD)?;
                pairs.push(PointPair {
                    in_a_m: face.corner_m(pairs.len()),
                    in_b_m: touched_m,
                });
                if let Err(close) = apart(pairs) {
                    pairs.pop();
                    return Err(close.to_string());
                }
                // The finger must come to the next corner first.
                self.tips.clear();
                let Ok(pairs) = <[PointPair; 3]>::try_from(pairs.as_slice()) else {
                    return Ok(false);
                };
                self.state = State::Touching(Vec::new());
                let found = self.found(&face, pairs, head_m);
                self.calibration = Some(found.map_err(|error| error.to_string())?);
                self.state = State::Good(None);
                Ok(true)
            }
            State::Unchecked(errors_m) => {
                let errors_m = std::mem::take(errors_m);
                self.check(&face, errors_m, touched_m)
            }
            _ => self.check(&face, Vec::new(), touched_m),
        }
    }

    /// Takes a check touch after those with these errors.
    fn check(
        &mut self,
        face: &Face,
        mut errors_m: Vec<DVec3>,
        touched_m: DVec3,
    ) -> Result<bool, String> {
        let calibration = self.calibration.as_ref();
        let at_m = calibration
            .ok_or("press Calibrate first")?
            .place_m(touched_m);
        errors_m.push(at_m - face.corner_m(errors_m.len()));
        self.tips.clear();
        self.state = checked(errors_m);
        Ok(false)
    }

    fn found(
        &self,
        face: &Face,
        pairs: [PointPair; 3],
        head_m: DVec3,
    ) -> Result<Calibration, CalibrationError> {
        let headset = self.touches.unwrap_or_default();
        let found = Calibration::from_touches(headset, pairs)?;
        // On an upright board, exchanged sides also fit, with a rotation by half a turn.
        match face.is_before(found.place_m(head_m)) {
            true => Ok(found),
            false => Err(CalibrationError::Behind),
        }
    }

    /// Where the requested corner should be in the headset's space, WebXR's axes, m, if known.
    fn target_m(&self, corner: Option<usize>) -> Option<DVec3> {
        let corner_m = self.face?.face.corner_m(corner?);
        let base_from_headset = match &self.state {
            State::Touching(pairs) => level(pairs).ok()?.a_from_b,
            _ => self.base_from_headset()?,
        };
        let base_from_webxr = base_from_headset * Pose::Z_UP_FROM_Y_UP;
        Some(base_from_webxr.inverse_transform_point(corner_m))
    }

    /// For the page of a headset, or for another one.
    pub(crate) fn to_json(&self, to: Option<u64>) -> String {
        if self.is_of_another(to) {
            return json!({
                "type": "calibration",
                "state": "other",
                "side": self.side,
                "text": "another headset is calibrated: the hands of this one do not count; press Calibrate to calibrate this headset instead",
            })
            .to_string();
        }
        let (name, corner, off_m) = match &self.state {
            State::Free => ("free", None, None),
            State::Needed => ("needed", None, None),
            State::Unchecked(errors_m) => ("unchecked", Some(errors_m.len()), None),
            State::Touching(pairs) => ("touching", Some(pairs.len()), None),
            State::Good(off_m) => ("good", None, *off_m),
            State::Off(off_m) => ("off", Some(0), Some(*off_m)),
        };
        let tenths = |value: f64| (10.0 * value).round() / 10.0;
        let mm = |m: f64| tenths(1e3 * m);
        let face = self.face.map(|seen| seen.face);
        let in_face_mm = |m: DVec3| face.map(|face| face.axes(m).map(mm));
        let corners_m = face.map(|face| [0, 1, 2].map(|i| face.offset_m(i)));
        let known = self.calibration.as_ref();
        let pose = self.base_from_headset();
        json!({
            "type": "calibration",
            "state": name,
            "side": self.side,
            "corner": corner,
            "text": self.text(corner, off_m),
            "target_m": self.target_m(corner).map(|target_m| target_m.to_array()),
            "rms_mm": known.map(|known| mm(known.rms_m())),
            "turn_deg": known.map(|known| tenths(known.turn_rad().to_degrees())),
            "off_mm": off_m.map(mm),
            "bound_mm": mm(CHECK_BOUND_M),
            "corners_mm": corners_m.map(|corners| corners.map(in_face_mm)),
            "errors_mm": known.map(|known| known.errors_m().map(in_face_mm)),
            "base_from_headset": pose.map(|pose| json!({
                "position_m": pose.position_m().to_array(),
                "rotation": pose.rotation().to_cols_array(),
            })),
        })
        .to_string()
    }

    /// What to do, in words.
    fn text(&self, corner: Option<usize>, off_m: Option<f64>) -> String {
        if let Some(refused) = &self.refused {
            return refused.clone();
        }
        let [off_mm, bound_mm] = [off_m.unwrap_or(0.0), CHECK_BOUND_M].map(|m| 1e3 * m);
        let touch = format!(
            "touch the {} corner of the real board with the tip of the {} index finger, hold still, and pinch with the other hand (or let somebody press Take)",
            CORNERS[corner.unwrap_or(0).min(2)],
            self.side
        );
        match self.state {
            State::Free => "the headset's space stands as --origin says".to_owned(),
            State::Needed => {
                "not calibrated yet: press Calibrate; the arm stands until then".to_owned()
            }
            State::Unchecked(_) => format!("check: {touch}"),
            State::Touching(_) => touch,
            State::Good(None) => {
                let known = self.calibration.as_ref();
                let [rms_mm, turn_deg] = [
                    known.map_or(0.0, |known| 1e3 * known.rms_m()),
                    known.map_or(0.0, |known| known.turn_rad().to_degrees()),
                ];
                format!("calibrated to {rms_mm:.1} mm, {turn_deg:.1} degrees: let the arm go")
            }
            State::Good(Some(_)) => format!("checked, {off_mm:.0} mm off: let the arm go"),
            State::Off(_) => format!(
                "the check is {off_mm:.0} mm off, more than {bound_mm:.0}: calibrate anew, or touch again"
            ),
        }
    }
}

/// The state after check touches with these errors, m.
fn checked(errors_m: Vec<DVec3>) -> State {
    // Different errors mean a rotation of the space.
    let differences_m = errors_m.iter().enumerate().flat_map(|(count, error_m)| {
        let before = errors_m.iter().take(count);
        before.map(|other| other.distance(*error_m))
    });
    let lengths_m = errors_m.iter().map(|error_m| error_m.length());
    let off_m: Vec<f64> = lengths_m.chain(differences_m).collect();
    let is_near = off_m.iter().all(|off_m| *off_m <= CHECK_BOUND_M);
    let off_m = off_m.into_iter().fold(0.0, f64::max);
    match (is_near, errors_m.len() < CHECKED) {
        (false, _) => State::Off(off_m),
        (true, true) => State::Unchecked(errors_m),
        (true, false) => State::Good(Some(off_m)),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn errors_that_are_no_numbers_are_off() {
        let near_m = DVec3::splat(1e-3);
        assert_eq!(checked(vec![near_m]), State::Unchecked(vec![near_m]));
        assert_eq!(checked(vec![near_m; 2]), State::Good(Some(near_m.length())));
        for no_number in [f64::NAN, -f64::NAN, f64::INFINITY] {
            let off_m = DVec3::new(0.0, no_number, 0.0);
            for errors_m in [vec![off_m], vec![near_m, off_m], vec![off_m, near_m]] {
                assert!(matches!(checked(errors_m), State::Off(_)));
            }
        }
    }
}
