//! Arms by name or URDF file, for the command line.

use super::counted::Counted;
use super::numbers::{counted, list};
use crate::board_body::{BOARD_KG, board_body};
use crate::console::note;
use anyhow::{Context, bail};
use glam::DVec3;
use hwall::geometry::Pose;
use hwall::haptics::{Board, QUARTER_TURNS_RAD, board_pose};
use hwall::scene::Scene;
use hwall::{LikelyTouches, Walls, WallsConfig};
use hwall_kinematics::{
    ArmKinematics, BranchPolicy, Chain, ChainArm, EstimatedAccelerations, JointPositions,
    KinematicsError, MOST_JOINTS, NearestConfig, SrsArm, Unreachable, Verdict,
};
use std::f64::consts::PI;
use std::path::Path;
use std::sync::Arc;

/// Start posture of the dissertation's arm, degrees: board upright, facing the person.
pub const START_DEG: [f64; 7] = [0.0, 30.0, 0.0, -90.0, 0.0, -30.0, 90.0];

/// Which arm, as flags.
#[derive(Debug, Clone, PartialEq, Eq, clap::Args)]
pub struct NamedArm {
    /// iiwa7, iiwa14, or PATH.urdf of an arm with at most seven joints
    #[arg(long = "arm", value_name = "ARM", default_value = "iiwa7")]
    pub name: String,
    /// Last link of an arm from a URDF file [default: tool0, a flange, or where its only chain of moving joints ends]
    #[arg(long, value_name = "LINK")]
    pub tip: Option<String>,
    /// First link of an arm from a URDF file, whose frame is that of the base [default: the root of the file]
    #[arg(long, value_name = "LINK")]
    pub root: Option<String>,
}

impl From<&str> for NamedArm {
    fn from(name: &str) -> Self {
        Self {
            name: name.to_owned(),
            tip: None,
            root: None,
        }
    }
}

impl NamedArm {
    pub(crate) fn is_file(&self) -> bool {
        self.name.to_ascii_lowercase().ends_with(".urdf")
    }

    fn check_ends(&self) -> anyhow::Result<()> {
        let are_named = self.tip.is_some() || self.root.is_some();
        if are_named && !self.is_file() {
            bail!(
                "--tip and --root need a URDF file; --arm {} is not one",
                self.name
            );
        }
        Ok(())
    }

    /// As a general chain with inertials. Tells the user which links of a file it uses.
    ///
    /// # Errors
    /// An unknown name, or a file that cannot be read as URDF.
    pub fn chain(&self) -> anyhow::Result<Chain> {
        let name = &self.name;
        self.check_ends()?;
        match name.as_str() {
            "iiwa7" => Ok(Chain::iiwa7()),
            "iiwa14" => Ok(Chain::iiwa14()),
            _ if self.is_file() => {
                let (root, tip) = (self.root.as_deref(), self.tip.as_deref());
                let chain = Chain::from_urdf_file(Path::new(name), root, tip);
                let chain = chain.map_err(|error| match error {
                    KinematicsError::UrdfAmbiguous { .. } => {
                        anyhow::anyhow!("{error} (--root LINK, --tip LINK)")
                    }
                    other => other.into(),
                })?;
                if let Some([root, tip]) = chain.ends() {
                    let joints = counted(chain.joint_count(), "joint", "joints");
                    note(format_args!("{name}: {joints} from {root} to {tip}"));
                }
                Ok(chain)
            }
            other => bail!("--arm {other}: expected iiwa7, iiwa14 or a path that ends in .urdf"),
        }
    }

    /// As an arm in closed form.
    ///
    /// # Errors
    /// As for [`chain`](Self::chain); an arm without a closed form.
    pub fn closed_form(&self) -> anyhow::Result<SrsArm> {
        self.check_ends()?;
        match self.name.as_str() {
            "iiwa7" => Ok(SrsArm::iiwa7()),
            "iiwa14" => Ok(SrsArm::iiwa14()),
            name => SrsArm::from_chain(&self.chain()?).with_context(|| {
                format!("--arm {name}: this needs an arm with a closed form, such as an iiwa")
            }),
        }
    }
}

