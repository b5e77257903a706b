//! The corridor with several seeds: the tables of docs/ENVIRONMENTS.md.

use super::hall::Hall;
use super::moving::hand_meets_m_per_s;
use super::possible::Possible;
use super::report::{in_place, metres, missed, share};
use super::run::{Corridor, Walked, trained};
use super::touches::{Cause, CorridorTouch};
use super::visits::{Visit, visits};
use crate::input::arms::{BoardArm, NamedArm};
use crate::input::base_flag::BaseKind;
use crate::person::kinds::PersonKind;
use hwall_haptics::Board;
use hwall_numeric::parallel;
use hwall_testkit::{MarkdownTable, cells, grid};
use std::fmt::Write as _;

/// Touches of a walk.
const TOUCHES: usize = 60;

/// Walks of plain people with each seed and a driving base, without and with redirection; with the first seed also a fixed base.
/// `speeds_m_per_s`: speeds at which the base may meet a hand, to measure their effect on the share in place with the first three seeds.
/// Returns Markdown tables.
///
/// # Errors
/// As [`run`](fn@super::run).
pub fn study(arm: &NamedArm, seeds: &[u64], speeds_m_per_s: &[f64]) -> anyhow::Result<String> {
    let arm = BoardArm::named(arm.clone(), &Board::default())?;
    let (people, predictors) = trained(&arm, None)?;
    let corridors = seeds.iter().map(|&seed| {
        let hall = Hall::for_touches(&arm, TOUCHES, seed)?;
        let visits = visits(&hall, TOUCHES, seed)?;
        Ok((hall, visits))
    });
    let corridors: Vec<(Hall, Vec<Visit>)> = corridors.collect::<anyhow::Result<_>>()?;
    let nominal = hand_meets_m_per_s();
    let kinds = |at: usize| match at {
        0 => BaseKind::ALL.to_vec(),
        _ => vec![BaseKind::Drives, BaseKind::Both],
    };
    let rows = (0..seeds.len()).flat_map(|at| kinds(at).into_iter().map(move |kind| (at, kind)));
    let rows = rows.map(|(at, kind)| (at, kind, nominal));
    let few = seeds.len().min(3);
    let prices = speeds_m_per_s.iter();
    let prices = prices.flat_map(|speed| (0..few).map(move |at| (at, BaseKind::Drives, *speed)));
    let jobs: Vec<(usize, BaseKind, f64)> = rows.chain(prices).collect();
    let walks = parallel::map(jobs.len(), |i| {
        let (at, kind, hand_meets_m_per_s) = jobs[i];
        let (hall, visits) = &corridors[at];
        let corridor = Corridor {
            hall,
            visits,
            arm: &arm,
            people: &people,
            predictors: &predictors,
            person: PersonKind::Plain,
            seed: seeds[at],
            hand_meets_m_per_s,
            shown: None,
        };
        corridor.walk(kind, |_| {})
    });
    let walks: Vec<Walked> = walks.into_iter().collect::<anyhow::Result<_>>()?;
    let (rows, prices) = walks.split_at(walks.len() - few * speeds_m_per_s.len());
    let named: Vec<(u64, &Walked)> = jobs.iter().map(|job| seeds[job.0]).zip(rows).collect();
    let price = price(&seeds[..few], prices.chunks(few).zip(speeds_m_per_s));
    Ok(format!("{}\n{price}\n{}", table(&named), causes(&named)))
}

fn table(walks: &[(u64, &Walked)]) -> String {
    let mut text = "| base | seed | in place, % | first of a visit, % | later ones, % | missed: base elsewhere | missed: arm | base's way, m | least margin, m | least margin to a hand, m | steps below the distance | steps in motion while touched | the fastest of them, m/s | before doors, s | possible, % | possible beside a person, % |\n".to_owned();
    text += &("| --- ".repeat(16) + "|\n");
    for (seed, walk) in walks {
        let (touches, base) = (&walk.touches, &walk.base);
        let [elsewhere, by_arm] = missed(walk);
        let possible = |of: fn(Possible) -> bool| {
            let has = |touch: &CorridorTouch| touch.possible.is_some_and(of);
            share(touches, |touch| touch.possible.is_some(), has)
        };
        let alone = possible(|possible| possible.alone);
        let beside_person = possible(|possible| possible.beside_person);
        let _ = writeln!(
            text,
            "| {} | {seed} | {} | {} | {} | {elsewhere} | {by_arm} | {:.1} | {} | {} | {} | {} | {:.2} | {:.0} | {alone} | {beside_person} |",
            walk.kind.name(),
            share(touches, |_| true, in_place),
            share(touches, |touch| touch.number == 0, in_place),
            share(touches, |touch| touch.number > 0, in_place),
            base.way_m,
            metres(base.margin_m),
            metres(base.hand_margin_m),
            base.too_near,
            base.moved_touched,
            base.touched_m_per_s,
            walk.waited_s,
        );
    }
    text
}

/// Shares in place by the speed at which a hand may meet the base.
fn price<'a>(seeds: &[u64], walks: impl Iterator<Item = (&'a [Walked], &'a f64)>) -> MarkdownTable {
    let names = seeds.iter().map(|seed| format!("seed {seed}, %"));
    let titles = names.chain(["steps below the distance".to_owned()]);
    let mut table = MarkdownTable::new(cells(["a hand may meet the base at, m/s"], titles));
    for (walks, speed) in walks {
        let shares = walks
            .iter()
            .map(|walk| share(&walk.touches, |_| true, in_place));
        let near: u64 = walks.iter().map(|walk| walk.base.too_near).sum();
        table.row(cells(
            [&*speed.to_string()],
            shares.chain([near.to_string()]),
        ));
    }
    table
}

/// Results of the touches with a driving base.
fn causes(walks: &[(u64, &Walked)]) -> MarkdownTable {
    let drives = walks
        .iter()
        .filter(|(_, walk)| walk.kind == BaseKind::Drives);
    let drives: Vec<_> = drives.copied().collect();
    let count = |cause: &Cause, (_, walk): (u64, &Walked)| {
        let touches = walk.touches.iter();
        touches
            .filter(|touch| touch.cause == *cause)
            .count()
            .to_string()
    };
    let title = "touches of the base that drives";
    let name = |cause: &Cause| cause.name().to_owned();
    grid(
        title,
        &drives,
        |(seed, _)| format!("seed {seed}"),
        Cause::ALL,
        name,
        count,
    )
}
