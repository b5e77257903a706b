//! Prints the tables of hwall-kinematics against its peers; see README.md for how to run it.

mod hwall;
mod k_crate;
mod report;
mod targets;

use anyhow::{Context, Result, bail};
use hwall_kinematics::SrsArm;
use hwall_testkit::{Machine, MarkdownTable, Sampler, format_ns};
use std::collections::BTreeMap;
use std::path::{Path, PathBuf};
use targets::{BEYOND_M, Joints, Targets, limits};

const SEED: u64 = 20_180_601;

struct Arguments {
    date: String,
    urdf: PathBuf,
    reachable: usize,
    unreachable: usize,
}

impl Arguments {
    fn parse() -> Result<Self> {
        let mut arguments = Self {
            date: "no date given".to_owned(),
            urdf: Path::new(env!("CARGO_MANIFEST_DIR")).join("iiwa7.urdf"),
            reachable: 10_000,
            unreachable: 2_000,
        };
        let mut words = std::env::args().skip(1);
        while let Some(name) = words.next() {
            let value = words
                .next()
                .with_context(|| format!("{name} needs a value"))?;
            match name.as_str() {
                "--date" => arguments.date = value,
                "--urdf" => arguments.urdf = value.into(),
                "--reachable" => arguments.reachable = value.parse()?,
                "--unreachable" => arguments.unreachable = value.parse()?,
                _ => bail!("unknown argument {name}"),
            }
        }
        Ok(arguments)
    }
}

fn main() -> Result<()> {
    let arguments = Arguments::parse()?;
    let urdf_text = std::fs::read_to_string(&arguments.urdf)
        .with_context(|| format!("reading {}", arguments.urdf.display()))?;
    let hwall = hwall::Hwall::new(&urdf_text)?;
    let k_crate = k_crate::KCrate::new(&arguments.urdf)?;

    let mut sampler = Sampler::new(SEED);
    let joints: Vec<Joints> = (0..20_000)
        .map(|_| sampler.array_within(limits()))
        .collect();
    let reachable = Targets::reachable(&mut sampler, arguments.reachable);
    let unreachable = Targets::unreachable(&mut sampler, arguments.unreachable);
    let beyond = Targets::just_beyond(&mut sampler, arguments.unreachable.min(500));

    println!("# hwall-kinematics and its peers\n");
    println!("{} · {}\n", Machine::detect(SEED), arguments.date);

    println!("## Forward kinematics\n");
    let mut rows = hwall.forward(&joints)?;
    rows.push(k_crate.forward(&joints));
    println!("{}", report::forward_table(&rows));

    println!("## Forward kinematics and Jacobian\n");
    let mut rows = hwall.jacobian(&joints)?;
    rows.push(k_crate.jacobian(&joints));
    println!("{}", report::forward_table(&rows));

    println!(
        "## Verdict alone and all branches (median and p99 over batches of {})\n",
        hwall::BATCH
    );
    let mut table = MarkdownTable::new(["call", "median", "p99"]);
    for (call, timing) in hwall.short_calls(&reachable, &unreachable) {
        table.row([call, format_ns(timing.median_ns), format_ns(timing.p99_ns)]);
    }
    println!("{table}");

    println!("## Inverse, reachable targets\n");
    let mut runs = hwall.inverse(&reachable);
    runs.push(k_crate.inverse(&reachable, SEED));
    println!("{}", report::reachable_table(&reachable, &runs));

    println!(
        "## Inverse, targets that only the limits forbid\n\n{}.\n",
        reasons(&unreachable)
    );
    let mut runs = hwall.inverse(&unreachable);
    runs.push(k_crate.inverse(&unreachable, SEED));
    println!("{}", report::unreachable_table(&unreachable, &runs));

    println!(
        "## Inverse, {} mm beyond the stretched arm\n",
        BEYOND_M * 1e3
    );
    let mut runs = hwall.inverse(&beyond);
    runs.push(k_crate.inverse(&beyond, SEED));
    println!("{}", report::unreachable_table(&beyond, &runs));
    Ok(())
}

/// Why the targets cannot be reached, by count.
fn reasons(targets: &Targets) -> String {
    let arm = SrsArm::iiwa7();
    let mut counts = BTreeMap::<&str, usize>::new();
    for pose in &targets.poses {
        if let hwall_kinematics::Verdict::Unreachable(reason) = arm.verdict(pose) {
            *counts.entry(reason.name()).or_default() += 1;
        }
    }
    let parts: Vec<String> = counts
        .iter()
        .map(|(reason, count)| format!("{reason} {count}"))
        .collect();
    format!("Reasons: {}", parts.join(", "))
}
