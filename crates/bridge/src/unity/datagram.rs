//! The datagram in which the dissertation's Unity side sends the target of the board.

use crate::error::BridgeError;
use hwall::numeric::check::{finite, that};

/// Added to the orientation of an object that moves, degrees.
const DYNAMIC_DEG: f64 = 600.0;
/// Range of an orientation, degrees: either half a turn to each side or a whole turn.
const ORIENTATION_DEG: [f64; 2] = [-180.0, 360.0];
/// Largest coordinate, mm, far beyond the reach of any table-top arm.
const MAX_MM: f64 = 1e5;
/// Degrees for each step of the tens digit of a roughness code.
const STEP_DEG: f64 = 22.5;
/// mm/s for each step of its ones digit.
const STEP_MM_PER_S: f64 = 10.0;
/// A number further than this from a whole number is rejected; f32 holds two-digit whole numbers exactly.
const WHOLE: f64 = 1e-3;

/// How the board turns and moves to feel as rough as the surface that it represents.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct RoughnessCode {
    angle_steps: u8,
    speed_steps: u8,
}

impl RoughnessCode {
    /// From the steps of the two digits, 22.5 degrees and 10 mm/s each.
    ///
    /// # Errors
    /// A digit above nine.
    pub fn new(angle_steps: u8, speed_steps: u8) -> Result<Self, BridgeError> {
        if angle_steps > 9 || speed_steps > 9 {
            return Err(BridgeError::RoughnessCode {
                code: 10.0 * f64::from(angle_steps) + f64::from(speed_steps),
            });
        }
        Ok(Self {
            angle_steps,
            speed_steps,
        })
    }

    /// The code as a number of two digits.
    #[must_use]
    pub const fn number(self) -> u8 {
        10 * self.angle_steps + self.speed_steps
    }

    /// Turn of the board about its normal, rad.
    #[must_use]
    pub fn angle_rad(self) -> f64 {
        (STEP_DEG * f64::from(self.angle_steps)).to_radians()
    }

    /// Speed of the board within its plane, m/s.
    #[must_use]
    pub fn speed_m_per_s(self) -> f64 {
        1e-3 * STEP_MM_PER_S * f64::from(self.speed_steps)
    }

    fn from_number(code: f64) -> Result<Self, BridgeError> {
        let whole = code.round();
        // NaN fails both comparisons.
        if !((code - whole).abs() <= WHOLE && (0.0..=99.0).contains(&whole)) {
            return Err(BridgeError::RoughnessCode { code });
        }
        let number = whole as u8;
        Self::new(number / 10, number % 10)
    }
}

/// The target of the board: five little-endian f32, 20 bytes.
///
/// | number | means |
/// | --- | --- |
/// | 0 | orientation of the surface, degrees, -180 to 360; 600 is added for an object that moves |
/// | 1, 2, 3 | x, y, z, mm |
/// | 4 | roughness code: tens digit times 22.5 degrees, ones digit times 10 mm/s |
///
/// Source: the released code of the dissertation. The code states no frames. It is assumed that positions are in the base frame of the arm,
/// and that the orientation is the heading of the surface's outward normal about z, counter-clockwise from x
/// ([`UnityConfig`](crate::UnityConfig) corrects both).
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct BoardDatagram {
    /// Heading of the outward normal, degrees, without the offset for moving objects.
    pub orientation_deg: f64,
    /// Position, mm.
    pub position_mm: [f64; 3],
    /// Does the object move?
    pub is_dynamic: bool,
    /// How rough it is.
    pub roughness: RoughnessCode,
}

impl BoardDatagram {
    /// Bytes of a datagram.
    pub const BYTES: usize = 20;

    /// Decodes a datagram.
    ///
    /// # Errors
    /// Another length, NaN, or a number outside its range.
    pub fn decode(bytes: &[u8]) -> Result<Self, BridgeError> {
        let wrong = BridgeError::DatagramLength { bytes: bytes.len() };
        let bytes: &[u8; Self::BYTES] = bytes.try_into().map_err(|_| wrong)?;
        let [orientation, x, y, z, code] = {
            let mut numbers = [0.0; 5];
            for (number, four) in numbers.iter_mut().zip(bytes.chunks_exact(4)) {
                let mut word = [0; 4];
                word.copy_from_slice(four);
                *number = f64::from(f32::from_le_bytes(word));
            }
            numbers
        };
        finite("orientation_deg", orientation)?;
        let is_dynamic = orientation >= DYNAMIC_DEG + ORIENTATION_DEG[0];
        let mark_deg = if is_dynamic { DYNAMIC_DEG } else { 0.0 };
        let datagram = Self {
            orientation_deg: orientation - mark_deg,
            position_mm: [x, y, z],
            is_dynamic,
            roughness: RoughnessCode::from_number(code)?,
        };
        datagram.validate()?;
        Ok(datagram)
    }

