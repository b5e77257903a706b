//! Where the board goes for what is foreseen: to the most probable point, or to where it is
//! expected to serve best.

use clap::ValueEnum;
use glam::DVec3;
use hwall_contact::{BoardChooser, BoardConfig, ContactError, ContactPrediction, SteadyPoint};
use hwall_haptics::Board;

/// A way to choose the board's place.
#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
pub enum Follow {
    /// The most probable point
    Likeliest,
    /// The place from which the board most probably gets under the hand in time, given its speed
    Expected,
}

/// The board stands still while its place stays within this, m: half its half width.
const STEADY_M: f64 = 0.05;

/// How soon a hand may touch that does not say when, s: about as long as a reach takes.
const UNKNOWN_S: f64 = 1.0;

/// Chooses the board's place, sample by sample.
pub struct BoardFollow {
    steady: SteadyPoint,
    chooser: Option<BoardChooser>,
}

impl BoardFollow {
    /// For a board.
    ///
    /// # Errors
    /// A board smaller than a fingertip.
    pub fn new(follow: Follow, board: &Board) -> Result<Self, ContactError> {
        let config = BoardConfig {
            half_extents_m: [board.half_width_m, board.half_height_m],
            ..BoardConfig::default()
        };
        let chooser = (follow == Follow::Expected).then(|| BoardChooser::new(config));
        Ok(Self {
            steady: SteadyPoint::new(STEADY_M)?,
            chooser: chooser.transpose()?,
        })
    }

    /// The prediction that the board serves, with the place to send it to as its point; `None`
    /// without predictions.
    pub fn step(
        &mut self,
        answers: &[ContactPrediction],
        board_m: DVec3,
    ) -> Option<ContactPrediction> {
        let likeliest = answers.first().copied()?;
        let chosen = self.chooser.as_ref().and_then(|chooser| {
            let choice = chooser.choose(answers, board_m, UNKNOWN_S)?;
            let served = answers.iter().find(|p| p.surface == choice.surface)?;
            Some(ContactPrediction {
                point_m: choice.point_m,
                normal: choice.normal,
                ..*served
            })
        });
        Some(self.steady.step(chosen.unwrap_or(likeliest)))
    }
}
