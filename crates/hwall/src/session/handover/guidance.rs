//! What the tracker's side sends to the control side.

use crate::fingertip::Fingertip;
use crate::response::Task;
use crate::session::response::Answer;
use glam::DVec3;
use hwall_hand::{Bystanders, HandFrame, MOST_BYSTANDERS};
use hwall_haptics::{BoardTarget, PostureTarget};
use hwall_kinematics::JointPositions;
use hwall_scene::SurfaceId;

/// Where the board should go and what it represents there, as of one frame of the tracker.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub(in crate::session) struct Guidance {
    /// In the base frame, stamped on the clock of the arm; `None`: no touch is predicted.
    pub(in crate::session) target: Option<BoardTarget>,
    /// The surface that the board represents.
    pub(in crate::session) surface: Option<SurfaceId>,
    /// Roughness of that surface in the scene.
    pub(in crate::session) roughness: Option<f64>,
    /// The hand, while it is tracked.
    pub(in crate::session) fingertip: Option<Fingertip>,
    /// The palm, while it is tracked, base frame, m.
    pub(in crate::session) palm_m: Option<DVec3>,
    /// The head, while it is tracked, base frame, m.
    pub(in crate::session) head_m: Option<DVec3>,
    /// The elbow, while it is tracked, base frame, m.
    pub(in crate::session) elbow_m: Option<DVec3>,
    /// The palm of the other hand, while it is tracked, base frame, m.
    pub(in crate::session) other_hand_m: Option<DVec3>,
    /// The heads of people who stand by, by their places, base frame, m, and when each was last seen, on the clock of the arm, s. NaN: there, but never
    /// seen.
    pub(in crate::session) bystanders: [Option<(DVec3, f64)>; MOST_BYSTANDERS],
    /// When hands, elbow and head were seen, on the clock of the arm, s.
    pub(in crate::session) seen_s: f64,
    /// Waiting posture for this person; used while there is no target.
    pub(in crate::session) waits: Option<PostureTarget>,
    /// The configuration that answers the hand, from a predictor that gives joints. The arm goes there regardless of the target's place,
    /// which is then only the position of the face at these joints.
    pub(in crate::session) answer: Option<Answer>,
    /// What the hand is about to do.
    pub(in crate::session) gesture: Option<Task>,
    /// When the hand is expected at the surface, on the clock of the arm, s.
    pub(in crate::session) contact_s: Option<f64>,
    /// How many times the virtual world has moved.
    pub(in crate::session) world_moves: u64,
    /// How many people were tracked before this one.
    pub(in crate::session) people_before: u64,
}

/// Length of the encoding.
pub(super) const WORDS: usize = BYSTANDERS_AT + 4 * MOST_BYSTANDERS;
/// Where the bystanders begin.
const BYSTANDERS_AT: usize = 72;

/// One bit for each value that may be absent.
const TARGET: u64 = 1;
const ROLL: u64 = 2;
const SURFACE: u64 = 4;
const ROUGHNESS: u64 = 8;
const FINGERTIP: u64 = 16;
const CONTACT: u64 = 32;
const NEAR: u64 = 64;
const PALM: u64 = 128;
const WAITS: u64 = 256;
const PREPOSITIONS: u64 = 512;
const HEAD: u64 = 1024;
const ANSWERS: u64 = 2048;
const ELBOW: u64 = 4096;
const OTHER_HAND: u64 = 8192;
/// Of the first one; the others follow.
const BYSTANDER: u64 = 16384;
/// Of the first task; the others follow.
const GESTURE: u64 = 1 << 32;

impl Guidance {
    /// Who stands by after another frame, at `arm_s` on the clock of the arm. Only an empty list says that somebody has left: whom a list leaves out, or
    /// does not see, stays where last seen.
    pub(in crate::session) fn bystanders_after(
        &self,
        frame: &HandFrame,
        arm_s: f64,
    ) -> [Option<(DVec3, f64)>; MOST_BYSTANDERS] {
        let Some(heads_m) = frame.bystanders.as_ref().map(Bystanders::heads_m) else {
            return self.bystanders;
        };
        if heads_m.len() == 0 {
            return [None; _];
        }
        let mut all = self.bystanders;
        for (known, head_m) in all.iter_mut().zip(heads_m) {
            let never_seen = || known.unwrap_or((DVec3::NAN, arm_s));
            *known = Some(head_m.map_or_else(never_seen, |head_m| (head_m, arm_s)));
        }
        all
    }

