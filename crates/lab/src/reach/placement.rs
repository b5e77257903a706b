//! Base placement from the command line: targets on the walls of a scene, the heat map, the table.

use super::figures::{Key, shade};
use crate::report::ends;
use anyhow::{Context, ensure};
use glam::DVec3;
use hwall_kinematics::SrsArm;
use hwall_reachability::{Interval, Placement, PlacementScores, Steps, Target};
use hwall_scene::{Facet, Scene, SurfaceId};
use hwall_stage::arms;
use hwall_stage::figures::{COLOURS, TEXT};
use hwall_stage::person::touches::within;
use hwall_stage::report::figure::{Area, Axes, Draw, Mesh, Plot, figure};
use hwall_testkit::{Column, MarkdownTable, table_of};
use plotters::prelude::*;
use std::path::Path;

/// The parts of walls to reach.
pub struct TargetChoice<'a> {
    /// Names of surfaces; all touchable ones if empty.
    pub surfaces: &'a [String],
    /// Heights, m.
    pub heights: Interval,
    /// Distance between targets, m.
    pub spacing_m: f64,
    /// Only targets within this circle of the floor plan: x, y and radius, m.
    pub near: Option<[f64; 3]>,
}

/// Targets all over the vertical surfaces of a scene, seen from their outer side.
///
/// # Errors
/// An unknown surface, a spacing that is not positive, no targets at all.
pub fn targets(scene: &Scene, wanted: &TargetChoice) -> anyhow::Result<Vec<Target>> {
    for name in wanted.surfaces {
        let known = || scene.surfaces().iter().map(|s| s.name.as_str());
        ensure!(
            known().any(|other| other == name),
            "--surface {name}: the scene has {}",
            known().collect::<Vec<_>>().join(", ")
        );
    }
    let mut targets = Vec::new();
    for patch in scene.vertical_facets() {
        let name = &scene.surface(patch.surface).name;
        if !wanted.surfaces.is_empty() && !wanted.surfaces.contains(name) {
            continue;
        }
        let low = patch.lowest_m.max(wanted.heights.lo_m);
        let high = patch.highest_m.min(wanted.heights.hi_m);
        if low > high {
            continue;
        }
        let (normal, width_m, spacing_m) = (patch.normal, patch.width_m, wanted.spacing_m);
        let heights = Interval::new(low, high);
        let mut all = Target::on_wall(middle(&patch), normal, width_m, heights, spacing_m)?;
        all.retain(|target| {
            let at_m = target.point_m;
            let is_near = |[x, y, radius]: [f64; 3]| (at_m.x - x).hypot(at_m.y - y) <= radius;
            wanted.near.is_none_or(is_near) && within(&patch, at_m, -1e-6)
        });
        targets.extend(all);
    }
    ensure!(
        !targets.is_empty(),
        "no vertical surface with targets between {} and {} m",
        wanted.heights.lo_m,
        wanted.heights.hi_m
    );
    Ok(targets)
}

/// A line about surfaces without targets that were not excluded by the user; `None` if there are none.
pub fn left_out(scene: &Scene, wanted: &TargetChoice) -> Option<String> {
    if !wanted.surfaces.is_empty() || wanted.near.is_some() {
        return None;
    }
    let facets = scene.vertical_facets();
    let heights = |facet: &Facet| {
        facet.lowest_m <= wanted.heights.hi_m && wanted.heights.lo_m <= facet.highest_m
    };
    let mut reasons = [const { Vec::new() }; 3];
    for (id, surface) in scene.surfaces().iter().enumerate() {
        let mut own = facets
            .iter()
            .filter(|f| f.surface == SurfaceId(id))
            .peekable();
        let why = match surface.touchable() {
            false => 0,
            true if own.peek().is_none() => 1,
            true if !own.any(heights) => 2,
            true => continue,
        };
        reasons[why].push(surface.name.as_str());
    }
    let words = ["must not be touched", "not upright", "not at these heights"];
    let said = reasons
        .iter()
        .zip(words)
        .filter(|(names, _)| !names.is_empty());
    let said = said.map(|(names, why)| format!("{} ({why})", names.join(", ")));
    let said: Vec<String> = said.collect();
    (!said.is_empty()).then(|| {
        format!(
            "no targets on {}; whether the arm meets them on its way is not looked at",
            said.join(", ")
        )
    })
}

/// A line about targets too far apart for one base; `None` if most may be within reach of one.
pub fn too_far_apart(arm: &SrsArm, targets: &[Target]) -> Option<String> {
    let [low, high] = corners(targets)?;
    let size = high - low;
    let reach_m = arm.shoulder_wrist_range().longest_m;
    (size.x.hypot(size.y) > 6.0 * reach_m).then(|| {
        format!(
            "the targets lie within {:.1} x {:.1} m, and an arm of {reach_m:.2} m serves a small part of that: \
             --near X,Y,RADIUS chooses where",
            size.x, size.y
        )
    })
}

/// The corners of the box around the targets; `None` without targets.
pub(super) fn corners(targets: &[Target]) -> Option<[DVec3; 2]> {
    let points = || targets.iter().map(|target| target.point_m);
    Some([points().reduce(DVec3::min)?, points().reduce(DVec3::max)?])
}