/// An arm that carries the board: its tool is the middle of the face.
#[derive(Debug, Clone)]
pub struct BoardArm {
    kinematics: Arc<dyn ArmKinematics>,
    board: Board,
    /// Exact verdicts and maps, if the arm has a closed form.
    closed_form: Option<SrsArm>,
    /// The links of an arm without a closed form.
    chain: Option<Chain>,
    start: JointPositions,
}

impl BoardArm {
    /// `iiwa7`, `iiwa14` or the path of a URDF file of an arm with at most seven joints.
    ///
    /// # Errors
    /// An unknown name, a file that cannot be read as URDF, an arm of more joints, or one that cannot hold the
    /// board anywhere in front of it.
    pub fn named(arm: impl Into<NamedArm>, board: &Board) -> anyhow::Result<Self> {
        let arm = arm.into();
        match arm.is_file() {
            true => Self::from_chain(&arm.name, arm.chain()?, board),
            false => Self::from_srs(&arm.closed_form()?, board),
        }
    }

    /// The same arm with counted queries: [`asked_in`](super::counted::asked_in).
    #[must_use]
    pub fn counted(mut self) -> Self {
        self.kinematics = Arc::new(Counted(self.kinematics));
        self
    }

    /// From the text of a URDF file, with the name and the ends of an arm.
    ///
    /// # Errors
    /// As for [`BoardArm::named`].
    pub fn from_urdf(arm: &NamedArm, text: &str, board: &Board) -> anyhow::Result<Self> {
        let (root, tip) = (arm.root.as_deref(), arm.tip.as_deref());
        Self::from_chain(&arm.name, Chain::from_urdf_str(text, root, tip)?, board)
    }

    fn from_chain(name: &str, chain: Chain, board: &Board) -> anyhow::Result<Self> {
        // A URDF of an arm with a closed form becomes that arm.
        if let Ok(arm) = SrsArm::from_chain(&chain) {
            let known = arm.parameters().max_acceleration_rad_per_s2;
            let whose = match known.iter().flatten().count() {
                0 => "whose accelerations count",
                7 => "with the accelerations of the description",
                _ => "whose accelerations count where the description has none",
            };
            note(format_args!("{name}: built as an iiwa, {whose}"));
            let mut of_srs = Self::from_srs(&arm, board)?;
            of_srs.chain = Some(chain);
            let limits = of_srs.kinematics.limits();
            let is_within = limits
                .iter()
                .zip(&of_srs.start.0)
                .all(|(l, q)| l.contains(*q));
            if !is_within && let Some(start) = start_of(&*of_srs.kinematics)? {
                of_srs.start = start;
            }
            return Ok(of_srs);
        }
        let estimated = chain.estimated_accelerations(Some(&board_body(board, BOARD_KG)));
        note(format_args!("{name}: {}", words_of(&chain, &estimated)));
        let chain = ChainArm::new(chain)?.with_tool(board.flange_from_board_face()?);
        let chain = chain.with_accelerations(estimated.rad_per_s2);
        let links = chain.chain().clone();
        let kinematics: Arc<dyn ArmKinematics> = Arc::new(chain);
        let start = start_of(&*kinematics)?.with_context(|| {
            format!("{name}: the arm cannot hold the board upright anywhere in front of it")
        })?;
        Ok(Self {
            kinematics,
            board: *board,
            closed_form: None,
            chain: Some(links),
            start,
        })
    }

    /// An arm with a closed form.
    ///
    /// # Errors
    /// A board with a size outside its range.
    pub fn from_srs(arm: &SrsArm, board: &Board) -> anyhow::Result<Self> {
        let arm = arm.with_tool(board.flange_from_board_face()?);
        let start = JointPositions::from_deg(START_DEG);
        Ok(Self {
            kinematics: Arc::new(arm.clone()),
            board: *board,
            closed_form: Some(arm),
            chain: None,
            start,
        })
    }

    /// The arm's kinematics.
    #[must_use]
    pub const fn kinematics(&self) -> &Arc<dyn ArmKinematics> {
        &self.kinematics
    }

    /// The board.
    #[must_use]
    pub const fn board(&self) -> &Board {
        &self.board
    }

    /// Start posture.
    #[must_use]
    pub const fn start(&self) -> JointPositions {
        self.start
    }

    /// The closed form, if there is one.
    #[must_use]
    pub const fn closed_form(&self) -> Option<&SrsArm> {
        self.closed_form.as_ref()
    }