    /// Encodes a datagram; angles and positions are rounded to f32.
    ///
    /// # Errors
    /// NaN, or a number outside its range.
    pub fn encode(&self) -> Result<[u8; Self::BYTES], BridgeError> {
        self.validate()?;
        let mark_deg = if self.is_dynamic { DYNAMIC_DEG } else { 0.0 };
        let [x, y, z] = self.position_mm;
        let code = f64::from(self.roughness.number());
        let mut bytes = [0; Self::BYTES];
        let numbers = [self.orientation_deg + mark_deg, x, y, z, code];
        for (four, number) in bytes.chunks_exact_mut(4).zip(numbers) {
            four.copy_from_slice(&(number as f32).to_le_bytes());
        }
        Ok(bytes)
    }

    fn validate(&self) -> Result<(), BridgeError> {
        let [least, most] = ORIENTATION_DEG;
        that(
            (least..=most).contains(&self.orientation_deg),
            "orientation_deg",
            self.orientation_deg,
            "in [-180, 360], or 600 more",
        )?;
        for (what, value) in ["x_mm", "y_mm", "z_mm"].into_iter().zip(self.position_mm) {
            that(value.abs() <= MAX_MM, what, value, "in [-1e5, 1e5]")?;
        }
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use hwall_testkit::{Sampler, refusal};

    fn bytes(numbers: [f32; 5]) -> Vec<u8> {
        numbers.iter().flat_map(|n| n.to_le_bytes()).collect()
    }

    #[test]
    fn a_datagram_written_by_hand_is_read() {
        // 45.0, 620.0, -150.0, 300.0, 23.0
        let bytes = [
            0x00, 0x00, 0x34, 0x42, 0x00, 0x00, 0x1b, 0x44, 0x00, 0x00, 0x16, 0xc3, 0x00, 0x00,
            0x96, 0x43, 0x00, 0x00, 0xb8, 0x41,
        ];
        let read = BoardDatagram::decode(&bytes).expect("a datagram");
        assert_eq!(read.orientation_deg, 45.0);
        assert_eq!(read.position_mm, [620.0, -150.0, 300.0]);
        assert!(!read.is_dynamic);
        assert!((read.roughness.angle_rad() - 45_f64.to_radians()).abs() < 1e-15);
        assert!((read.roughness.speed_m_per_s() - 0.03).abs() < 1e-15);
        assert_eq!(read.encode().expect("bytes"), bytes);
    }

    #[test]
    fn six_hundred_marks_what_moves() {
        for (orientation, deg, is_dynamic) in [
            (360.0, 360.0, false),
            (-180.0, -180.0, false),
            (420.0, -180.0, true),
            (600.0, 0.0, true),
            (960.0, 360.0, true),
        ] {
            let read = BoardDatagram::decode(&bytes([orientation, 0.0, 0.0, 0.0, 0.0]));
            let read = read.expect("a datagram");
            assert_eq!((read.orientation_deg, read.is_dynamic), (deg, is_dynamic));
        }
    }

    #[test]
    fn every_datagram_comes_back() {
        let mut sampler = Sampler::new(5);
        for _ in 0..2000 {
            let mm = |s: &mut Sampler| f64::from(s.uniform(-1000.0, 1000.0) as f32);
            let written = BoardDatagram {
                orientation_deg: f64::from(sampler.uniform(-180.0, 360.0) as f32),
                position_mm: std::array::from_fn(|_| mm(&mut sampler)),
                is_dynamic: sampler.bool(),
                roughness: RoughnessCode::new(sampler.index(10) as u8, sampler.index(10) as u8)
                    .expect("two digits"),
            };
            let bytes = written.encode().expect("bytes");
            let mut read = BoardDatagram::decode(&bytes).expect("a datagram");
            assert!((read.orientation_deg - written.orientation_deg).abs() < 1e-4);
            read.orientation_deg = written.orientation_deg;
            assert_eq!(read, written);
        }
    }

    #[test]
    fn what_makes_no_sense_is_named() {
        for (numbers, name) in [
            ([f32::NAN, 0.0, 0.0, 0.0, 0.0], "orientation_deg"),
            ([400.0, 0.0, 0.0, 0.0, 0.0], "orientation_deg"),
            ([1000.0, 0.0, 0.0, 0.0, 0.0], "orientation_deg"),
            ([0.0, 0.0, f32::INFINITY, 0.0, 0.0], "y_mm"),
            ([0.0, 0.0, 0.0, 2e5, 0.0], "z_mm"),
            ([0.0, 0.0, 0.0, 0.0, -1.0], "roughness code"),
            ([0.0, 0.0, 0.0, 0.0, 100.0], "roughness code"),
            ([0.0, 0.0, 0.0, 0.0, 2.5], "roughness code"),
            ([0.0, 0.0, 0.0, 0.0, f32::NAN], "roughness code"),
        ] {
            let said = refusal(BoardDatagram::decode(&bytes(numbers)));
            assert!(said.contains(name), "{said}");
        }
        for length in [0, 4, 19, 21, 1500] {
            let refused = BoardDatagram::decode(&vec![0; length]);
            let is_named =
                |e| matches!(e, BridgeError::DatagramLength { bytes } if bytes == length);
            assert!(refused.is_err_and(is_named), "{length}");
        }
        assert!(RoughnessCode::new(10, 0).is_err());
    }
}
