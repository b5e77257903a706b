//! A control loop around the supervisor, for its tests.

use crate::support::{DT_S, at_rest, home};
use glam::DVec3;
use hwall_haptics::safety::{
    PersonPart, PersonPoint, Supervisor, SupervisorConfig, SupervisorInput, SupervisorStep,
};
use hwall_haptics::{ArmCommand, ArmState, Board};
use hwall_kinematics::{SrsArm, Wrench};

/// A loop with an arm that executes commands at once.
pub(crate) struct Bench {
    pub(crate) supervisor: Supervisor,
    pub(crate) now_s: f64,
    pub(crate) state: ArmState,
    pub(crate) person: Vec<PersonPoint>,
    pub(crate) target: Option<DVec3>,
    pub(crate) force: Option<Wrench>,
    pub(crate) command: ArmCommand,
    pub(crate) ticks: u32,
}

impl Bench {
    pub(crate) fn new() -> Self {
        Self::with(SupervisorConfig::default())
    }

    /// After some good cycles.
    pub(crate) fn after(cycles: usize) -> Self {
        let mut bench = Self::new();
        bench.run(cycles);
        bench
    }

    /// Its first state counts.
    pub(crate) fn with(config: SupervisorConfig) -> Self {
        Self::as_configured(SupervisorConfig {
            agreeing_states: 1,
            ..config
        })
    }

    pub(crate) fn as_configured(config: SupervisorConfig) -> Self {
        let far = |part, y: f64| PersonPoint {
            part,
            position_m: DVec3::new(2.0, y, 1.0),
            stamp_s: 0.0,
        };
        let person = vec![
            far(PersonPart::Fingertip, 0.0),
            far(PersonPart::Palm, 0.1),
            far(PersonPart::Head, 0.3),
            far(PersonPart::Bystander1, 1.5),
        ];
        Self {
            supervisor: Supervisor::new(&SrsArm::iiwa7(), &Board::default(), config).unwrap(),
            now_s: 10.0,
            state: at_rest(10.0, home()),
            person,
            target: Some(DVec3::new(0.6, 0.0, 0.6)),
            force: Some(Wrench::default()),
            command: ArmCommand::Position(home()),
            ticks: 0,
        }
    }

    /// One cycle; `spoil` changes the supervisor's inputs.
    pub(crate) fn step_with(&mut self, spoil: impl Fn(&mut Self, &mut f64)) -> SupervisorStep {
        self.now_s += DT_S;
        self.ticks += 1;
        self.state.t_s = self.now_s;
        for point in &mut self.person {
            point.stamp_s = self.now_s;
            // Values with jitter, like measurements.
            let is_even = self.ticks.is_multiple_of(2);
            point.position_m.z += if is_even { 1e-5 } else { -1e-5 };
        }
        let mut now_s = self.now_s;
        let (state, person) = (self.state, self.person.clone());
        let (target, force, command) = (self.target, self.force, self.command);
        spoil(self, &mut now_s);
        let step = self.supervisor.step(&SupervisorInput {
            now_s,
            state: &self.state,
            person: &self.person,
            target: self.target.map(|target| (target, self.now_s)),
            force: self.force,
            command: self.command,
        });
        (self.state, self.person) = (state, person);
        (self.target, self.force, self.command) = (target, force, command);
        step
    }

    pub(crate) fn step(&mut self) -> SupervisorStep {
        self.step_with(|_, _| {})
    }

    pub(crate) fn run(&mut self, steps: usize) -> SupervisorStep {
        self.run_with(steps, |_, _| {})
    }

    pub(crate) fn run_with(
        &mut self,
        steps: usize,
        spoil: impl Fn(&mut Self, &mut f64),
    ) -> SupervisorStep {
        let last = (0..steps).map(|_| self.step_with(&spoil)).last();
        last.expect("at least one step")
    }
}
