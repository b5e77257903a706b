//! Detects fixations and saccades in the samples of an eye tracker.

use super::gaze::Gaze;
use super::gaze_samples::{Recent, Sample, Sums, UnderWay, angle_rad};
use crate::error::HandError;
use crate::frame::GazeRay;
use crate::noise::MedianSize;
use hwall_numeric::check::{non_negative, positive};

/// Criteria for a fixation.
///
/// Sources: velocities below 100 degrees/s are fixations and above 300 saccades (identification by velocity threshold,
/// I-VT, \[Salvucci 2000\]); fixations last 0.2 to 0.35 s on average,
/// depending on the task, saccades 0.02 to 0.1 s (\[Rayner 2009\]).
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct GazeFilterConfig {
    /// A faster line of sight is a saccade, rad/s. Default 1.4 (80 degrees/s); raised if the measured tracker noise alone exceeds it.
    pub saccade_rad_per_s: f64,
    /// A smaller shift of the line of sight is ignored, rad: drift, tremor, small corrections. Default 0.02 (1.1 degrees).
    pub least_shift_rad: f64,
    /// Initial noise of one sample, standard deviation in each of two directions, rad. Default 0.0087 (0.5 degrees). Later it is measured.
    pub noise_rad: f64,
    /// Longest gap without samples within a fixation, s. Default 0.1.
    pub max_gap_s: f64,
}

impl Default for GazeFilterConfig {
    fn default() -> Self {
        Self {
            saccade_rad_per_s: 1.4,
            least_shift_rad: 0.02,
            noise_rad: 0.0087,
            max_gap_s: 0.1,
        }
    }
}

impl GazeFilterConfig {
    fn validate(&self) -> Result<(), HandError> {
        positive("saccade_rad_per_s", self.saccade_rad_per_s)?;
        positive("least_shift_rad", self.least_shift_rad)?;
        non_negative("noise_rad", self.noise_rad)?;
        positive("max_gap_s", self.max_gap_s)?;
        Ok(())
    }
}

/// Separates fixations from saccades and averages the line of sight over each fixation.
///
/// - A sample belongs to the fixation while its distance from the mean is within the measured tracker noise. A single outlier is ignored; two in a
///   row are a saccade. Smaller steps are detected by comparing the last five samples with those before.
/// - During a saccade there is no line of sight. The eye has landed when its samples agree over 0.02 s: about 30 ms after the true landing at 90
///   Hz.
/// - The line of sight is the mean over the whole fixation, from its first sample on, so its error falls with the square root of the number of
///   samples. It is a mean *line*, which head motion does not blur.
/// - Lost samples are bridged; after a blink the same fixation continues.
///
/// It does not allocate and never returns NaN.
#[derive(Debug, Clone, Copy)]
pub struct GazeFilter {
    config: GazeFilterConfig,
    /// Angles between successive directions, rad.
    noise: MedianSize,
    /// The newest samples in order of time, of the present fixation or saccade.
    recent: Recent,
    under_way: Option<UnderWay>,
    /// The last ended fixation.
    ended: Option<UnderWay>,
    /// Consecutive outliers of the fixation; they are the last ones of `recent`.
    strays: usize,
    flight_since_s: f64,
    /// The newest usable sample.
    seen: Option<Sample>,
    last: Option<(f64, Gaze)>,
}

/// The eye has landed once its samples agree over this time, s: three samples at 90 Hz, two at 30 Hz.
const SETTLE_S: f64 = 0.02;
/// A fixation that was interrupted and is found again at the same place within this time continues, s: a blink takes 0.1 to 0.4 s.
const RESUME_S: f64 = 0.4;
/// Median length of the difference of two directions, each with unit noise in two directions: √2 times the median √(2 ln 2) of a Rayleigh
/// distribution.
const MEDIAN_OF_DIFFERENCE: f64 = 1.665_109_222_315_395_4;
/// Samples closer together than this count once, s: in faster streams they repeat.
const LEAST_STEP_S: f64 = 0.004;
/// Newest samples of a fixation, which may still turn out to belong to the next one.
const WINDOW: usize = 5;
/// A sample beyond this many standard deviations of the noise is an outlier: 0.2 % of the samples of a fixation.
const OFF_SDS: f64 = 3.5;
/// Samples agree if they differ by less than this many standard deviations: the eye has landed.
const LANDED_SDS: f64 = 3.0;
/// A mean of five samples has shifted beyond this many of its standard deviations: strict, as it is tested at every sample.
const SHIFT_SDS: f64 = 4.5;
/// Number of consecutive outliers that make a saccade.
const STRAYS: usize = 2;
/// After a shorter fixation, the one before it may still continue, s.
const BRIEF_S: f64 = 0.06;

