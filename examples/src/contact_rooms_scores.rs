//! How good predictions with a scene are: the right surface, how far off, how early, how sure.

use crate::contact_rooms::Touch;
use glam::DVec3;
use hwall_contact::ContactPrediction;
use hwall_testkit::{MarkdownTable, quantile};

/// Shares of the time of a reach at which predictions are judged.
pub const SHARES: [f64; 5] = [0.3, 0.5, 0.7, 0.8, 0.9];
/// Times before contact at which they are judged, s.
pub const BEFORE_S: [f64; 4] = [0.4, 0.2, 0.1, 0.05];
/// Half a board's edge, m.
const HALF_BOARD_M: f64 = 0.1;
/// A board this far before or behind the touched surface is not there, m.
const OFF_PLANE_M: f64 = 0.03;
/// A prediction is right within this, m.
const RIGHT_M: f64 = 0.05;

/// What was said at one sample.
#[derive(Debug, Clone, Copy)]
pub struct Heard {
    /// Time, s.
    pub t_s: f64,
    /// The most probable answer.
    pub first: Option<ContactPrediction>,
    /// How long it took, µs.
    pub took_us: f64,
}

/// What was said of one touch.
#[derive(Debug, Clone)]
pub struct Told {
    /// The touch.
    pub touch: Touch,
    /// Sample by sample.
    pub heard: Vec<Heard>,
}

/// A moment of a touch.
#[derive(Debug, Clone, Copy)]
pub enum Moment {
    /// After a share of its time.
    Share(f64),
    /// A time before contact, s.
    Before(f64),
}

impl Told {
    fn at(&self, moment: Moment) -> Option<&ContactPrediction> {
        let Touch {
            start_s, contact_s, ..
        } = self.touch;
        let t_s = match moment {
            Moment::Share(share) => start_s + share * (contact_s - start_s),
            Moment::Before(s) => contact_s - s,
        };
        let heard = self
            .heard
            .partition_point(|h| h.t_s <= t_s)
            .checked_sub(1)?;
        self.heard[heard].first.as_ref()
    }

    fn off_m(&self, answer: &ContactPrediction) -> DVec3 {
        answer.point_m - self.touch.target_m
    }

    fn missed(&self, answer: Option<&ContactPrediction>) -> bool {
        answer.is_none_or(|a| {
            let off_m = self.off_m(a);
            let off_plane_m = off_m.dot(self.touch.normal);
            let in_plane_m = off_m - self.touch.normal * off_plane_m;
            let up_m = in_plane_m.z;
            let across_m = (in_plane_m - DVec3::Z * up_m).length();
            off_plane_m.abs() > OFF_PLANE_M || up_m.abs().max(across_m) > HALF_BOARD_M
        })
    }

    /// Time before contact from which the answers stay right, s.
    #[must_use]
    pub fn lead_s(&self) -> f64 {
        let right = |h: &&Heard| {
            h.first.is_some_and(|a| {
                a.surface == self.touch.surface && self.off_m(&a).length() <= RIGHT_M
            })
        };
        let since = self.heard.iter().rev().take_while(right).last();
        since.map_or(0.0, |h| self.touch.contact_s - h.t_s)
    }
}

/// Averages over the touches at one moment.
#[derive(Debug, Clone, Copy)]
pub struct Summary {
    /// Share with the right surface.
    pub right: f64,
    /// Median distance of the point, m; of those about which something was said.
    pub median_m: f64,
    /// Share of the boards that are missed.
    pub missed: f64,
}

/// Over all touches at a moment.
#[must_use]
pub fn summary(told: &[Told], moment: Moment) -> Summary {
    let n = told.len().max(1) as f64;
    let count = |f: &dyn Fn(&Told) -> bool| told.iter().filter(|t| f(t)).count() as f64 / n;
    let mut off_m: Vec<f64> = told
        .iter()
        .filter_map(|t| t.at(moment).map(|a| t.off_m(a).length()))
        .collect();
    off_m.sort_by(f64::total_cmp);
    Summary {
        right: count(&|t| t.at(moment).is_some_and(|a| a.surface == t.touch.surface)),
        median_m: if off_m.is_empty() {
            f64::NAN
        } else {
            quantile(&off_m, 0.5)
        },
        missed: count(&|t| t.missed(t.at(moment))),
    }
}

