//! Arms: forward kinematics, reachable poses, and reasons for unreachable ones.

use crate::arrays::{Array, Floats, Rows, array, like, matrix, one_pose, pose};
use crate::error::{Error, OrRaise, one_of};
use hwall::glam::DVec3;
use hwall::kinematics::{
    ArmKinematics, BranchPolicy, Chain, ChainArm, Inertial, JointPositions, KinematicsError,
    MOST_JOINTS, NearestConfig, Pose, SrsArm, Unreachable, Verdict as Answer,
};
use hwall::numeric::check::all_finite;
use hwall::reachability::{orientation_margin_rad, position_margin_m};
use numpy::PyArrayDyn;
use pyo3::prelude::*;
use pyo3::types::PyTuple;
use std::path::PathBuf;
use std::sync::Arc;

/// Short names of the reasons, by code; code 0 is no reason.
const KINDS: [&str; 9] = [
    "",
    "too_far",
    "too_near",
    "elbow_limit",
    "shoulder_limit",
    "wrist_limit",
    "arm_angle_conflict",
    "other_branch",
    "not_found",
];

/// A serial robot arm of up to seven joints, immutable.
#[pyclass(frozen, module = "hwall", name = "Arm")]
pub(crate) struct PyArm {
    model: Arc<dyn ArmKinematics>,
    /// Why there is no closed form, if there is none.
    why_not: Option<String>,
    /// In the order of the chain.
    joint_names: Vec<String>,
}

impl PyArm {
    fn of(arm: SrsArm) -> Self {
        Self {
            model: Arc::new(arm),
            why_not: None,
            joint_names: (1..=7).map(|joint| format!("A{joint}")).collect(),
        }
    }

    /// An arm with a tool; checks for a closed form.
    pub(crate) fn carrying(model: Arc<dyn ArmKinematics>, joint_names: Vec<String>) -> Self {
        let why_not = model
            .closed_form()
            .is_none()
            .then(|| "the arm has no closed form".into());
        Self {
            model,
            why_not,
            joint_names,
        }
    }

    pub(crate) fn model(&self) -> &Arc<dyn ArmKinematics> {
        &self.model
    }

    /// The closed form.
    pub(crate) fn srs(&self) -> PyResult<&SrsArm> {
        let why = || Error::new_err(self.why_not.clone().unwrap_or_default());
        self.model.closed_form().ok_or_else(why)
    }

    /// Joint angles from a row of an array; missing joints are 0.
    pub(crate) fn joints(&self, row: &[f64]) -> Result<JointPositions, KinematicsError> {
        all_finite("q", row)?;
        let mut q = [0.0; MOST_JOINTS];
        q[..row.len()].copy_from_slice(row);
        Ok(JointPositions(q))
    }

    /// One or many configurations.
    pub(crate) fn rows<'a>(&self, q: &'a Floats<'_>) -> PyResult<Rows<'a>> {
        let (expected, shape) = (
            self.model.joint_count(),
            numpy::PyUntypedArrayMethods::shape(&***q),
        );
        match shape.last() {
            Some(&got) if got != expected && shape.len() <= 2 => {
                let what = "q";
                Err(KinematicsError::WrongJointCount {
                    what,
                    expected,
                    got,
                })
                .or_raise()
            }
            _ => Rows::new("q", q, &[expected]),
        }
    }

    /// One configuration.
    pub(crate) fn one(&self, q: &Floats<'_>) -> PyResult<JointPositions> {
        let rows = self.rows(q)?;
        if rows.many {
            Rows::new("q", q, &[])?;
        }
        self.joints(rows.row(0)).or_raise()
    }

