//! From flags to a protocol.

use anyhow::{Context, bail, ensure};
use clap::ValueEnum;
use hwall_stage::numbers::count_within;
use hwall_study::{
    ArmKind, Durability, Participants, Procedure, Protocol, ReadyProtocol, Study, StudyError,
    StudyFactor, TrialOrder,
};
use std::path::Path;

/// Order of the conditions within a block.
#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
pub enum OrderKind {
    /// At random, no condition twice in a row
    Random,
    /// Rows of a balanced Latin square
    Latin,
}

/// The question after a touch.
#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
pub enum ProcedureKind {
    /// A number in proportion to the sensation
    Magnitude,
    /// A point on a scale, see --points
    Likert,
    /// Which of two was rougher, the condition or the study's first condition
    Intervals,
    /// The same; a staircase, two down and one up, chooses the condition
    Staircase,
    /// The same; QUEST+ chooses the condition
    Quest,
    /// Which felt more real, the condition or a whiteboard, on a scale, see --points
    Real,
}

/// Flags of a protocol. Missing flags take their defaults, or the values of the resumed study.
#[derive(Debug, Clone, Default, clap::Args)]
pub struct ProtocolArgs {
    /// A ready protocol, which the other flags can change: thesis:experiment-1, thesis:experiment-2, thesis:preliminary,
    /// thesis:roughness, thesis:cones
    #[arg(long = "protocol", value_name = "NAME", value_parser = ReadyProtocol::named)]
    pub ready: Option<ReadyProtocol>,
    /// Factors: angle (degrees from the long axis of the bumps), speed (mm/s), surface (wall, door, panel), patch (study-1.5,
    /// study-2, study-2.5, study-3, cones-3), question (any names) [default: angle,speed]
    #[arg(long, value_delimiter = ',')]
    pub factors: Vec<String>,
    /// Levels of the factors: 0,45,90/20,60, one list for each [default: the dissertation's five angles and five speeds]
    #[arg(long, value_delimiter = '/')]
    pub levels: Vec<String>,
    /// Blocks; each holds every condition once [default: 1]
    #[arg(long, value_parser = count_within::<1, 1000>, allow_negative_numbers = true)]
    pub repeats: Option<usize>,
    /// Order within a block [default: random]
    #[arg(long, value_enum)]
    pub order: Option<OrderKind>,
    /// The question [default: magnitude]
    #[arg(long, value_enum)]
    pub procedure: Option<ProcedureKind>,
    /// A question in your own words; with a factor `question`, one for each level, otherwise one for all trials
    #[arg(long = "question", value_name = "TEXT")]
    pub questions: Vec<String>,
    /// Points of the scale of --procedure likert [default: 7] and real [default: 5]
    #[arg(long, value_parser = count_within::<2, 100>, allow_negative_numbers = true)]
    pub points: Option<usize>,
    /// Practice trials [default: 3]
    #[arg(long, allow_negative_numbers = true)]
    pub practice: Option<usize>,
    /// Trials of a block that are repeated immediately [default: 2]
    #[arg(long = "catch", allow_negative_numbers = true)]
    pub catch_per_block: Option<usize>,
    /// A break after this many trials; 0: none [default: 50]
    #[arg(long, allow_negative_numbers = true)]
    pub break_after: Option<usize>,
    /// Seed of all orders [default: 1]
    #[arg(long, allow_negative_numbers = true)]
    pub seed: Option<u64>,
}

impl ProtocolArgs {
    /// The protocol of a new study for `subjects` subjects, by default the protocol's number.
    ///
    /// # Errors
    /// Levels that do not match the factors; a protocol that cannot be run.
    pub fn protocol(&self, subjects: Option<usize>) -> anyhow::Result<Protocol> {
        let nominal = self
            .ready
            .map_or_else(Protocol::default, ReadyProtocol::protocol);
        let protocol = self.applied_to(&nominal, subjects)?;
        let flags = || match protocol.procedure {
            Procedure::Staircase | Procedure::Quest => {
                format!("--levels, --procedure {}", in_words(protocol.procedure))
            }
            _ => "the protocol".to_owned(),
        };
        protocol.validate().with_context(flags)?;
        Ok(protocol)
    }

