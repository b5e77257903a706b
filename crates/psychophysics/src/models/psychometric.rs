//! Psychometric functions and the just noticeable difference, from comparisons of two stimuli.

use crate::error::{PsychophysicsError, Result};
use crate::tails::{chi2_tail, normal_cdf, normal_quantile};
use hwall_numeric::check::{finite, that};
use std::f64::consts::TAU;

/// Answers at one stimulus.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct PairAnswers {
    /// Size of the comparison stimulus, or its difference from the reference, in any unit.
    pub stimulus: f64,
    /// Number of "greater" answers.
    pub greater: u32,
    /// Number of comparisons.
    pub trials: u32,
}

/// Form of the psychometric function.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, serde::Serialize)]
#[serde(rename_all = "snake_case")]
#[non_exhaustive]
pub enum Sigmoid {
    /// `Φ((x − pse) / scale)`.
    #[default]
    CumulativeGaussian,
    /// `1 / (1 + exp(−(x − pse) / scale))`.
    Logistic,
}

/// A psychometric function fitted to answers.
#[derive(Debug, Clone, Copy, PartialEq, serde::Serialize)]
pub struct Psychometric {
    /// Form of the function.
    pub sigmoid: Sigmoid,
    /// Point of subjective equality: half of the answers are "greater". Unit of the stimulus.
    pub pse: f64,
    /// Standard error of `pse`.
    pub pse_se: f64,
    /// Scale of the sigmoid; for the Gaussian its standard deviation.
    pub scale: f64,
    /// Just noticeable difference: from the 50 % to the 75 % point.
    pub jnd: f64,
    /// Standard error of `jnd`.
    pub jnd_se: f64,
    /// Deviance from the answers.
    pub deviance: f64,
    /// Probability of a deviance at least as large if the function is right; `None` for two stimuli.
    pub deviance_p: Option<f64>,
}

impl Psychometric {
    /// Predicted share of "greater" answers at a stimulus.
    #[must_use]
    pub fn share(&self, stimulus: f64) -> f64 {
        self.sigmoid.at((stimulus - self.pse) / self.scale)
    }
}

impl Sigmoid {
    /// The function itself, from 0 to 1.
    pub(crate) fn at(self, z: f64) -> f64 {
        match self {
            Self::CumulativeGaussian => normal_cdf(z),
            Self::Logistic => 1.0 / (1.0 + (-z).exp()),
        }
    }

    fn slope(self, z: f64) -> f64 {
        match self {
            Self::CumulativeGaussian => (-0.5 * z * z).exp() / TAU.sqrt(),
            Self::Logistic => self.at(z) * self.at(-z),
        }
    }

    /// Argument at which three quarters are reached.
    fn three_quarters(self) -> f64 {
        match self {
            Self::CumulativeGaussian => normal_quantile(0.75),
            Self::Logistic => 3_f64.ln(),
        }
    }
}

/// Steps of Fisher's scoring, at most.
const MOST_STEPS: usize = 200;
/// Relative size of the last step of a fit: the target, and the largest value accepted if rounding of the sums
/// stops the fit earlier.
const BEST_STEP: f64 = 1e-13;
const LAST_STEP: f64 = 1e-8;

/// Fits a psychometric function by maximum likelihood; shares run from 0 to 1, without lapses.
///
/// Standard errors come from the expected information, by the delta method.
///
/// Source: Fisher's scoring of a binomial model with probit or logit link, McCullagh and Nelder 1989,
/// sec. 4.4; the 75 % point as just noticeable difference: Gescheider 1997, ch. 3.
///
/// # Errors
/// More "greater" than trials. No finite fit: fewer than two stimuli, answers that switch from all "less" to
/// all "greater", answers that do not rise with the stimulus. A fit that does not converge.
pub fn fit_psychometric(answers: &[PairAnswers], sigmoid: Sigmoid) -> Result<Psychometric> {
    for a in answers {
        finite("stimulus", a.stimulus)?;
        let holds = a.greater <= a.trials && a.trials > 0;
        that(
            holds,
            "answers \"greater\"",
            a.greater.into(),
            "at most the trials, which are at least 1",
        )?;
    }
    refuse_separated(answers)?;
    let n: f64 = answers.iter().map(|a| f64::from(a.trials)).sum();
    let weighted = |f: &dyn Fn(f64) -> f64| -> f64 {
        let parts = answers.iter().map(|a| f64::from(a.trials) * f(a.stimulus));
        parts.sum::<f64>() / n
    };
    // Standardised stimuli keep the information matrix well scaled.
    let mean = weighted(&|x| x);
    let sd = weighted(&|x| (x - mean).powi(2)).sqrt();
    let points: Vec<Point> = answers
        .iter()
        .map(|a| Point {
            x: (a.stimulus - mean) / sd,
            answers: *a,
        })
        .collect();
    let (line, information, best) = most_likely(&points, sigmoid)?;
    // A flat function gives a slope of rounding errors, of either sign.
    if line.slope <= 1e-9 {
        let why = "the answers do not rise with the stimulus";
        return Err(PsychophysicsError::NoFit { why });
    }
    let (a, b) = (line.offset, line.slope);
    let determinant = information.determinant();
    let aa = information.slope / determinant;
    let ab = -information.both / determinant;
    let bb = information.offset / determinant;
    // pse = −a / b and scale = 1 / b in standardised stimuli.
    let pse_variance = (aa + 2.0 * ab * (-a / b) + bb * (a / b).powi(2)) / (b * b);
    let scale = sd / b;
    let jnd = scale * sigmoid.three_quarters();
    let saturated: f64 = answers
        .iter()
        .map(|a| {
            let (k, n) = (f64::from(a.greater), f64::from(a.trials));
            let part = |k: f64| if k > 0.0 { k * (k / n).ln() } else { 0.0 };
            part(k) + part(n - k)
        })
        .sum();
    let deviance = (2.0 * (saturated - best)).max(0.0);
    Ok(Psychometric {
        sigmoid,
        pse: mean - sd * a / b,
        pse_se: sd * pse_variance.sqrt(),
        scale,
        jnd,
        jnd_se: jnd * bb.sqrt() / b,
        deviance,
        deviance_p: (answers.len() > 2).then(|| chi2_tail(deviance, answers.len() as f64 - 2.0)),
    })
}

