//! Levels for virtual textures: one to one, in order, evenly spread; and discriminable levels.

use crate::common::bumps::level;
use glam::{DVec2, dvec2};
use hwall_testkit::Sampler;
use hwall_texton::{
    Encoding, Level, LevelTable, RoughnessMap, SurfaceRoughness, TextonError, discriminable,
};

fn levels(magnitudes: &[f64]) -> Vec<Level> {
    magnitudes.iter().map(|m| level(90.0, 10.0, *m)).collect()
}

fn magnitudes(encoding: &Encoding) -> Vec<f64> {
    encoding.levels().iter().map(|l| l.magnitude).collect()
}

#[test]
fn the_order_of_roughness_is_that_of_the_levels() {
    let encoding = Encoding::new(&[0.9, 0.1, 0.5], &levels(&[5.0, 1.0, 3.2, 3.0, 4.9])).unwrap();
    assert_eq!(magnitudes(&encoding), [1.0, 3.0, 5.0]);
    let of = |i| encoding.level(i).unwrap().magnitude;
    assert_eq!([of(0), of(1), of(2)], [5.0, 1.0, 3.0]);
    assert_eq!(encoding.level(3), None);
    for (roughness, magnitude) in [(-9.0, 1.0), (0.2, 1.0), (0.3, 1.0), (0.31, 3.0), (9.0, 5.0)] {
        let level = encoding.level_for(roughness).unwrap();
        assert_eq!(level.magnitude, magnitude, "{roughness}");
    }
    assert_eq!(encoding.level_for(f64::NAN), None);
    assert_eq!(encoding.least_step(), Some(2.0));
}

#[test]
fn no_other_choice_is_more_even() {
    let mut s = Sampler::new(7);
    for _ in 0..200 {
        let m = 2 + s.index(9);
        let n = 2 + s.index(m - 1);
        let mut all: Vec<f64> = (0..m).map(|_| s.uniform(0.0, 1.0)).collect();
        let encoding = Encoding::new(&vec![0.0; n], &levels(&all)).unwrap();
        all.sort_by(f64::total_cmp);
        let step = (all[m - 1] - all[0]) / (n - 1) as f64;
        let cost = |chosen: &[f64]| -> f64 {
            chosen
                .windows(2)
                .map(|w| (w[1] - w[0] - step).powi(2))
                .sum()
        };
        let best = (0..1_u32 << m)
            .filter(|set| set.count_ones() as usize == n)
            .map(|set| {
                let chosen = (0..m).filter(|i| set >> i & 1 == 1).map(|i| all[i]);
                cost(&chosen.collect::<Vec<_>>())
            })
            .fold(f64::INFINITY, f64::min);
        assert!((cost(&magnitudes(&encoding)) - best).abs() < 1e-12);
    }
}

#[test]
fn single_equal_and_too_many() {
    let three = levels(&[1.0, 2.0, 4.0]);
    let one = Encoding::new(&[7.0], &three).unwrap();
    assert_eq!(magnitudes(&one), [2.0]);
    assert_eq!(one.least_step(), None);
    assert_eq!(one.level_for(-1e300), one.level(0));
    // Equally rough textures still get different levels, in the order given.
    let equal = Encoding::new(&[0.5; 3], &three).unwrap();
    let got: Vec<f64> = (0..3).map(|i| equal.level(i).unwrap().magnitude).collect();
    assert_eq!(got, [1.0, 2.0, 4.0]);
    let alike = Encoding::new(&[0.2, 0.1], &levels(&[3.0; 4])).unwrap();
    assert_eq!(magnitudes(&alike), [3.0; 2]);
    let few = |wanted, levels| Err(TextonError::TooFewLevels { wanted, levels });
    assert_eq!(Encoding::new(&[1.0; 4], &three), few(4, 3));
    assert_eq!(Encoding::new(&[], &three), few(0, 3));
    assert!(Encoding::new(&[f64::NAN], &three).is_err());
    assert!(Encoding::new(&[1.0], &levels(&[f64::INFINITY])).is_err());
    assert!(LevelTable::new(vec![]).is_err());
}

#[test]
fn the_nearest_level() {
    let table = LevelTable::new(levels(&[4.0, 1.0, 2.0])).unwrap();
    for (wanted, got) in [
        (-1.0, 1.0),
        (1.5, 1.0),
        (1.6, 2.0),
        (3.1, 4.0),
        (f64::INFINITY, 4.0),
    ] {
        assert_eq!(table.nearest(wanted).unwrap().magnitude, got, "{wanted}");
    }
    assert_eq!(table.nearest(f64::NAN), None);
    let mut s = Sampler::new(8);
    let many: Vec<f64> = (0..100).map(|_| s.normal()).collect();
    let table = LevelTable::new(levels(&many)).unwrap();
    for _ in 0..1000 {
        let wanted = s.normal();
        let off = |m: &f64| (m - wanted).abs();
        let best = many.iter().map(off).fold(f64::INFINITY, f64::min);
        assert!((off(&table.nearest(wanted).unwrap().magnitude) - best).abs() < 1e-12);
    }
}

