//! The search for textures and levels.

use super::candidate::{DesignCandidate, DesignLevel, LevelPath};
use super::given_up::GivenUp;
use super::limits::ProcessLimits;
use super::request::{Compression, DesignRequest, RoughnessSource, Wanted};
use super::response::{BeyondRange, Grid, Response};
use super::solve::{Found, Scope};
use crate::error::{Result, TextonError};
use crate::geometry::{Layout, Radii, ScanAngle, Texton, Texture};

/// Short radii to try in addition to the printer's smallest, mm; near those of the published patches.
const RADII_MM: [f64; 3] = [0.75, 1.0, 1.5];
/// Long radius by short radius; 3 in the released patch.
const ASPECTS: [f64; 3] = [1.5, 2.0, 3.0];
/// Gaps to try, as multiples of the printer's smallest.
const GAPS: [f64; 3] = [1.0, 2.0, 4.0];
/// Heights to try, mm; 0.7 in the published patches.
const HEIGHTS_MM: [f64; 3] = [0.7, 0.4, 1.0];
/// Largest pitch to try, mm: a finger does not span more.
const MOST_PITCH_MM: f64 = 15.0;
/// Gap, short radius and height of the released patch, mm.
const RELEASED_MM: [f64; 3] = [0.2, 1.0, 0.7];
/// Relative tolerance at the ends of a range.
const ROUNDING: f64 = 1e-12;

/// Finds textures and levels that present the wanted roughnesses, the best first.
///
/// Candidates are hemiellipsoids on rectangular grids that the printer can make (with a table: the patch of its study).
/// Their levels vary the speed, the angle or both. Ratios are placed in the middle of the range a texture can present,
/// on a logarithmic scale. Ranking: most levels within the model's range; then the least
/// [`DesignCandidate::worst_error_jnd`], rounded to a tenth; then the strongest magnitudes; then the least variation.
/// The best candidate for speed alone, angle alone and both are included if `most_candidates` allows it.
///
/// Error: the levels have the reported magnitudes within 1e-9, relative.
///
/// # Errors
/// An argument outside its range. Not printable: a table's patch with smaller gaps or bumps than the printer makes.
/// [`TextonError::RatioTooWide`] and [`TextonError::MagnitudeOutOfReach`] state the nearest possible value.
pub fn design(request: &DesignRequest<'_>) -> Result<Vec<DesignCandidate>> {
    request.validate()?;
    let textures = textures(request)?;
    let mut nearest = Nearest::default();
    let mut candidates = candidates_at(1.0, request, &textures, &mut nearest);
    if candidates.is_empty() {
        candidates = narrowed(request, &textures, nearest)?;
    }
    candidates.sort_by(|a, b| {
        let beyond = |c: &DesignCandidate| {
            let levels = c.given_up.iter().map(|g| match g {
                GivenUp::ModelRange { levels, .. } => *levels,
                _ => 0,
            });
            levels.sum::<usize>()
        };
        let tenths = |c: &DesignCandidate| (10.0 * c.worst_error_jnd).round();
        let strength = |c: &DesignCandidate| -> f64 {
            let ln = c.levels.iter().map(|level| level.magnitude.ln());
            ln.sum::<f64>() / c.levels.len() as f64
        };
        beyond(a)
            .cmp(&beyond(b))
            .then_with(|| tenths(a).total_cmp(&tenths(b)))
            .then_with(|| strength(b).total_cmp(&strength(a)))
            .then_with(|| a.path.cmp(&b.path))
    });
    Ok(chosen(candidates, request.most_candidates))
}