impl GazeFilter {
    /// A filter without samples.
    ///
    /// # Errors
    /// A setting that is not finite, or not positive where it must be.
    pub fn new(config: GazeFilterConfig) -> Result<Self, HandError> {
        config.validate()?;
        Ok(Self::unchecked(config))
    }

    fn unchecked(config: GazeFilterConfig) -> Self {
        Self {
            config,
            noise: MedianSize::new(config.noise_rad * MEDIAN_OF_DIFFERENCE),
            recent: Recent::default(),
            under_way: None,
            ended: None,
            strays: 0,
            flight_since_s: 0.0,
            seen: None,
            last: None,
        }
    }

    /// Takes the line of sight of the next sample, or `None` if the tracker has none. Call it in either case.
    ///
    /// Samples come in order of time. One that repeats the last time gets the same answer; an earlier one restarts the filter; one without a usable
    /// time is answered with [`Gaze::Lost`] and otherwise ignored. A ray with a NaN or without a direction counts as `None`.
    pub fn step(&mut self, t_s: f64, ray: Option<&GazeRay>) -> Gaze {
        if !t_s.is_finite() {
            return Gaze::Lost;
        }
        match self.last {
            Some((last_s, gaze)) if t_s == last_s => return gaze,
            Some((last_s, _)) if t_s < last_s => self.reset(),
            _ => {}
        }
        let sample = ray.and_then(|ray| Sample::new(t_s, ray));
        match (sample, self.seen) {
            // The stream is faster than its tracker.
            (Some(_), Some(seen)) if t_s - seen.t_s < LEAST_STEP_S => {}
            (Some(sample), _) => self.take(sample),
            (None, _) => self.miss(t_s),
        }
        let gaze = self.answer(t_s);
        self.last = Some((t_s, gaze));
        gaze
    }

    /// Forgets the samples and the measured noise, e.g. for another person or a clock reset; the settings stay.
    pub fn reset(&mut self) {
        *self = Self::unchecked(self.config);
    }

    /// Measured noise of single samples, standard deviation in each of two directions, rad.
    #[must_use]
    pub fn noise_rad(&self) -> f64 {
        self.noise.median() / MEDIAN_OF_DIFFERENCE
    }

    fn answer(&self, t_s: f64) -> Gaze {
        let Some(seen) = self.seen else {
            return Gaze::Lost;
        };
        if t_s - seen.t_s > self.config.max_gap_s {
            return Gaze::Lost;
        }
        match &self.under_way {
            Some(fixation) => fixation
                .published(&self.recent, self.strays, self.noise_rad())
                .map_or(Gaze::Lost, Gaze::Fixed),
            None => Gaze::InFlight {
                since_s: self.flight_since_s,
            },
        }
    }

    fn miss(&mut self, t_s: f64) {
        let gone = self
            .seen
            .is_none_or(|seen| t_s - seen.t_s > self.config.max_gap_s);
        if gone {
            self.end();
            self.recent.clear();
        }
    }

    fn take(&mut self, sample: Sample) {
        // Samples before a gap do not belong to those after it.
        self.miss(sample.t_s);
        if let Some(seen) = self.seen
            && sample.t_s - seen.t_s <= self.config.max_gap_s
        {
            self.noise.add(angle_rad(seen.direction, sample.direction));
        }
        if self.under_way.is_none() && self.recent.is_empty() {
            self.flight_since_s = sample.t_s;
        }
        self.seen = Some(sample);
        if self.under_way.is_some() {
            self.follow(sample);
        } else {
            self.recent.push(sample);
            self.land();
        }
    }