    /// Refuses flags that contradict the protocol of a resumed study, and names them.
    ///
    /// # Errors
    /// Such flags; levels that do not match the factors.
    pub fn check_against(&self, stored: &Protocol, subjects: Option<usize>) -> anyhow::Result<()> {
        let asked = self.applied_to(stored, subjects)?;
        let factors = |p: &Protocol| -> String {
            let each = p.factors.iter();
            let each = each.map(|f| format!("{} {}", f.name, f.levels.join(",")));
            each.collect::<Vec<_>>().join(" / ")
        };
        let mut others = Vec::new();
        let mut compare = |what: &str, [asked, there]: [String; 2]| {
            if asked != there {
                others.push(format!("{what} {asked} (there: {there})"));
            }
        };
        let both = [&asked, stored];
        let name =
            |ready: Option<ReadyProtocol>| ready.map_or("none", ReadyProtocol::name).to_owned();
        let there = ReadyProtocol::of(stored);
        compare("--protocol", [self.ready.or(there), there].map(name));
        compare("factors", both.map(factors));
        compare("subjects", both.map(|p| p.subjects.to_string()));
        compare("--repeats", both.map(|p| p.repeats.to_string()));
        let order = |p: &Protocol| format!("{:?}", p.order).to_lowercase();
        compare("--order", both.map(order));
        compare("--procedure", both.map(|p| in_words(p.procedure)));
        compare("--question", both.map(|p| p.questions.join(" / ")));
        compare("--practice", both.map(|p| p.practice.to_string()));
        compare("--catch", both.map(|p| p.catch_per_block.to_string()));
        compare("--break-after", both.map(|p| p.break_after.to_string()));
        compare("--seed", both.map(|p| p.seed.to_string()));
        ensure!(
            others.is_empty(),
            "the study there has other settings: {}; leave these flags out to go on with it",
            others.join(", ")
        );
        Ok(())
    }

    /// A protocol with the given flags applied.
    fn applied_to(&self, base: &Protocol, subjects: Option<usize>) -> anyhow::Result<Protocol> {
        let names: Vec<&str> = match self.factors.is_empty() {
            true => base.factors.iter().map(|f| f.name.as_str()).collect(),
            false => self.factors.iter().map(|f| f.trim()).collect(),
        };
        let factors = if self.levels.is_empty() {
            let nominal = Protocol::default();
            let known = |name: &&str| {
                let mut all = base.factors.iter().chain(&nominal.factors);
                let found = all.find(|f| f.name == *name).cloned();
                found.with_context(|| format!("--levels: none for {name:?}"))
            };
            names.iter().map(known).collect::<anyhow::Result<_>>()?
        } else {
            let (factors, lists) = (names.len(), self.levels.len());
            ensure!(
                factors == lists,
                "--levels: {lists} lists for {factors} factors ({}); write 0,45,90/20,60, and --factors if it is others",
                names.join(",")
            );
            let factor = |(name, list): (&&str, &String)| {
                StudyFactor::new(*name, list.split(',').map(str::trim))
            };
            names.iter().zip(&self.levels).map(factor).collect()
        };
        Ok(Protocol {
            title: match ReadyProtocol::of(base) {
                Some(_) if self.factors.is_empty() => base.title.clone(),
                _ => format!("roughness by {}", names.join(" and ")),
            },
            factors,
            subjects: subjects.unwrap_or(base.subjects),
            repeats: self.repeats.unwrap_or(base.repeats),
            order: match self.order {
                None => base.order,
                Some(OrderKind::Random) => TrialOrder::Random,
                Some(OrderKind::Latin) => TrialOrder::Latin,
            },
            procedure: self.procedure_from(base.procedure)?,
            questions: match self.questions.is_empty() {
                true => base.questions.clone(),
                false => self.questions.clone(),
            },
            practice: self.practice.unwrap_or(base.practice),
            catch_per_block: self.catch_per_block.unwrap_or(base.catch_per_block),
            break_after: self.break_after.unwrap_or(base.break_after),
            seed: self.seed.unwrap_or(base.seed),
            ..base.clone()
        })
    }

    /// The question and its scale, with the given flags applied.
    fn procedure_from(&self, base: Procedure) -> anyhow::Result<Procedure> {
        let procedure = match self.procedure {
            None => base,
            Some(ProcedureKind::Magnitude) => Procedure::Magnitude,
            Some(ProcedureKind::Likert) => match base {
                Procedure::Likert { .. } => base,
                _ => Procedure::Likert { points: 7 },
            },
            Some(ProcedureKind::Real) => match base {
                Procedure::MoreReal { .. } => base,
                _ => Procedure::MoreReal { points: 5 },
            },
            Some(ProcedureKind::Intervals) => Procedure::TwoIntervals,
            Some(ProcedureKind::Staircase) => Procedure::Staircase,
            Some(ProcedureKind::Quest) => Procedure::Quest,
        };
        Ok(match (procedure, self.points) {
            (Procedure::Likert { .. }, Some(points)) => Procedure::Likert {
                points: points.try_into().context("--points")?,
            },
            (Procedure::MoreReal { .. }, Some(points)) => Procedure::MoreReal {
                points: points.try_into().context("--points")?,
            },
            (_, Some(_)) => bail!("--points is for --procedure likert and real"),
            (_, None) => procedure,
        })
    }
}

