//! Base placement by arrival, for the command line.

use super::arrival::{degrees, named_walls, percent};
use super::arrival_figure::{self, ArrivalFigure};
use super::maps::{progress, shown};
use super::placement::metres;
use hwall::facets_of;
use hwall_arrival::reachability::{PlacementConfig, Progress, Target, WallMaps, WallMapsConfig};
use hwall_arrival::{
    ArrivalPlacement, ArrivalPlacementConfig, Atlas, AtlasConfig, BoardExtent, WaitingConfig,
    WeightedTarget, place_base_by_arrival_monitored,
};
use hwall_kinematics::SrsArm;
use hwall_motion::{MotionConfig, MotionLimits};
use hwall_scene::Scene;
use hwall_stage::input::floor_pose::FloorPose;
use hwall_stage::note;
use hwall_testkit::{Column, MarkdownTable, table_of};
use std::path::Path;
use std::time::Instant;

/// Finds the best places for an arm whose tool is the face of the default board, writes placements_by_arrival.csv and, for the best
/// place, arrival.svg; returns the text to print. All points of the room are equally likely to be touched.
///
/// # Errors
/// Settings out of range, nothing within reach, files that cannot be written.
pub fn run(
    arm: &SrsArm,
    scene: &Scene,
    targets: &[Target],
    places: PlacementConfig,
    waiting: WaitingConfig,
    out: &Path,
) -> anyhow::Result<String> {
    let board = BoardExtent::default();
    let limits = MotionLimits::of_arm(arm, &MotionConfig::default())?;
    let targets: Vec<WeightedTarget> = targets.iter().map(|&t| t.into()).collect();
    let (budget_s, slack_m) = (waiting.budget_s, waiting.slack_m);
    let config = ArrivalPlacementConfig {
        waiting,
        ..ArrivalPlacementConfig::new(places)
    };
    let walls = facets_of(scene);
    let start = Instant::now();
    note("judging places by arrival, which may take a minute");
    let bar = progress();
    let shown = |p: Progress| shown(&bar, p);
    let found =
        place_base_by_arrival_monitored(arm, &targets, &walls, board, &limits, &config, &shown)?;
    bar.finish_and_clear();
    let took = start.elapsed().as_secs_f64();
    csv(&out.join("placements_by_arrival.csv"), &found.best)?;
    if let Some(best) = found.best.first() {
        let base = FloorPose {
            origin_m: best.room_from_base.position_m(),
            yaw_rad: best.heading_rad,
        };
        let scene = base.scene_seen(scene)?;
        let maps = WallMaps::build(arm, &facets_of(&scene), WallMapsConfig::default())?;
        let q = best.arrivals.posture.q;
        let atlas = Atlas::build(arm, &maps, board, &limits, &q, &AtlasConfig::default())?;
        let waiting = degrees(&q);
        let figure = ArrivalFigure {
            walls: &named_walls(&scene, &atlas),
            budget_s,
            waiting: &format!("base at {base} (x,y,z,yaw), waiting at {waiting} degrees"),
        };
        arrival_figure::draw(&out.join("arrival.svg"), &figure)?;
    }
    Ok(format!(
        "by arrival, within {budget_s} s with {slack_m} m of slack: {} places judged, {took:.1} s\n\n{}\nwrote placements_by_arrival.csv and arrival.svg to {}",
        found.judged,
        table(&found.best),
        out.display()
    ))
}

/// The best places by arrival as a table.
fn table(places: &[ArrivalPlacement]) -> MarkdownTable {
    let at = |p: &ArrivalPlacement| p.room_from_base.position_m();
    let posture = |p: &ArrivalPlacement| p.arrivals.posture;
    let seconds = |p: &ArrivalPlacement, share| format!("{:.2} s", p.arrivals.quantile_s(share));
    let columns: [Column<'_, (usize, &ArrivalPlacement)>; 10] = [
        ("", &|(i, _)| i.to_string()),
        ("x, m", &|(_, p)| metres(at(p).x)),
        ("y, m", &|(_, p)| metres(at(p).y)),
        ("heading", &|(_, p)| {
            format!("{:.0} deg", p.heading_rad.to_degrees())
        }),
        ("in time", &|(_, p)| percent(p.in_time_share)),
        ("in reach", &|(_, p)| percent(posture(p).reached_share)),
        ("median", &|(_, p)| seconds(p, 0.5)),
        ("p90", &|(_, p)| seconds(p, 0.9)),
        ("ways clear", &|(_, p)| percent(posture(p).clear_share)),
        ("waiting posture, deg", &|(_, p)| degrees(&posture(p).q)),
    ];
    table_of((1..).zip(places), &columns)
}

/// `x_m,y_m,z_m,heading_rad,in_time,in_reach,median_s,p90_s,q1_rad..q7_rad`, best first.
///
/// # Errors
/// A file that cannot be written.
fn csv(path: &Path, places: &[ArrivalPlacement]) -> anyhow::Result<()> {
    let mut writer = hwall_stage::numbers::writer(Some(path))?;
    let names = "x_m,y_m,z_m,heading_rad,in_time,in_reach,median_s,p90_s";
    let joints = (1..=7).map(|joint| format!("q{joint}_rad"));
    writer.write_record(names.split(',').map(String::from).chain(joints))?;
    for place in places {
        let base_m = place.room_from_base.position_m();
        let arrivals = &place.arrivals;
        let numbers = [
            place.heading_rad,
            place.in_time_share,
            arrivals.posture.reached_share,
            arrivals.quantile_s(0.5),
            arrivals.quantile_s(0.9),
        ];
        let numbers = numbers.into_iter().chain(arrivals.posture.q.0);
        let base = base_m.to_array().map(|x| format!("{x:.9}"));
        let row = base.into_iter().chain(numbers.map(|x| x.to_string()));
        writer.write_record(row)?;
    }
    writer.flush()
}