    /// The values of the arm's joints.
    pub(crate) fn joint_array<'py>(
        &self,
        py: Python<'py>,
        of: &[f64; MOST_JOINTS],
    ) -> PyResult<Array<'py>> {
        let joints = self.model.joint_count();
        array(py, of[..joints].to_vec(), &[joints])
    }

    fn held(
        &self,
        at: &Pose,
        search: &mut Search,
    ) -> Result<(JointPositions, Option<f64>), KinematicsError> {
        match self.model.closed_form() {
            Some(arm) => match arm.verdict(at) {
                Answer::Reachable(witness) => Ok((witness.q, Some(witness.arm_angle_rad))),
                Answer::Unreachable(reason) => Err(reason.into()),
            },
            None => {
                let found =
                    self.model
                        .nearest(at, &search.from, &search.config, &mut search.scratch)?;
                Ok((found.q, None))
            }
        }
    }

    fn search(&self, policy: BranchPolicy) -> Search {
        Search {
            from: JointPositions(self.model.limits().map(|limit| {
                let middle = limit.middle_rad();
                if middle.is_finite() { middle } else { 0.0 }
            })),
            config: NearestConfig {
                policy,
                ..NearestConfig::default()
            },
            scratch: self.model.scratch(),
        }
    }
}

/// Settings of a search for a configuration.
struct Search {
    from: JointPositions,
    config: NearestConfig,
    scratch: hwall::kinematics::ArmScratch,
}

fn code(reason: &Unreachable) -> u8 {
    let place = KINDS.iter().position(|name| *name == reason.name());
    place.unwrap_or_default() as u8
}

/// The missing length, m; NaN for reasons without one.
fn gap(reason: &Unreachable) -> f64 {
    match reason {
        Unreachable::TooFar { gap_m }
        | Unreachable::TooNear { gap_m }
        | Unreachable::ElbowLimit { gap_m } => *gap_m,
        _ => f64::NAN,
    }
}

// Poses are called T, as in the literature: a user may write `T=`.
#[allow(non_snake_case)]
#[pymethods]
impl PyArm {
    /// KUKA LBR iiwa 7 R800, base frame at the foot, z up. The tool is the flange until `with_tool`.
    #[staticmethod]
    fn iiwa7() -> Self {
        Self::of(SrsArm::iiwa7())
    }

    /// KUKA LBR iiwa 14 R820.
    #[staticmethod]
    fn iiwa14() -> Self {
        Self::of(SrsArm::iiwa14())
    }

    /// An arm from a URDF file. `root` and `tip` are link names; needed if the file is ambiguous.
    /// Arms with spherical shoulder and wrist are solved in closed form (`exact`), all others numerically.
    #[staticmethod]
    #[pyo3(signature = (path, tip=None, root=None))]
    fn from_urdf(
        py: Python<'_>,
        path: PathBuf,
        tip: Option<&str>,
        root: Option<&str>,
    ) -> PyResult<Self> {
        py.detach(|| {
            let chain = Chain::from_urdf_file(&path, root, tip)?;
            let joints = chain.joints().iter();
            let joint_names = joints.map(|joint| joint.name.clone()).collect();
            match SrsArm::from_chain(&chain) {
                Ok(arm) => Ok(Self {
                    joint_names,
                    ..Self::of(arm)
                }),
                Err(why_not) => {
                    // Of an arm that carries a board, for the stopping ways of a `Session`.
                    let board = Inertial::solid_box(
                        "board",
                        0.6,
                        0.01 * DVec3::Z,
                        DVec3::new(0.2, 0.2, 0.02),
                    );
                    let estimated = chain.estimated_accelerations(Some(&board)).rad_per_s2;
                    Ok::<_, KinematicsError>(Self {
                        model: Arc::new(ChainArm::new(chain)?.with_accelerations(estimated)),
                        why_not: Some(why_not.to_string()),
                        joint_names,
                    })
                }
            }
        })
        .or_raise()
    }

    /// The same arm with a tool; all poses then refer to the tool. `flange_from_tool` (4, 4), m.
    fn with_tool(&self, flange_from_tool: Floats<'_>) -> PyResult<Self> {
        let tool = one_pose("flange_from_tool", &flange_from_tool)?;
        Ok(Self {
            model: self.model.carrying(tool),
            why_not: self.why_not.clone(),
            joint_names: self.joint_names.clone(),
        })
    }