/// The study of a folder, if it has these participants, this kind of arm and the given settings; `None` if its log was truncated
/// before its first event.
///
/// # Errors
/// Anything else; a log that cannot be read.
pub(super) fn resumed(
    folder: &Path,
    asked: Participants,
    arm: Option<ArmKind>,
    subjects: Option<usize>,
    protocol: &ProtocolArgs,
    durability: Durability,
) -> anyhow::Result<Option<Study>> {
    let read = || -> anyhow::Result<Option<Study>> {
        let record = match Study::read(folder) {
            Err(StudyError::NothingRecorded { .. }) => return Ok(None),
            read => read?,
        };
        // Check before resuming, because resuming is logged.
        let stored = record.participants;
        if stored != asked {
            return Err(StudyError::OtherParticipants { stored, asked }.into());
        }
        if let Some(asked) = arm.filter(|asked| *asked != record.arm) {
            let stored = record.arm;
            return Err(StudyError::OtherArm { stored, asked }.into());
        }
        protocol.check_against(&record.protocol, subjects)?;
        Ok(Some(Study::resume(folder, durability)?))
    };
    read().with_context(|| folder.display().to_string())
}

fn in_words(procedure: Procedure) -> String {
    match procedure {
        Procedure::Magnitude => "magnitude".to_owned(),
        Procedure::Likert { points } => format!("likert with {points} points"),
        Procedure::TwoIntervals => "intervals".to_owned(),
        Procedure::MoreReal { points } => format!("real with {points} points"),
        Procedure::Staircase => "staircase".to_owned(),
        Procedure::Quest => "quest".to_owned(),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn flags_that_differ_from_the_study_are_named() {
        let first = ProtocolArgs {
            factors: vec!["angle".to_owned()],
            levels: vec!["0,90".to_owned()],
            seed: Some(4),
            ..ProtocolArgs::default()
        };
        let stored = first.protocol(Some(3)).expect("a protocol");
        first.check_against(&stored, Some(3)).expect("the same");
        let none = ProtocolArgs::default();
        none.check_against(&stored, None).expect("nothing given");
        let other = ProtocolArgs {
            levels: vec!["0,45".to_owned()],
            seed: Some(5),
            order: Some(OrderKind::Latin),
            ..ProtocolArgs::default()
        };
        let refused = other.check_against(&stored, Some(7)).expect_err("others");
        let refused = refused.to_string();
        for named in [
            "factors angle 0,45 (there: angle 0,90)",
            "subjects 7 (there: 3)",
            "--order latin (there: random)",
            "--seed 5 (there: 4)",
        ] {
            assert!(refused.contains(named), "{refused}");
        }
        assert!(!refused.contains("--repeats"), "{refused}");
    }

    #[test]
    fn points_belong_to_a_scale() {
        let args = ProtocolArgs {
            points: Some(5),
            ..ProtocolArgs::default()
        };
        assert!(args.protocol(Some(2)).is_err());
        let args = ProtocolArgs {
            procedure: Some(ProcedureKind::Likert),
            ..args
        };
        let protocol = args.protocol(Some(2)).expect("a protocol");
        assert_eq!(protocol.procedure, Procedure::Likert { points: 5 });
    }

    #[test]
    fn a_ready_protocol_is_changed_by_other_flags() {
        let args = ProtocolArgs {
            ready: Some(ReadyProtocol::Experiment2),
            questions: ["a?", "b?", "c?"].map(str::to_owned).to_vec(),
            points: Some(7),
            ..ProtocolArgs::default()
        };
        let protocol = args.protocol(None).expect("a protocol");
        assert_eq!(protocol.subjects, 8);
        assert_eq!(protocol.procedure, Procedure::Likert { points: 7 });
        assert_eq!(protocol.questions, ["a?", "b?", "c?"]);
        // The study resumes with the same flags, with its name alone, and without flags.
        let name = ProtocolArgs {
            ready: args.ready,
            ..ProtocolArgs::default()
        };
        for same in [&args, &name, &ProtocolArgs::default()] {
            same.check_against(&protocol, None).expect("the same");
        }
        let other = ProtocolArgs {
            ready: Some(ReadyProtocol::Cones),
            ..ProtocolArgs::default()
        };
        let refused = other.check_against(&protocol, None).expect_err("another");
        let refused = refused.to_string();
        let said = "--protocol thesis:cones (there: thesis:experiment-2)";
        assert!(refused.contains(said), "{refused}");
        // Too few questions.
        let args = ProtocolArgs {
            questions: vec!["a?".to_owned()],
            ..args
        };
        assert!(args.protocol(None).is_err());
    }
}
