//! Scratch.
use clap::ValueEnum;
use hwall_haptics::Board;
use hwall_stage::input::arms::BoardArm;
use hwall_stage::person::kinds::PersonKind;
use hwall_stage::person::participants;
use hwall_stage::person::predictors::{PredictorKind, Predictors, TrainingPeople};
use hwall_stage::run::{closed_loop, judge};
use hwall_stage::setting::load_scene;

fn main() -> anyhow::Result<()> {
    let args: Vec<String> = std::env::args().collect();
    let (kind, seed, people) = (PersonKind::from_str(&args[1], true).unwrap(), args[2].parse::<u64>()?, args[3].parse::<usize>()?);
    let leader = match args.get(4).map(String::as_str) { Some("ray") => PredictorKind::RayLed, _ => PredictorKind::Fused };
    let board = Board::default();
    let arm = BoardArm::named("iiwa7", &board)?;
    let (scene, _) = load_scene(None)?;
    let (predictors, _) = Predictors::train(&scene, &arm, &TrainingPeople::default(), Some(leader))?;
    let cast = participants::simulated(&scene, &arm, kind, 12 * people, seed)?;
    let walls = arm.walls_of(&scene, &board, participants::likely_touches(&scene, &arm, &cast), true)?;
    let deg = |q: hwall_kinematics::JointPositions| q.0.map(|q| q.to_degrees().round() as i32);
    println!("waiting {:?}", deg(walls.waiting.unwrap()));
    let (mut good, mut all) = (0, 0);
    let mut worst: Vec<f64> = vec![];
    for (w, who) in cast.iter().enumerate() {
        let setup = closed_loop::RunSetup { arm: &arm, board: &board, scene: &scene, walls: &walls, hand: &who.hand, textured: std::env::var_os("NOTEX").is_none(), period_s: 1e-3, seed: who.seed };
        let run = closed_loop::run(&setup, predictors.for_another_person(), |_| {})?;
        let outcomes = judge::judge(&arm, &board, &who.touches, &run.ticks)?;
        if std::env::var_os("LINE").is_some() {
            let mut last: Option<String> = None;
            for (k, p) in run.probe.iter().enumerate() {
                let st = format!("{:?}", p.state);
                let key = format!("{} {}", &st[..st.len().min(8)], p.target.map(|x| format!("{:.1}", x.point_m)).unwrap_or_default());
                if last.as_ref() != Some(&key) {
                    let t = run.ticks[k].t_s;
                    let next = who.touches.iter().find(|x| x.end_s > t);
                    println!("L {t:.2} {key} {} c {}", next.map(|x| format!("next touch {} {:.2} starts {:.2} landed {:.2?} contact {:.2} ends {:.2}", x.surface, x.point_m, x.start_s - t, x.landed_s.map(|l| l - t), x.contact_s - t, x.end_s - t)).unwrap_or_default(), p.contact.map(|c| format!("{:.2} sd {:.3} p {:.2} looked {:.2?} d {:.2} ttc {:.2?}", c.point_m, c.covariance_m2.map_or(0.0, |c| (c.x_axis.x + c.y_axis.y + c.z_axis.z).sqrt()), c.probability, c.looked_at_since_s.map(|s| s - t), c.distance_m, c.time_to_contact_s.map(|t| t.mean_s))).unwrap_or_default());
                    last = Some(key);
                }
            }
        }
        for p in &run.probe { if !matches!(p.state, hwall::SessionState::Touched) { worst.push(p.protrusion_m.unwrap_or(-1.0)); } }
        for (i, o) in outcomes.iter().enumerate() {
            if o.unreachable.is_some() { continue; }
            all += 1;
            if o.lead_s.is_some() { good += 1; continue; }
            let t = &who.touches[i];
            println!("\n== person {w} touch {i} {} at {:.3} start {:.2} landed {:.2?} gap {:.1} mm offset {:.0} mm", o.touch.surface, t.point_m, t.start_s - t.contact_s, t.landed_s.map(|l| l - t.contact_s), 1e3 * o.gap_m, 1e3 * o.offset_m);
            // Compact: since when the target was right until the end, and how long the motion then took.
            let mut since: Option<(f64, f64, bool, bool, f64, bool)> = None;
            for (k, p) in run.probe.iter().enumerate() {
                let rel = run.ticks[k].t_s - t.contact_s;
                if rel > 0.0 { break; }
                let right = p.target.is_some_and(|x| { let off = t.point_m - x.point_m; off.length() < 0.075 && off.dot(t.normal).abs() < 0.01 });
                if !right { since = None; } else if since.is_none() { since = Some((rel, p.left_s.unwrap_or(-1.0), p.detour, p.bent, p.target.unwrap().slack_m[0], p.q.max_abs_difference(&walls.waiting.unwrap()) < 0.2)); }
            }
            let budget = t.landed_s.map_or(0.0, |l| t.contact_s - l);
            println!("SUM p{w} t{i} {} {:.2} budget {budget:.2} right since {:.2?}", o.touch.surface, t.point_m, since);
            let mut last: Option<(f64, String)> = None;
            for (k, p) in run.probe.iter().enumerate() {
                let tick = &run.ticks[k];
                let rel = tick.t_s - t.contact_s;
                if tick.t_s < t.landed_s.unwrap_or(t.start_s) - 0.5 || rel > 0.05 { continue; }
                let at = p.target.map(|x| { let off = t.point_m - x.point_m; format!("miss {:.0} mm behind {:.2} slack {:.3?}", 1e3 * off.length(), x.behind_m, x.slack_m) });
                let state = format!("{:?}", p.state); let state = &state[..state.len().min(14)];
                let key = format!("{state} {} {}{}", p.target.map(|x| format!("{:.2} {:.2}", x.point_m, x.behind_m)).unwrap_or_default(), u8::from(p.detour), u8::from(p.bent));
                if last.as_ref().is_none_or(|l| l.1 != key || rel - l.0 > 0.1) {
                    let m = tick.base_from_board.position_m();
                    let off = t.point_m - m;
                    println!("{rel:.2} {state} left {:.2} d{}b{} off {:.3} depth {:.3} {} q {:?} goal {:?} c {:?}", p.left_s.unwrap_or(-1.0), u8::from(p.detour), u8::from(p.bent), off.reject_from(t.normal).length(), -off.dot(t.normal), at.unwrap_or_default(), deg(p.q), p.goal.map(deg), p.contact.map(|c| (c.surface.0, format!("{:.2} sd {:.3} p {:.2} looked {:.2?} ttc {:.2?}", c.point_m, c.covariance_m2.map_or(0.0, |c| (c.x_axis.x + c.y_axis.y + c.z_axis.z).sqrt()), c.probability, c.looked_at_since_s.map(|s| s - t.contact_s), c.time_to_contact_s.map(|t| t.mean_s)))));
                    last = Some((rel, key));
                }
            }
        }
    }
    worst.sort_by(f64::total_cmp);
    let n = worst.len();
    println!("protrusion p99 {:.1} p999 {:.1} max {:.1} mm", 1e3 * worst[n * 99 / 100], 1e3 * worst[n * 999 / 1000], 1e3 * worst[n - 1]);
    println!("{good} of {all}");
    Ok(())
}