/// The point halfway along the wall, which may differ from the centroid.
fn middle(patch: &Facet) -> DVec3 {
    let along = DVec3::Z.cross(patch.normal).normalize_or_zero();
    let outline = patch.outline_m.iter();
    let (low, high) = ends(outline.map(|p| (*p - patch.point_m).dot(along)));
    patch.point_m + along * (0.5 * (low + high))
}

/// Rounded to centimetres, without -0.
pub(super) fn metres(value_m: f64) -> String {
    format!("{:.2}", (100.0 * value_m).round() / 100.0 + 0.0)
}

/// The best placements as a table.
pub fn table(scores: &PlacementScores) -> MarkdownTable {
    let mm =
        |margin: Option<f64>| margin.map_or("none".to_owned(), |m| format!("{:.1} mm", 1e3 * m));
    let at = |p: &Placement| p.room_from_base.position_m();
    let reached = |p: &Placement| {
        let percent = 100.0 * p.share();
        format!("{} of {} ({percent:.1} %)", p.reachable, p.total)
    };
    let columns: [Column<'_, (usize, &Placement)>; 7] = [
        ("", &|(i, _)| i.to_string()),
        ("x, m", &|(_, p)| metres(at(p).x)),
        ("y, m", &|(_, p)| metres(at(p).y)),
        ("heading", &|(_, p)| {
            format!("{:.0} deg", p.heading_rad.to_degrees())
        }),
        ("targets reached", &|(_, p)| reached(p)),
        ("worst margin", &|(_, p)| mm(p.worst_margin_m)),
        ("mean margin", &|(_, p)| mm(p.mean_margin_m)),
    ];
    table_of((1..).zip(scores.best()), &columns)
}

/// `x,y,z,heading_rad,reachable,total,worst_margin_m,mean_margin_m`, best first; empty cells for missing values.
///
/// # Errors
/// A file that cannot be written.
pub fn csv(path: &Path, scores: &PlacementScores) -> anyhow::Result<()> {
    let mut writer = hwall_stage::numbers::writer(Some(path))?;
    let names = "x_m,y_m,z_m,heading_rad,reachable,total,worst_margin_m,mean_margin_m";
    writer.write_record(names.split(','))?;
    let cell = |margin: Option<f64>| margin.map_or(String::new(), |m| m.to_string());
    for place in scores.best() {
        let base_m = place.room_from_base.position_m();
        writer.write_record([
            // To a nanometre: finer digits are rounding of the grid.
            format!("{:.9}", base_m.x),
            format!("{:.9}", base_m.y),
            format!("{:.9}", base_m.z),
            place.heading_rad.to_string(),
            place.reachable.to_string(),
            place.total.to_string(),
            cell(place.worst_margin_m),
            cell(place.mean_margin_m),
        ])?;
    }
    writer.flush()
}

/// Length of the line that shows a heading, m.
const HEADING_M: f64 = 0.35;

/// The heat map from above: share of the targets for a base standing there, walls, targets, best.
///
/// # Errors
/// A file that cannot be written.
pub fn heat_map(
    path: &Path,
    scene: &Scene,
    targets: &[Target],
    scores: &PlacementScores,
) -> anyhow::Result<()> {
    let config = scores.config();
    let half = |steps: &Steps| 0.5 * steps.spacing_m();
    let ends = |steps: &Steps| {
        let (a, b) = (steps.at(0), steps.at(steps.count() - 1));
        (a.min(b) - half(steps), a.max(b) + half(steps))
    };
    let ((x0, x1), (y0, y1)) = (ends(&config.x), ends(&config.y));
    let scale = 620.0 / (x1 - x0).max(y1 - y0);
    let (w, h) = (((x1 - x0) * scale) as u32, ((y1 - y0) * scale) as u32);
    let size = ((w + 220).max(560), h.max(260) + 120);
    figure(path, size, |root| {
        let (left, key) = root.split_horizontally(size.0 - 130);
        let axes = Axes {
            title: "Where to stand: share of the targets in reach",
            names: ["x in the scene, m", "y in the scene, m"],
            labels: [58, 46],
            margin: 10,
            mesh: Mesh::None,
            ..Axes::default()
        };
        let mut chart = axes.on(&left, x0..x1, y0..y1)?;
        let shares = scores.shares();
        // No place reaches all walls of a room, so the lightest shade marks the best place.
        let most = shares.iter().copied().fold(0.0, f64::max);
        let relative = |share: f64| if most > 0.0 { share / most } else { 0.0 };
        let (columns, hx, hy) = (config.x.count(), half(&config.x), half(&config.y));
        let cells = shares.iter().enumerate().map(|(i, share)| {
            let (x, y) = (config.x.at(i % columns), config.y.at(i / columns));
            let corners = [(x - hx, y - hy), (x + hx, y + hy)];
            Rectangle::new(corners, shade(relative(*share)).filled())
        });
        chart.series(cells)?;
        let wall = WHITE.mix(0.9).stroke_width(2);
        let inside = |p: DVec3| (x0..=x1).contains(&p.x) && (y0..=y1).contains(&p.y);
        for id in (0..scene.surfaces().len()).map(SurfaceId) {
            for [a, b, c] in scene.triangles_m(id)? {
                let normal = (b - a).cross(c - a).normalize_or_zero();
                let upright = normal.z.abs() < 0.02;
                for edge in [[a, b], [b, c], [c, a]] {
                    let level = (edge[0].z - edge[1].z).abs() < 1e-6 && upright;
                    if level && edge.into_iter().any(inside) {
                        let ends = edge.map(|p| (p.x.clamp(x0, x1), p.y.clamp(y0, y1)));
                        chart.series([PathElement::new(ends, wall)])?;
                    }
                }
            }
        }
        let dots = targets.iter().map(|t| {
            // Slightly in front of the wall, on the person's side.
            let at = t.point_m + t.normal * 0.03;
            Circle::new((at.x, at.y), 1, COLOURS[1].filled())
        });
        chart.series(dots)?;
        for (i, place) in scores.best().iter().enumerate().take(3).rev() {
            let base_m = place.room_from_base.position_m();
            let at = (base_m.x, base_m.y);
            // The arm's heading: the middle of the range of joint 1.
            let (sin, cos) = place.heading_rad.sin_cos();
            let ahead = (at.0 + HEADING_M * cos, at.1 + HEADING_M * sin);
            for (colour, width) in [(WHITE, 5), (BLACK, 2)] {
                let heading = PathElement::new(vec![at, ahead], colour.stroke_width(width));
                chart.series([heading])?;
            }
            let mark = EmptyElement::at(at)
                + Circle::new((0, 0), 9, WHITE.filled())
                + Circle::new((0, 0), 9, BLACK.stroke_width(1))
                + Text::new((i + 1).to_string(), (-4, -8), TEXT.into_font());
            chart.series([mark])?;
        }
        draw_key(&key, most)
    })
}