    /// As words, for the hand-over between threads.
    pub(super) fn to_words(self) -> [u64; WORDS] {
        let mut words = [0; WORDS];
        let mut present = 0;
        let mut put = |at: usize, bit: u64, values: &[f64]| {
            present |= bit;
            for (word, value) in words[at..].iter_mut().zip(values) {
                *word = value.to_bits();
            }
        };
        if let Some(target) = self.target {
            put(2, TARGET, &target.point_m.to_array());
            put(5, TARGET, &target.normal.to_array());
            put(8, TARGET, &[target.stamp_s]);
            if let Some(roll_rad) = target.roll_rad {
                put(9, ROLL, &[roll_rad]);
            }
            put(19, TARGET, &[target.behind_m]);
            put(20, TARGET, &target.slack_m);
            if let Some(near) = &target.near {
                put(22, NEAR, &near.0);
            }
        }
        if let Some(roughness) = self.roughness {
            put(10, ROUGHNESS, &[roughness]);
        }
        if let Some(fingertip) = self.fingertip {
            put(11, FINGERTIP, &fingertip.point_m.to_array());
            put(14, FINGERTIP, &fingertip.velocity_m_per_s.to_array());
        }
        if let Some(palm_m) = self.palm_m {
            put(29, PALM, &palm_m.to_array());
        }
        if let Some(head_m) = self.head_m {
            put(41, HEAD, &head_m.to_array());
        }
        if let Some(elbow_m) = self.elbow_m {
            put(66, ELBOW, &elbow_m.to_array());
        }
        if let Some(other_hand_m) = self.other_hand_m {
            put(69, OTHER_HAND, &other_hand_m.to_array());
        }
        for (place, bystander) in self.bystanders.iter().enumerate() {
            if let Some((DVec3 { x, y, z }, seen_s)) = *bystander {
                put(
                    BYSTANDERS_AT + 4 * place,
                    BYSTANDER << place,
                    &[x, y, z, seen_s],
                );
            }
        }
        put(40, 0, &[self.seen_s]);
        if let Some(waits) = &self.waits {
            put(32, WAITS, &[waits.stamp_s]);
            put(51, WAITS, &waits.q.0);
            if let Some(prepositions_to) = &waits.prepositions_to {
                put(33, PREPOSITIONS, &prepositions_to.0);
            }
        }
        if let Some(answer) = &self.answer {
            put(44, ANSWERS, &answer.at.0);
            put(58, ANSWERS, &answer.short.0);
        }
        if let Some(contact_s) = self.contact_s {
            put(17, CONTACT, &[contact_s]);
        }
        if let Some(surface) = self.surface {
            put(18, SURFACE, &[]);
            words[18] = surface.0 as u64;
        }
        words[0] = present | self.gesture.map_or(0, |task| GESTURE << task as u64);
        words[1] = self.world_moves;
        words[65] = self.people_before;
        words
    }

