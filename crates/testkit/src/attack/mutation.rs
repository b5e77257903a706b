//! Good inputs turned into hostile ones.

use crate::sampler::Sampler;

/// Replacements for numbers.
const NUMBERS: [&str; 26] = [
    "0",
    "-0",
    "1",
    "-1",
    "NaN",
    "inf",
    "-inf",
    "1e308",
    "-1e308",
    "1.8e308",
    "1e-320",
    "5e-324",
    "1e154",
    "1e160",
    "1e20",
    "1e9",
    "-1e9",
    "1e-9",
    "1e7",
    "99999999999",
    "18446744073709551616",
    "-9223372036854775809",
    "0x10",
    "1,5",
    "",
    "1e",
];
/// Byte sequences inserted anywhere.
const SCRAPS: [&[u8]; 16] = [
    b"\r\n",
    b"\r",
    b"\n\n",
    b"\xef\xbb\xbf",
    b"\"",
    b"\0",
    b"\xff",
    b"..",
    b"/",
    b";",
    b"\t",
    b",",
    b"<",
    b">",
    b"\\\n",
    b"#",
];
/// Extreme counts for binary files.
const COUNTS: [u64; 10] = [
    0,
    1,
    255,
    65_535,
    65_536,
    0x7fff_ffff,
    0xffff_ffff,
    0x1_0000_0000,
    0x7fff_ffff_ffff_ffff,
    u64::MAX,
];

/// Makes inputs from a few good ones: flips bits, truncates, joins pieces of two inputs, makes numbers extreme, repeats
/// or moves lines, makes counts huge. One seed, one sequence.
#[derive(Debug, Clone)]
pub struct Mutator<'a> {
    good: &'a [Vec<u8>],
    sampler: Sampler,
    most_bytes: usize,
}

impl<'a> Mutator<'a> {
    /// From accepted inputs; the mutated ones have at most `most_bytes`.
    ///
    /// # Panics
    /// Without any input.
    #[must_use]
    pub fn new(good: &'a [Vec<u8>], seed: u64, most_bytes: usize) -> Self {
        assert!(!good.is_empty(), "an attack needs an input to begin with");
        Self {
            good,
            sampler: Sampler::new(seed),
            most_bytes,
        }
    }

    /// The next input: one to six mutations of a good one, mostly few, so that many pass the first checks.
    pub fn input(&mut self) -> Vec<u8> {
        let mut bytes = self.any().to_vec();
        let most = 1 + self.sampler.index(6);
        for _ in 0..=self.sampler.index(most) {
            self.mutate(&mut bytes);
            bytes.truncate(self.most_bytes);
        }
        bytes
    }

    fn any(&mut self) -> &'a [u8] {
        &self.good[self.sampler.index(self.good.len())]
    }

    fn mutate(&mut self, bytes: &mut Vec<u8>) {
        if bytes.is_empty() {
            bytes.extend_from_slice(self.any());
        }
        let at = self.sampler.index(bytes.len());
        match self.sampler.index(14) {
            0 => bytes[at] ^= 1 << self.sampler.index(8),
            1 => bytes[at] = self.sampler.index(256) as u8,
            2 => bytes.truncate(at),
            3 => {
                let other = self.any();
                let from = self.sampler.index(other.len().max(1)).min(other.len());
                bytes.truncate(at);
                bytes.extend_from_slice(&other[from..]);
            }
            4..=6 => self.number(bytes, at),
            7 => self.line(bytes, at),
            8 => self.count(bytes, at),
            9 => {
                let scrap = SCRAPS[self.sampler.index(SCRAPS.len())];
                bytes.splice(at..at, scrap.iter().copied());
            }
            10 => {
                let end = (at + 1 + self.sampler.index(32)).min(bytes.len());
                let piece: Vec<u8> = bytes[at..end].to_vec();
                let times = 1 << self.sampler.index(9);
                bytes.splice(at..at, piece.repeat(times));
            }
            11 => {
                let end = (at + 1 + self.sampler.index(16)).min(bytes.len());
                bytes.drain(at..end);
            }
            12 => {
                // Eight bytes as a number, as in binary formats.
                let numbers = [
                    f64::NAN,
                    f64::INFINITY,
                    -1.0,
                    1e308,
                    -1e308,
                    5e-324,
                    1e20,
                    0.0,
                ];
                let number = numbers[self.sampler.index(numbers.len())].to_le_bytes();
                for (byte, new) in bytes[at..].iter_mut().zip(number) {
                    *byte = new;
                }
            }
            _ => {
                let other = self.sampler.index(bytes.len());
                bytes.swap(at, other);
            }
        }
    }

    /// Replaces the next number after a position.
    fn number(&mut self, bytes: &mut Vec<u8>, at: usize) {
        let of_number =
            |b: &u8| b.is_ascii_digit() || matches!(b, b'.' | b'-' | b'+' | b'e' | b'E');
        let Some(start) = bytes[at..].iter().position(u8::is_ascii_digit) else {
            return;
        };
        let mut start = at + start;
        while start > 0 && of_number(&bytes[start - 1]) {
            start -= 1;
        }
        let length = bytes[start..].iter().take_while(|b| of_number(b)).count();
        let new = NUMBERS[self.sampler.index(NUMBERS.len())];
        bytes.splice(start..start + length, new.bytes());
    }

    /// Repeats, drops or moves the line at a position.
    fn line(&mut self, bytes: &mut Vec<u8>, at: usize) {
        let start = bytes[..at]
            .iter()
            .rposition(|b| *b == b'\n')
            .map_or(0, |i| i + 1);
        let end = bytes[at..]
            .iter()
            .position(|b| *b == b'\n')
            .map_or(bytes.len(), |i| at + i + 1);
        let line: Vec<u8> = bytes[start..end].to_vec();
        match self.sampler.index(3) {
            0 => {
                let times = 1 << self.sampler.index(9);
                bytes.splice(start..start, line.repeat(times));
            }
            1 => drop(bytes.drain(start..end)),
            _ => {
                bytes.drain(start..end);
                bytes.extend_from_slice(&line);
            }
        }
    }

    /// Overwrites a position with a count, little-endian, two, four or eight bytes.
    fn count(&mut self, bytes: &mut [u8], at: usize) {
        let count = COUNTS[self.sampler.index(COUNTS.len())].to_le_bytes();
        let width = 2 << self.sampler.index(3);
        for (byte, new) in bytes[at..].iter_mut().zip(&count[..width]) {
            *byte = *new;
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn one_seed_gives_one_sequence_of_bounded_inputs() {
        let good = [b"a,b\n1,2\n3,4\n".to_vec(), vec![0; 100]];
        let inputs = |seed| {
            let mut mutator = Mutator::new(&good, seed, 1000);
            (0..2000).map(|_| mutator.input()).collect::<Vec<_>>()
        };
        let first = inputs(1);
        assert_eq!(first, inputs(1));
        assert_ne!(first, inputs(2));
        assert!(first.iter().all(|input| input.len() <= 1000));
        let text = |what: &[u8]| {
            first
                .iter()
                .any(|i| i.windows(what.len()).any(|w| w == what))
        };
        assert!(text(b"1e308") && text(b"NaN") && text(b"\r\n"));
    }
}