/// The best `most` candidates, including the best of every path if there is room; always the best of all.
fn chosen(candidates: Vec<DesignCandidate>, most: usize) -> Vec<DesignCandidate> {
    let paths = [LevelPath::Speed, LevelPath::Angle, LevelPath::Both];
    let first = paths.map(|path| candidates.iter().position(|c| c.path == path));
    let mut firsts: Vec<usize> = first.into_iter().flatten().collect();
    firsts.sort_unstable();
    firsts.truncate(most);
    let others = (0..candidates.len()).filter(|place| !firsts.contains(place));
    let others: Vec<usize> = others.take(most - firsts.len()).collect();
    let kept = candidates.into_iter().enumerate();
    let kept = kept.filter(|(place, _)| firsts.contains(place) || others.contains(place));
    kept.map(|(_, c)| c).collect()
}

/// Candidates with all ratios compressed by one power so that they fit, if that is allowed; otherwise the error.
fn narrowed(
    request: &DesignRequest<'_>,
    textures: &[Texture],
    nearest: Nearest,
) -> Result<Vec<DesignCandidate>> {
    let refusal = nearest.refusal(request);
    let wanted = ratio(request.wanted.levels());
    // Ratios are never widened: if they fit but have no levels, the predictions have gaps.
    let allowed = request.compression == Compression::Allow
        && matches!(request.wanted, Wanted::Ratios(_))
        && nearest.ratio > 1.0
        && nearest.ratio < wanted;
    if !allowed {
        return Err(refusal);
    }
    let power = nearest.ratio.ln() / wanted.ln();
    let candidates = candidates_at(power, request, textures, &mut Nearest::default());
    if candidates.is_empty() {
        return Err(refusal);
    }
    Ok(candidates)
}

/// Candidates for each texture and scope that has all levels, with ratios raised to `power`.
fn candidates_at(
    power: f64,
    request: &DesignRequest<'_>,
    textures: &[Texture],
    nearest: &mut Nearest,
) -> Vec<DesignCandidate> {
    let asked = ratio(request.wanted.levels()).powf(power);
    let mut candidates = Vec::new();
    for texture in textures {
        let response = &Response::of(request, *texture);
        let grid = &Grid::of(response, &request.device);
        for scope in grid.scopes(asked) {
            let job = Job {
                request,
                texture,
                response,
                grid,
                scope,
            };
            if let Some(targets) = job.targets(power, nearest) {
                candidates.extend(job.candidate(&targets, power));
            }
        }
    }
    candidates
}

/// The nearest possible values of an impossible request.
#[derive(Debug, Clone, Copy, Default)]
struct Nearest {
    /// Largest ratio of magnitudes.
    ratio: f64,
    /// For the design that misses by least: wanted magnitude, nearest possible magnitude, and logarithm of their ratio.
    miss: Option<(f64, f64, f64)>,
}

impl Nearest {
    fn refusal(self, request: &DesignRequest<'_>) -> TextonError {
        match (&request.wanted, self.miss) {
            (Wanted::Magnitudes(_), Some((wanted, nearest, _))) => {
                TextonError::MagnitudeOutOfReach { wanted, nearest }
            }
            (Wanted::Magnitudes(levels), None) => TextonError::NoSuchLevels {
                asked: levels.len(),
            },
            (Wanted::Ratios(levels), _) if ratio(levels) <= self.ratio => {
                TextonError::NoSuchLevels {
                    asked: levels.len(),
                }
            }
            (Wanted::Ratios(levels), _) => TextonError::RatioTooWide {
                wanted: ratio(levels),
                nearest: self.ratio,
            },
        }
    }
}

fn ratio(levels: &[f64]) -> f64 {
    let [low, high] = ends(levels);
    high / low
}

fn ends(levels: &[f64]) -> [f64; 2] {
    let low = levels.iter().copied().fold(f64::INFINITY, f64::min);
    [low, levels.iter().copied().fold(0.0, f64::max)]
}

/// One texture, and the part of the grid in which its levels may lie.
struct Job<'a> {
    request: &'a DesignRequest<'a>,
    texture: &'a Texture,
    response: &'a Response<'a>,
    grid: &'a Grid,
    scope: Scope,
}

