use hwall_haptics::Board;
use hwall_stage::input::arms::BoardArm;
use hwall_stage::person::kinds::PersonKind;
use hwall_stage::person::participants;
use hwall_stage::person::predictors::{PredictorKind, Predictors, TrainingPeople};
use hwall_stage::run::{closed_loop, judge};
use hwall_stage::setting::load_scene;
use clap::ValueEnum;

fn main() -> anyhow::Result<()> {
    let args: Vec<String> = std::env::args().collect();
    let (kind, seed, person, touch) = (PersonKind::from_str(&args[1], true).unwrap(), args[2].parse::<u64>()?, args[3].parse::<usize>()?, args[4].parse::<usize>()?);
    let leader = match args.get(5).map(String::as_str) { Some("ray") => PredictorKind::RayLed, _ => PredictorKind::Fused };
    let board = Board::default();
    let arm = BoardArm::named("iiwa7", &board)?;
    let (scene, _) = load_scene(None)?;
    let (predictors, _) = Predictors::train(&scene, &arm, &TrainingPeople::default(), Some(leader))?;
    let cast = participants::simulated(&scene, &arm, kind, 12 * (person + 1), seed)?;
    let walls = arm.walls_of(&scene, &board, participants::within_reach(&cast))?;
    let who = &cast[person];
    let setup = closed_loop::RunSetup { arm: &arm, board: &board, scene: &scene, walls: &walls, hand: &who.hand, textured: true, period_s: 1e-3, seed: who.seed };
    let run = closed_loop::run(&setup, predictors, |_| {})?;
    let outcomes = judge::judge(&arm, &board, &who.touches, &run.ticks)?;
    for (i, o) in outcomes.iter().enumerate() { println!("{i} {} {:?} lead {:?} gap {:.1}", o.touch.surface, o.unreachable, o.lead_s, 1e3*o.gap_m); }
    let t = &who.touches[touch];
    println!("touch {touch} {} at {:.3} start {:.3} landed {:?}", t.surface, t.point_m, t.start_s - t.contact_s, t.landed_s.map(|l| l - t.contact_s));
    for (k, line) in run.probe.iter().enumerate() {
        let tick = &run.ticks[k];
        if tick.t_s > t.start_s - 1.0 && tick.t_s < t.contact_s + 0.15 && k % 30 == 0 {
            let p = tick.base_from_board.position_m();
            let off = t.point_m - p;
            println!("{:.2} {:.2} off {:.3} depth {:.3} {line}", tick.t_s - t.contact_s, p, off.reject_from(t.normal).length(), -off.dot(t.normal));
        }
    }
    Ok(())
}
