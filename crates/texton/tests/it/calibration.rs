//! Calibration tables: exact where they must be, inverted, repaired, and refused where they know nothing.

use hwall_files::TableError;
use hwall_testkit::Sampler;
use hwall_texton::{Calibration, Level, ScanAngle, TextonError};

fn scan(deg: f64) -> ScanAngle {
    ScanAngle::from_deg(deg).unwrap()
}

/// The conditions of the published study.
const ORIENTATIONS_DEG: [f64; 5] = [0.0, 45.0, 63.43, 71.57, 90.0];
const SPEEDS: [f64; 5] = [0.0, 20.0, 40.0, 60.0, 80.0];

fn row(scan: ScanAngle, speed_mm_per_s: f64, magnitude: f64) -> Level {
    Level {
        scan,
        speed_mm_per_s,
        magnitude,
    }
}

fn grid(of: impl Fn(f64, f64) -> f64) -> Calibration {
    let rows = ORIENTATIONS_DEG
        .iter()
        .flat_map(|deg| SPEEDS.map(|speed| row(scan(*deg), speed, of(*deg, speed))));
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
        // An angle that comes from elsewhere may be an ulp off.
        let beside = ScanAngle::from_rad(node.scan.deg().to_radians()).unwrap();
        let got = table.magnitude(beside, node.speed_mm_per_s).unwrap();
        assert!((got - node.magnitude).abs() < 1e-9);
    }
    let linear = |deg: f64, speed: f64| 1.0 + 0.03 * deg - 0.02 * speed;
    let table = grid(linear);
    let mut s = Sampler::new(1);
    for i in 0..20_000 {
        let (mut deg, mut speed) = (s.uniform(0.0, 90.0), s.uniform(0.0, 80.0));
        // On the border, and so near it that its cells are huge.
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
        assert!(
            (got - linear(deg, speed)).abs() < 1e-7,
            "{deg} {speed}: {got}"
        );
    }
}

#[test]
fn a_product_is_nearly_reproduced_and_nothing_leaves_the_nodes_around() {
    // Natural neighbours are exact for planes; a saddle they meet in the middle of a square, and
    // within a tenth elsewhere.
    let rows = (0..6).flat_map(|i| (0..6).map(move |j| (i, j)));
    let rows = rows.map(|(i, j)| {
        row(
            scan(18.0 * f64::from(i)),
            16.0 * f64::from(j),
            f64::from(i * j),
        )
    });
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
        assert!(
            matches!(got, Err(TextonError::OutsideCalibration { .. })),
            "{got:?}"
        );
    }
    assert!(table.magnitude(scan(1.0), f64::NAN).is_err());
    // A triangle of conditions.
    let rows = [
        row(scan(0.0), 0.0, 1.0),
        row(scan(90.0), 0.0, 2.0),
        row(scan(0.0), 80.0, 3.0),
    ];
    let table = Calibration::from_rows(rows).unwrap();
    assert!((table.magnitude(scan(30.0), 20.0).unwrap() - (1.0 + 1.0 / 3.0 + 0.5)).abs() < 1e-12);
    assert!(
        (table.magnitude(scan(45.0), 40.0).unwrap() - 2.5).abs() < 1e-9,
        "on the long side"
    );
    assert!(table.magnitude(scan(60.0), 60.0).is_err());
}

#[test]
fn what_is_asked_back_comes_back() {
    let table = grid(planted);
    let mut s = Sampler::new(3);
    for _ in 0..500 {
        let (deg, speed) = (s.uniform(0.0, 90.0), s.uniform(0.0, 80.0));
        let magnitude = table.magnitude(scan(deg), speed).unwrap();
        let found = table.orientation_for(magnitude, speed).unwrap();
        assert!((table.magnitude(found, speed).unwrap() - magnitude).abs() < 1e-9);
        assert!((found.deg() - deg).abs() < 1e-6, "{deg} {speed}: {found:?}");
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
        assert!(table.orientation_for(wanted, 40.0).is_err());
        assert!(table.speed_for(wanted, scan(45.0)).is_err());
    }
    assert!(table.level_for(f64::NAN).is_err());
    assert!(table.orientation_for(3.0, f64::NAN).is_err());
    // No orientation at a speed that was never shown.
    assert!(table.orientation_for(3.0, 90.0).is_err());
}