    /// Names of the joints in the order of `q`: those of the URDF; A1 to A7 of an iiwa.
    #[getter]
    pub(crate) fn joint_names(&self) -> Vec<String> {
        self.joint_names.clone()
    }

    /// Number of joints, at most 7.
    #[getter]
    fn joint_count(&self) -> usize {
        self.model.joint_count()
    }

    /// Does the arm have a closed form, so that verdicts are proofs and maps can be made?
    #[getter]
    fn exact(&self) -> bool {
        self.model.closed_form().is_some()
    }

    /// Joint limits, (joints, 2), rad (m for a prismatic joint): min, max.
    #[getter]
    fn limits<'py>(&self, py: Python<'py>) -> PyResult<Array<'py>> {
        let limits = &self.model.limits()[..self.joint_count()];
        let values = limits.iter().flat_map(|l| [l.min_rad, l.max_rad]).collect();
        array(py, values, &[self.joint_count(), 2])
    }

    /// Largest joint speeds, (joints,), rad/s.
    #[getter]
    fn max_velocity<'py>(&self, py: Python<'py>) -> PyResult<Array<'py>> {
        let speeds = &self.model.max_velocity_rad_per_s()[..self.joint_count()];
        array(py, speeds.to_vec(), &[self.joint_count()])
    }

    /// Pose of the tool in the base frame: (4, 4) of q (joints,), (n, 4, 4) of (n, joints). q in rad, positions in m.
    fn forward<'py>(&self, py: Python<'py>, q: Floats<'py>) -> PyResult<Array<'py>> {
        let rows = self.rows(&q)?;
        let poses = py.detach(|| {
            let mut poses = Vec::with_capacity(16 * rows.count);
            for row in 0..rows.count {
                let q = self.joints(rows.row(row)).map_err(|e| (row, e))?;
                poses.extend(matrix(&self.model.forward(&q)));
            }
            Ok(poses)
        });
        like(py, &rows, in_row(&rows, poses)?, &[4, 4])
    }

    /// Geometric Jacobian of the tool, base axes: (6, joints) of q (joints,), (n, 6, joints) of (n, joints).
    /// Rows: velocity of the tool's origin (m/rad), then angular velocity (rad/rad).
    fn jacobian<'py>(&self, py: Python<'py>, q: Floats<'py>) -> PyResult<Array<'py>> {
        let (rows, joints) = (self.rows(&q)?, self.joint_count());
        let all = py.detach(|| {
            let mut all = Vec::with_capacity(6 * joints * rows.count);
            for row in 0..rows.count {
                let q = self.joints(rows.row(row)).map_err(|e| (row, e))?;
                for line in self.model.jacobian(&q).to_rows() {
                    all.extend(&line[..joints]);
                }
            }
            Ok(all)
        });
        like(py, &rows, in_row(&rows, all)?, &[6, joints])
    }

    /// Can the arm hold T, (4, 4), the pose of its tool in the base frame, m? A `Verdict`: `reachable`, with a configuration `q`, rad, that
    /// holds it within the limits, or `reason`, `kind` and `gap`, m. Of (n, 4, 4) `Verdicts`: the same as arrays, and three times as fast.
    /// If the arm is `exact`, both answers are proofs, and `forward(q)` is within 1e-12 (m, rad) of T; if not, it is a search, whose "not
    /// found" proves nothing. T must be rigid: `hwall.Error` otherwise.
    fn verdict<'py>(&self, py: Python<'py>, T: Floats<'py>) -> PyResult<Bound<'py, PyAny>> {
        let (rows, joints) = (Rows::new("T", &T, &[4, 4])?, self.joint_count());
        let mut search = self.search(BranchPolicy::Any);
        if !rows.many {
            let at = pose(rows.row(0)).or_raise()?;
            let verdict = match py.detach(|| self.held(&at, &mut search)) {
                Ok((q, arm_angle)) => Verdict {
                    reason: None,
                    q: Some(self.joint_array(py, &q.0)?.unbind()),
                    arm_angle,
                },
                Err(KinematicsError::Unreachable(reason)) => Verdict {
                    reason: Some(reason),
                    q: None,
                    arm_angle: None,
                },
                Err(error) => return Err(error).or_raise(),
            };
            return Ok(Bound::new(py, verdict)?.into_any());
        }
        let found = py.detach(|| {
            let mut found = (Vec::new(), Vec::new(), Vec::new());
            found.0.reserve_exact(rows.count);
            found.1.reserve_exact(rows.count);
            found.2.reserve_exact(rows.count * joints);
            for row in 0..rows.count {
                let at = pose(rows.row(row)).map_err(|e| (row, e.into()))?;
                match self.held(&at, &mut search) {
                    Ok((q, _)) => {
                        found.0.push(0_u8);
                        found.1.push(f64::NAN);
                        found.2.extend(&q.0[..joints]);
                    }
                    Err(KinematicsError::Unreachable(reason)) => {
                        found.0.push(code(&reason));
                        found.1.push(gap(&reason));
                        found.2.resize(found.2.len() + joints, f64::NAN);
                    }
                    Err(error) => return Err((row, error)),
                }
            }
            Ok(found)
        });
        let (codes, gaps, q) = in_row(&rows, found)?;
        let reachable = codes.iter().map(|code| *code == 0).collect();
        let verdicts = Verdicts {
            reachable: array(py, reachable, &[rows.count])?.unbind(),
            code: array(py, codes, &[rows.count])?.unbind(),
            gap: array(py, gaps, &[rows.count])?.unbind(),
            q: array(py, q, &[rows.count, joints])?.unbind(),
        };
        Ok(Bound::new(py, verdicts)?.into_any())
    }

    /// Can the arm hold this pose of its tool? Without reason and configuration: bool of T (4, 4), (n,) bool of (n, 4, 4).
    /// Three times as fast as `verdict`. Only for `exact` arms.
    fn is_reachable<'py>(&self, py: Python<'py>, T: Floats<'py>) -> PyResult<Bound<'py, PyAny>> {
        let (arm, rows) = (self.srs()?, Rows::new("T", &T, &[4, 4])?);
        let held = py.detach(|| {
            let at = |row| pose(rows.row(row)).map_err(|e| (row, e.into()));
            let all = (0..rows.count).map(|row| Ok(arm.is_reachable(&at(row)?)));
            all.collect::<Result<Vec<bool>, _>>()
        });
        let held = in_row(&rows, held)?;
        match rows.many {
            true => Ok(array(py, held, &[rows.count])?.into_any()),
            false => Ok(pyo3::types::PyBool::new(py, held[0]).to_owned().into_any()),
        }
    }

    /// The configuration within the limits that holds T (as for `verdict`) and is nearest to q, by the sum of squared differences, rad. q may
    /// be beyond the limits. Near singularities a nearer one can be missed. A `Nearest` of T (4, 4) and q (joints,), or `hwall.Error` with
    /// the reason why T cannot be held; `Nearests` of (n, 4, 4) and q (joints,) or (n, joints), with NaN where a pose cannot. `policy` says
    /// which of the eight branches (signs of joints 2, 4 and 6) count: "prefer" (that of q, or all if it does not hold T), "keep" (that of q
    /// only) or "any".
    #[pyo3(signature = (T, q, policy="prefer"))]
    fn nearest<'py>(
        &self,
        py: Python<'py>,
        T: Floats<'py>,
        q: Floats<'py>,
        policy: &str,
    ) -> PyResult<Bound<'py, PyAny>> {
        let policies = [
            ("prefer", BranchPolicy::Prefer),
            ("keep", BranchPolicy::Keep),
            ("any", BranchPolicy::Any),
        ];
        let mut search = self.search(one_of("policy", policy, &policies)?);
        let (rows, from, joints) = (
            Rows::new("T", &T, &[4, 4])?,
            self.rows(&q)?,
            self.joint_count(),
        );
        if from.many && (!rows.many || from.count != rows.count) {
            return crate::error::refuse(format!(
                "{} poses and {} rows of q",
                rows.count, from.count
            ));
        }
        let found = py.detach(|| {
            let mut found = (Vec::new(), Vec::new(), Vec::new(), Vec::new());
            for row in 0..rows.count {
                let at = pose(rows.row(row)).map_err(|e| (row, e.into()))?;
                let q = from.row(if from.many { row } else { 0 });
                let q = self.joints(q).map_err(|e| (row, e))?;
                match self
                    .model
                    .nearest(&at, &q, &search.config, &mut search.scratch)
                {
                    Ok(solution) => {
                        found.0.extend(&solution.q.0[..joints]);
                        found.1.push(true);
                        found.2.push(solution.branch_changed);
                        found.3.push(solution.largest_move_rad);
                    }
                    Err(KinematicsError::Unreachable(_)) if rows.many => {
                        found.0.resize(found.0.len() + joints, f64::NAN);
                        found.1.push(false);
                        found.2.push(false);
                        found.3.push(f64::NAN);
                    }
                    Err(error) => return Err((row, error)),
                }
            }
            Ok(found)
        });
        let (q, held, changed, moves) = in_row(&rows, found)?;
        if !rows.many {
            let nearest = Nearest {
                q: array(py, q, &[joints])?.unbind(),
                branch_changed: changed[0],
                largest_move: moves[0],
            };
            return Ok(Bound::new(py, nearest)?.into_any());
        }
        let nearests = Nearests {
            q: array(py, q, &[rows.count, joints])?.unbind(),
            reachable: array(py, held, &[rows.count])?.unbind(),
            branch_changed: array(py, changed, &[rows.count])?.unbind(),
            largest_move: array(py, moves, &[rows.count])?.unbind(),
        };
        Ok(Bound::new(py, nearests)?.into_any())
    }

    /// Radius (m) of the ball of positions around T (4, 4) in which every pose is guaranteed reachable, at every orientation
    /// within `cone` (rad); None if T itself is not. Only for `exact` arms.
    #[pyo3(signature = (T, cone=0.0))]
    fn position_margin(&self, py: Python<'_>, T: Floats<'_>, cone: f64) -> PyResult<Option<f64>> {
        let (arm, at) = (self.srs()?, one_pose("T", &T)?);
        py.detach(|| position_margin_m(arm, &at, cone)).or_raise()
    }

    /// Angle (rad) of the cone of orientations around T (4, 4) in which every pose is guaranteed reachable, at every position
    /// within `radius` (m); None if T itself is not. Only for `exact` arms.
    #[pyo3(signature = (T, radius=0.0))]
    fn orientation_margin(
        &self,
        py: Python<'_>,
        T: Floats<'_>,
        radius: f64,
    ) -> PyResult<Option<f64>> {
        let (arm, at) = (self.srs()?, one_pose("T", &T)?);
        py.detach(|| orientation_margin_rad(arm, &at, radius))
            .or_raise()
    }

    /// Largest distance that all joints can keep from their limits while the arm holds T (4, 4), rad; None if it cannot. Only for
    /// `exact` arms.
    fn joint_margin(&self, T: Floats<'_>) -> PyResult<Option<f64>> {
        Ok(self.srs()?.joint_margin_rad(&one_pose("T", &T)?))
    }

    fn __repr__(&self) -> String {
        let how = if self.exact() {
            "closed form"
        } else {
            "numeric"
        };
        format!("<hwall.Arm of {} joints, {how}>", self.joint_count())
    }
}

