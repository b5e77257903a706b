//! Frames as bytes: the binary messages of the page and the contents of a replay.
//!
//! Little-endian, without padding. First the version (u8), the state (u8), a bit for each part that is present (u16), the time (f64, s) and
//! seven joint angles (f32, rad). Then the parts in the order of their bits; all numbers are f32 unless stated otherwise:
//!
//! | bit | part | numbers |
//! | --- | --- | --- |
//! | 0 | hand | mask of the joints that are seen (u32), three for each of them |
//! | 1 | head | 3 |
//! | 2 | gaze | origin 3, direction 3 |
//! | 3 | prediction | point 3, normal 3, surface (i32, -1: unknown), time to contact (NaN: does not approach) |
//! | 4 | its 90 % region | two half axes of 3 |
//! | 5 | goal | point 3, normal 3 |
//! | 6 | time left for the board | 1 |
//! | 7 | force | 3 |
//! | 8 | openings | their number (u32), one each; trailing zeros are left out |
//! | 9 | parts that the supervisor uses | their number (u32); for each its kind (u32, 0: the arm, 1: head, 2: torso, 3: the person's arm), its ends 3 and 3, its radius |
//! | 10 | link in front of a surface | its index among the parts (u32), its distance in front of the surface, m |
//! | 11 | place of a base that drives | place in the scene 3, heading |

use crate::body::{MOST_PARTS, ViewPart};
use crate::error::ViewError;
use crate::frame::{ViewFrame, ViewPrediction};
use crate::hand::{HAND_JOINTS, ViewHand};
use crate::scene::MOST_MOVING;
use crate::state::ViewState;
use glam::DVec3;
use hwall::haptics::LinkInFront;
use hwall::haptics::body::BodyRegion;
use hwall::kinematics::JointPositions;

/// The version of the encoding.
pub(crate) const VERSION: u8 = 1;

/// Bits of the parts, in their order.
const HAND: u16 = 1;
const HEAD: u16 = 2;
const GAZE: u16 = 4;
const PREDICTED: u16 = 8;
const REGION: u16 = 16;
const GOAL: u16 = 32;
const LEFT: u16 = 64;
const FORCE: u16 = 128;
const OPENINGS: u16 = 256;
const PARTS: u16 = 512;
const IN_FRONT: u16 = 1024;
const BASE: u16 = 2048;
/// All bits with a meaning.
const KNOWN: u16 = 4095;
/// Kinds of parts, in the order of their numbers.
const REGIONS: [Option<BodyRegion>; 4] = [
    None,
    Some(BodyRegion::Head),
    Some(BodyRegion::Torso),
    Some(BodyRegion::Arm),
];

impl ViewFrame {
    /// Most bytes that a frame takes.
    pub const MOST_BYTES: usize = 40
        + (4 + 12 * HAND_JOINTS)
        + 12
        + 24
        + 32
        + 24
        + 24
        + 4
        + 12
        + (4 + 4 * MOST_MOVING)
        + (4 + 32 * MOST_PARTS)
        + 8
        + 16;

