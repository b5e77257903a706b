//! Calibration tables: exactness at nodes, inversion, and errors outside their hull.

use crate::common::bumps::{level, scan};
use hwall_files::TableError;
use hwall_testkit::Sampler;
use hwall_texton::{Calibration, ScanAngle, TextonError};

/// The conditions of the published study.
const ORIENTATIONS_DEG: [f64; 5] = [0.0, 45.0, 63.43, 71.57, 90.0];
const SPEEDS: [f64; 5] = [0.0, 20.0, 40.0, 60.0, 80.0];

fn grid(of: impl Fn(f64, f64) -> f64) -> Calibration {
    let rows = ORIENTATIONS_DEG
        .iter()
        .flat_map(|deg| SPEEDS.map(|speed| level(*deg, speed, of(*deg, speed))));
    Calibration::from_rows(rows.collect::<Vec<_>>()).unwrap()
}

/// Rises with both.
fn planted(deg: f64, speed: f64) -> f64 {
    2.0 + 3.0 * deg.to_radians().sin().powi(2) + 0.8 * (speed / 80.0).sqrt()
}

#[test]
fn nodes_are_exact_and_what_is_linear_is_reproduced() {
    let table = grid(planted);
    for node in table.nodes() {
        let got = table.magnitude(node.scan, node.speed_mm_per_s).unwrap();
        assert_eq!(got, node.magnitude);
        // An angle computed elsewhere may be an ulp off.
        let beside = ScanAngle::from_rad(node.scan.deg().to_radians()).unwrap();
        let got = table.magnitude(beside, node.speed_mm_per_s).unwrap();
        assert!((got - node.magnitude).abs() < 1e-9);
    }
    let linear = |deg: f64, speed: f64| 1.0 + 0.03 * deg - 0.02 * speed;
    let table = grid(linear);
    let mut s = Sampler::new(1);
    for i in 0..20_000 {
        let (mut deg, mut speed) = (s.uniform(0.0, 90.0), s.uniform(0.0, 80.0));
        // On the border, and so near it that the Sibson cells are huge.
        match i % 10 {
            0 => deg = 0.0,
            1 => deg = 90.0,
            2 => speed = 80.0,
            3 => speed = 10_f64.powf(s.uniform(-14.0, 0.0)),
            4 => deg = 10_f64.powf(s.uniform(-14.0, 0.0)),
            // On a line between nodes, and on the diagonal of a cell.
            5 => speed = 40.0,
            6 => (deg, speed) = (22.5, 10.0),
            _ => {}
        }
        let got = table.magnitude(scan(deg), speed).unwrap();
        let off = got - linear(deg, speed);
        assert!(off.abs() < 1e-7, "{deg} {speed}: {got}");
    }
}

#[test]
fn a_product_is_nearly_reproduced_and_nothing_leaves_the_nodes_around() {
    // Natural neighbours are exact for planes. For a saddle they are exact in the middle of a square, and
    // within a tenth elsewhere.
    let rows = (0..6).flat_map(|i| (0..6).map(move |j| (i, j)));
    let rows = rows.map(|(i, j)| level(18.0 * f64::from(i), 16.0 * f64::from(j), f64::from(i * j)));
    let table = Calibration::from_rows(rows).unwrap();
    let middle = table.magnitude(scan(45.0), 40.0).unwrap();
    assert!((middle - 6.25).abs() < 1e-12, "{middle}");
    let mut s = Sampler::new(2);
    let mut worst = 0.0_f64;
    for _ in 0..5000 {
        let (x, y) = (s.uniform(0.0, 5.0), s.uniform(0.0, 5.0));
        let got = table.magnitude(scan(18.0 * x), 16.0 * y).unwrap();
        assert!((0.0..=25.0).contains(&got));
        worst = worst.max((got - x * y).abs());
    }
    assert!(worst < 0.1, "{worst}");
}

#[test]
fn outside_the_nodes_there_is_no_answer() {
    let table = grid(planted);
    for (deg, speed) in [(45.0, 80.001), (45.0, -1.0), (0.0, 1e6)] {
        let got = table.magnitude(scan(deg), speed);
        let is_outside = matches!(got, Err(TextonError::OutsideCalibration { .. }));
        assert!(is_outside, "{got:?}");
    }
    assert!(table.magnitude(scan(1.0), f64::NAN).is_err());
    // A triangle of conditions.
    let rows = [(0.0, 0.0, 1.0), (90.0, 0.0, 2.0), (0.0, 80.0, 3.0)];
    let table = Calibration::from_rows(rows.map(|(d, s, m)| level(d, s, m))).unwrap();
    assert!((table.magnitude(scan(30.0), 20.0).unwrap() - (1.0 + 1.0 / 3.0 + 0.5)).abs() < 1e-12);
    let off = table.magnitude(scan(45.0), 40.0).unwrap() - 2.5;
    assert!(off.abs() < 1e-9, "on the long side");
    assert!(table.magnitude(scan(60.0), 60.0).is_err());
}

#[test]
fn what_is_asked_back_comes_back() {
    let table = grid(planted);
    let mut s = Sampler::new(3);
    for _ in 0..500 {
        let (deg, speed) = (s.uniform(0.0, 90.0), s.uniform(0.0, 80.0));
        let magnitude = table.magnitude(scan(deg), speed).unwrap();
        let found = table.speed_for(magnitude, scan(deg)).unwrap();
        assert!((found - speed).abs() < 1e-6, "{deg} {speed}: {found}");
        let level = table.level_for(magnitude).unwrap();
        assert_eq!(level.magnitude, magnitude);
        let got = table.magnitude(level.scan, level.speed_mm_per_s).unwrap();
        assert!((got - magnitude).abs() < 1e-9);
    }
    let (least, most) = (planted(0.0, 0.0), planted(90.0, 80.0));
    for end in [least, most] {
        assert!(table.level_for(end).is_ok());
    }
    for wanted in [least - 0.1, most + 0.1] {
        let refused = Err(TextonError::NotAttained {
            wanted,
            min: least,
            max: most,
        });
        assert_eq!(table.level_for(wanted), refused);
        assert!(table.speed_for(wanted, scan(45.0)).is_err());
    }
    assert!(table.level_for(f64::NAN).is_err());
}

