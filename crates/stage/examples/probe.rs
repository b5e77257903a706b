use hwall_haptics::Board;
use hwall_stage::input::arms::BoardArm;
use hwall_stage::person::predictors::{PredictorKind, Predictors};
use hwall_stage::run::{closed_loop, judge};
use hwall_stage::setting::{Setting, SettingOptions};

fn main() -> anyhow::Result<()> {
    let args: Vec<String> = std::env::args().collect();
    let from: u64 = args[1].parse()?;
    let to: u64 = args[2].parse()?;
    let kind = match args.get(3).map(String::as_str) {
        Some("ray") => PredictorKind::RayLed,
        _ => PredictorKind::Fused,
    };
    let board = Board::default();
    let arm = BoardArm::named("iiwa7", &board)?;
    let trace: Option<(u64, usize)> = args.get(4).map(|a| {
        let (s, t) = a.split_once(':').unwrap();
        (s.parse().unwrap(), t.parse().unwrap())
    });
    let (mut n, mut hit) = (0, 0);
    let mut gaps = vec![];
    let mut p99s = vec![];
    let mut walls = None;
    for seed in from..=to {
        let setting = Setting::new(
            &arm,
            &SettingOptions {
                scene: None,
                hand: None,
                y_up: true,
                rigid_hand: false,
                auto: false,
                base: None,
                hand_origin: None,
                touches: 12,
                seed,
            },
        )?;
        let walls: &hwall::Walls = walls.get_or_insert_with(|| {
            let srs = hwall::kinematics::SrsArm::iiwa7().with_tool(board.flange_from_board_face().unwrap());
            let mut config = hwall::WallsConfig::default();
            if let Ok(b) = std::env::var("BUDGET") { config.waiting.budget_s = b.parse().unwrap(); }
            if std::env::var("AREA").is_ok() { config.touches.share = hwall::arrival::WallShare::Area; }
            if let Ok(b) = std::env::var("STAND") { config.waiting.standoff_m = b.parse().unwrap(); }
            config.touches.ball = Some((glam::DVec3::new(0.95, 0.15, 0.72), 1.0));
            if let Ok(b) = std::env::var("SLACK") { config.waiting.slack_m = b.parse().unwrap(); }
            if let Ok(b) = std::env::var("BLOCK") { config.waiting.blocked_price_s = b.parse().unwrap(); config.atlas.blocked_price_s = config.waiting.blocked_price_s; }
            let t = std::time::Instant::now();
            let mut walls = hwall::Walls::of(&setting.scene, &srs, &board, &config).unwrap();
            if let Ok(w) = std::env::var("WAIT") {
                let v: Vec<f64> = w.split(',').map(|x| x.parse().unwrap()).collect();
                let q = hwall::kinematics::JointPositions::from_deg(v.try_into().unwrap());
                walls.waiting = Some(q);
                let limits = hwall_haptics::MotionLimits::of_arm(&srs, &config.motion).unwrap();
                walls.atlas = Some(std::sync::Arc::new(hwall::arrival::Atlas::build(&srs, &walls.maps, Default::default(), &limits, &q, &config.atlas).unwrap()));
            }
            let atlas = walls.atlas.as_ref().unwrap();
            let mut all: Vec<f64> = atlas.nodes().map(|n| n.arrival_s).collect();
            all.sort_by(f64::total_cmp);
            println!("walls in {:?}; waiting {:?}; nodes {} clear {} arrival median {:.2} p90 {:.2}", t.elapsed(), walls.waiting.unwrap().0.map(|q| q.to_degrees().round()), all.len(), atlas.nodes().filter(|n| n.clear).count(), all[all.len()/2], all[all.len()*9/10]);
            println!("{:?}", hwall::kinematics::ArmKinematics::forward(&srs, &walls.waiting.unwrap()).position_m());
            walls
        });
        let (predictors, _) =
            Predictors::train(&setting.scene, &arm, &setting.training_people, Some(kind))?;
        let setup = closed_loop::RunSetup {
            arm: &arm,
            board: &board,
            scene: &setting.scene,
            walls,
            hand: &setting.hand,
            textured: true,
            period_s: 1e-3,
            seed,
        };
        let run = closed_loop::run(&setup, predictors, |_| {})?;
        p99s.push(run.step_ns[(run.step_ns.len() as f64 * 0.99) as usize] / 1e3);
        let outcomes = judge::judge(&arm, &board, &setting.touches, &run.ticks)?;
        let leads = judge::leads(&setting.scene, &setting.touches, &run.predictions);
        let mut line = String::new();
        for (i, (o, l)) in outcomes.iter().zip(&leads).enumerate() {
            if o.unreachable.is_some() {
                continue;
            }
            n += 1;
            if o.lead_s.is_some() {
                hit += 1;
            } else {
                line += &format!(
                    " {}:{}(gap {:.1} off {:.0}mm led {:?})",
                    i,
                    o.touch.surface,
                    1e3 * o.gap_m,
                    1e3 * o.offset_m,
                    l[kind as usize].map(|x| (x * 100.0).round() / 100.0)
                );
            }
            gaps.push(o.gap_m);
        }
        println!("seed {seed}: {hit}/{n} missed{line}");
        if let Some((s, t)) = trace
            && s == seed
        {
            let touch = &setting.touches[t];
            println!(
                "touch {t} {} at {} contact {:.3} start {:.3}",
                touch.surface, touch.point_m, touch.contact_s, touch.start_s
            );
            for (k, line) in run.probe.iter().enumerate() {
                let tick = &run.ticks[k];
                if tick.t_s > touch.start_s - 1.0
                    && tick.t_s < touch.contact_s + 0.15
                    && k % 20 == 0
                {
                    let p = tick.base_from_board.position_m();
                    let off = touch.point_m - p;
                    println!(
                        "{:.3} board {:.3} off {:.3} depth {:.3} {line}",
                        tick.t_s - touch.contact_s,
                        p,
                        off.reject_from(touch.normal).length(),
                        -off.dot(touch.normal)
                    );
                }
            }
        }
    }
    gaps.sort_by(f64::total_cmp);
    let m = |v: &[f64], q: f64| v[((v.len() - 1) as f64 * q) as usize];
    println!(
        "in place {hit} of {n} = {:.1} %; gap median {:.2} p90 {:.2} mm; step p99 median {:.1} us",
        100.0 * hit as f64 / n as f64,
        1e3 * m(&gaps, 0.5),
        1e3 * m(&gaps, 0.9),
        {
            p99s.sort_by(f64::total_cmp);
            p99s[p99s.len() / 2]
        }
    );
    Ok(())
}
