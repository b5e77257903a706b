//! A hand with mass that pushes a board.

use crate::error::SimError;
use glam::DVec3;
use hwall_kinematics::{Pose, Twist, Wrench};
use hwall_numeric::check::{all_finite, non_negative, positive, within};

/// Longest integration step of the hand, s.
const MAX_STEP_S: f64 = 5e-5;

/// A finger and the hand behind it, as one mass at the fingertip.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct HandBodyConfig {
    /// Effective mass at the fingertip, kg. Default 0.6, the value for hands and fingers in ISO/TS 15066, annex A; a relaxed finger alone
    /// has far less than 0.1 kg, and a stiff forearm adds 2 kg.
    pub mass_kg: f64,
    /// Stiffness of the human arm that holds the hand at its aim, N/m. Default 300; measurements in a maintained posture give a few
    /// hundred ([Tsuji 1995]).
    pub arm_stiffness_n_per_m: f64,
    /// Damping of the human arm, N s/m. Default 20; a few tens in the same measurements.
    pub arm_damping_n_s_per_m: f64,
    /// Stiffness of the finger along the board's normal, N/m. Default 1000: from a few hundred to more than a thousand,
    /// increasing with the force ([Hajian 1997]).
    pub finger_stiffness_n_per_m: f64,
    /// Damping of the finger, N s/m. Default 5; a few units in the same measurements.
    pub finger_damping_n_s_per_m: f64,
    /// Coulomb friction coefficient of skin on the face. Default 0.6, an assumption; dry skin on plastic is between 0.3 and 1.
    pub friction: f64,
    /// Shear stiffness of the fingertip along the face before it slips, N/m. Default 1000, an assumption.
    pub shear_stiffness_n_per_m: f64,
    /// Half the edge of the board, m. Default 0.1, a board of 200 x 200 mm.
    pub half_extent_m: f64,
}

impl Default for HandBodyConfig {
    fn default() -> Self {
        Self {
            mass_kg: 0.6,
            arm_stiffness_n_per_m: 300.0,
            arm_damping_n_s_per_m: 20.0,
            finger_stiffness_n_per_m: 1000.0,
            finger_damping_n_s_per_m: 5.0,
            friction: 0.6,
            shear_stiffness_n_per_m: 1000.0,
            half_extent_m: 0.1,
        }
    }
}

/// Action of the muscles.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum HandDrive {
    /// The muscles pull the hand towards a moving aim, base frame, m and m/s.
    Aim {
        /// Desired fingertip position, m.
        position_m: DVec3,
        /// Velocity of the aim, m/s.
        velocity_m_per_s: DVec3,
    },
    /// The muscles exert a force, base axes, N; the arm's damping opposes the hand's velocity.
    Force(DVec3),
}

/// A moving hand, with or without contact with a board.
///
/// The hand is a mass on a spring and a damper. The finger is a unilateral spring and damper along the board's normal, with Coulomb
/// friction along the face: a spring that slips at `friction` times the normal force, so that a resting finger does not creep. Within a
/// step the hand uses substeps of at most 50 µs while the board moves at constant velocity; the returned force is the mean over the step,
/// for the same step of the arm.
///
/// ```
/// use glam::DVec3;
/// use hwall_kinematics::{Pose, Twist};
/// use hwall_sim::{HandBody, HandBodyConfig, HandDrive};
///
/// // Face at the origin, normal +z; the hand comes at 2 m/s.
/// let mut hand = HandBody::new(HandBodyConfig::default(), DVec3::new(0.0, 0.0, 0.001), DVec3::new(0.0, 0.0, -2.0))?;
/// let mut most_n = 0.0_f64;
/// for _ in 0..200 {
///     let wrench = hand.step(1e-3, &Pose::IDENTITY, &Twist::default(), &HandDrive::Force(DVec3::ZERO))?;
///     most_n = most_n.max(-wrench.force_n.z);
/// }
/// // v √(k m), less damping.
/// assert!((20.0..50.0).contains(&most_n));
/// assert!(hand.velocity_m_per_s().z > 0.0);
/// # Ok::<(), hwall_sim::SimError>(())
/// ```
#[derive(Debug, Clone, PartialEq)]
pub struct HandBody {
    config: HandBodyConfig,
    position_m: DVec3,
    velocity_m_per_s: DVec3,
    touching: bool,
    /// Shear displacement of the fingertip, board axes, m.
    shear_m: DVec3,
}

impl HandBody {
    /// A hand at a position with a velocity, base frame, m and m/s.
    ///
    /// # Errors
    /// NaN, infinity, a mass or extent that is not positive, or another negative setting.
    pub fn new(
        config: HandBodyConfig,
        position_m: DVec3,
        velocity_m_per_s: DVec3,
    ) -> Result<Self, SimError> {
        positive("mass_kg", config.mass_kg)?;
        positive("half_extent_m", config.half_extent_m)?;
        for (what, value) in [
            ("arm_stiffness_n_per_m", config.arm_stiffness_n_per_m),
            ("arm_damping_n_s_per_m", config.arm_damping_n_s_per_m),
            ("finger_stiffness_n_per_m", config.finger_stiffness_n_per_m),
            ("finger_damping_n_s_per_m", config.finger_damping_n_s_per_m),
            ("friction", config.friction),
        ] {
            non_negative(what, value)?;
        }
        positive("shear_stiffness_n_per_m", config.shear_stiffness_n_per_m)?;
        all_finite("position_m", &position_m.to_array())?;
        all_finite("velocity_m_per_s", &velocity_m_per_s.to_array())?;
        Ok(Self {
            config,
            position_m,
            velocity_m_per_s,
            touching: false,
            shear_m: DVec3::ZERO,
        })
    }