#[test]
fn a_level_between_the_ranges_of_two_orientations_takes_one_between_them() {
    let rows = [0.0, 90.0]
        .into_iter()
        .flat_map(|deg| [0.0, 80.0].map(|speed| level(deg, speed, deg / 10.0 + speed / 80.0)));
    let table = Calibration::from_rows(rows).unwrap();
    let level = table.level_for(5.0).unwrap();
    assert!((40.0..50.0).contains(&level.scan.deg()), "{level:?}");
    let got = table.magnitude(level.scan, level.speed_mm_per_s).unwrap();
    assert!((got - 5.0).abs() < 1e-12);
    assert_eq!(table.level_for(0.5).unwrap().scan, ScanAngle::ALONG);
}

#[test]
fn a_csv_in_any_order_with_repeats_and_other_columns() {
    let csv = "\u{feff}subject, value ,velocity_mm_s,orientation_deg\n\
               1,4,80,90\n1,1,0,0\n2,3,0,180\n1,2,80,0\n1,3.5,0,90\n";
    let table = Calibration::from_csv(csv.as_bytes()).unwrap();
    let nodes: Vec<_> = table
        .nodes()
        .iter()
        .map(|n| (n.scan.deg(), n.speed_mm_per_s, n.magnitude, n.rows))
        .collect();
    // 180 degrees equals 0.
    assert_eq!(
        nodes,
        [
            (0.0, 0.0, 2.0, 2),
            (0.0, 80.0, 2.0, 1),
            (90.0, 0.0, 3.5, 1),
            (90.0, 80.0, 4.0, 1)
        ]
    );
    assert_eq!(table.levels().len(), 4);
}

const HEADER: &str = "orientation_deg,velocity_mm_s,value";

fn refused(csv: &str) -> TextonError {
    Calibration::from_csv(csv.as_bytes()).unwrap_err()
}

fn cell(line: u64, column: &'static str, text: &str) -> TextonError {
    TextonError::Cell {
        line,
        column,
        text: text.to_owned(),
    }
}

fn short_row(line: u64) -> TextonError {
    TextonError::Table(TableError::CellCount {
        line,
        got: 2,
        expected: 3,
    })
}

#[test]
fn bad_csv_names_the_line() {
    let column = "orientation_deg";
    let no_area = |nodes| TextonError::NoArea { nodes };
    assert_eq!(refused("a,b\n1,2\n"), TextonError::MissingColumn { column });
    assert_eq!(refused(""), TextonError::Table(TableError::Empty));
    for (rows, error) in [
        ("0,0,1\n\n0,20,x\n", cell(4, "value", "x")),
        ("0,0,NaN\n", cell(2, "value", "NaN")),
        ("0,-1,1\n", cell(2, "velocity_mm_s", "-1")),
        ("inf,0,1\n", cell(2, column, "inf")),
        ("0,0,1\n0,20\n", short_row(3)),
        ("", no_area(0)),
        ("0,0,1\n", no_area(1)),
        // All on one line, along an axis or across.
        ("0,0,1\n0,1,1\n0,2,1\n", no_area(3)),
        ("0,0,1\n45,40,1\n90,80,1\n", no_area(3)),
    ] {
        assert_eq!(refused(&format!("{HEADER}\n{rows}")), error);
    }
    assert!(Calibration::from_csv(&[0xff, 0xfe, 0x00][..]).is_err());
    // Regression: a cell of a megabyte was repeated in the message.
    let long = format!("{HEADER}\n0,20,{}\n", "x".repeat(1 << 20));
    assert!(refused(&long).to_string().len() < 200);
    // Regression: speeds of 0 and 5e-324 mm/s became two nodes at one place, and one lost its magnitude.
    for speed in ["5e-324", "1e-9"] {
        let near = format!("{HEADER}\n0,{speed},1.2\n0,40,1.4\n0,0,2.2\n45,40,2.4\n90,20,3\n");
        let error = refused(&near);
        assert!(error.to_string().contains("speed"), "{error}");
    }
}

#[test]
fn beyond_the_hull_nothing_is_called_attained() {
    let rows = [(20.0, 0.0), (20.0, 80.0), (70.0, 0.0), (70.0, 80.0)];
    let narrow = rows.map(|(deg, speed)| level(deg, speed, planted(deg, speed)));
    let narrow = Calibration::from_rows(narrow).unwrap();
    let refused = narrow.speed_for(3.0, scan(80.0)).unwrap_err();
    let TextonError::OutsideCalibration { speed_mm_per_s, .. } = refused else {
        panic!("{refused}");
    };
    assert_eq!(speed_mm_per_s, 0.0);
}

/// Regression: magnitudes of 1e308 overflowed in sums and differences.
#[test]
fn a_calibration_of_unbounded_numbers_is_refused() {
    for (speed, value, fine) in [
        ("40", "1e308", false),
        ("40", "-1e308", false),
        ("1e308", "1", false),
        ("1e7", "1", false),
        ("40", "3", true),
    ] {
        let text = format!("{HEADER}\n0,20,1\n90,20,2\n0,{speed},{value}\n");
        let read = Calibration::from_csv(text.as_bytes());
        assert_eq!(read.is_ok(), fine, "{speed} {value}");
    }
}
