//! Frames as bytes: the page's binary messages and what a replay holds.
//!
//! Little-endian, without padding. First the version (u8), the state (u8), a bit for each part that is there (u16), the time
//! (f64, s) and seven joint angles (f32, rad). Then the parts in the order of their bits, all numbers f32 unless said otherwise:
//!
//! | bit | part | numbers |
//! | --- | --- | --- |
//! | 0 | hand | mask of the joints that are seen (u32), three for each of them |
//! | 1 | head | 3 |
//! | 2 | gaze | origin 3, direction 3 |
//! | 3 | prediction | point 3, normal 3, surface (i32, -1: not known), time to contact (NaN: does not approach) |
//! | 4 | its 90 % region | two half axes of 3 |
//! | 5 | goal | point 3, normal 3 |
//! | 6 | time left for the board | 1 |
//! | 7 | force | 3 |
//! | 8 | openings | their number (u32), one each; trailing zeros are left out |

use crate::error::ViewError;
use crate::frame::{ViewFrame, ViewPrediction};
use crate::hand::{HAND_JOINTS, ViewHand};
use crate::scene::MOST_MOVING;
use crate::state::ViewState;
use glam::DVec3;
use hwall::kinematics::JointPositions;

/// The version of the encoding.
pub(crate) const VERSION: u8 = 1;

const HAND: u16 = 1;
const HEAD: u16 = 2;
const GAZE: u16 = 4;
const PREDICTED: u16 = 8;
const REGION: u16 = 16;
const GOAL: u16 = 32;
const LEFT: u16 = 64;
const FORCE: u16 = 128;
const OPENINGS: u16 = 256;
/// All bits with a meaning.
const KNOWN: u16 = 511;

impl ViewFrame {
    /// Most bytes that a frame takes.
    pub const MOST_BYTES: usize =
        40 + (4 + 12 * HAND_JOINTS) + 12 + 24 + 32 + 24 + 24 + 4 + 12 + (4 + 4 * MOST_MOVING);

    /// Appends the frame: little-endian, numbers as f32 but the time, which is f64. What is NaN or infinite is left out as
    /// if it were absent; such joint angles, openings and times are written as zero.
    pub fn encode(&self, out: &mut Vec<u8>) {
        let finite = |v: &DVec3| v.is_finite();
        let both = |pair: &(DVec3, DVec3)| pair.0.is_finite() && pair.1.is_finite();
        let head_m = self.head_m.filter(finite);
        let gaze = self.gaze.filter(both);
        let predicted = self
            .predicted
            .filter(|p| p.point_m.is_finite() && p.normal.is_finite());
        let region_m = predicted
            .and_then(|p| p.region_m)
            .filter(|axes_m| axes_m.iter().all(finite));
        let goal = self.goal.filter(both);
        let left_s = self.left_s.filter(|s| s.is_finite());
        let force_n = self.force_n.filter(finite);
        let hand = ViewHand::from_joints(&self.hand.joints_m);
        let openings = self
            .openings
            .iter()
            .rposition(|opening| *opening != 0.0)
            .map_or(0, |last| last + 1);
        let bit = |is: bool, bit: u16| if is { bit } else { 0 };
        let present = bit(!hand.is_lost(), HAND)
            | bit(head_m.is_some(), HEAD)
            | bit(gaze.is_some(), GAZE)
            | bit(predicted.is_some(), PREDICTED)
            | bit(region_m.is_some(), REGION)
            | bit(goal.is_some(), GOAL)
            | bit(left_s.is_some(), LEFT)
            | bit(force_n.is_some(), FORCE)
            | bit(openings > 0, OPENINGS);
        out.push(VERSION);
        out.push(self.state as u8);
        out.extend(present.to_le_bytes());
        let or_zero = |value: f64| if value.is_finite() { value } else { 0.0 };
        out.extend(or_zero(self.t_s).to_le_bytes());
        for q_rad in self.q.0 {
            number(out, or_zero(q_rad));
        }
        if !hand.is_lost() {
            let seen = hand.joints_m.iter().enumerate();
            let mask = seen.fold(0_u32, |mask, (i, m)| mask | (u32::from(m.is_some()) << i));
            out.extend(mask.to_le_bytes());
            for joint_m in hand.joints_m.iter().flatten() {
                vector(out, *joint_m);
            }
        }
        if let Some(head_m) = head_m {
            vector(out, head_m);
        }
        if let Some((origin_m, direction)) = gaze {
            vector(out, origin_m);
            vector(out, direction);
        }
        if let Some(predicted) = predicted {
            vector(out, predicted.point_m);
            vector(out, predicted.normal);
            let surface = predicted.surface.and_then(|s| i32::try_from(s).ok());
            out.extend(surface.unwrap_or(-1).to_le_bytes());
            let contact_s = predicted.contact_s.filter(|s| s.is_finite());
            number(out, contact_s.unwrap_or(f64::NAN));
        }
        if let Some(axes_m) = region_m {
            axes_m.iter().for_each(|axis_m| vector(out, *axis_m));
        }
        if let Some((point_m, normal)) = goal {
            vector(out, point_m);
            vector(out, normal);
        }
        if let Some(left_s) = left_s {
            number(out, left_s);
        }
        if let Some(force_n) = force_n {
            vector(out, force_n);
        }
        if openings > 0 {
            out.extend((openings as u32).to_le_bytes());
            for opening in &self.openings[..openings] {
                number(out, or_zero(*opening));
            }
        }
    }