/// Raises the error of one row, with its number if there were several.
fn in_row<T>(rows: &Rows<'_>, result: Result<T, (usize, KinematicsError)>) -> PyResult<T> {
    result.or_else(|(row, error)| match rows.many {
        true => Err(error).or_raise_in_row(row),
        false => Err(error).or_raise(),
    })
}

/// Can a pose be held? Truthy if so.
#[pyclass(frozen, module = "hwall")]
pub(crate) struct Verdict {
    reason: Option<Unreachable>,
    /// A configuration that holds the pose, (joints,), rad: a proof, not a posture to work in. None if there is none.
    #[pyo3(get)]
    q: Option<Py<PyArrayDyn<f64>>>,
    /// Arm angle of `q`, rad, 0 where the elbow is highest; None for arms without a closed form.
    #[pyo3(get)]
    arm_angle: Option<f64>,
}

#[pymethods]
impl Verdict {
    /// Can the pose be held?
    #[getter]
    fn reachable(&self) -> bool {
        self.reason.is_none()
    }

    /// The reason as text; None if the pose can be held.
    #[getter]
    fn reason(&self) -> Option<String> {
        self.reason.as_ref().map(ToString::to_string)
    }

    /// The reason as a short name such as "too_far"; None if the pose can be held.
    #[getter]
    fn kind(&self) -> Option<&'static str> {
        self.reason.as_ref().map(Unreachable::name)
    }

    /// The missing length, m; None for reasons without one.
    #[getter]
    fn gap(&self) -> Option<f64> {
        self.reason.as_ref().map(gap).filter(|gap| gap.is_finite())
    }

    fn __bool__(&self) -> bool {
        self.reachable()
    }

    fn __repr__(&self) -> String {
        match &self.reason {
            None => "<hwall.Verdict reachable>".into(),
            Some(reason) => format!("<hwall.Verdict unreachable: {reason}>"),
        }
    }
}