/// Rows of the table of one room and condition; the first predictor is what leads are gained over.
pub fn rows(table: &mut MarkdownTable, place: &str, all: &[(String, Vec<Told>)]) {
    let Some((_, reference)) = all.first() else {
        return;
    };
    for (name, told) in all {
        let shares = SHARES.map(|s| summary(told, Moment::Share(s)));
        let list = |f: &dyn Fn(&Summary) -> f64| {
            shares
                .iter()
                .map(|s| format!("{:.0}", f(s)))
                .collect::<Vec<_>>()
                .join(" / ")
        };
        let quartiles = |mut values: Vec<f64>| {
            values.sort_by(f64::total_cmp);
            let q = |p| {
                if values.is_empty() {
                    f64::NAN
                } else {
                    1e3 * quantile(&values, p)
                }
            };
            format!("{:.0} ({:.0} to {:.0})", q(0.5), q(0.25), q(0.75))
        };
        let lead = quartiles(told.iter().map(Told::lead_s).collect());
        let gained = told
            .iter()
            .zip(reference)
            .map(|(t, r)| t.lead_s() - r.lead_s());
        let mut took: Vec<f64> = told
            .iter()
            .flat_map(|t| t.heard.iter().map(|h| h.took_us))
            .collect();
        took.sort_by(f64::total_cmp);
        let took = if took.is_empty() {
            f64::NAN
        } else {
            quantile(&took, 0.5)
        };
        table.row([
            place.to_owned(),
            name.clone(),
            told.len().to_string(),
            list(&|s| 100.0 * s.right),
            list(&|s| 1e3 * s.median_m),
            list(&|s| 100.0 * s.missed),
            lead,
            quartiles(gained.collect()),
            format!("{took:.1}"),
        ]);
    }
}

/// The table that [`rows`] fills.
#[must_use]
pub fn table() -> MarkdownTable {
    MarkdownTable::new([
        "room",
        "predictor",
        "touches",
        "right surface, %, at 30 / 50 / 70 / 80 / 90 %",
        "median error, mm",
        "board missed, %",
        "right for good before contact, ms (quartiles)",
        "gained over the ray cast, ms",
        "µs",
    ])
}

/// Times before contact: right surface and median error.
pub fn rows_before(table: &mut MarkdownTable, place: &str, all: &[(String, Vec<Told>)]) {
    for (name, told) in all {
        let at = BEFORE_S.map(|s| summary(told, Moment::Before(s)));
        let list = |f: &dyn Fn(&Summary) -> f64| {
            at.iter()
                .map(|s| format!("{:.0}", f(s)))
                .collect::<Vec<_>>()
                .join(" / ")
        };
        table.row([
            place.to_owned(),
            name.clone(),
            list(&|s| 100.0 * s.right),
            list(&|s| 1e3 * s.median_m),
        ]);
    }
}

/// How the stated probabilities of the first answers compare with how often they are right, by
/// tenths, and which share of the touches on the right surface lies in the 90 % region.
#[must_use]
pub fn reliability(told: &[Told]) -> (Vec<[f64; 3]>, f64) {
    let mut bins = vec![[0.0; 3]; 10];
    let (mut inside, mut regions) = (0.0, 0.0);
    for t in told {
        for answer in SHARES.iter().filter_map(|&s| t.at(Moment::Share(s))) {
            let right = answer.surface == t.touch.surface;
            let bin = &mut bins[((10.0 * answer.probability) as usize).min(9)];
            bin[0] += answer.probability;
            bin[1] += f64::from(u8::from(right));
            bin[2] += 1.0;
            if let Some(c) = answer.covariance_m2.filter(|_| right) {
                let (u, v) = answer.normal.any_orthonormal_pair();
                let [uu, uv, vv] = [u.dot(c * u), u.dot(c * v), v.dot(c * v)];
                let [a, b] = [u, v].map(|axis| t.off_m(answer).dot(axis));
                let squared = (vv * a * a - 2.0 * uv * a * b + uu * b * b) / (uu * vv - uv * uv);
                // 90 % of a normal distribution in two dimensions.
                inside += f64::from(u8::from(squared <= 2.0 * 10_f64.ln()));
                regions += 1.0;
            }
        }
    }
    let mean = |[stated, right, count]: [f64; 3]| [stated / count, right / count, count];
    let bins = bins.into_iter().filter(|b| b[2] > 0.0).map(mean).collect();
    (bins, inside / regions)
}
