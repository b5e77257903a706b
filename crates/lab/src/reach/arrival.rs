//! Arrival times of the arm at people's touches, for the command line.

use crate::spans::ends as span;
use glam::DVec3;
use hwall_arrival::{Atlas, AtlasWall, PostureArrivals};
use hwall_kinematics::JointPositions;
use hwall_scene::Scene;
use hwall_stage::arms;
use hwall_testkit::{Column, MarkdownTable, Timing, quantiles, table_of, time_batches};

/// A configuration from seven numbers in degrees.
///
/// # Errors
/// Anything but seven finite numbers.
pub fn configuration(text: &str) -> anyhow::Result<JointPositions> {
    Ok(JointPositions::from_deg(arms::parse_list::<7>(text)?))
}

/// A configuration as seven numbers in degrees.
pub fn degrees(q: &JointPositions) -> String {
    let joints = q.0.map(|q| format!("{:.1}", q.to_degrees()));
    joints.join(",")
}

/// Arrival times at the targets, one row per posture.
pub fn posture_table(postures: &[(&str, PostureArrivals)]) -> MarkdownTable {
    let within = |a: &PostureArrivals, time_s: f64| percent(a.share_within(time_s));
    let late = |a: &PostureArrivals| format!("{:.0} ms", 1e3 * a.posture.expected_lateness_s);
    let columns: [Column<'_, &(&str, PostureArrivals)>; 10] = [
        ("posture", &|(name, _)| (*name).to_owned()),
        ("joints, deg", &|(_, a)| degrees(&a.posture.q)),
        ("within 0.5 s", &|(_, a)| within(a, 0.5)),
        ("0.6 s", &|(_, a)| within(a, 0.6)),
        ("0.7 s", &|(_, a)| within(a, 0.7)),
        ("median", &|(_, a)| format!("{:.2} s", a.quantile_s(0.5))),
        ("p90", &|(_, a)| format!("{:.2} s", a.quantile_s(0.9))),
        ("late on average", &|(_, a)| late(a)),
        ("ways clear", &|(_, a)| percent(a.posture.clear_share)),
        ("behind surfaces", &|(_, a)| {
            format!("{:.0} mm", 1e3 * a.posture.standoff_m)
        }),
    ];
    table_of(postures, &columns)
}

/// One row per touchable wall of an atlas.
pub fn wall_table(walls: &[(String, &AtlasWall)]) -> MarkdownTable {
    let nodes = |wall: &AtlasWall| -> Vec<_> {
        let nodes = wall.places().filter_map(|place| wall.node(place).copied());
        nodes.collect()
    };
    let at = |wall: &AtlasWall, share: f64| {
        let times_s = nodes(wall).into_iter().map(|node| node.arrival_s);
        format!("{:.2} s", quantiles(times_s, [share])[0])
    };
    let clear = |wall: &AtlasWall| {
        let nodes = nodes(wall);
        let clear = nodes.iter().filter(|node| node.clear).count();
        percent(clear as f64 / nodes.len() as f64)
    };
    let holes = |wall: &AtlasWall| wall.places().count() - nodes(wall).len();
    let columns: [Column<'_, &(String, &AtlasWall)>; 9] = [
        ("wall", &|(name, _)| name.clone()),
        ("nodes", &|(_, wall)| nodes(wall).len().to_string()),
        ("holes", &|(_, wall)| holes(wall).to_string()),
        ("ways clear", &|(_, wall)| clear(wall)),
        ("seams", &|(_, wall)| wall.seams().count().to_string()),
        ("soonest", &|(_, wall)| at(wall, 0.0)),
        ("median", &|(_, wall)| at(wall, 0.5)),
        ("p90", &|(_, wall)| at(wall, 0.9)),
        ("latest", &|(_, wall)| at(wall, 1.0)),
    ];
    table_of(walls, &columns)
}