    /// The links with their masses.
    ///
    /// # Errors
    /// An arm of which only the geometry is known.
    pub fn links(&self) -> anyhow::Result<Chain> {
        match (&self.chain, &self.closed_form) {
            (Some(chain), _) => Ok(chain.clone()),
            (None, Some(arm)) if arm.geometry() == SrsArm::iiwa7().geometry() => Ok(Chain::iiwa7()),
            (None, Some(arm)) if arm.geometry() == SrsArm::iiwa14().geometry() => {
                Ok(Chain::iiwa14())
            }
            _ => bail!("the masses of the arm's links are not known"),
        }
    }

    /// Polyline of the arm from its base to the middle of the board's face, base frame, m; for figures.
    #[must_use]
    pub fn skeleton_m(&self, q: &JointPositions) -> Vec<DVec3> {
        let mut points_m = vec![DVec3::ZERO];
        match (&self.closed_form, &self.chain) {
            (Some(arm), _) => points_m.extend(arm.skeleton_m(q)),
            (None, chain) => {
                let links = chain
                    .as_ref()
                    .map(|chain| chain.link_poses(&q.0[..chain.joint_count()]));
                let links = links.and_then(Result::ok).unwrap_or_default();
                points_m.extend(links.iter().map(Pose::position_m));
                points_m.push(self.kinematics.forward(q).position_m());
            }
        }
        points_m
    }

    /// The walls of a scene for this arm. An arm without a waiting posture for them waits at its start.
    ///
    /// # Errors
    /// As for [`Walls::of`].
    pub fn walls_of(
        &self,
        scene: &Scene,
        touches: LikelyTouches,
        texture: bool,
    ) -> anyhow::Result<Walls> {
        let config = WallsConfig {
            touches,
            texture,
            ..WallsConfig::default()
        };
        let mut walls = Walls::of(scene, &*self.kinematics, &self.board, &config)?;
        walls.waiting.get_or_insert(self.start);
        Ok(walls)
    }

    /// Why no quarter turn of the board can present a point of a surface; `None` if one can. Exact for an arm with a
    /// closed form; a numeric search that failed proves nothing.
    ///
    /// # Errors
    /// A point or a normal that is not finite, or a normal without a direction.
    pub fn unreachable(
        &self,
        point_m: DVec3,
        normal: DVec3,
    ) -> anyhow::Result<Option<Unreachable>> {
        let mut first = None;
        for roll_rad in QUARTER_TURNS_RAD {
            let pose = board_pose(point_m, normal, roll_rad)?;
            let reason = match &self.closed_form {
                Some(arm) => match arm.verdict(&pose) {
                    Verdict::Reachable(_) => return Ok(None),
                    Verdict::Unreachable(reason) => reason,
                },
                None => match nearest(&*self.kinematics, &pose, &self.start)? {
                    Ok(_) => return Ok(None),
                    Err(reason) => reason,
                },
            };
            first.get_or_insert(reason);
        }
        Ok(first)
    }

    /// The largest distance of the board from the base, m: for figures.
    #[must_use]
    pub fn span_m(&self) -> f64 {
        if let Some(arm) = &self.closed_form {
            let g = arm.geometry();
            return g.d_se_m + g.d_ew_m + g.d_wf_m;
        }
        let mut sampler = hwall_testkit::Sampler::new(1);
        let limits = *self.kinematics.limits();
        let mut most: f64 = 0.0;
        for _ in 0..2000 {
            let q = limits.map(|l| {
                // One turn covers an endless joint.
                let middle_rad = l.middle_rad();
                let low = l.min_rad.max(middle_rad - PI);
                sampler.uniform(low, l.max_rad.min(middle_rad + PI))
            });
            let at_m = self.kinematics.forward(&JointPositions(q)).position_m();
            most = most.max(at_m.truncate().length());
        }
        most
    }
}

/// The solver's configuration for a pose, of any branch; or why there is none.
pub(crate) fn nearest(
    arm: &dyn ArmKinematics,
    pose: &Pose,
    reference: &JointPositions,
) -> anyhow::Result<Result<JointPositions, Unreachable>> {
    let config = NearestConfig {
        policy: BranchPolicy::Any,
        ..NearestConfig::default()
    };
    match arm.nearest(pose, reference, &config, &mut arm.scratch()) {
        Ok(found) => Ok(Ok(found.q)),
        Err(KinematicsError::Unreachable(reason)) => Ok(Err(reason)),
        Err(other) => Err(other.into()),
    }
}

