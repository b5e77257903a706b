//! Base placement by arrival, for the command line.

use super::arrival::{degrees, extent, facets, in_base, named_walls, percent};
use super::arrival_figure::{self, ArrivalFigure};
use super::maps::progress;
use super::placement::metres;
use crate::report::{Column, table_of};
use hwall_arrival::reachability::{PlacementConfig, Target, WallMaps, WallMapsConfig};
use hwall_arrival::{
    ArrivalPlacement, ArrivalPlacementConfig, Atlas, AtlasConfig, WaitingConfig, WeightedTarget,
    place_base_by_arrival_monitored,
};
use hwall_haptics::Board;
use hwall_kinematics::SrsArm;
use hwall_motion::{MotionConfig, MotionLimits};
use hwall_scene::Scene;
use hwall_stage::input::floor_pose::FloorPose;
use hwall_stage::note;
use hwall_testkit::MarkdownTable;
use std::ops::ControlFlow;
use std::path::Path;
use std::time::Instant;

/// What is to be placed, and what it is judged by.
pub struct ByArrival<'a> {
    /// Its tool is the face of the default board.
    pub arm: &'a SrsArm,
    /// The room.
    pub scene: &'a Scene,
    /// Places in the room, equally likely.
    pub targets: &'a [Target],
    /// Positions and headings.
    pub config: &'a PlacementConfig,
    /// Time from when a target is known to the touch, s.
    pub budget_s: f64,
    /// The middle of the board may be this far from a target, m.
    pub slack_m: f64,
}

/// Finds the best places, writes placements_by_arrival.csv and, for the best of them, arrival.svg; returns what to print.
///
/// # Errors
/// Settings out of range, nothing within reach, files that cannot be written.
pub fn run(wanted: &ByArrival, out: &Path) -> anyhow::Result<String> {
    let board = extent(&Board::default());
    let limits = MotionLimits::of_arm(wanted.arm, &MotionConfig::default())?;
    let targets: Vec<WeightedTarget> = wanted.targets.iter().map(|&t| t.into()).collect();
    let config = ArrivalPlacementConfig {
        waiting: WaitingConfig {
            budget_s: wanted.budget_s,
            slack_m: wanted.slack_m,
            ..WaitingConfig::default()
        },
        ..ArrivalPlacementConfig::new(wanted.config.clone())
    };
    let walls = facets(wanted.scene);
    let start = Instant::now();
    note("judging places by arrival, which may take a minute");
    let bar = progress();
    let found = place_base_by_arrival_monitored(
        wanted.arm,
        &targets,
        &walls,
        board,
        &limits,
        &config,
        &|p| {
            bar.set_length(p.total as u64);
            bar.set_position(p.done as u64);
            ControlFlow::Continue(())
        },
    )?;
    bar.finish_and_clear();
    let took = start.elapsed().as_secs_f64();
    csv(&out.join("placements_by_arrival.csv"), &found.best)?;
    if let Some(best) = found.best.first() {
        let base = FloorPose {
            origin_m: best.room_from_base.position_m(),
            yaw_rad: best.heading_rad,
        };
        let scene = in_base(wanted.scene, base)?;
        let maps = WallMaps::build(wanted.arm, &facets(&scene), WallMapsConfig::default())?;
        let waiting = best.arrivals.posture.q;
        let atlas_config = AtlasConfig::default();
        let atlas = Atlas::build(wanted.arm, &maps, board, &limits, &waiting, &atlas_config)?;
        let figure = ArrivalFigure {
            walls: &named_walls(&scene, &atlas),
            budget_s: wanted.budget_s,
            waiting: &format!(
                "base at {base} (x,y,z,yaw), waiting at {} degrees",
                degrees(&waiting)
            ),
        };
        arrival_figure::draw(&out.join("arrival.svg"), &figure)?;
    }
    Ok(format!(
        "by arrival, within {} s with {} m of slack: {} places judged, {took:.1} s\n\n{}\nwrote placements_by_arrival.csv and arrival.svg to {}",
        wanted.budget_s,
        wanted.slack_m,
        found.judged,
        table(&found.best),
        out.display()
    ))
}

/// The best places by arrival as a table.
fn table(places: &[ArrivalPlacement]) -> MarkdownTable {
    let at = |p: &ArrivalPlacement| p.room_from_base.position_m();
    let seconds = |p: &ArrivalPlacement, share| format!("{:.2} s", p.arrivals.quantile_s(share));
    let columns: [Column<'_, (usize, &ArrivalPlacement)>; 10] = [
        ("", &|(i, _)| i.to_string()),
        ("x, m", &|(_, p)| metres(at(p).x)),
        ("y, m", &|(_, p)| metres(at(p).y)),
        ("heading", &|(_, p)| {
            format!("{:.0} deg", p.heading_rad.to_degrees())
        }),
        ("in time", &|(_, p)| percent(p.in_time_share)),
        ("in reach", &|(_, p)| {
            percent(p.arrivals.posture.reached_share)
        }),
        ("median", &|(_, p)| seconds(p, 0.5)),
        ("p90", &|(_, p)| seconds(p, 0.9)),
        ("ways clear", &|(_, p)| {
            percent(p.arrivals.posture.clear_share)
        }),
        ("waiting posture, deg", &|(_, p)| {
            degrees(&p.arrivals.posture.q)
        }),
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
    let mut header: Vec<String> = names.split(',').map(String::from).collect();
    header.extend((1..=7).map(|joint| format!("q{joint}_rad")));
    writer.write_record(&header)?;
    for place in places {
        let base_m = place.room_from_base.position_m();
        let arrivals = &place.arrivals;
        let mut row: Vec<String> = base_m
            .to_array()
            .iter()
            .map(|x| format!("{x:.9}"))
            .collect();
        row.push(place.heading_rad.to_string());
        row.push(place.in_time_share.to_string());
        row.push(arrivals.posture.reached_share.to_string());
        row.push(arrivals.quantile_s(0.5).to_string());
        row.push(arrivals.quantile_s(0.9).to_string());
        row.extend(arrivals.posture.q.0.iter().map(f64::to_string));
        writer.write_record(&row)?;
    }
    writer.flush()
}
