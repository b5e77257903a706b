//! The tables of the study, and the whole of docs/FEEL.md.

use super::figures;
use super::push::{Hand, Profile, Push, run};
use super::rig::{Rig, Way};
use super::stability::{Bound, FINGERS_N_PER_M, Held, SWING_M, SWINGS_ON_M};
use super::study::{EXCITED_HZ, HELD_N, MOST_M, PUSHES, Request, Results, Row};
use super::subject::{Kind, Subject, of_scene};
use crate::documents::{Documents, written_by};
use hwall_haptics::{ObjectPortConfig, ObjectRenderingConfig};
use hwall_stage::setting::load_scene;
use hwall_testkit::{Machine, MarkdownTable, format_ns};
use std::path::PathBuf;

/// The name of the document.
pub const NAME: &str = "FEEL.md";
/// Targets: largest errors of stiffness, and of inertia and damping.
pub const TARGETS: [f64; 2] = [0.02, 0.05];

fn percent(felt: f64, asked: f64) -> String {
    if asked > 0.0 {
        format!("{:+.1}", 100.0 * (felt / asked - 1.0))
    } else {
        format!("({felt:+.2})")
    }
}

/// One row for each object and way: the push that is worst for stiffness, inertia and damping together.
#[must_use]
pub fn table(rows: &[Row]) -> MarkdownTable {
    let mut table = MarkdownTable::new([
        "arm, way",
        "object",
        "stiffness asked",
        "inertia asked",
        "damping asked",
        "stiffness off, %",
        "inertia off, %",
        "damping off, %",
        "unexplained, %",
        "off its path, mm",
        "held push off, mm",
    ]);
    for pushes in rows.chunks(PUSHES as usize) {
        let Some(row) = pushes.iter().max_by(|a, b| worst(a).total_cmp(&worst(b))) else {
            continue;
        };
        let (asked, felt) = (&row.asked, &row.felt);
        let held = if row.held_m.is_finite() {
            format!("{:.2}", 1e3 * row.held_m)
        } else {
            "none".to_owned()
        };
        table.row([
            row.way.name(),
            format!("{:?}", row.kind).to_lowercase(),
            asked.stiffness.to_string(),
            asked.inertia.to_string(),
            asked.damping.to_string(),
            percent(felt.stiffness, asked.stiffness),
            percent(felt.inertia, asked.inertia),
            percent(felt.damping, asked.damping),
            format!("{:.1}", 100.0 * felt.unexplained),
            format!("{:.2}", 1e3 * row.off_path_m),
            held,
        ]);
    }
    table
}

/// Largest error over its target.
fn worst(row: &Row) -> f64 {
    let (asked, felt) = (&row.asked, &row.felt);
    [
        (felt.stiffness, asked.stiffness, TARGETS[0]),
        (felt.inertia, asked.inertia, TARGETS[1]),
        (felt.damping, asked.damping, TARGETS[1]),
    ]
    .into_iter()
    .filter(|(_, asked, _)| *asked > 0.0)
    .map(|(felt, asked, target)| (felt / asked - 1.0).abs() / target)
    .fold(0.0, f64::max)
}

/// What is to be shown, and whether it was.
#[must_use]
pub fn verdicts(rows: &[Row]) -> MarkdownTable {
    let mut table = MarkdownTable::new([
        "arm, way",
        "pushes",
        "out of reach, periods",
        "stiffness within 2 %",
        "worst, %",
        "inertia within 5 %",
        "worst, %",
        "damping within 5 %",
        "worst, %",
        "limited by the port, periods",
    ]);
    for way in Way::ALL {
        let own = || rows.iter().filter(move |row| row.way == way);
        let mut cells = vec![way.name(), own().count().to_string()];
        cells.push(own().map(|row| row.unreachable).sum::<usize>().to_string());
        let errors: [(f64, Vec<f64>); 3] = [
            (
                TARGETS[0],
                own()
                    .filter(|row| row.asked.stiffness > 0.0)
                    .map(|row| row.felt.stiffness / row.asked.stiffness - 1.0)
                    .collect(),
            ),
            (
                TARGETS[1],
                own()
                    .map(|row| row.felt.inertia / row.asked.inertia - 1.0)
                    .collect(),
            ),
            (
                TARGETS[1],
                own()
                    .map(|row| row.felt.damping / row.asked.damping - 1.0)
                    .collect(),
            ),
        ];
        for (target, errors) in errors {
            let within = errors.iter().filter(|error| error.abs() <= target).count();
            let worst = errors
                .iter()
                .fold(0.0, |most: f64, error| most.max(error.abs()));
            cells.push(format!("{within} of {}", errors.len()));
            cells.push(format!("{:.1}", 100.0 * worst));
        }
        let ledgers = own().flat_map(|row| [Some(row.ledger), row.held_ledger]);
        let (limited, all) = ledgers.flatten().fold((0, 0), |(limited, all), ledger| {
            (limited + ledger.limited_steps, all + ledger.steps)
        });
        cells.push(format!("{limited} of {all}"));
        table.row(cells);
    }
    table
}