/// A configuration with the board upright in front of the base; `None` if none was found.
fn start_of(arm: &dyn ArmKinematics) -> anyhow::Result<Option<JointPositions>> {
    let middle = JointPositions(arm.limits().map(|l| l.middle_rad()));
    for x_m in [0.45, 0.35, 0.55, 0.65] {
        for z_m in [0.5, 0.4, 0.6, 0.3] {
            let pose = board_pose(DVec3::new(x_m, 0.0, z_m), DVec3::X, 0.0)?;
            if let Ok(found) = nearest(arm, &pose, &middle)? {
                return Ok(Some(found));
            }
        }
    }
    Ok(None)
}

/// `x,y,...` as exactly `N` finite numbers.
///
/// # Errors
/// Another count, or a value that is not a finite number.
pub fn parse_list<const N: usize>(text: &str) -> anyhow::Result<[f64; N]> {
    let values = list(text, N)?;
    let count = values.len();
    values
        .try_into()
        .map_err(|_| anyhow::anyhow!("{count} numbers, expected {N}"))
}

/// Message to the user about the accelerations of an arm.
fn words_of(chain: &Chain, estimated: &EstimatedAccelerations) -> String {
    let joints = chain.joints();
    let shown = &estimated.rad_per_s2[..joints.len().min(MOST_JOINTS)];
    let unknown = (joints.iter()).filter(|joint| joint.max_acceleration.is_none());
    let unknown: Vec<&str> = unknown.map(|joint| &*joint.name).collect();
    let whose = match unknown.len() {
        0 => return format!("acceleration limits of the description: {shown:.1?} rad/s²"),
        all if all == joints.len() => String::new(),
        _ => format!(" of {}", unknown.join(", ")),
    };
    let source = match estimated.is_computed {
        true => "estimated from torque limits and inertia",
        false => "assumed, without masses or torque limits",
    };
    let full_speed_s = estimated.full_speed_s;
    format!(
        "acceleration limits{whose} are not in the description: {source}: {shown:.1?} rad/s², full speed within {full_speed_s:.2} s"
    )
}

/// A posture of an iiwa 7 in front of walls, for tests.
#[cfg(test)]
pub(crate) fn waiting_iiwa7() -> JointPositions {
    JointPositions::from_deg([-6.0, 18.0, 0.0, -100.0, -13.0, -29.0, 101.0])
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn accelerations_of_a_description_are_the_arms() {
        let text = include_str!("../../../kinematics/tests/data/panda.urdf");
        let named = NamedArm::from("panda.urdf");
        let most = |text: &str| {
            let arm = BoardArm::from_urdf(&named, text, &Board::default()).unwrap();
            arm.kinematics().accelerations_or([0.0; 7])
        };
        let told = |text: &str| text.replacen("<limit ", "<limit drake:acceleration=\"2.5\" ", 1);
        let (estimated, of_first) = (most(text), most(&told(text)));
        assert_eq!(of_first[0], 2.5);
        assert_eq!(of_first[1..], estimated[1..]);
    }

    #[test]
    fn a_panda_with_continuous_joints_carries_the_board() {
        let text = include_str!("../../../kinematics/tests/data/panda.urdf");
        let path = std::env::temp_dir().join(format!("continuous-{}.urdf", std::process::id()));
        let bounds = r#"lower="-2.8973" upper="2.8973""#;
        assert_eq!(text.matches(bounds).count(), 4);
        let continuous = text.replace("revolute", "continuous").replace(bounds, "");
        for text in [
            &continuous,
            &text.replace(bounds, r#"lower="-1e16" upper="1e16""#),
        ] {
            std::fs::write(&path, text).unwrap();
            let arm = BoardArm::named(path.to_str().unwrap(), &Board::default());
            std::fs::remove_file(&path).unwrap();
            let arm = arm.unwrap();
            // The arm's own values: not an iiwa's, and feasible for its weakest joint.
            let most = arm.kinematics().accelerations_or([0.0; 7]);
            assert!(most.iter().all(|a| (0.5..40.0).contains(a)), "{most:?}");
            assert!(arm.start().0.iter().all(|q| q.is_finite()));
            assert!((0.8..1.5).contains(&arm.span_m()), "{}", arm.span_m());
        }
    }
}
