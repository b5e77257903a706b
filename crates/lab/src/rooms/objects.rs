//! Predicts which of several objects a hand will touch, and what it will feel like: errors before contact.

use super::contenders::{SharedTraining, ray_cast};
use super::people::{self, Condition, StudyPeople, StudySize};
use super::room::Room;
use super::study::FIRST_SEED;
use glam::DVec3;
use hwall::{SceneObject, objects_of};
use hwall_contact::score::{Moment, Span};
use hwall_contact::{ContactPrediction, Predictor};
use hwall_scene::{Scene, SurfaceId};
use hwall_stage::training::{Stream, SurfaceTouch};
use hwall_testkit::{Column, MarkdownTable, percent_of, table_of};
use std::array::from_fn;

/// Evaluated times before contact, s.
const BEFORE_S: [f64; 5] = [0.5, 0.3, 0.2, 0.1, 0.0];
/// Largest force of a finger, N: objects that need more do not move, and count as this.
const MOST_N: f64 = 40.0;
/// Largest stiffness, N/m: that of a fingertip; stiffer objects count as this.
const HARD_N_PER_M: f64 = 2000.0;
/// Names for the table of the quantities in [`Feel`].
const FEELS: [&str; 4] = [
    "roughness",
    "gives way, 1/kg",
    "starts at, N",
    "spring, N/mm",
];
/// Methods of prediction.
const TOLD_BY: [&str; 4] = [
    "nothing: mean of all touches",
    "ray cast, likeliest",
    "fused, likeliest",
    "fused, mean by probability",
];

/// Roughness; inverse of the mass at the place; force that starts the motion, N; spring, N/mm.
type Feel = [f64; FEELS.len()];

/// What a finger feels at a place of a surface.
fn feel(scene: &Scene, objects: &[SceneObject], surface: SurfaceId, point_m: DVec3) -> Feel {
    let fixed = scene.surface(surface);
    let roughness = fixed.roughness.unwrap_or(0.0);
    let found = objects.iter().find(|object| object.surface == surface);
    let [gives, starts_n, spring_n_per_m] = match found {
        None => [
            0.0,
            MOST_N,
            fixed.contact_stiffness_n_per_m.unwrap_or(HARD_N_PER_M),
        ],
        Some(SceneObject { config, path, .. }) => {
            // Travel of the place per unit of the object's.
            let lever = path.velocity_at(point_m, 1.0).linear_m_per_s.length();
            let square = lever * lever;
            [
                square / config.inertia,
                config.friction / lever,
                config.stiffness / square,
            ]
        }
    };
    [
        roughness,
        gives,
        starts_n.min(MOST_N),
        1e-3 * spring_n_per_m.min(HARD_N_PER_M),
    ]
}

/// A prediction of a touch at a moment.
#[derive(Debug, Clone, Copy)]
struct Told {
    t_s: f64,
    /// Whether the likeliest object is the right one, and the probability of the right one.
    is_right: bool,
    of_right: f64,
    /// The feel at the likeliest place, and the mean over all places weighted by probability; `None` without a prediction.
    likeliest: Option<Feel>,
    mean: Option<Feel>,
}

impl Told {
    fn of(
        t_s: f64,
        touched: SurfaceId,
        ranked: &[ContactPrediction],
        feel: impl Fn(&ContactPrediction) -> Feel,
    ) -> Self {
        let right = ranked.iter().filter(|p| p.surface == touched);
        let weighed = ranked
            .iter()
            .map(|p| feel(p).map(|value| p.probability * value));
        Self {
            t_s,
            is_right: ranked.first().is_some_and(|p| p.surface == touched),
            of_right: right.map(|p| p.probability).sum(),
            likeliest: ranked.first().map(&feel),
            mean: weighed.reduce(|a, b| from_fn(|k| a[k] + b[k])),
        }
    }
}

/// A touch, and its predictions over time by the ray cast and by the fusion.
struct Judged {
    touch: SurfaceTouch,
    felt: Feel,
    told: [Vec<Told>; 2],
}

/// People and touches of the study, in [`report`] and in the dissertation's page.
pub(crate) const SIZE: StudySize = StudySize {
    training_people: 12,
    participants: 10,
    touches: 12,
    seed: 0,
};