fn cause_table(results: &Results) -> MarkdownTable {
    let mut table = MarkdownTable::new([
        "the arm has",
        "arm, way",
        "object",
        "stiffness off, %",
        "inertia off, %",
        "damping off, %",
        "unexplained, %",
        "held push off, mm",
    ]);
    for (spared, row) in &results.causes {
        table.row([
            spared.name().to_owned(),
            row.way.name(),
            match row.kind {
                Kind::Door => "free door".to_owned(),
                _ => "stiff panel".to_owned(),
            },
            percent(row.felt.stiffness, row.asked.stiffness),
            percent(row.felt.inertia, row.asked.inertia),
            percent(row.felt.damping, row.asked.damping),
            format!("{:.1}", 100.0 * row.felt.unexplained),
            if row.held_m.is_finite() {
                format!("{:.2}", 1e3 * row.held_m)
            } else {
                "none".to_owned()
            },
        ]);
    }
    table
}

fn bound_table(bounds: &[Bound]) -> MarkdownTable {
    let mut table = MarkdownTable::new([
        "arm, way",
        "hand, N/m",
        "lightest stable panel, kg",
        "over k t²",
    ]);
    for b in bounds {
        table.row([
            b.way.name(),
            b.stiffness_n_per_m.to_string(),
            format!("{:.2}", b.mass_kg),
            format!("{:.2}", b.share),
        ]);
    }
    table
}

fn held_table(held: &[Held]) -> MarkdownTable {
    let mut table = MarkdownTable::new([
        "arm, way",
        "finger, N/m",
        "hands",
        "most generated, J",
        "beyond the reserve",
        "swing on, %",
    ]);
    for way in Way::ALL {
        for [low, high] in FINGERS_N_PER_M {
            let of_it = |h: &&Held| h.way == way && (low..high).contains(&h.stiffness_n_per_m);
            let all: Vec<_> = held.iter().filter(of_it).collect();
            let beyond = all
                .iter()
                .filter(|h| h.generated_j > ObjectPortConfig::default().reserve_j);
            let swings = all.iter().filter(|h| h.swing_m > SWINGS_ON_M).count();
            table.row([
                way.name(),
                format!("{low} to {high}"),
                all.len().to_string(),
                format!(
                    "{:.3}",
                    all.iter().map(|h| h.generated_j).fold(0.0, f64::max)
                ),
                beyond.count().to_string(),
                format!("{:.1}", 100.0 * swings as f64 / all.len().max(1) as f64),
            ]);
        }
    }
    table
}

fn cost_table(results: &Results) -> MarkdownTable {
    let mut table = MarkdownTable::new(["what", "median", "p99"]);
    for (name, timing) in &results.costs {
        table.row([
            name.clone(),
            format_ns(timing.median_ns),
            format_ns(timing.p99_ns),
        ]);
    }
    table
}

/// All tables, as they are printed and written.
#[must_use]
pub fn text(results: &Results) -> String {
    let least_j = results
        .rows
        .iter()
        .map(|row| row.least_given_j)
        .fold(0.0, f64::min);
    format!(
        "## What is felt\n\n{PUSHES} different pushes at every object.\n\n{}\nThe worst push at each, by the largest error over its \
         target:\n\n{}\n`(…)`: nothing was asked for, the value itself. The least that had been given to the board at \
         any time, less what came back: {least_j:.1e} J.\n\n## What is whose error\n\n{}\n## Light objects, stiff hands\n\nThe lightest \
         panel (spring 200 N/m) on which the board does not go on swinging by {} mm under a hand of 0.6 kg that leans on it; nothing \
         is made heavier here.\n\n{}\nAs the product renders it: hands of 0.3 to 5 kg lean with 4 to 30 N on panels of 0.05 to 20 kg. \
         *Generated*: what the board had given out beyond what the hand had put in, at any time; *swing on*: by more than {} mm after 3 s.\n\n{}\n## Cost\n\nOf one step at 1 kHz; nothing is \
         allocated.\n\n{}",
        verdicts(&results.rows),
        table(&results.rows),
        cause_table(results),
        1e3 * SWING_M,
        bound_table(&results.bounds),
        1e3 * SWINGS_ON_M,
        held_table(&results.held),
        cost_table(results),
    )
}

/// The push of the figures: 10 N for a second on the door of the built-in room.
///
/// # Errors
/// As for [`of_scene`].
pub fn shown(rig: &Rig, seed: u64) -> anyhow::Result<(Subject, Vec<Push>)> {
    let (scene, _) = load_scene(None)?;
    let subject = of_scene(rig, &scene, None)?;
    let push = |way| Push {
        way,
        hand: Hand::Profile(Profile {
            mean_n: 10.0,
            sines: Vec::new(),
            until_s: 1.0,
        }),
        seconds: 3.0,
        seed,
        config: ObjectRenderingConfig::default(),
    };
    Ok((subject, Way::ALL.into_iter().map(push).collect()))
}