/// The walls of an atlas that are outer sides of surfaces of the scene, with the surface's name. If a surface has
/// several, the heading of the normal is appended, and the distance from the base if that is the same, too.
pub fn named_walls<'a>(scene: &Scene, atlas: &'a Atlas) -> Vec<(String, &'a AtlasWall)> {
    /// Planes and borders that differ by less are the same, m.
    const SAME_M: f64 = 1e-6;
    let facets = scene.vertical_facets();
    let name_of = |wall: &AtlasWall| {
        let plane = wall.plane();
        let along = wall.along();
        let ends = [along.at(0), along.at(along.count() - 1)];
        let of_plane = facets.iter().filter_map(|facet| {
            let same = facet.normal.dot(plane.normal()) > 1.0 - SAME_M
                && plane.project(facet.point_m).off_m.abs() < SAME_M;
            let outline = facet.outline_m.iter();
            let (lo, hi) = span(outline.map(|p| plane.along().dot(*p)));
            let holds = lo - SAME_M <= ends[0] && ends[1] <= hi + SAME_M;
            (same && holds).then_some((hi - lo, facet))
        });
        let narrowest = of_plane.min_by(|a, b| a.0.total_cmp(&b.0));
        narrowest.map(|(_, facet)| scene.surface(facet.surface).name.clone())
    };
    let named = |wall: &'a AtlasWall| Some((name_of(wall)?, wall));
    let walls: Vec<(String, &AtlasWall)> = atlas.walls().iter().filter_map(named).collect();
    told_apart(walls, |wall| {
        let plane = wall.plane();
        let (normal, distance_m) = (plane.normal(), plane.distance_m());
        // Not -0.
        let heading_deg = normal.y.atan2(normal.x).to_degrees().round() + 0.0;
        [
            format!(", {heading_deg:.0}°"),
            format!(", {distance_m:.2} m"),
        ]
    })
}

/// Makes names unique by appending `more`; remaining duplicates are numbered.
fn told_apart<T>(named: Vec<(String, T)>, more: impl Fn(&T) -> [String; 2]) -> Vec<(String, T)> {
    let mut names: Vec<String> = named.iter().map(|(name, _)| name.clone()).collect();
    let number = |at: usize| format!(" ({})", at + 1);
    for step in 0..3 {
        let before = names.clone();
        let is_repeated = |name: &String| before.iter().filter(|other| *other == name).count() > 1;
        for (at, (name, (_, of))) in names.iter_mut().zip(&named).enumerate() {
            if is_repeated(&*name) {
                *name += more(of).get(step).unwrap_or(&number(at));
            }
        }
    }
    let of = named.into_iter().map(|(_, of)| of);
    names.into_iter().zip(of).collect()
}

/// Times look-ups at points off the nodes by a fraction of the spacing, so that four nodes contribute.
pub fn time_look_ups(atlas: &Atlas, slack_m: Option<f64>) -> Timing {
    /// Calls in a batch, and batches.
    const CALLS: [usize; 2] = [1000, 50];
    let places: Vec<(DVec3, DVec3)> = atlas
        .walls()
        .iter()
        .flat_map(|wall| {
            let normal = wall.plane().normal();
            let beside_m = wall.plane().along() * 0.013 + DVec3::Z * 0.017;
            let nodes = wall.places().filter(|&place| wall.node(place).is_some());
            nodes.map(move |place| (wall.point_m(place) + beside_m, normal))
        })
        .collect();
    time_batches(CALLS[1], CALLS[0], |i| {
        let (point_m, normal) = places[i % places.len()];
        match slack_m {
            Some(slack_m) => atlas.look_up_within(point_m, normal, slack_m),
            None => atlas.look_up(point_m, normal),
        }
    })
}

pub(super) fn percent(share: f64) -> String {
    format!("{:.1} %", 100.0 * share)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn panels_of_one_surface_are_told_apart() {
        let walls = [
            ("side", ["a", "1"]),
            ("side", ["b", "1"]),
            ("front", ["a", "1"]),
            ("back", ["a", "1"]),
            ("back", ["a", "2"]),
            ("lid", ["a", "1"]),
            ("lid", ["a", "1"]),
        ];
        let named = walls.map(|(name, more)| (name.to_owned(), more));
        let named = told_apart(named.into(), |more| more.map(|word| format!(" {word}")));
        let names: Vec<&str> = named.iter().map(|(name, _)| name.as_str()).collect();
        let last = ["lid a 1 (6)", "lid a 1 (7)"];
        assert_eq!(
            names[..5],
            ["side a", "side b", "front", "back a 1", "back a 2"]
        );
        assert_eq!(names[5..], last);
    }
}
