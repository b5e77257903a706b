//! The contacts, on all cores.

use super::contact::Contact;
use super::simulation::{self, Outcome};
use hwall_haptics::HapticsError;
use hwall_haptics::passivity::{Causality, PassivityMethod};
use hwall_stage::numbers::whole_within;
use hwall_testkit::quantile;
use rayon::prelude::*;

/// Settings of the study.
#[derive(Debug, Clone, Copy, PartialEq, Eq, clap::Args)]
pub struct Request {
    /// Number of contacts
    #[arg(long, default_value_t = 1_000_000, value_parser = whole_within::<1, 100_000_000>, allow_negative_numbers = true)]
    pub contacts: u64,
    /// Seed of the contacts and the sensors' noise
    #[arg(long, default_value_t = 1, allow_negative_numbers = true)]
    pub seed: u64,
}

/// Compared methods: none, and the one in use.
const METHODS: [PassivityMethod; 2] = [PassivityMethod::Off, PassivityMethod::Tank];

/// Energy beyond this counts as generated, J: a hundred times the rounding of the sums.
pub const NUMERICAL_J: f64 = 1e-9;
/// Energy beyond this counts as felt, J.
pub const FELT_J: f64 = 1e-3;
/// A persistent oscillation above this is a limit cycle, peak to peak, m.
pub const LIMIT_CYCLE_M: f64 = 2e-3;

/// One method on all contacts of a causality.
#[derive(Debug, Clone, PartialEq)]
pub struct Row {
    /// Which variable is commanded.
    pub causality: Causality,
    /// Passivity method.
    pub method: PassivityMethod,
    /// Contacts.
    pub contacts: usize,
    /// With more than [`NUMERICAL_J`] generated.
    pub generating: usize,
    /// With more than [`FELT_J`] generated.
    pub felt: usize,
    /// Largest generated energy, J.
    pub most_j: f64,
    /// With a limit cycle beyond [`LIMIT_CYCLE_M`].
    pub cycling: usize,
    /// Largest persistent oscillation, m.
    pub largest_swing_m: f64,
    /// Number of failures: energy above [`NUMERICAL_J`], or a limit cycle.
    pub failed: usize,
    /// Reduction of commands for contacts that are passive and quiet without a method: mean, median, 90th percentile.
    pub intrusion: [f64; 3],
}

/// Contacts between two reports of progress.
const BLOCK: u64 = 2048;

/// The stored result of a contact.
type Kept = (Causality, [Outcome; METHODS.len()]);

/// Runs every contact with every method: a row for each causality and method. `progress` receives the number of contacts done.
///
/// # Errors
/// As [`simulation::run`].
pub fn run(request: &Request, progress: impl Fn(u64)) -> anyhow::Result<Vec<Row>> {
    let followed = |index: u64| -> Result<Kept, HapticsError> {
        let contact = Contact::draw(request.seed, index);
        let [off, tank] = METHODS.map(|method| simulation::run(&contact, method));
        Ok((contact.causality, [off?, tank?]))
    };
    let mut kept: Vec<Kept> = Vec::with_capacity(request.contacts as usize);
    let mut done = 0;
    while done < request.contacts {
        let end = (done + BLOCK).min(request.contacts);
        let block = (done..end).into_par_iter().map(followed);
        kept.extend(block.collect::<Result<Vec<Kept>, _>>()?);
        done = end;
        progress(done);
    }
    let mut rows = Vec::new();
    for causality in [Causality::Impedance, Causality::Admittance] {
        for (place, method) in METHODS.into_iter().enumerate() {
            rows.push(row(&kept, causality, method, place));
        }
    }
    Ok(rows)
}

fn failed(outcome: &Outcome) -> bool {
    outcome.generated_j > NUMERICAL_J || outcome.swing_m > LIMIT_CYCLE_M
}

fn row(kept: &[Kept], causality: Causality, method: PassivityMethod, place: usize) -> Row {
    let own = || kept.iter().filter(move |(of, _)| *of == causality);
    let outcomes = || own().map(move |(_, outcomes)| outcomes[place]);
    let count = |f: &dyn Fn(&Outcome) -> bool| outcomes().filter(f).count();
    let most = |f: &dyn Fn(&Outcome) -> f64| outcomes().map(|o| f(&o)).fold(0.0, f64::max);
    let sound = own().filter(|(_, outcomes)| !failed(&outcomes[0]));
    let mut intrusion: Vec<f64> = sound
        .map(|(_, outcomes)| outcomes[place].intrusion)
        .collect();
    intrusion.sort_by(f64::total_cmp);
    let mean = intrusion.iter().sum::<f64>() / intrusion.len().max(1) as f64;
    let at = |share: f64| quantile(&intrusion, share);
    Row {
        causality,
        method,
        contacts: outcomes().count(),
        generating: count(&|o| o.generated_j > NUMERICAL_J),
        felt: count(&|o| o.generated_j > FELT_J),
        most_j: most(&|o| o.generated_j),
        cycling: count(&|o| o.swing_m > LIMIT_CYCLE_M),
        largest_swing_m: most(&|o| o.swing_m),
        failed: count(&failed),
        intrusion: [mean, at(0.5), at(0.9)],
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::passivity::document;

    #[test]
    fn the_default_never_fails_where_nothing_does() {
        let request = Request {
            contacts: 150,
            seed: 3,
        };
        let rows = run(&request, |_| {}).unwrap();
        let of = |method| rows.iter().filter(move |row| row.method == method);
        let failed = |method| of(method).map(|row| row.failed).sum::<usize>();
        assert_eq!(failed(PassivityMethod::default()), 0);
        assert!(failed(PassivityMethod::Off) > 10);
        let contacts = of(PassivityMethod::Off).map(|row| row.contacts);
        assert_eq!(contacts.sum::<usize>(), 150);
        let text = document::text(&request, &rows);
        assert!(!text.contains("NaN") && !text.contains("| no "), "{text}");
        // The same seed, the same rows.
        assert_eq!(run(&request, |_| {}).unwrap(), rows);
    }
}
