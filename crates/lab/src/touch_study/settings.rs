//! From flags to a protocol.

use anyhow::{Context, ensure};
use clap::ValueEnum;
use hwall_stage::numbers::count_within;
use hwall_study::{Procedure, Protocol, StudyFactor, TrialOrder};

/// Order of the conditions within a block.
#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
pub enum OrderKind {
    /// At random, no condition twice in a row
    Random,
    /// Rows of a balanced Latin square
    Latin,
}

/// What is asked after a touch.
#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
pub enum ProcedureKind {
    /// A number in proportion to what was felt
    Magnitude,
    /// A point of a scale from 1 to 7
    Likert,
    /// Which of two was rougher, the condition or the study's first
    Intervals,
    /// The same; which condition comes is decided by a staircase, two down and one up
    Staircase,
    /// The same; which condition comes is decided by QUEST+
    Quest,
}

/// Flags of a protocol.
#[derive(Debug, Clone, clap::Args)]
pub struct ProtocolArgs {
    /// Factors: angle (degrees from the long axis of the bumps), speed (mm/s), surface (wall, door, panel)
    #[arg(long, value_delimiter = ',', default_value = "angle,speed")]
    pub factors: Vec<String>,
    /// Levels of the factors: 0,45,90/20,60, one list for each [default: the dissertation's five angles and five speeds]
    #[arg(long, value_delimiter = '/')]
    pub levels: Vec<String>,
    /// Blocks; each holds every condition once
    #[arg(long, default_value_t = 1, value_parser = count_within::<1, 1000>)]
    pub repeats: usize,
    /// Order within a block
    #[arg(long, value_enum, default_value = "random")]
    pub order: OrderKind,
    /// What is asked
    #[arg(long, value_enum, default_value = "magnitude")]
    pub procedure: ProcedureKind,
    /// Practice trials
    #[arg(long, default_value_t = 3)]
    pub practice: usize,
    /// Trials of a block that are repeated right away
    #[arg(long = "catch", default_value_t = 2)]
    pub catch_per_block: usize,
    /// A break after so many trials; 0: none
    #[arg(long, default_value_t = 50)]
    pub break_after: usize,
    /// Seed of all orders
    #[arg(long, default_value_t = 1)]
    pub seed: u64,
}

impl ProtocolArgs {
    /// The protocol for so many subjects.
    ///
    /// # Errors
    /// Levels that do not match the factors; a protocol that cannot be run.
    pub fn protocol(&self, subjects: usize) -> anyhow::Result<Protocol> {
        let usual = Protocol::default();
        let factors = if self.levels.is_empty() {
            let known = |name: &String| {
                let found = usual.factors.iter().find(|f| f.name == *name).cloned();
                found.with_context(|| format!("--levels: none for {name:?}"))
            };
            self.factors
                .iter()
                .map(known)
                .collect::<anyhow::Result<_>>()?
        } else {
            let (factors, lists) = (self.factors.len(), self.levels.len());
            ensure!(
                factors == lists,
                "--levels: {lists} lists for {factors} factors; write 0,45,90/20,60"
            );
            let lists = self.factors.iter().zip(&self.levels);
            lists
                .map(|(name, list)| StudyFactor::new(name.trim(), list.split(',').map(str::trim)))
                .collect()
        };
        let protocol = Protocol {
            title: format!("roughness by {}", self.factors.join(" and ")),
            factors,
            subjects,
            repeats: self.repeats,
            order: match self.order {
                OrderKind::Random => TrialOrder::Random,
                OrderKind::Latin => TrialOrder::Latin,
            },
            procedure: match self.procedure {
                ProcedureKind::Magnitude => Procedure::Magnitude,
                ProcedureKind::Likert => Procedure::Likert { points: 7 },
                ProcedureKind::Intervals => Procedure::TwoIntervals,
                ProcedureKind::Staircase => Procedure::Staircase,
                ProcedureKind::Quest => Procedure::Quest,
            },
            practice: self.practice,
            catch_per_block: self.catch_per_block,
            break_after: self.break_after,
            seed: self.seed,
            ..usual
        };
        protocol.validate()?;
        Ok(protocol)
    }
}