#[test]
fn the_largest_set_that_differs_pairwise() {
    // Nine planted levels among 25 as in the published study's conditions, others differing at random.
    let mut s = Sampler::new(9);
    for _ in 0..20 {
        let magnitudes: Vec<f64> = (0..25).map(|_| s.uniform(1.0, 5.0)).collect();
        let mut places: Vec<usize> = (0..25).collect();
        for i in (1..25).rev() {
            places.swap(i, s.index(i + 1));
        }
        let planted = &places[..9];
        let mut pairs = Vec::new();
        for a in 0..25 {
            for b in 0..a {
                let both = planted.contains(&a) && planted.contains(&b);
                if both || s.uniform(0.0, 1.0) < 0.4 {
                    pairs.push([a, b]);
                }
            }
        }
        let found = discriminable(&magnitudes, &pairs).unwrap();
        assert!(found.len() >= 9);
        assert!(found.is_sorted_by_key(|level| magnitudes[*level]));
        for (i, a) in found.iter().enumerate() {
            for b in &found[..i] {
                assert!(pairs.contains(&[*a, *b]) || pairs.contains(&[*b, *a]));
            }
        }
    }
    assert_eq!(discriminable(&[], &[]).unwrap(), [0; 0]);
    // Nothing differs: any one level.
    assert_eq!(discriminable(&[1.0; 5], &[]).unwrap().len(), 1);
    // A just noticeable difference of 1 on a scale from 0 to 127 / 8: every eighth.
    let scale: Vec<f64> = (0..128).map(|i| f64::from(i) / 8.0).collect();
    let apart = |[a, b]: &[usize; 2]| scale[*a] - scale[*b] >= 1.0;
    let pairs: Vec<_> = (0..128)
        .flat_map(|a| (0..a).map(move |b| [a, b]))
        .filter(apart)
        .collect();
    assert_eq!(discriminable(&scale, &pairs).unwrap().len(), 16);
    assert!(discriminable(&[1.0; 129], &[]).is_err());
    let bad = |pair| Err(TextonError::BadPair { pair, levels: 2 });
    assert_eq!(discriminable(&[1.0; 2], &[[0, 2]]), bad([0, 2]));
    assert_eq!(discriminable(&[1.0; 2], &[[1, 1]]), bad([1, 1]));
    assert!(discriminable(&[f64::NAN], &[]).is_err());
}

#[test]
fn a_roughness_map_is_bilinear_between_the_middles_of_pixels() {
    // Top row 1 2, bottom row 3 5.
    let map = RoughnessMap::new(2, 2, vec![1.0, 2.0, 3.0, 5.0]).unwrap();
    for (uv, value) in [
        ([0.25, 0.75], 1.0),
        ([0.75, 0.75], 2.0),
        ([0.25, 0.25], 3.0),
        ([0.5, 0.5], 2.75),
        ([0.5, 0.25], 4.0),
        ([0.0, 1.0], 1.0),
        ([9.0, -9.0], 5.0),
        ([1e300, 0.0], 5.0),
    ] {
        assert_eq!(map.at(DVec2::from(uv)), Some(value), "{uv:?}");
    }
    assert_eq!(map.at(dvec2(f64::NAN, 0.5)), None);
    let single = RoughnessMap::new(1, 1, vec![0.4]).unwrap();
    assert_eq!(single.at(dvec2(0.3, 0.9)), Some(f64::from(0.4_f32)));
    let uniform = SurfaceRoughness::Uniform(0.7);
    assert_eq!(uniform.at(dvec2(0.1, 0.1)), Some(0.7));
    for surface in [uniform, SurfaceRoughness::Map(single)] {
        for bad in [f64::NAN, f64::INFINITY, f64::NEG_INFINITY] {
            assert_eq!(surface.at(dvec2(bad, 0.0)), None);
            assert_eq!(surface.at(dvec2(0.1, bad)), None);
        }
    }
    for (width, height, values) in [(0, 0, 0), (2, 2, 3), (usize::MAX, 2, 1)] {
        let map = RoughnessMap::new(width, height, vec![1.0; values]);
        assert!(matches!(map, Err(TextonError::MapSize { .. })), "{map:?}");
    }
    assert!(RoughnessMap::new(1, 1, vec![f32::NAN]).is_err());
}
