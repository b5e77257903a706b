//! Gives inputs to a reader, and reports the results.

use super::mutation::Mutator;
use std::panic::{AssertUnwindSafe, catch_unwind};
use std::time::Instant;

/// Largest input, bytes: long enough for every loop, short enough for millions of inputs.
const MOST_BYTES: usize = 40_000;
/// Largest number of findings kept.
const MOST_FINDINGS: usize = 20;

/// A reader's result for an input.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum Verdict {
    /// A typed error.
    Refused,
    /// A result that satisfies its contract.
    Accepted,
    /// A result that violates its contract, with the violation.
    Broken(String),
}

/// An input that caused a panic or a violation.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Finding {
    /// Its number in the sequence of the seed, from 0.
    pub number: u64,
    /// The violated contract, or the panic.
    pub what: String,
    /// The input.
    pub input: Vec<u8>,
}

/// The result of an attack.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct AttackReport {
    /// Name of the attack.
    pub name: String,
    /// Inputs given.
    pub inputs: u64,
    /// Refused with an error.
    pub refused: u64,
    /// Accepted without violation.
    pub accepted: u64,
    /// Panics and violations.
    pub findings: u64,
    /// The first of them.
    pub examples: Vec<Finding>,
    /// The longest time for one input, ms.
    pub slowest_ms: f64,
    /// Number of that input.
    pub slowest: u64,
}

/// Gives `inputs` hostile inputs to a reader, made from good ones.
///
/// # Panics
/// Without any good input.
pub fn attack(
    name: &str,
    good: &[Vec<u8>],
    inputs: u64,
    seed: u64,
    reader: impl Fn(&[u8]) -> Verdict,
) -> AttackReport {
    let mut report = AttackReport {
        name: name.to_owned(),
        inputs,
        ..AttackReport::default()
    };
    let mut mutator = Mutator::new(good, seed, MOST_BYTES);
    for number in 0..inputs {
        let input = mutator.input();
        let start = Instant::now();
        let verdict = catch_unwind(AssertUnwindSafe(|| reader(&input)));
        let took_ms = 1e3 * start.elapsed().as_secs_f64();
        if took_ms > report.slowest_ms {
            (report.slowest_ms, report.slowest) = (took_ms, number);
        }
        let what = match verdict {
            Ok(Verdict::Refused) => {
                report.refused += 1;
                continue;
            }
            Ok(Verdict::Accepted) => {
                report.accepted += 1;
                continue;
            }
            Ok(Verdict::Broken(what)) => what,
            Err(panic) => {
                let text = panic.downcast_ref::<String>().map(String::as_str);
                let text = text.or_else(|| panic.downcast_ref::<&str>().copied());
                format!("panic: {}", text.unwrap_or("without a message"))
            }
        };
        report.findings += 1;
        if report.examples.len() < MOST_FINDINGS {
            report.examples.push(Finding {
                number,
                what,
                input,
            });
        }
    }
    report
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn panics_and_broken_promises_are_findings() {
        let good = [b"12".to_vec()];
        let report = attack("number", &good, 3000, 1, |input| {
            let Ok(text) = std::str::from_utf8(input) else {
                return Verdict::Refused;
            };
            assert!(!text.contains("NaN"), "met NaN");
            match text.parse::<f64>() {
                Ok(number) if number.is_finite() => Verdict::Accepted,
                Ok(_) => Verdict::Broken("infinite".to_owned()),
                Err(_) => Verdict::Refused,
            }
        });
        assert_eq!(
            report.refused + report.accepted + report.findings,
            report.inputs
        );
        assert!(report.refused > 0 && report.accepted > 0);
        let met = |what: &str| report.examples.iter().any(|f| f.what.contains(what));
        assert!(met("met NaN") && met("infinite"));
        assert!(report.examples.len() <= MOST_FINDINGS);
    }
}