    /// The frame at the beginning of some bytes, and how many of them it took. Numbers come back as f32 had them: within
    /// 6e-8 of their size.
    ///
    /// # Errors
    /// Too few bytes, another version, a state or a bit without a meaning.
    pub fn decode(bytes: &[u8]) -> Result<(Self, usize), ViewError> {
        let mut reader = Reader { bytes, at: 0 };
        let [version, state] = reader.take()?;
        if version != VERSION {
            return Err(ViewError::Version {
                expected: VERSION,
                got: version,
            });
        }
        let state = ViewState::from_number(state).ok_or(ViewError::Unknown {
            what: "state",
            got: u32::from(state),
            most: ViewState::ALL.len() as u32 - 1,
        })?;
        let present = u16::from_le_bytes(reader.take()?);
        at_most("presence bits", u32::from(present), u32::from(KNOWN))?;
        let has = |bit: u16| present & bit != 0;
        let t_s = f64::from_le_bytes(reader.take()?);
        let mut q = JointPositions::default();
        for q_rad in &mut q.0 {
            *q_rad = reader.number()?;
        }
        let mut frame = Self {
            state,
            ..Self::new(t_s, q)
        };
        if has(HAND) {
            let mask = reader.word()?;
            at_most("mask of joints", mask, (1 << HAND_JOINTS) - 1)?;
            for (i, joint_m) in frame.hand.joints_m.iter_mut().enumerate() {
                if mask & (1 << i) != 0 {
                    *joint_m = Some(reader.vector()?);
                }
            }
        }
        if has(HEAD) {
            frame.head_m = Some(reader.vector()?);
        }
        if has(GAZE) {
            frame.gaze = Some((reader.vector()?, reader.vector()?));
        }
        if has(PREDICTED) {
            frame.predicted = Some(ViewPrediction {
                point_m: reader.vector()?,
                normal: reader.vector()?,
                surface: u32::try_from(i32::from_le_bytes(reader.take()?)).ok(),
                contact_s: Some(reader.number()?).filter(|s| s.is_finite()),
                region_m: None,
            });
        }
        if has(REGION) {
            let axes_m = [reader.vector()?, reader.vector()?];
            if let Some(predicted) = &mut frame.predicted {
                predicted.region_m = Some(axes_m);
            }
        }
        if has(GOAL) {
            frame.goal = Some((reader.vector()?, reader.vector()?));
        }
        if has(LEFT) {
            frame.left_s = Some(reader.number()?);
        }
        if has(FORCE) {
            frame.force_n = Some(reader.vector()?);
        }
        if has(OPENINGS) {
            let count = reader.word()?;
            at_most("number of openings", count, MOST_MOVING as u32)?;
            for opening in frame.openings.iter_mut().take(count as usize) {
                *opening = reader.number()?;
            }
        }
        Ok((frame, reader.at))
    }
}

fn at_most(what: &'static str, got: u32, most: u32) -> Result<(), ViewError> {
    if got > most {
        return Err(ViewError::Unknown { what, got, most });
    }
    Ok(())
}

fn number(out: &mut Vec<u8>, value: f64) {
    out.extend((value as f32).to_le_bytes());
}

fn vector(out: &mut Vec<u8>, v: DVec3) {
    v.to_array()
        .into_iter()
        .for_each(|value| number(out, value));
}

struct Reader<'a> {
    bytes: &'a [u8],
    at: usize,
}

impl Reader<'_> {
    fn take<const N: usize>(&mut self) -> Result<[u8; N], ViewError> {
        let truncated = ViewError::Truncated {
            needed: self.at + N,
            got: self.bytes.len(),
        };
        let rest = self.bytes.get(self.at..).unwrap_or_default();
        let taken = rest.first_chunk().ok_or(truncated)?;
        self.at += N;
        Ok(*taken)
    }

    fn word(&mut self) -> Result<u32, ViewError> {
        Ok(u32::from_le_bytes(self.take()?))
    }

    fn number(&mut self) -> Result<f64, ViewError> {
        Ok(f64::from(f32::from_le_bytes(self.take()?)))
    }

    fn vector(&mut self) -> Result<DVec3, ViewError> {
        Ok(DVec3::new(self.number()?, self.number()?, self.number()?))
    }
}
