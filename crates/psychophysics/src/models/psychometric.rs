//! Just noticeable difference from answers to pairs: which of two is more?

use crate::PsychophysicsError;
use crate::error::check;
use crate::tails::{chi2_tail, normal_cdf, normal_quantile};
use std::f64::consts::TAU;

/// Answers at one stimulus.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct PairAnswers {
    /// Of the compared one, or its difference to the reference, in any unit.
    pub stimulus: f64,
    /// How often it was judged the greater one.
    pub greater: u32,
    /// How often it was judged.
    pub trials: u32,
}

/// Form of the psychometric function.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, serde::Serialize)]
#[serde(rename_all = "snake_case")]
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
    /// Its form.
    pub sigmoid: Sigmoid,
    /// Point of subjective equality: half of the answers are "greater". Unit of the stimulus.
    pub pse: f64,
    /// Its standard error.
    pub pse_se: f64,
    /// Scale of the sigmoid; for the Gaussian its standard deviation.
    pub scale: f64,
    /// Just noticeable difference: from half to three quarters of the answers.
    pub jnd: f64,
    /// Its standard error.
    pub jnd_se: f64,
    /// Deviance from the answers.
    pub deviance: f64,
    /// Probability of a deviance as large if the function is right; `None` for two stimuli.
    pub deviance_p: Option<f64>,
}

impl Psychometric {
    /// Share of "greater" at a stimulus.
    #[must_use]
    pub fn share(&self, stimulus: f64) -> f64 {
        self.sigmoid.at((stimulus - self.pse) / self.scale)
    }
}

impl Sigmoid {
    fn at(self, z: f64) -> f64 {
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

    /// Where three quarters are reached.
    fn three_quarters(self) -> f64 {
        match self {
            Self::CumulativeGaussian => normal_quantile(0.75),
            Self::Logistic => 3_f64.ln(),
        }
    }
}

/// Steps of Fisher's scoring, at most.
const MOST_STEPS: usize = 200;
/// Last step of a fit, relative: as far as the sums go at best, and what is still an answer where
/// their rounding ends it before.
const BEST_STEP: f64 = 1e-13;
const LAST_STEP: f64 = 1e-8;

/// Fits a psychometric function by maximum likelihood; answers run from 0 to 1, with no lapses.
///
/// Standard errors come from the expected information, by the delta method.
///
/// Source: Fisher's scoring of a binomial model with probit or logit link, McCullagh and Nelder 1989,
/// sec. 4.4; the 75 % point as just noticeable difference: Gescheider 1997, ch. 3.
///
/// # Errors
/// More "greater" than trials; and where no finite fit exists: fewer than two stimuli, answers that change
/// from all "less" to all "greater" at once, answers that do not rise with the stimulus. A fit that
/// does not converge.
pub fn fit_psychometric(
    answers: &[PairAnswers],
    sigmoid: Sigmoid,
) -> Result<Psychometric, PsychophysicsError> {
    for a in answers {
        check("stimulus", a.stimulus, true, "a finite number")?;
        let holds = a.greater <= a.trials && a.trials > 0;
        check(
            "answers \"greater\"",
            a.greater.into(),
            holds,
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
    let points: Vec<(f64, PairAnswers)> = answers
        .iter()
        .map(|a| ((a.stimulus - mean) / sd, *a))
        .collect();
    let mut line = [0.0, 1.0];
    let mut best = log_likelihood(&points, sigmoid, line);
    let mut information = [0.0; 3];
    let mut moved = f64::INFINITY;
    for _ in 0..MOST_STEPS {
        let mut score = [0.0; 2];
        information = [0.0; 3];
        for (x, a) in &points {
            let z = line[0] + line[1] * x;
            let (share, slope) = (sigmoid.at(z), sigmoid.slope(z));
            let variance = (share * sigmoid.at(-z)).max(f64::MIN_POSITIVE);
            let trials = f64::from(a.trials);
            let pull = (f64::from(a.greater) - trials * share) * slope / variance;
            let weight = trials * slope * slope / variance;
            score[0] += pull;
            score[1] += pull * x;
            information[0] += weight;
            information[1] += weight * x;
            information[2] += weight * x * x;
        }
        let [i00, i01, i11] = information;
        let determinant = i00 * i11 - i01 * i01;
        let step = [
            (i11 * score[0] - i01 * score[1]) / determinant,
            (i00 * score[1] - i01 * score[0]) / determinant,
        ];
        if !step.iter().all(|s| s.is_finite()) {
            let why = "the likelihood is flat";
            return Err(PsychophysicsError::NoFit { why });
        }
        let mut share = 1.0;
        loop {
            let next = [line[0] + share * step[0], line[1] + share * step[1]];
            let value = log_likelihood(&points, sigmoid, next);
            if value >= best || share < 1e-6 {
                (line, best) = (next, value.max(best));
                break;
            }
            share *= 0.5;
        }
        moved = step[0].abs().max(step[1].abs()) / (1.0 + line[1].abs());
        if moved < BEST_STEP {
            break;
        }
    }
    if moved > LAST_STEP {
        let steps = MOST_STEPS;
        return Err(PsychophysicsError::NotConverged { steps });
    }
    // A flat function is found with a slope of rounding, either way.
    if line[1] <= 1e-9 {
        let why = "the answers do not rise with the stimulus";
        return Err(PsychophysicsError::NoFit { why });
    }
    Ok(describe(
        answers,
        sigmoid,
        [mean, sd],
        line,
        information,
        best,
    ))
}

fn describe(
    answers: &[PairAnswers],
    sigmoid: Sigmoid,
    [mean, sd]: [f64; 2],
    [a, b]: [f64; 2],
    [i00, i01, i11]: [f64; 3],
    log_likelihood: f64,
) -> Psychometric {
    let determinant = i00 * i11 - i01 * i01;
    let (aa, ab, bb) = (i11 / determinant, -i01 / determinant, i00 / determinant);
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
    let deviance = (2.0 * (saturated - log_likelihood)).max(0.0);
    Psychometric {
        sigmoid,
        pse: mean - sd * a / b,
        pse_se: sd * pse_variance.sqrt(),
        scale,
        jnd,
        jnd_se: jnd * bb.sqrt() / b,
        deviance,
        deviance_p: (answers.len() > 2).then(|| chi2_tail(deviance, answers.len() as f64 - 2.0)),
    }
}

fn log_likelihood(points: &[(f64, PairAnswers)], sigmoid: Sigmoid, [a, b]: [f64; 2]) -> f64 {
    let ln = |z: f64| sigmoid.at(z).max(f64::MIN_POSITIVE).ln();
    let parts = points.iter().map(|(x, answers)| {
        let z = a + b * x;
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

/// Without overlap of "less" and "greater" the steepest function is the most likely one.
fn refuse_separated(answers: &[PairAnswers]) -> Result<(), PsychophysicsError> {
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