    /// Appends the frame: little-endian, numbers as f32, the time as f64. A part with a NaN or infinite value is left out as if it were
    /// absent; such joint angles, openings and times are written as zero.
    pub fn encode(&self, out: &mut Vec<u8>) {
        let finite = |v: &DVec3| v.is_finite();
        let both = |pair: &(DVec3, DVec3)| pair.0.is_finite() && pair.1.is_finite();
        let or_zero = |value: f64| if value.is_finite() { value } else { 0.0 };
        let predicted = self
            .predicted
            .filter(|p| p.point_m.is_finite() && p.normal.is_finite());
        let mut frame = Self {
            t_s: or_zero(self.t_s),
            q: JointPositions(self.q.0.map(or_zero)),
            hand: ViewHand::from_joints(&self.hand.joints_m),
            head_m: self.head_m.filter(finite),
            gaze: self.gaze.filter(both),
            predicted: predicted.map(|predicted| ViewPrediction {
                region_m: predicted.region_m.filter(|axes| axes.iter().all(finite)),
                ..predicted
            }),
            goal: self.goal.filter(both),
            left_s: self.left_s.filter(|s| s.is_finite()),
            force_n: self.force_n.filter(finite),
            parts: [None; MOST_PARTS],
            link_in_front: (self.link_in_front).filter(|found| found.in_front_m.is_finite()),
            base: (self.base).filter(|(at_m, yaw_rad)| at_m.is_finite() && yaw_rad.is_finite()),
            ..*self
        };
        // A link is identified by its index among the parts, so send all of them or none.
        if self.parts.iter().flatten().all(|part| part.is_finite()) {
            for (to, part) in frame.parts.iter_mut().zip(self.parts.iter().flatten()) {
                *to = Some(*part);
            }
        }
        let openings = frame.openings.iter().rposition(|opening| *opening != 0.0);
        let mut openings = openings.map_or(0, |last| last as u32 + 1);
        frame.openings = frame.openings.map(or_zero);
        let region = frame.predicted.is_some_and(|p| p.region_m.is_some());
        let parts = [
            (HAND, !frame.hand.is_lost()),
            (HEAD, frame.head_m.is_some()),
            (GAZE, frame.gaze.is_some()),
            (PREDICTED, frame.predicted.is_some()),
            (REGION, region),
            (GOAL, frame.goal.is_some()),
            (LEFT, frame.left_s.is_some()),
            (FORCE, frame.force_n.is_some()),
            (OPENINGS, openings > 0),
            (PARTS, frame.parts[0].is_some()),
            (IN_FRONT, frame.link_in_front.is_some()),
            (BASE, frame.base.is_some()),
        ];
        let present = parts.into_iter().filter(|(_, is)| *is);
        let present = present.fold(0, |bits, (bit, _)| bits | bit);
        out.extend([VERSION, self.state as u8]);
        out.extend(present.to_le_bytes());
        out.extend(frame.t_s.to_le_bytes());
        // Writing never fails.
        let _ = frame.pass(&mut Bytes::Out(out), present, &mut openings);
    }

    /// Decodes the frame at the start of `bytes`; returns it and its length in bytes. Numbers come back as f32: within 6e-8 of their size.
    ///
    /// # Errors
    /// Too few bytes, another version, an undefined state or bit.
    pub fn decode(bytes: &[u8]) -> Result<(Self, usize), ViewError> {
        let mut at = 0;
        let mut reader = Bytes::In { bytes, at: &mut at };
        let [version, state] = reader.take()?;
        if version != VERSION {
            return Err(ViewError::Version {
                expected: VERSION,
                got: version,
            });
        }
        let last = ViewState::ALL.len() as u32 - 1;
        at_most("state", u32::from(state), last)?;
        let present = u16::from_le_bytes(reader.take()?);
        at_most("presence bits", u32::from(present), u32::from(KNOWN))?;
        let t_s = f64::from_le_bytes(reader.take()?);
        let mut frame = Self {
            state: ViewState::ALL[usize::from(state)],
            ..Self::new(t_s, JointPositions::default())
        };
        frame.pass(&mut reader, present, &mut 0)?;
        Ok((frame, at))
    }

