//! A room under a condition, and how its people were predicted.

use crate::rooms::contenders::{Contender, SharedTraining};
use crate::rooms::people::{self, Condition, StudyPeople, StudySize, Telling};
use crate::rooms::room::Room;
use crate::rooms::scores::TouchPredictions;
use anyhow::Context;
use hwall_stage::numbers::counted;
use hwall_stage::training::Stream;

/// One room under one condition, and the results in it.
pub struct Setting {
    /// Touchable surfaces.
    pub surfaces: usize,
    /// The room.
    pub room: Room,
    /// The condition.
    pub condition: Condition,
    /// Whose touches are predicted.
    pub participants: Vec<Stream>,
    /// What was learnt from others.
    pub training: SharedTraining,
    /// Are all contenders run, or only the main ones?
    all_contenders: bool,
    results: Vec<(String, Vec<TouchPredictions>)>,
}

/// A predictor and its predictions for every touch, in the same order for every predictor.
#[derive(Debug, Clone, Copy)]
pub struct PredictorResult<'a> {
    /// Name of the predictor.
    pub name: &'a str,
    /// The touches.
    pub touches: &'a [TouchPredictions],
}

impl Setting {
    /// With its people, and what is learnt from some of them.
    ///
    /// # Errors
    /// People who cannot be made, an estimator that cannot be trained.
    pub fn new(
        surfaces: usize,
        condition: Condition,
        size: &StudySize,
        all_contenders: bool,
    ) -> anyhow::Result<Self> {
        let name = || format!("{}, {}", counted_surfaces(surfaces), condition.name);
        let room = Room::new(surfaces)?;
        let StudyPeople {
            training,
            participants,
        } = people::people(&room, &condition, size).with_context(name)?;
        let training = SharedTraining::new(&room.scene, &training).with_context(name)?;
        Ok(Self {
            surfaces,
            room,
            condition,
            participants,
            training,
            all_contenders,
            results: Vec::new(),
        })
    }

    /// Runs the contenders over the participants.
    ///
    /// # Errors
    /// An estimator that cannot be trained, settings that a filter refuses.
    pub fn run(&mut self) -> anyhow::Result<()> {
        let contenders = match self.all_contenders {
            true => self.training.all()?,
            false => self.training.main()?,
        };
        let (room, streams) = (&self.room, &self.participants);
        for Contender {
            name,
            mut predictor,
        } in contenders
        {
            let predictor = predictor.as_mut();
            let touches = people::predictions(predictor, room, streams, Telling::Nothing)?;
            self.results.push((name, touches));
        }
        Ok(())
    }

    /// The predictions of a contender; none of one that was not run.
    pub fn touches(&self, name: &str) -> &[TouchPredictions] {
        let found = self.results.iter().find(|r| r.0 == name);
        found.map_or(&[], |r| &r.1)
    }

    /// Those of all contenders.
    pub fn results(&self) -> Vec<PredictorResult<'_>> {
        let results = self.results.iter();
        results
            .map(|(name, touches)| PredictorResult { name, touches })
            .collect()
    }

    /// Those of some.
    pub fn named<'a, const N: usize>(&'a self, names: [&'a str; N]) -> [PredictorResult<'a>; N] {
        names.map(|name| PredictorResult {
            name,
            touches: self.touches(name),
        })
    }

    /// Is nothing made worse?
    pub fn is_usual(&self) -> bool {
        self.condition == Condition::usual()
    }
}

/// `1 surface`, `3 surfaces`.
pub fn counted_surfaces(count: usize) -> String {
    counted(count, "surface", "surfaces")
}
