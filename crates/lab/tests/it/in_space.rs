//! The map of one orientation as a page and a figure, and compared with its published file.

use hwall_lab::reach::figures::LineInterval;
use hwall_lab::reach::in_space::{InSpaceArgs, OrientationMap};
use hwall_lab::reach::orientation_rows::{OrientationRow, orientation_rows, table};
use hwall_lab::reach::published;
use hwall_reachability::{Steps, WallGrid};
use hwall_testkit::shared;

fn grid(planes: usize) -> WallGrid {
    WallGrid {
        heading_rad: 0.5,
        distances: Steps::new(0.6, -0.1, planes).unwrap(),
        heights: Steps::new(0.2, 0.1, 3).unwrap(),
        span_m: None,
    }
}

fn interval(plane: usize, height: usize, s_m: [f64; 2]) -> LineInterval {
    LineInterval { plane, height, s_m }
}

#[test]
fn page_and_figure_hold_every_interval_and_the_plane_with_a_hole() {
    let grid = grid(3);
    let intervals = [
        interval(0, 1, [-0.4, 0.4]),
        interval(1, 0, [-0.3, -0.1]),
        interval(1, 0, [0.1, 0.3]),
        interval(2, 2, [-0.2, 0.2]),
    ];
    let map = OrientationMap::new(&grid, &intervals, None).unwrap();
    assert_eq!(map.plane, 1);
    let page = map.page().unwrap();
    let start = page.find("application/json\">").unwrap() + "application/json\">".len();
    let json = &page[start..start + page[start..].find('<').unwrap()];
    let data: serde_json::Value = serde_json::from_str(json).unwrap();
    assert_eq!(data["intervals"].as_array().unwrap().len(), 4);
    assert_eq!(data["intervals"][2], serde_json::json!([1, 0, 0.1, 0.3]));
    assert!(!page.contains("http"), "outside resources");

    let folder = std::env::temp_dir().join(format!("hwall_in_space_{}", std::process::id()));
    std::fs::create_dir_all(&folder).unwrap();
    let [html, svg] = ["a.html", "a.svg"].map(|name| folder.join(name));
    let args = |shown, shown_plane| InSpaceArgs {
        html: Some(html.clone()),
        svg_3d: Some(svg.clone()),
        shown,
        shown_plane,
    };
    let along = [Vec::new(), intervals.to_vec()];
    let grids = [grid.clone(), grid.clone()];
    args(Some(2), None).write(&grids, &along).unwrap();
    assert_eq!(std::fs::read_to_string(&html).unwrap(), page);
    let drawn = std::fs::read_to_string(&svg).unwrap();
    assert!(drawn.ends_with("</svg>\n") && drawn.contains("Projection"));
    assert!(!drawn.contains("NaN"));
    for (shown, plane, because) in [
        (3, None, "there are 2"),
        (2, Some(3), "plane 3"),
        (1, None, "nothing"),
    ] {
        let error = args(Some(shown), plane)
            .write(&grids, &along)
            .unwrap_err()
            .to_string();
        assert!(error.contains(because), "{error}");
    }
    let _ = std::fs::remove_dir_all(&folder);
}

#[test]
fn a_single_plane_and_a_single_height_are_drawn() {
    let one = WallGrid {
        heights: Steps::single(0.4, 0.025).unwrap(),
        distances: Steps::single(0.6, 0.025).unwrap(),
        ..grid(1)
    };
    let intervals = [interval(0, 0, [-0.4, 0.4])];
    let map = OrientationMap::new(&one, &intervals, Some(0)).unwrap();
    let path = std::env::temp_dir().join(format!("hwall_one_line_{}.svg", std::process::id()));
    map.write_svg(&path).unwrap();
    assert!(!std::fs::read_to_string(&path).unwrap().contains("NaN"));
    std::fs::remove_file(&path).unwrap();
}

#[test]
fn a_published_orientation_is_slower_less_exact_and_has_no_holes() {
    let Some(folder) = shared("data/hwall_maps_2018") else {
        return;
    };
    let published = published::read(&folder).unwrap();
    let rows = orientation_rows(&published, 4).unwrap();
    let row = |name: &str| -> &OrientationRow {
        rows.iter()
            .find(|row| row.quantity.starts_with(name))
            .unwrap()
    };
    // As in docs/VALIDATION.md.
    let off = row("bounds off").published.unwrap();
    assert!((off - 19.5).abs() < 0.05, "{off}");
    assert!((row("largest error").published.unwrap() - 1158.0).abs() < 1.0);
    let holes = row("lines with holes");
    assert_eq!((holes.published, holes.ours), (Some(0.0), 216.0));
    assert!(row("time").ours < row("time").published.unwrap());
    assert!(row("lines reachable").published.unwrap() > row("lines reachable").ours);
    let text = table(&rows).to_string();
    assert!(text.contains("| 3600"), "{text}");
    assert!(text.contains("not stated"), "{text}");
    assert!(orientation_rows(&published, 0).is_err() && orientation_rows(&published, 8).is_err());
}