/// The study as Markdown, for people on whom no model was designed.
///
/// # Errors
/// As [`Objects::new`].
pub fn report(seed: u64) -> anyhow::Result<String> {
    Ok(Objects::of_seed(seed)?.table().to_string())
}

/// The study in the room with different objects.
pub struct Objects {
    judged: Vec<Judged>,
}

impl Objects {
    /// The study of a seed, for people on whom no model was designed.
    ///
    /// # Errors
    /// As [`Objects::new`].
    pub fn of_seed(seed: u64) -> anyhow::Result<Self> {
        Self::new(&StudySize {
            seed: FIRST_SEED + seed,
            ..SIZE
        })
    }

    /// Trains on some simulated people, and follows others.
    ///
    /// # Errors
    /// People who cannot be generated, an estimator that cannot be trained.
    pub fn new(size: &StudySize) -> anyhow::Result<Self> {
        let room = Room::of_objects()?;
        let StudyPeople {
            training,
            participants,
        } = people::people(&room, &Condition::nominal(), size)?;
        let shared = SharedTraining::new(&training)?;
        let objects = objects_of(&room.scene)?;
        let feel = |surface, point_m| feel(&room.scene, &objects, surface, point_m);
        let touches = || {
            participants
                .iter()
                .flat_map(|stream: &Stream| &stream.touches)
        };
        let told = |predictor: &mut dyn Predictor| -> anyhow::Result<Vec<Vec<Told>>> {
            let touched: Vec<SurfaceId> = touches().map(|touch| touch.surface).collect();
            let mut told = vec![Vec::new(); touched.len()];
            people::follow(predictor, &room, &participants, |n, t_s, ranked, _| {
                let of = |p: &ContactPrediction| feel(p.surface, p.point_m);
                told[n].push(Told::of(t_s, touched[n], ranked, of));
            })?;
            Ok(told)
        };
        let [cast, fused] = [
            told(&mut ray_cast()?)?,
            told(&mut shared.fused(&shared.config)?)?,
        ];
        let both = touches().zip(cast.into_iter().zip(fused));
        let judged = both.map(|(&touch, (cast, fused))| Judged {
            touch,
            felt: feel(touch.surface, touch.target_m),
            told: [cast, fused],
        });
        Ok(Self {
            judged: judged.collect(),
        })
    }

    /// Touches that were followed.
    pub fn touches(&self) -> usize {
        self.judged.len()
    }

    /// The expectation without a prediction.
    fn nominal(&self) -> Feel {
        let count = self.judged.len() as f64;
        from_fn(|k| self.judged.iter().map(|one| one.felt[k]).sum::<f64>() / count)
    }

    /// True feel and prediction of each touch at a moment; touches that begin later are left out.
    fn at(&self, before_s: f64, told_by: usize) -> Vec<(Feel, Told)> {
        let nominal = Told {
            t_s: 0.0,
            is_right: false,
            of_right: 0.0,
            likeliest: None,
            mean: None,
        };
        let at = |one: &Judged| {
            let told = match told_by {
                0 | 1 => &one.told[0],
                _ => &one.told[1],
            };
            let SurfaceTouch {
                start_s, contact_s, ..
            } = one.touch;
            let span = Span { start_s, contact_s };
            let index = Moment::Before(before_s).index(told.iter().map(|t| t.t_s), span)?;
            Some((one.felt, if told_by == 0 { nominal } else { told[index] }))
        };
        self.judged.iter().filter_map(at).collect()
    }

    /// Mean error of each quantity over the touches.
    fn errors(&self, told_by: usize, at: &[(Feel, Told)]) -> Feel {
        let nominal = self.nominal();
        let off = |k: usize, (felt, told): &(Feel, Told)| {
            let told = match told_by {
                3 => told.mean,
                _ => told.likeliest,
            };
            (told.unwrap_or(nominal)[k] - felt[k]).abs()
        };
        let count = at.len() as f64;
        from_fn(|k| at.iter().map(|one| off(k, one)).sum::<f64>() / count)
    }

