//! A session with a recorder.

use crate::input::Request;
use crate::recorder::Recorder;
use crate::replay::tell;
use hwall::contact::Predictor;
use hwall::hand::HandFrame;
use hwall::haptics::{ArmCommand, ArmState};
use hwall::{Controller, Cycle, Session, WorldPose};

/// A session that records its inputs and outputs in order: a [`Controller`] for [`drive`](hwall::drive), like the session itself. Without a
/// recorder it only forwards to the session.
///
/// The loop records views and events: after each cycle it calls [`Recorder::view`], and [`Recorder::event`] for every event that it takes.
pub struct Recorded<'a, P> {
    /// The session. Direct calls to it are not recorded.
    pub session: Session<P>,
    /// The recorder.
    pub recorder: Option<&'a mut Recorder>,
}

impl<P: Predictor> Recorded<'_, P> {
    /// Passes a request to the session, and records it.
    pub fn request(&mut self, request: Request) {
        if let Some(recorder) = &mut self.recorder {
            recorder.request(request);
        }
        tell(&mut self.session, request);
    }
}

impl<P: Predictor> Controller for Recorded<'_, P> {
    fn frame(&mut self, frame: &HandFrame) {
        if let Some(recorder) = &mut self.recorder {
            recorder.frame(frame);
        }
        self.session.frame(frame);
    }

    fn world(&mut self, pose: &WorldPose) {
        if let Some(recorder) = &mut self.recorder {
            recorder.world(pose);
        }
        Controller::world(&mut self.session, pose);
    }

    fn step(&mut self, now_s: f64, state: &ArmState) -> ArmCommand {
        let (planned, perceived) = (self.session.planned(), self.session.perceived());
        let command = self.session.step(now_s, state);
        if let Some(recorder) = &mut self.recorder {
            if perceived != self.session.perceived() {
                recorder.request(Request::Perceived);
            }
            if let Some([step, surfaces]) =
                self.session.planned().filter(|now| planned != Some(*now))
            {
                recorder.request(Request::Planned { step, surfaces });
            }
            recorder.cycle(&Cycle {
                t_s: now_s,
                state: *state,
                command,
            });
        }
        command
    }

    fn plan(&mut self) {
        self.session.plan();
        if self.session.has_lost_thread()
            && let Some(recorder) = &mut self.recorder
        {
            // The session has stopped itself.
            recorder.request(Request::Stop);
        }
    }

    fn refused(&mut self) {
        self.request(Request::Refused);
    }

    fn failed(&mut self) {
        self.request(Request::Stop);
    }
}