    /// Advances the hand by `dt_s`; returns its mean wrench on the board, base axes, about the board's origin.
    ///
    /// `base_from_board` has its origin in the middle of the face and z out of it, towards the hand; `board_velocity` is
    /// the board's velocity there, base axes: `pose()` and `twist()` of an arm with the board as its tool.
    ///
    /// # Errors
    /// A time step that is not positive or longer than 1 s, NaN or infinity; the hand is then unchanged.
    pub fn step(
        &mut self,
        dt_s: f64,
        base_from_board: &Pose,
        board_velocity: &Twist,
        drive: &HandDrive,
    ) -> Result<Wrench, SimError> {
        within(
            "dt_s",
            dt_s,
            f64::MIN_POSITIVE..=1.0,
            "above 0 and at most 1",
        )?;
        all_finite("board velocity", &board_velocity.to_array())?;
        match drive {
            HandDrive::Aim {
                position_m,
                velocity_m_per_s,
            } => {
                all_finite("aim", &position_m.to_array())?;
                all_finite("velocity of the aim", &velocity_m_per_s.to_array())?;
            }
            HandDrive::Force(force_n) => all_finite("force", &force_n.to_array())?,
        }
        let mut next = self.clone();
        let count = (dt_s / MAX_STEP_S).ceil().max(1.0);
        let h_s = dt_s / count;
        let mut sum = Wrench::default();
        for k in 0..count as u64 {
            let t_s = k as f64 * h_s;
            let board = base_from_board
                .at(base_from_board.position_m() + t_s * board_velocity.linear_m_per_s);
            let force_n = next.contact_force_n(h_s, &board, board_velocity);
            let lever_m = next.position_m - board.position_m();
            sum.force_n -= force_n;
            sum.moment_n_m -= lever_m.cross(force_n);
            next.accelerate(h_s, t_s, force_n, drive);
        }
        all_finite("hand", &next.position_m.to_array())?;
        all_finite("hand", &next.velocity_m_per_s.to_array())?;
        sum.force_n /= count;
        sum.moment_n_m /= count;
        all_finite("wrench of the hand", &sum.to_array())?;
        *self = next;
        Ok(sum)
    }

    /// Position of the fingertip, base frame, m.
    #[must_use]
    pub const fn position_m(&self) -> DVec3 {
        self.position_m
    }

    /// Velocity of the fingertip, base frame, m/s.
    #[must_use]
    pub const fn velocity_m_per_s(&self) -> DVec3 {
        self.velocity_m_per_s
    }

    /// True if the hand touched the board at the end of the last step.
    #[must_use]
    pub const fn is_touching(&self) -> bool {
        self.touching
    }

    /// The settings.
    #[must_use]
    pub const fn config(&self) -> &HandBodyConfig {
        &self.config
    }

    /// Force of the board on the finger, base axes, N.
    fn contact_force_n(&mut self, h_s: f64, board: &Pose, velocity: &Twist) -> DVec3 {
        let lever_m = self.position_m - board.position_m();
        let rotation = board.rotation();
        let place_m = rotation.transpose() * lever_m;
        let beside = place_m.x.abs().max(place_m.y.abs()) > self.config.half_extent_m;
        // A finger that comes from behind or around the edge is not in contact with the face.
        let enters = self.touching || place_m.z > -self.deepest_entry_m(h_s, velocity);
        if beside || place_m.z >= 0.0 || !enters {
            self.touching = false;
            self.shear_m = DVec3::ZERO;
            return DVec3::ZERO;
        }
        self.touching = true;
        let of_board = velocity.linear_m_per_s + velocity.angular_rad_per_s.cross(lever_m);
        let relative = rotation.transpose() * (self.velocity_m_per_s - of_board);
        let config = &self.config;
        let pressed_n = -config.finger_stiffness_n_per_m * place_m.z
            - config.finger_damping_n_s_per_m * relative.z;
        let normal_n = pressed_n.max(0.0);
        self.shear_m += h_s * DVec3::new(relative.x, relative.y, 0.0);
        let damping = config.finger_damping_n_s_per_m * DVec3::new(relative.x, relative.y, 0.0);
        let mut along_n = -config.shear_stiffness_n_per_m * self.shear_m - damping;
        let most_n = config.friction * normal_n;
        if along_n.length() > most_n {
            along_n = along_n.normalize_or_zero() * most_n;
            self.shear_m = -along_n / config.shear_stiffness_n_per_m;
        }
        rotation * (along_n + DVec3::new(0.0, 0.0, normal_n))
    }

    /// Maximum present depth of a finger that was in front of the face one step ago, m.
    fn deepest_entry_m(&self, h_s: f64, velocity: &Twist) -> f64 {
        let speed = self.velocity_m_per_s.length()
            + velocity.linear_m_per_s.length()
            + velocity.angular_rad_per_s.length() * 2.0 * self.config.half_extent_m;
        2.0 * h_s * speed + 1e-6
    }

    fn accelerate(&mut self, h_s: f64, t_s: f64, contact_n: DVec3, drive: &HandDrive) {
        let config = &self.config;
        let damping = config.arm_damping_n_s_per_m;
        let muscles_n = match drive {
            HandDrive::Aim {
                position_m,
                velocity_m_per_s,
            } => {
                let aim_m = *position_m + t_s * *velocity_m_per_s;
                config.arm_stiffness_n_per_m * (aim_m - self.position_m)
                    + damping * *velocity_m_per_s
            }
            HandDrive::Force(force_n) => *force_n,
        };
        // The arm's damping is integrated implicitly.
        self.velocity_m_per_s = (config.mass_kg * self.velocity_m_per_s
            + h_s * (muscles_n + contact_n))
            / (config.mass_kg + h_s * damping);
        self.position_m += h_s * self.velocity_m_per_s;
    }
}