    /// Share of right objects, and mean error of the predicted feel, before contact.
    pub fn table(&self) -> MarkdownTable {
        let rows = BEFORE_S.iter().flat_map(|before_s| {
            (0..TOLD_BY.len()).map(move |told_by| {
                let at = self.at(*before_s, told_by);
                (before_s, told_by, self.errors(told_by, &at), at)
            })
        });
        type Row<'a> = (&'a f64, usize, Feel, Vec<(Feel, Told)>);
        let error = |k: usize| move |row: &Row<'_>| format!("{:.3}", row.2[k]);
        let errors: [_; FEELS.len()] = from_fn(error);
        let first: [Column<'_, Row<'_>>; 5] = [
            ("before contact, s", &|row| format!("{:.1}", row.0)),
            ("told by", &|row| TOLD_BY[row.1].to_owned()),
            ("touches", &|row| row.3.len().to_string()),
            ("right object, %", &|row| match row.1 {
                0 => String::new(),
                _ => {
                    let right = row.3.iter().filter(|(_, told)| told.is_right);
                    percent_of(right.count(), row.3.len(), 1, "none")
                }
            }),
            ("its probability, mean", &|row| match row.1 {
                0 => String::new(),
                _ => {
                    let all: f64 = row.3.iter().map(|(_, told)| told.of_right).sum();
                    format!("{:.3}", all / row.3.len() as f64)
                }
            }),
        ];
        let mut columns = first.to_vec();
        for (name, cell) in FEELS.iter().zip(&errors) {
            columns.push((name, cell));
        }
        table_of(rows, &columns)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_place_feels_like_its_mechanism() {
        let Room { scene, .. } = Room::of_objects().unwrap();
        let objects = objects_of(&scene).unwrap();
        let at = |name: &str, point_m| feel(&scene, &objects, scene.find(name).unwrap(), point_m);
        let wall = at("wall", DVec3::new(0.4, 0.0, 0.8));
        assert_eq!(wall, [0.8, 0.0, MOST_N, 1e-3 * HARD_N_PER_M]);
        // Places closer to the hinge feel heavier.
        let [far, near] = [0.2, 0.4].map(|y| at("door", DVec3::new(0.4, y, 0.8)));
        assert!((far[1] / near[1] - 4.0).abs() < 1e-9 && (near[2] / far[2] - 2.0).abs() < 1e-9);
        let heavy = at("side", DVec3::new(0.8, -0.5, 0.8));
        assert!((heavy[1] - 0.16 / 5.0).abs() < 1e-9 && (heavy[2] - 10.0).abs() < 1e-9);
        assert!((heavy[3] - 1e-3 * 10.0 / 0.16).abs() < 1e-9);
        assert_eq!(at("key3", DVec3::new(0.5, 0.1, 0.8))[3], 0.6);
    }

    #[test]
    fn what_is_told_counts_by_its_probability() {
        let place = |surface, probability| ContactPrediction {
            probability,
            ..ContactPrediction::of_place(SurfaceId(surface), DVec3::ZERO, DVec3::X)
        };
        let ranked = [place(2, 0.75), place(1, 0.25)];
        let told = Told::of(0.0, SurfaceId(1), &ranked, |p| [p.surface.0 as f64; 4]);
        assert_eq!((told.is_right, told.of_right), (false, 0.25));
        assert_eq!(
            (told.likeliest, told.mean),
            (Some([2.0; 4]), Some([1.75; 4]))
        );
        let nothing = Told::of(0.0, SurfaceId(1), &[], |_| [0.0; 4]);
        assert_eq!((nothing.is_right, nothing.mean), (false, None));
    }

    #[test]
    fn a_prediction_tells_more_than_nothing_and_more_the_later() {
        let size = StudySize {
            participants: 3,
            ..StudySize::default()
        };
        let objects = Objects::new(&size).unwrap();
        assert!(objects.touches() > 25);
        let error = |before_s, told_by| objects.errors(told_by, &objects.at(before_s, told_by));
        let (nothing, early, late) = (error(0.3, 0), error(0.3, 2), error(0.0, 2));
        for k in 0..FEELS.len() {
            assert!(early[k] < 0.5 * nothing[k], "{}", FEELS[k]);
            assert!(late[k] <= early[k], "{}", FEELS[k]);
        }
    }
}