impl Job<'_> {
    /// The magnitude of each level; `None` if they do not fit into what the texture can present.
    fn targets(&self, power: f64, nearest: &mut Nearest) -> Option<Vec<f64>> {
        let whole = self.grid.range(self.scope, false)?;
        let wanted = self.request.wanted.levels();
        let clamped = |target: f64| target.clamp(whole[0], whole[1]);
        if let Wanted::Magnitudes(_) = self.request.wanted {
            let miss = |w: &f64| (*w, clamped(*w), (*w / clamped(*w)).ln().abs());
            let worst = wanted.iter().map(miss);
            let worst = worst.max_by(|a, b| a.2.total_cmp(&b.2))?;
            if worst.2 > ROUNDING {
                if nearest.miss.is_none_or(|least| worst.2 < least.2) {
                    nearest.miss = Some(worst);
                }
                return None;
            }
            return Some(wanted.iter().map(|w| clamped(*w)).collect());
        }
        let [low, high] = ends(wanted);
        let asked = (high / low).ln() * power;
        nearest.ratio = nearest.ratio.max(whole[1] / whole[0]);
        let within = self.grid.range(self.scope, true);
        let fits = |[low, high]: &[f64; 2]| asked <= (high / low).ln() + ROUNDING;
        let range = within.filter(fits).or(Some(whole).filter(fits))?;
        let middle = 0.5 * (range[0].ln() + range[1].ln());
        let own = 0.5 * (low.ln() + high.ln());
        let target = |w: &f64| clamped((middle + power * (w.ln() - own)).exp());
        Some(wanted.iter().map(target).collect())
    }

    fn candidate(&self, targets: &[f64], power: f64) -> Option<DesignCandidate> {
        let solve = |target: &f64| self.grid.solve(self.response, self.scope, *target);
        let found: Vec<Found> = targets.iter().map(solve).collect::<Option<_>>()?;
        let wanted = self.request.wanted.levels();
        let breadth = self.breadth_errors(&found)?;
        let levels = wanted.iter().zip(&found).zip(&breadth);
        let levels: Vec<DesignLevel> = levels
            .map(|((wanted, found), breadth)| self.level(*wanted, found, *breadth))
            .collect::<Option<_>>()?;
        let worst = levels.iter().map(|l| l.error_jnd);
        let worst_error_jnd = worst.fold(0.0, f64::max);
        let mut order: Vec<&DesignLevel> = levels.iter().collect();
        order.sort_by(|a, b| a.magnitude.total_cmp(&b.magnitude));
        let step = |pair: &[&DesignLevel]| {
            let jnd = self
                .request
                .steps_between(pair[0].magnitude, pair[1].magnitude);
            ([pair[0].wanted, pair[1].wanted], jnd)
        };
        let closest = order.windows(2).map(step);
        let closest = closest.min_by(|a, b| a.1.total_cmp(&b.1));
        let mut given_up = self.given_up(&found, power);
        if let Some((pair, jnd)) = closest {
            if jnd < 1.0 {
                given_up.push(GivenUp::Step { pair, jnd });
            } else if worst_error_jnd > 0.5 * jnd {
                given_up.push(GivenUp::Accuracy {
                    error_jnd: worst_error_jnd,
                    step_jnd: jnd,
                });
            }
        }
        Some(DesignCandidate {
            texture: *self.texture,
            path: if levels.len() == 1 {
                LevelPath::Speed
            } else {
                self.scope.path()
            },
            levels,
            least_step_jnd: closest.map(|c| c.1),
            worst_error_jnd,
            given_up,
        })
    }

    /// For each level, the absolute logarithm of the change of magnitude for the largest breadth error; the larger of the two
    /// signs. For ratios, the change common to all levels is removed. `None` if neither sign has a prediction, because an
    /// unknown error must not count as zero.
    fn breadth_errors(&self, found: &[Found]) -> Option<Vec<f64>> {
        let half_mm = 0.5 * self.request.printer.tolerance_mm;
        let none = vec![0.0; found.len()];
        if matches!(self.request.source, RoughnessSource::Table { .. }) || half_mm == 0.0 {
            return Some(none);
        }
        let Radii { long_mm, short_mm } = self.texture.texton().radii();
        let height_mm = self.texture.texton().height_mm();
        let mut worst: Option<Vec<f64>> = None;
        for by_mm in [-half_mm, half_mm] {
            let radii = Radii {
                long_mm: long_mm + by_mm,
                short_mm: short_mm + by_mm,
            };
            let texture = Texton::hemiellipsoid(radii, height_mm)
                .and_then(|texton| Texture::new(texton, *self.texture.layout()));
            let Ok(texture) = texture else {
                continue;
            };
            let response = Response::of(self.request, texture);
            let changes = found.iter().map(|at| {
                let now = response.at(at.deg, at.speed_mm_per_s)?;
                Some((now.magnitude / at.felt.magnitude).ln())
            });
            let Some(changes) = changes.collect::<Option<Vec<f64>>>() else {
                continue;
            };
            let shared = match self.request.wanted {
                Wanted::Ratios(_) => changes.iter().sum::<f64>() / changes.len() as f64,
                Wanted::Magnitudes(_) => 0.0,
            };
            let worst = worst.get_or_insert_with(|| none.clone());
            for (worst, change) in worst.iter_mut().zip(&changes) {
                *worst = f64::max(*worst, (change - shared).abs());
            }
        }
        worst
    }

    fn level(&self, wanted: f64, found: &Found, breadth: f64) -> Option<DesignLevel> {
        let device = &self.request.device;
        let magnitude = found.felt.magnitude;
        let ln = |deg: f64, speed: f64| {
            let felt = self.response.at(deg, speed)?;
            Some((felt.magnitude / magnitude).ln())
        };
        let (deg, speed) = (found.deg, found.speed_mm_per_s);
        // The larger change of the two sides; a side without a prediction is ignored.
        let largest = |a: Option<f64>, b: Option<f64>| {
            let size = |x: Option<f64>| x.map_or(0.0, f64::abs);
            size(a).max(size(b))
        };
        let off_deg = device.angle_error_deg;
        let by_angle = largest(
            ln((deg - off_deg).max(0.0), speed),
            ln((deg + off_deg).min(90.0), speed),
        );
        let off = device.speed_error;
        let by_speed = largest(ln(deg, speed * (1.0 - off)), ln(deg, speed * (1.0 + off)));
        let jnd_ln = self.request.weber_fraction.ln_1p();
        let error = by_angle.hypot(by_speed).hypot(breadth);
        // Change per degree and per mm/s: the larger side of a small step.
        let per_deg = largest(
            ln((deg - 0.5).max(0.0), speed),
            ln((deg + 0.5).min(90.0), speed),
        ) / 0.5;
        let step = 0.01 * speed.max(1.0);
        let per_mm_per_s = largest(ln(deg, (speed - step).max(0.0)), ln(deg, speed + step)) / step;
        let needed = |per: f64, most: f64| Some(jnd_ln / per).filter(|change| *change <= most);
        Some(DesignLevel {
            wanted,
            scan: ScanAngle::from_deg(deg).ok()?,
            speed_mm_per_s: speed,
            magnitude,
            jnd: self.request.weber_fraction * magnitude,
            jnd_deg: needed(per_deg, 90.0),
            jnd_mm_per_s: needed(per_mm_per_s, 1e4),
            error_jnd: error / jnd_ln,
        })
    }

    fn given_up(&self, found: &[Found], power: f64) -> Vec<GivenUp> {
        let mut given_up = Vec::new();
        if power < 1.0 {
            let wanted = ratio(self.request.wanted.levels());
            given_up.push(GivenUp::Ratio {
                wanted,
                given: wanted.powf(power),
            });
        }
        let beyond: Vec<BeyondRange> = found.iter().filter_map(|f| f.felt.beyond).collect();
        let out = |b: &&BeyondRange| (b.range[0] - b.at).max(b.at - b.range[1]);
        if let Some(worst) = beyond.iter().max_by(|a, b| out(a).total_cmp(&out(b))) {
            given_up.push(GivenUp::ModelRange {
                levels: beyond.len(),
                what: worst.what,
                at: worst.at,
                range: worst.range,
            });
        }
        if let RoughnessSource::Model { scale, .. } = &self.request.source {
            given_up.extend(published_patch(&self.request.printer));
            if scale.ln_sd.is_none() {
                given_up.push(GivenUp::ScaleAssumed);
            }
        }
        if matches!(self.request.wanted, Wanted::Ratios(_)) {
            given_up.push(GivenUp::Magnitude);
        }
        given_up
    }
}