    /// Back from [`Guidance::to_words`].
    pub(super) fn from_words(words: &[u64; WORDS]) -> Self {
        let number = |at: usize| f64::from_bits(words[at]);
        let vector = |at: usize| DVec3::new(number(at), number(at + 1), number(at + 2));
        let joints = |at: usize| JointPositions(std::array::from_fn(|i| number(at + i)));
        let has = |bit: u64| words[0] & bit != 0;
        Self {
            target: has(TARGET).then(|| BoardTarget {
                point_m: vector(2),
                normal: vector(5),
                stamp_s: number(8),
                roll_rad: has(ROLL).then(|| number(9)),
                behind_m: number(19),
                slack_m: [number(20), number(21)],
                near: has(NEAR).then(|| joints(22)),
                // Set by the control half, which knows how late the board is.
                sooner_within_m: None,
            }),
            surface: has(SURFACE).then(|| SurfaceId(words[18] as usize)),
            roughness: has(ROUGHNESS).then(|| number(10)),
            fingertip: has(FINGERTIP).then(|| Fingertip {
                point_m: vector(11),
                velocity_m_per_s: vector(14),
            }),
            palm_m: has(PALM).then(|| vector(29)),
            head_m: has(HEAD).then(|| vector(41)),
            elbow_m: has(ELBOW).then(|| vector(66)),
            other_hand_m: has(OTHER_HAND).then(|| vector(69)),
            bystanders: std::array::from_fn(|place| {
                let at = BYSTANDERS_AT + 4 * place;
                has(BYSTANDER << place).then(|| (vector(at), number(at + 3)))
            }),
            seen_s: number(40),
            waits: has(WAITS).then(|| PostureTarget {
                q: joints(51),
                prepositions_to: has(PREPOSITIONS).then(|| joints(33)),
                stamp_s: number(32),
            }),
            answer: has(ANSWERS).then(|| Answer {
                at: joints(44),
                short: joints(58),
            }),
            gesture: Task::ALL
                .into_iter()
                .find(|task| has(GESTURE << *task as u64)),
            contact_s: has(CONTACT).then(|| number(17)),
            world_moves: words[1],
            people_before: words[65],
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn words_and_back_are_the_same_with_and_without_every_part() {
        let full = Guidance {
            target: Some(BoardTarget {
                point_m: DVec3::new(0.6, -0.1, 0.5),
                normal: DVec3::X,
                stamp_s: 12.5,
                roll_rad: Some(-0.3),
                behind_m: 0.06,
                slack_m: [0.02, 0.03],
                near: Some(JointPositions([0.1, 0.2, 0.3, 0.4, 0.5, 0.6, 0.7])),
                sooner_within_m: None,
            }),
            surface: Some(SurfaceId(7)),
            roughness: Some(0.4),
            fingertip: Some(Fingertip {
                point_m: DVec3::new(0.7, 0.0, 0.5),
                velocity_m_per_s: DVec3::NEG_X,
            }),
            palm_m: Some(DVec3::new(0.8, 0.0, 0.5)),
            head_m: Some(DVec3::new(1.2, 0.1, 0.9)),
            elbow_m: Some(DVec3::new(0.9, 0.2, 0.6)),
            other_hand_m: Some(DVec3::new(0.8, 0.5, 0.4)),
            bystanders: [1.0, 2.0, 3.0, 4.0].map(|y| Some((DVec3::Y * y, 12.0 + y))),
            seen_s: 12.4,
            waits: Some(PostureTarget {
                q: JointPositions([0.2, 0.3, 0.4, 0.5, 0.6, 0.7, 0.8]),
                prepositions_to: Some(JointPositions([0.7, 0.6, 0.5, 0.4, 0.3, 0.2, 0.1])),
                stamp_s: 12.0,
            }),
            answer: Some(Answer {
                at: JointPositions([0.5, 0.4, 0.3, 0.2, 0.1, 0.0, -0.1]),
                short: JointPositions([0.6, 0.4, 0.3, 0.2, 0.1, 0.0, -0.2]),
            }),
            gesture: Some(Task::Stroke),
            contact_s: Some(13.0),
            world_moves: 3,
            people_before: 2,
        };
        let changes: [fn(&mut Guidance); 19] = [
            |_| {},
            |g| *g = Guidance::default(),
            |g| g.target = None,
            |g| g.target.iter_mut().for_each(|t| t.roll_rad = None),
            |g| g.target.iter_mut().for_each(|t| t.near = None),
            |g| g.surface = None,
            |g| g.roughness = None,
            |g| g.fingertip = None,
            |g| g.palm_m = None,
            |g| g.head_m = None,
            |g| g.elbow_m = None,
            |g| g.other_hand_m = None,
            |g| g.bystanders[0] = None,
            |g| g.bystanders[3] = None,
            |g| g.waits = None,
            |g| g.waits.iter_mut().for_each(|w| w.prepositions_to = None),
            |g| g.answer = None,
            |g| g.gesture = None,
            |g| g.contact_s = None,
        ];
        for change in changes {
            let mut guidance = full;
            change(&mut guidance);
            assert_eq!(Guidance::from_words(&guidance.to_words()), guidance);
        }
    }
}