#[test]
fn a_level_between_the_ranges_of_two_orientations_takes_one_between_them() {
    let rows = [0.0, 90.0]
        .into_iter()
        .flat_map(|deg| [0.0, 80.0].map(|speed| row(scan(deg), speed, deg / 10.0 + speed / 80.0)));
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
    // 180 degrees are those of 0.
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

#[test]
fn bad_csv_names_the_line() {
    let of = |csv: &str| Calibration::from_csv(csv.as_bytes()).unwrap_err();
    let header = "orientation_deg,velocity_mm_s,value\n";
    let cell = |line, column, text: &str| TextonError::Cell {
        line,
        column,
        text: text.to_owned(),
    };
    assert_eq!(
        of("a,b\n1,2\n"),
        TextonError::MissingColumn {
            column: "orientation_deg"
        }
    );
    assert_eq!(of(""), TextonError::Table(TableError::Empty));
    assert_eq!(
        of(&format!("{header}0,0,1\n0,20,x\n")),
        cell(3, "value", "x")
    );
    assert_eq!(of(&format!("{header}0,0,NaN\n")), cell(2, "value", "NaN"));
    assert_eq!(
        of(&format!("{header}0,-1,1\n")),
        cell(2, "velocity_mm_s", "-1")
    );
    assert_eq!(
        of(&format!("{header}inf,0,1\n")),
        cell(2, "orientation_deg", "inf")
    );
    assert_eq!(
        of(&format!("{header}0,0,1\n0,20\n")),
        TextonError::Table(TableError::CellCount {
            line: 3,
            got: 2,
            expected: 3
        })
    );
    assert_eq!(of(header), TextonError::NoArea { nodes: 0 });
    assert_eq!(
        of(&format!("{header}0,0,1\n")),
        TextonError::NoArea { nodes: 1 }
    );
    // All on one line, along an axis or across.
    assert_eq!(
        of(&format!("{header}0,0,1\n0,1,1\n0,2,1\n")),
        TextonError::NoArea { nodes: 3 }
    );
    assert_eq!(
        of(&format!("{header}0,0,1\n45,40,1\n90,80,1\n")),
        TextonError::NoArea { nodes: 3 }
    );
    assert!(Calibration::from_csv(&[0xff, 0xfe, 0x00][..]).is_err());
}

#[test]
fn a_calibration_is_read_as_any_spreadsheet_writes_it() {
    let text = "orientation_deg,velocity_mm_s,value\n0,0,2\n90,0,3.5\n0,80,2.5\n90,80,4\n";
    let plain = Calibration::from_csv(text.as_bytes()).unwrap();
    for separator in [";", "\t"] {
        let text = text
            .replace(',', separator)
            .replace('.', ",")
            .replace('\n', "\r\n");
        let read = Calibration::from_csv(format!("\u{feff}{text}").as_bytes()).unwrap();
        assert_eq!(read.levels(), plain.levels());
    }
}

#[test]
fn lines_are_counted_as_an_editor_does() {
    let of = |csv: &str| Calibration::from_csv(csv.as_bytes()).unwrap_err();
    let cell = |line| TextonError::Cell {
        line,
        column: "value",
        text: "x".to_owned(),
    };
    for mark in ["", "\u{feff}"] {
        for end in ["\n", "\r\n", "\r"] {
            let text = |lines: &[&str]| format!("{mark}{}{end}", lines.join(end));
            let header = "orientation_deg,velocity_mm_s,value";
            for (lines, line) in [
                (&[header, "0,0,x"][..], 2),
                (&[header, "0,0,1", "0,20,x"], 3),
                (&[header, "0,0,1", "", "", "0,20,x", "0,40,1"], 5),
                (&["", header, "", "0,0,1", "0,20,x"], 5),
                (&[header, "", "0,0,x", ""], 3),
            ] {
                assert_eq!(of(&text(lines)), cell(line), "{end:?} {lines:?}");
            }
            assert_eq!(
                of(&text(&[header, "0,0,1", "", "0,20"])),
                TextonError::Table(TableError::CellCount {
                    line: 4,
                    got: 2,
                    expected: 3
                }),
                "{end:?}"
            );
        }
    }
}

#[test]
fn beyond_the_hull_nothing_is_called_attained() {
    let table = grid(planted);
    assert_eq!(
        table.orientation_for(3.0, 90.0),
        Err(TextonError::OutsideCalibration {
            orientation_deg: 0.0,
            speed_mm_per_s: 90.0
        })
    );
    let rows = [(20.0, 0.0), (20.0, 80.0), (70.0, 0.0), (70.0, 80.0)];
    let narrow = rows.map(|(deg, speed)| row(scan(deg), speed, planted(deg, speed)));
    let narrow = Calibration::from_rows(narrow).unwrap();
    let refused = narrow.speed_for(3.0, scan(80.0));
    assert!(
        matches!(
            refused,
            Err(TextonError::OutsideCalibration {
                speed_mm_per_s: 0.0,
                ..
            })
        ),
        "{refused:?}"
    );
    assert!(matches!(
        table.orientation_for(1e6, 40.0),
        Err(TextonError::NotAttained { .. })
    ));
}

#[test]
fn falls_are_reported_and_repaired() {
    let table = grid(planted);
    assert!(table.violations().is_empty());
    let same = table.isotonic().unwrap();
    for (a, b) in table.nodes().iter().zip(same.nodes()) {
        assert!((a.magnitude - b.magnitude).abs() < 1e-12);
    }
    // One condition too high: a fall to the next orientation and to the next speed.
    let high = |deg: f64, speed: f64| {
        planted(deg, speed)
            + if (deg, speed) == (45.0, 40.0) {
                3.0
            } else {
                0.0
            }
    };
    let table = grid(high);
    let falls = table.violations();
    assert_eq!(falls.len(), 2);
    for fall in &falls {
        assert_eq!(
            (fall.lower.scan.deg(), fall.lower.speed_mm_per_s),
            (45.0, 40.0)
        );
        assert!(fall.drop() > 1.0);
    }
    let repaired = table.isotonic().unwrap();
    assert!(repaired.violations().is_empty());
    // The mean stays, as least squares has it.
    let sum = |t: &Calibration| t.nodes().iter().map(|n| n.magnitude).sum::<f64>();
    assert!((sum(&table) - sum(&repaired)).abs() < 1e-9);
}

#[test]
fn the_repair_of_noise_is_the_closest_table() {
    let mut s = Sampler::new(4);
    let rows: Vec<_> = ORIENTATIONS_DEG
        .iter()
        .flat_map(|deg| SPEEDS.map(|speed| (*deg, speed)))
        .map(|(deg, speed)| row(scan(deg), speed, planted(deg, speed) + s.normal()))
        .collect();
    let table = Calibration::from_rows(rows).unwrap();
    assert!(!table.violations().is_empty());
    let repaired = table.isotonic().unwrap();
    assert!(repaired.violations().is_empty());
    // A projection onto a cone: the residual is at right angles to it, and no rising table is closer.
    let residual = |t: &Calibration| -> Vec<f64> {
        let nodes = t.nodes().iter().zip(table.nodes());
        nodes.map(|(a, b)| b.magnitude - a.magnitude).collect()
    };
    let r = residual(&repaired);
    let along: f64 = r
        .iter()
        .zip(repaired.nodes())
        .map(|(r, n)| r * n.magnitude)
        .sum();
    assert!(along.abs() < 1e-6, "{along}");
    for _ in 0..2000 {
        let (a, b) = (s.uniform(0.0, 90.0), s.uniform(0.0, 80.0));
        let step = |n: &hwall_texton::CalibrationNode| {
            f64::from(u8::from(n.scan.deg() >= a && n.speed_mm_per_s >= b))
        };
        let gain: f64 = r
            .iter()
            .zip(repaired.nodes())
            .map(|(r, n)| r * step(n))
            .sum();
        assert!(gain < 1e-6, "{gain}");
    }
    let holes = Calibration::from_rows([
        row(scan(0.0), 0.0, 1.0),
        row(scan(90.0), 0.0, 2.0),
        row(scan(0.0), 80.0, 3.0),
    ]);
    let refused = TextonError::NoGrid {
        orientations: 2,
        speeds: 2,
        nodes: 3,
    };
    assert_eq!(holes.unwrap().isotonic().unwrap_err(), refused);
}

/// Magnitudes of 1e308 overflowed in sums and differences.
#[test]
fn a_calibration_of_unbounded_numbers_is_refused() {
    let table = |speed: &str, value: &str| {
        format!("orientation_deg,velocity_mm_s,value\n0,20,1\n90,20,2\n0,{speed},{value}\n")
    };
    for (speed, value) in [
        ("40", "1e308"),
        ("40", "-1e308"),
        ("1e308", "1"),
        ("1e7", "1"),
    ] {
        let read = hwall_texton::Calibration::from_csv(table(speed, value).as_bytes());
        assert!(read.is_err(), "{speed} {value}");
    }
    let read = hwall_texton::Calibration::from_csv(table("40", "3").as_bytes());
    assert!(read.is_ok());
}

/// A cell of a megabyte was repeated in the message.
#[test]
fn a_long_cell_is_cut_in_the_message() {
    let text = format!(
        "orientation_deg,velocity_mm_s,value\n0,20,{}\n",
        "x".repeat(1 << 20)
    );
    let error = hwall_texton::Calibration::from_csv(text.as_bytes()).unwrap_err();
    assert!(error.to_string().len() < 200);
}

/// Speeds of 0 and 5e-324 mm/s were two nodes at one place, and one of them lost its magnitude.
#[test]
fn conditions_that_nearly_coincide_are_refused() {
    for speed in ["5e-324", "1e-9"] {
        let text = format!(
            "orientation_deg,velocity_mm_s,value\n0,{speed},1.2\n0,40,1.4\n0,0,2.2\n45,40,2.4\n90,20,3\n"
        );
        let error = hwall_texton::Calibration::from_csv(text.as_bytes()).unwrap_err();
        assert!(error.to_string().contains("speed"), "{error}");
    }
}