/// Verdicts on many poses, as arrays.
#[pyclass(frozen, module = "hwall")]
pub(crate) struct Verdicts {
    /// Which can be held, (n,) bool.
    #[pyo3(get)]
    reachable: Py<PyArrayDyn<bool>>,
    /// Why not, (n,) uint8, an index into `Verdicts.KINDS`; 0 where the pose can be held.
    #[pyo3(get)]
    code: Py<PyArrayDyn<u8>>,
    /// The missing length, (n,), m; NaN for reasons without one and for poses that can be held.
    #[pyo3(get)]
    gap: Py<PyArrayDyn<f64>>,
    /// A configuration for each pose, (n, joints), rad; NaN where there is none.
    #[pyo3(get)]
    q: Py<PyArrayDyn<f64>>,
}

#[pymethods]
impl Verdicts {
    /// Short names of the reasons by code; "" is no reason.
    #[classattr]
    #[pyo3(name = "KINDS")]
    fn kinds(py: Python<'_>) -> PyResult<Py<PyTuple>> {
        Ok(PyTuple::new(py, KINDS)?.unbind())
    }

    fn __len__(&self, py: Python<'_>) -> PyResult<usize> {
        self.reachable.bind(py).len()
    }
}

/// The configuration nearest to another one.
#[pyclass(frozen, get_all, module = "hwall")]
pub(crate) struct Nearest {
    /// Joint angles, (joints,), rad.
    q: Py<PyArrayDyn<f64>>,
    /// Did shoulder, elbow or wrist have to flip?
    branch_changed: bool,
    /// Largest change of a joint, rad.
    largest_move: f64,
}

/// The nearest configurations for many poses, as arrays.
#[pyclass(frozen, get_all, module = "hwall")]
pub(crate) struct Nearests {
    /// Joint angles, (n, joints), rad; NaN where the pose cannot be held.
    q: Py<PyArrayDyn<f64>>,
    /// Which poses can be held, (n,) bool.
    reachable: Py<PyArrayDyn<bool>>,
    /// Poses for which shoulder, elbow or wrist had to flip, (n,) bool.
    branch_changed: Py<PyArrayDyn<bool>>,
    /// Largest change of a joint, (n,), rad; NaN where the pose cannot be held.
    largest_move: Py<PyArrayDyn<f64>>,
}