    /// Writes or reads the joint angles and the parts that are present.
    fn pass(
        &mut self,
        bytes: &mut Bytes<'_>,
        present: u16,
        openings: &mut u32,
    ) -> Result<(), ViewError> {
        let has = |bit: u16| present & bit != 0;
        self.q.0.iter_mut().try_for_each(|q| bytes.number(q))?;
        if has(HAND) {
            let seen = self.hand.joints_m.iter().enumerate();
            let mut mask = seen.fold(0, |mask, (i, m)| mask | (u32::from(m.is_some()) << i));
            bytes.word(&mut mask)?;
            at_most("mask of joints", mask, (1 << HAND_JOINTS) - 1)?;
            for (i, joint_m) in self.hand.joints_m.iter_mut().enumerate() {
                if mask & (1 << i) != 0 {
                    bytes.vector(joint_m.get_or_insert_default())?;
                }
            }
        }
        if has(HEAD) {
            bytes.vector(self.head_m.get_or_insert_default())?;
        }
        if has(GAZE) {
            bytes.pair(self.gaze.get_or_insert_default())?;
        }
        let mut spare = ViewPrediction::default();
        if has(PREDICTED) {
            let predicted = self.predicted.get_or_insert_default();
            bytes.vector(&mut predicted.point_m)?;
            bytes.vector(&mut predicted.normal)?;
            let surface = predicted.surface.and_then(|s| i32::try_from(s).ok());
            let mut surface = surface.unwrap_or(-1).cast_unsigned();
            bytes.word(&mut surface)?;
            predicted.surface = u32::try_from(surface.cast_signed()).ok();
            let contact_s = predicted.contact_s.filter(|s| s.is_finite());
            let mut contact_s = contact_s.unwrap_or(f64::NAN);
            bytes.number(&mut contact_s)?;
            predicted.contact_s = Some(contact_s).filter(|s| s.is_finite());
        }
        if has(REGION) {
            let predicted = self.predicted.as_mut().unwrap_or(&mut spare);
            for axis_m in predicted.region_m.get_or_insert_default() {
                bytes.vector(axis_m)?;
            }
        }
        if has(GOAL) {
            bytes.pair(self.goal.get_or_insert_default())?;
        }
        if has(LEFT) {
            bytes.number(self.left_s.get_or_insert_default())?;
        }
        if has(FORCE) {
            bytes.vector(self.force_n.get_or_insert_default())?;
        }
        if has(OPENINGS) {
            bytes.word(openings)?;
            at_most("number of openings", *openings, MOST_MOVING as u32)?;
            for opening in self.openings.iter_mut().take(*openings as usize) {
                bytes.number(opening)?;
            }
        }
        if has(PARTS) {
            let mut count = self.parts.iter().flatten().count() as u32;
            bytes.word(&mut count)?;
            at_most("number of parts", count, MOST_PARTS as u32)?;
            for part in self.parts.iter_mut().take(count as usize) {
                let ViewPart { capsule, region } = part.get_or_insert(ViewPart::SPARE);
                let number = REGIONS.iter().position(|known| known == region);
                let mut number = number.unwrap_or(0) as u32;
                bytes.word(&mut number)?;
                at_most("part", number, REGIONS.len() as u32 - 1)?;
                *region = REGIONS[number as usize];
                bytes.vector(&mut capsule.from_m)?;
                bytes.vector(&mut capsule.to_m)?;
                bytes.number(&mut capsule.radius_m)?;
            }
        }
        if has(IN_FRONT) {
            let mut found = self.link_in_front.unwrap_or(LinkInFront {
                link: 0,
                in_front_m: 0.0,
            });
            let mut link = found.link as u32;
            bytes.word(&mut link)?;
            at_most("link", link, MOST_PARTS as u32 - 1)?;
            found.link = link as usize;
            bytes.number(&mut found.in_front_m)?;
            self.link_in_front = Some(found);
        }
        if has(BASE) {
            let (at_m, yaw_rad) = self.base.get_or_insert_default();
            bytes.vector(at_m)?;
            bytes.number(yaw_rad)?;
        }
        Ok(())
    }
}

fn at_most(what: &'static str, got: u32, most: u32) -> Result<(), ViewError> {
    if got > most {
        return Err(ViewError::Unknown { what, got, most });
    }
    Ok(())
}

/// A destination or source of bytes; reading overwrites the value.
enum Bytes<'a> {
    Out(&'a mut Vec<u8>),
    In { bytes: &'a [u8], at: &'a mut usize },
}

impl Bytes<'_> {
    /// The next bytes of a source.
    fn take<const N: usize>(&mut self) -> Result<[u8; N], ViewError> {
        let Self::In { bytes, at } = self else {
            return Ok([0; N]);
        };
        let truncated = ViewError::Truncated {
            needed: **at + N,
            got: bytes.len(),
        };
        let rest = bytes.get(**at..).unwrap_or_default();
        let taken = rest.first_chunk().ok_or(truncated)?;
        **at += N;
        Ok(*taken)
    }

    fn word(&mut self, value: &mut u32) -> Result<(), ViewError> {
        match self {
            Self::Out(out) => out.extend(value.to_le_bytes()),
            Self::In { .. } => *value = u32::from_le_bytes(self.take()?),
        }
        Ok(())
    }

    fn number(&mut self, value: &mut f64) -> Result<(), ViewError> {
        let mut bits = (*value as f32).to_bits();
        self.word(&mut bits)?;
        *value = f64::from(f32::from_bits(bits));
        Ok(())
    }

    fn vector(&mut self, v: &mut DVec3) -> Result<(), ViewError> {
        self.number(&mut v.x)?;
        self.number(&mut v.y)?;
        self.number(&mut v.z)
    }

    fn pair(&mut self, (a, b): &mut (DVec3, DVec3)) -> Result<(), ViewError> {
        self.vector(a)?;
        self.vector(b)
    }
}