/// `None` if the released patch can be printed; otherwise the printer's requirement.
fn published_patch(printer: &ProcessLimits) -> Option<GivenUp> {
    let needs = [
        printer.least_gap_mm,
        printer.least_radius_mm,
        printer.least_height_mm,
    ];
    let short = RELEASED_MM
        .into_iter()
        .zip(needs)
        .find(|(is, needs)| is < needs);
    short.map(|(is_mm, needs_mm)| GivenUp::PublishedPatch { is_mm, needs_mm })
}

/// The textures to try: the patch of the table's study, or without a table all textures that the printer can make.
fn textures(request: &DesignRequest<'_>) -> Result<Vec<Texture>> {
    let printer = &request.printer;
    if let RoughnessSource::Table { texture, .. } = &request.source {
        let [_, short_mm] = texture.texton().radii().to_array();
        for (what, is_mm, needs_mm) in [
            ("gap", texture.gap_mm(), printer.least_gap_mm),
            ("short radius", short_mm, printer.least_radius_mm),
            (
                "height",
                texture.texton().height_mm(),
                printer.least_height_mm,
            ),
        ] {
            // The computed gap may be too small by rounding.
            if is_mm < needs_mm * (1.0 - 1e-9) {
                return Err(TextonError::NotPrintable {
                    what,
                    is_mm,
                    needs_mm,
                });
            }
        }
        return Ok(vec![*texture]);
    }
    let mut radii_mm = vec![printer.least_radius_mm];
    radii_mm.extend(
        RADII_MM
            .into_iter()
            .filter(|r| *r > printer.least_radius_mm),
    );
    let mut heights_mm: Vec<f64> = HEIGHTS_MM
        .into_iter()
        .filter(|h| *h >= printer.least_height_mm)
        .collect();
    if heights_mm.is_empty() {
        heights_mm.push(printer.least_height_mm);
    }
    if matches!(request.wanted, Wanted::Ratios(_)) {
        // Ratios do not depend on the height.
        heights_mm.truncate(1);
    }
    let mut textures = Vec::new();
    if published_patch(printer).is_none() {
        textures.push(Texture::released());
    }
    for short_mm in radii_mm {
        for aspect in ASPECTS {
            for gap in GAPS {
                let gap_mm = gap * printer.least_gap_mm;
                let long_mm = aspect * short_mm;
                let pitch_mm = [2.0 * long_mm + gap_mm, 2.0 * short_mm + gap_mm];
                if pitch_mm[0] > MOST_PITCH_MM {
                    continue;
                }
                for height_mm in &heights_mm {
                    let texton = Texton::hemiellipsoid(Radii { long_mm, short_mm }, *height_mm)?;
                    let layout = Layout::Rectangular {
                        long_mm: pitch_mm[0],
                        short_mm: pitch_mm[1],
                    };
                    textures.push(Texture::new(texton, layout)?);
                }
            }
        }
    }
    if textures.is_empty() {
        let needs_mm = 2.0 * printer.least_radius_mm + printer.least_gap_mm;
        return Err(TextonError::NotPrintable {
            what: "largest pitch",
            is_mm: MOST_PITCH_MM,
            needs_mm,
        });
    }
    Ok(textures)
}