fn draw_key(area: &Area<'_>, most: f64) -> anyhow::Result<()> {
    let key = Key {
        area,
        signs: [8, 28],
        words: 34,
    };
    for i in 0..=40 {
        let y = 60 + 3 * (40 - i);
        key.bar([y, y + 3], shade(f64::from(i) / 40.0))?;
    }
    key.label(&format!("{:.0} %", 100.0 * most), 56)?;
    key.label(&format!("{:.0} %", 50.0 * most), 116)?;
    key.label("0 %", 176)?;
    area.put(&Circle::new((18, 204), 3, COLOURS[1].filled()))?;
    key.label("targets", 197)?;
    area.put(&Circle::new((18, 228), 7, BLACK.stroke_width(1)))?;
    key.label("best three", 221)?;
    key.label("and headings", 237)
}

/// `low,high` in metres.
///
/// # Errors
/// Anything else, or a low above the high.
pub(super) fn heights(text: &str) -> anyhow::Result<Interval> {
    let [low, high] = arms::parse_list::<2>(text).context("--heights")?;
    ensure!(low <= high, "--heights {text}: {low} is above {high}");
    Ok(Interval::new(low, high))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_house_needs_a_place_in_it_and_a_room_does_not() {
        let arm = SrsArm::iiwa7();
        let targets = |width_m: f64| {
            let heights = Interval::new(0.5, 1.0);
            Target::on_wall(DVec3::X, -DVec3::X, width_m, heights, 0.1).unwrap()
        };
        let said = too_far_apart(&arm, &targets(18.0)).unwrap();
        assert!(said.contains("--near") && said.contains("18"), "{said}");
        assert_eq!(too_far_apart(&arm, &targets(3.0)), None);
        assert_eq!(too_far_apart(&arm, &[]), None);
    }

    #[test]
    fn surfaces_without_targets_are_named_unless_they_were_left_out_on_purpose() {
        let quad = |name: &str, x: f64, z: f64| {
            format!(
                "o {name}\nv {x} -1 {z}\nv {x} 1 {z}\nv {x} 1 {}\nv {x} -1 {}\nf -4 -3 -2 -1\n",
                z + 1.0,
                z + 1.0
            )
        };
        let floor = "o floor\nv 0 0 0\nv 1 0 0\nv 1 1 0\nf -3 -2 -1\n";
        let text =
            quad("wall", 0.6, 0.0) + &quad("lamp", 0.9, 0.0) + &quad("loft", 2.0, 3.0) + floor;
        let lamp = "[surface.lamp]\nkind = \"untouchable\"\n";
        let (scene, _) = Scene::from_obj_str(&text, Some(lamp)).unwrap();
        let choice = |surfaces| TargetChoice {
            surfaces,
            heights: Interval::new(0.4, 1.4),
            spacing_m: 0.1,
            near: None,
        };
        let said = left_out(&scene, &choice(&[])).unwrap();
        for part in [
            "lamp (must not be touched)",
            "floor (not upright)",
            "loft (not at these heights)",
        ] {
            assert!(said.contains(part), "{said}");
        }
        assert!(!said.contains("wall"), "{said}");
        assert_eq!(left_out(&scene, &choice(&["wall".to_owned()])), None);
    }
}