/// Writes the document and its figures.
///
/// # Errors
/// A file that cannot be written.
pub fn write(
    request: &Request,
    results: &Results,
    documents: &Documents,
) -> anyhow::Result<PathBuf> {
    let folder = documents.figures("feel")?;
    let rig = Rig::new()?;
    let (subject, pushes) = shown(&rig, request.seed)?;
    let mut lines = Vec::new();
    for push in &pushes {
        lines.push((push.way.name(), run(&rig, &subject, push)?));
    }
    figures::push(&folder.join("door.svg"), &subject, &lines)?;
    figures::errors(&folder.join("errors.svg"), &results.rows)?;
    figures::bounds(&folder.join("bounds.svg"), &results.bounds)?;
    let text = format!(
        "# Feel\n\nDoes a hand feel the door that was asked for? {}\n\n{}\n\n{}\n![A push at the door](figures/feel/door.svg)\n\n![Errors](figures/feel/errors.svg)\n\n\
         ![Lightest stable mass](figures/feel/bounds.svg)\n\n{}",
        written_by(),
        Machine::detect(request.seed),
        text(results),
        explained(),
    );
    documents.write(NAME, &text)
}

/// How it was found, and what remains.
fn explained() -> String {
    format!(
        "\
## How it was found

- **Arms**: an iiwa 7 with a board of 1 kg. *Servo*: positions followed after 22 ms, within the joints' accelerations and jerks; a
  push does not bend it. *Torque*: rigid bodies, friction, rotors, delays of 5 and 1 ms, a torque loop of 2 ms, sensors with noise and
  ripple, external torques of 25 Hz; it takes positions (*admittance*) or torques (*impedance*). The renderer sees the wrench
  that the torque sensors say, never the true one.
- **Pushes**: a force of up to 12 N on the middle of the face and five sines on top ({:?} Hz, random phases), scaled such that the
  ideal object is accelerated by at most 1.8 m/s² at the face, which the arm can follow, and that the
  sines move it by at most {} mm; 8 s. With smaller sines the errors at torque level grow: the sensors' ripple stays the same.
- **Identified** from the true force and the true motion of the face: `m a + b v + k x + c = f` by least squares, both sides
  seen through the same filter `(λ / (s + λ))³`, λ of 5 Hz, whose states give velocity and acceleration without differentiating. Units of a
  door are N m/rad, kg m², N m s/rad, otherwise N/m, kg, N s/m. *Unexplained*: root mean square of what the three leave of the force.
- **Limited by the port**: periods in which the account of energy between hand and board (a tank with a reserve of 0.05 J) cut a motion
  against the hand; of all periods of the pushes and held pushes. None is meant to be.
- **Held push**: {HELD_N} N for 4 s; distance of the face from where the ideal object stands, over the last half second.

## What is done about the delays

A delay `t` alone makes an object feel as if its damping were `b + k t` and its mass `m + b t + k t² / 2`: with 30 ms a spring of
1000 N/m would feel like 30 N s/m of damping. So the face is led to where the object will be by then, by the object's own law and
with a force that goes on changing as it does. What the hand does within the delay cannot be known: that is the
error that is left, of the order of `(ω t)⁴ / 24` of the mass, and it is why light objects swing under stiff hands. All bounds that were
found lie below `(k + 1000 N/m) t²`. The renderer raises lighter objects to that for a hand of 3000 N/m and says so in every step: 3.7 kg at
servo level, 1.4 to 1.9 kg at torque level. A button of 50 g is not to be had from these arms. Under a hand that is
felt to be stiffer than 3000 N/m the object becomes heavier still, within one delay: its inertia is raised to `k t²`, where `k` is the ratio of the
changes of force to the changes of position. The speed against the hand is limited so that the account of energy covers the braking way.

## What remains, and why

- At servo level the targets hold. Where a push asks for all the acceleration that the arm has, joint by joint the servo's limits of
  jerk lead the face off its path (see the column; 1 mm was aimed at).
- Free objects are the hardest: their small motions at 3 Hz are tenths of a millimetre.
- At torque level the ripple of the torque sensors (0.1 N m in each joint, twice in a turn of the wave generator) is some tenths
  of a newton at the face that come and go within a centimetre of motion. It is most of what is unexplained in admittance (table of causes), and
  at 200 N/m some tenths of a newton are the millimetres of a held push. A ripple that was measured joint by joint could be taken off; this is not done.
- Impedance: the arm with its rotors is up to 28 kg at the face, against which 4000 N/m hold it.
  Friction that is not known (a fifth of it, and breaking away) shows as damping of stiff objects: without friction that error
  is gone. What is left then is the arm following its reference late, with 8.5 ms from torque to motion.
",
        EXCITED_HZ,
        1e3 * MOST_M
    )
}
