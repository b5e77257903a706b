//! What a person is asked to touch, and what came of it.

use super::face::{CORNERS, Face};
use super::fit::{CHECK_BOUND_M, Calibration, CalibrationError};
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
/// A touch has lasted at least this long, s: nearly all of it, since samples have gaps.
const SHORTEST_S: f64 = 0.4;
/// Fewest samples of a touch: a headset on a busy network has twice as many.
const FEWEST: usize = 6;
/// A fingertip that is farther than this from its mean does not hold still, m.
const STILL_M: f64 = 0.004;
/// The newest sample of a touch may be this old, s.
const NEWEST_S: f64 = 0.25;

/// What a page asks for.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Deserialize)]
#[serde(rename_all = "lowercase")]
pub(crate) enum Step {
    /// Calibrate anew.
    Begin,
    /// The fingertip is at the corner now.
    Take,
    /// Stop calibrating.
    Cancel,
    /// The headset has moved its space.
    Recentred,
}

/// How far a calibration has come.
#[derive(Debug, Clone, PartialEq)]
enum State {
    /// Nobody asked for one: the pose is as configured.
    Free,
    /// There is a file for it, but no calibration yet.
    Needed,
    /// It is of an earlier session.
    Unchecked,
    /// These corners have been touched.
    Touching(Vec<PointPair>),
    /// Made or checked in this session; the distance of the check touch, m.
    Good(Option<f64>),
    /// A check touch was this far off, m.
    Off(f64),
}

/// A calibration under way or done. The arm stands until it is [good](Self::must_stand).
#[derive(Debug)]
pub(crate) struct Procedure {
    file: Option<PathBuf>,
    side: &'static str,
    state: State,
    calibration: Option<Calibration>,
    face: Option<Face>,
    /// Time, s, and place in the headset's space, m, of the fingertip.
    tips: VecDeque<(f64, DVec3)>,
    /// Why the last step did not do what was asked for.
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
            tips: VecDeque::new(),
            refused: None,
        };
        opened.state = opened.at_rest();
        Ok(opened)
    }

    /// The state in which nobody calibrates and nothing was checked.
    fn at_rest(&self) -> State {
        match (&self.calibration, &self.file) {
            (Some(_), _) => State::Unchecked,
            (None, Some(_)) => State::Needed,
            (None, None) => State::Free,
        }
    }

    /// The pose of the headset's space that it has found, base frame.
    pub(crate) fn base_from_headset(&self) -> Option<Pose> {
        self.calibration
            .as_ref()
            .map(Calibration::base_from_headset)
    }

    /// Must the arm stand?
    pub(crate) const fn must_stand(&self) -> bool {
        !matches!(self.state, State::Free | State::Good(_))
    }

    /// The board is here now.
    pub(crate) fn see_board(&mut self, base_from_face: &Pose, board: &Board) {
        self.face = Some(Face::of(base_from_face, board));
    }

    /// The fingertip is here now, in the headset's space.
    pub(crate) fn see_tip(&mut self, now_s: f64, tip_m: DVec3) {
        self.tips.push_back((now_s, tip_m));
        while self
            .tips
            .front()
            .is_some_and(|(t_s, _)| now_s - t_s > TOUCH_S)
        {
            self.tips.pop_front();
        }
    }

    /// The mean of the fingertip, if it has held still.
    fn touch_m(&self, now_s: f64) -> Result<DVec3, String> {
        let count = self.tips.len();
        let is_new = self
            .tips
            .back()
            .is_some_and(|(t_s, _)| now_s - t_s < NEWEST_S);
        if count < FEWEST || !is_new {
            return Err(format!("the headset does not see the {} hand", self.side));
        }
        let first = self.tips.front();
        let is_long = first.is_some_and(|(t_s, _)| now_s - t_s >= SHORTEST_S);
        let mean_m = self.tips.iter().map(|tip| tip.1).sum::<DVec3>() / count as f64;
        match is_long && self.tips.iter().all(|tip| tip.1.distance(mean_m) < STILL_M) {
            true => Ok(mean_m),
            false => Err("hold the finger still for half a second".to_owned()),
        }
    }

    /// Does what a page asks for.
    pub(crate) fn act(&mut self, step: Step, now_s: f64) {
        self.refused = None;
        if step != Step::Take {
            // The board may have moved until now, or the headset's space.
            self.tips.clear();
        }
        match step {
            Step::Begin => self.state = State::Touching(Vec::new()),
            Step::Cancel => self.state = self.at_rest(),
            // Without a calibration the space is as configured, wherever it is; the server stops the arm.
            Step::Recentred => self.state = self.at_rest(),
            Step::Take => self.refused = self.take(now_s).err(),
        }
    }

    fn take(&mut self, now_s: f64) -> Result<(), String> {
        let face = self
            .face
            .ok_or("the board is not known yet: wait until the page shows the arm")?;
        let touched_m = self.touch_m(now_s)?;
        let State::Touching(pairs) = &mut self.state else {
            let calibration = self.calibration.as_ref();
            let calibration = calibration.ok_or("press Calibrate first")?;
            let off_m = calibration.off_m(face.corner_m(0), touched_m);
            self.state = match off_m <= CHECK_BOUND_M {
                true => State::Good(Some(off_m)),
                false => State::Off(off_m),
            };
            return Ok(());
        };
        pairs.push(PointPair {
            in_a_m: face.corner_m(pairs.len()),
            in_b_m: touched_m,
        });
        // The finger must come to the next corner first.
        self.tips.clear();
        let Ok(pairs) = <[PointPair; 3]>::try_from(pairs.as_slice()) else {
            return Ok(());
        };
        self.state = State::Touching(Vec::new());
        let found = Calibration::from_touches(pairs);
        let found = found.map_err(|error: CalibrationError| error.to_string())?;
        let text = found.to_json();
        self.calibration = Some(found);
        self.state = State::Good(None);
        match &self.file {
            Some(file) => hwall_files::write(file, text).map_err(|error| {
                format!("calibrated, but not kept in {}: {error}", file.display())
            }),
            None => Ok(()),
        }
    }

    /// For the pages.
    pub(crate) fn to_json(&self) -> String {
        let (name, corner, off_m) = match &self.state {
            State::Free => ("free", None, None),
            State::Needed => ("needed", None, None),
            State::Unchecked => ("unchecked", Some(0), None),
            State::Touching(pairs) => ("touching", Some(pairs.len()), None),
            State::Good(off_m) => ("good", None, *off_m),
            State::Off(off_m) => ("off", Some(0), Some(*off_m)),
        };
        let mm = |m: f64| (1e4 * m).round() / 10.0;
        let in_face_mm = |m: DVec3| self.face.map(|face| face.axes(m).map(mm));
        let corners_m = self.face.map(|face| [0, 1, 2].map(|i| face.offset_m(i)));
        let known = self.calibration.as_ref();
        let pose = self.base_from_headset();
        json!({
            "type": "calibration",
            "state": name,
            "side": self.side,
            "corner": corner,
            "text": self.text(corner, off_m),
            "rms_mm": known.map(|known| mm(known.rms_m())),
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
            State::Unchecked => format!("check: {touch}"),
            State::Touching(_) => touch,
            State::Good(None) => "calibrated: let the arm go".to_owned(),
            State::Good(Some(_)) => format!("checked, {off_mm:.0} mm off: let the arm go"),
            State::Off(_) => format!(
                "the touch is {off_mm:.0} mm off, more than {bound_mm:.0}: calibrate anew, or touch again"
            ),
        }
    }
}