/// The most likely line by Fisher's scoring, with its information and its log likelihood.
fn most_likely(points: &[Point], sigmoid: Sigmoid) -> Result<(Line, Information, f64)> {
    let mut line = Line {
        offset: 0.0,
        slope: 1.0,
    };
    let mut best = log_likelihood(points, sigmoid, line);
    let mut information = Information::default();
    let mut moved = f64::INFINITY;
    for _ in 0..MOST_STEPS {
        let mut score = [0.0; 2];
        information = Information::default();
        for Point { x, answers } in points {
            let z = line.at(*x);
            let (share, slope) = (sigmoid.at(z), sigmoid.slope(z));
            let variance = (share * sigmoid.at(-z)).max(f64::MIN_POSITIVE);
            let trials = f64::from(answers.trials);
            let pull = (f64::from(answers.greater) - trials * share) * slope / variance;
            score[0] += pull;
            score[1] += pull * x;
            information.add(trials * slope * slope / variance, *x);
        }
        let step = information.solve(score);
        if !step.iter().all(|s| s.is_finite()) {
            let why = "the likelihood is flat";
            return Err(PsychophysicsError::NoFit { why });
        }
        let mut share = 1.0;
        loop {
            let next = Line {
                offset: line.offset + share * step[0],
                slope: line.slope + share * step[1],
            };
            let value = log_likelihood(points, sigmoid, next);
            if value >= best || share < 1e-6 {
                (line, best) = (next, value.max(best));
                break;
            }
            share *= 0.5;
        }
        moved = step[0].abs().max(step[1].abs()) / (1.0 + line.slope.abs());
        if moved < BEST_STEP {
            break;
        }
    }
    if moved > LAST_STEP {
        let steps = MOST_STEPS;
        return Err(PsychophysicsError::NotConverged { steps });
    }
    Ok((line, information, best))
}

/// Answers at a standardised stimulus.
struct Point {
    x: f64,
    answers: PairAnswers,
}

/// Argument of the sigmoid over the standardised stimulus.
#[derive(Clone, Copy)]
struct Line {
    offset: f64,
    slope: f64,
}

impl Line {
    fn at(self, x: f64) -> f64 {
        self.offset + self.slope * x
    }
}

/// Expected information of offset and slope, a symmetric 2 x 2 matrix.
#[derive(Clone, Copy, Default)]
struct Information {
    offset: f64,
    both: f64,
    slope: f64,
}

impl Information {
    fn add(&mut self, weight: f64, x: f64) {
        self.offset += weight;
        self.both += weight * x;
        self.slope += weight * x * x;
    }

    fn determinant(self) -> f64 {
        self.offset * self.slope - self.both * self.both
    }

    fn solve(self, score: [f64; 2]) -> [f64; 2] {
        let determinant = self.determinant();
        [
            (self.slope * score[0] - self.both * score[1]) / determinant,
            (self.offset * score[1] - self.both * score[0]) / determinant,
        ]
    }
}

fn log_likelihood(points: &[Point], sigmoid: Sigmoid, line: Line) -> f64 {
    let ln = |z: f64| sigmoid.at(z).max(f64::MIN_POSITIVE).ln();
    let parts = points.iter().map(|Point { x, answers }| {
        let z = line.at(*x);
        let part = |count: u32, z: f64| {
            if count > 0 {
                f64::from(count) * ln(z)
            } else {
                0.0
            }
        };
        part(answers.greater, z) + part(answers.trials - answers.greater, -z)
    });
    parts.sum()
}

/// Refuses answers without overlap of "less" and "greater": an infinite slope would be most likely.
fn refuse_separated(answers: &[PairAnswers]) -> Result<()> {
    let ends = |kept: &dyn Fn(&PairAnswers) -> bool| {
        let stimuli = || answers.iter().filter(|a| kept(a)).map(|a| a.stimulus);
        (
            stimuli().fold(f64::INFINITY, f64::min),
            stimuli().fold(f64::NEG_INFINITY, f64::max),
        )
    };
    let all = ends(&|_| true);
    let greater = ends(&|a| a.greater > 0);
    let less = ends(&|a| a.greater < a.trials);
    let why = if all.0 >= all.1 {
        "fewer than two stimuli"
    } else if less.1 <= greater.0 || greater.1 <= less.0 {
        "\"less\" and \"greater\" do not overlap"
    } else {
        return Ok(());
    };
    Err(PsychophysicsError::NoFit { why })
}