    /// Takes a sample during a fixation.
    fn follow(&mut self, sample: Sample) {
        let off_rad = (OFF_SDS * self.noise_rad()).max(self.config.least_shift_rad);
        let Some(fixation) = &mut self.under_way else {
            return;
        };
        let mean = fixation.mean(&self.recent, self.strays);
        let away_rad = mean.map_or(0.0, |mean| mean.away_rad(&sample));
        if away_rad > off_rad {
            if self.strays == 0 {
                self.flight_since_s = sample.t_s;
            }
            self.recent.push(sample);
            self.strays += 1;
            if self.strays >= STRAYS {
                let strays = self.strays;
                self.end();
                self.recent.keep_last(strays);
                self.land();
            }
            return;
        }
        // A single outlier was noise.
        self.recent.drop_last(self.strays);
        self.strays = 0;
        if self.recent.len() == WINDOW
            && let Some(old) = self.recent.pop_first()
        {
            fixation.take_in(&old);
        }
        self.recent.push(sample);
        fixation.until_s = sample.t_s;
        fixation.samples = fixation.samples.saturating_add(1);
        if self.shifted() {
            if let Some(fixation) = &mut self.under_way {
                fixation.until_s = fixation.sums.t_s;
            }
            self.end();
            self.under_way = Some(self.begun(self.recent.first_s()));
        }
    }

    /// Have the newest samples shifted from those before?
    fn shifted(&self) -> bool {
        let Some(fixation) = &self.under_way else {
            return false;
        };
        let (Some(before), Some(now)) = (fixation.sums.mean(), self.recent.mean()) else {
            return false;
        };
        let (n, m) = (fixation.sums.effective(), self.recent.len() as f64);
        if self.recent.len() < WINDOW || n < 4.0 {
            return false;
        }
        let sd_rad = self.noise_rad() * (1.0 / n + 1.0 / m).sqrt();
        let limit_rad = (SHIFT_SDS * sd_rad).max(self.config.least_shift_rad);
        before.away_rad(&now) > limit_rad
    }

    fn end(&mut self) {
        self.strays = 0;
        if let Some(mut fixation) = self.under_way.take() {
            let until_s = fixation.until_s;
            for sample in self.recent.iter().filter(|s| s.t_s <= until_s) {
                fixation.take_in(sample);
            }
            let brief = until_s - fixation.since_s < BRIEF_S;
            if !brief || self.ended.is_none() {
                self.ended = Some(fixation);
            }
        }
    }

    /// Begins a fixation if the newest samples agree.
    fn land(&mut self) {
        let Some(run) = self.recent.settled(SETTLE_S) else {
            return;
        };
        let (speed, noise_rad) = (self.config.saccade_rad_per_s, self.noise_rad());
        let limit_rad = |from: &Sample, to: &Sample| {
            let noise_rad = LANDED_SDS * noise_rad * std::f64::consts::SQRT_2;
            (speed * (to.t_s - from.t_s)).max(noise_rad)
        };
        let newest = &self.recent.as_slice()[self.recent.len() - run..];
        let agree = newest.iter().enumerate().all(|(i, to)| {
            let mut before = newest[..i].iter();
            before.all(|from| from.away_rad(to) <= limit_rad(from, to))
        });
        if !agree {
            return;
        }
        self.recent.keep_last(run);
        let since_s = self.recent.first_s();
        if run > 2 {
            // The first of them may still belong to the saccade.
            self.recent.pop_first();
        }
        let begun = self.begun(since_s);
        let resumed = self.resumed(since_s).map(|ended| UnderWay {
            until_s: begun.until_s,
            samples: ended.samples.saturating_add(begun.samples),
            ..ended
        });
        if resumed.is_some() {
            self.ended = None;
        }
        self.under_way = Some(resumed.unwrap_or(begun));
    }

    /// A fixation from the newest samples.
    fn begun(&self, since_s: f64) -> UnderWay {
        UnderWay {
            since_s,
            until_s: self.seen.map_or(since_s, |seen| seen.t_s),
            samples: self.recent.len() as u32,
            sums: Sums::default(),
        }
    }

    /// The ended fixation, if the eye is back at its place.
    fn resumed(&self, landed_s: f64) -> Option<UnderWay> {
        let ended = self.ended?;
        let (before, now) = (ended.sums.mean()?, self.recent.mean()?);
        let (n, m) = (ended.sums.effective(), self.recent.len() as f64);
        let sd_rad = self.noise_rad() * (1.0 / n + 1.0 / m).sqrt();
        let limit_rad = (OFF_SDS * sd_rad).max(self.config.least_shift_rad);
        let soon = landed_s - ended.until_s <= RESUME_S;
        let same = before.away_rad(&now) <= limit_rad;
        (soon && same).then_some(ended)
    }
}

impl Default for GazeFilter {
    /// A filter with the default settings.
    fn default() -> Self {
        Self::unchecked(GazeFilterConfig::default())
    }
}
