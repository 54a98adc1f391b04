//! The bridge without its sockets: frames, commands, setpoints and time in; frames and `fmu/` messages out.

use std::time::Duration;

use autopilot::tasks::Tasks;
use domain::declared_skill::DeclaredSkills;
use domain::fmu::{Command, CommandAck, CommandId, CommandResult, OffboardControl, Setpoint, VehicleCommand};
use domain::time::{Now, Time};
use kittiwake_proto::v1;
use node::{Answers, Effect};

use crate::config::Config;
use crate::flown::Flown;
use crate::frame::Frame;
use crate::heard::{Heard, heard};
use crate::peers::{Peers, Whose};
use crate::personality;
use crate::pictures::{Pictures, Reporter};
use crate::said::{Said, Speaker};
use crate::status::Surroundings;

/// The bridge.
#[derive(Debug)]
pub(crate) struct Bridge {
    config: Config,
    peers: Peers,
    speaker: Speaker,
    flown: Option<Flown>,
    next_heartbeat: Time,
    answered: Answers<CommandResult, CommandId>,
    outgoing: Vec<Frame>,
    setpoint: Option<(Time, Setpoint)>,
    control: Option<(Time, OffboardControl)>,
    /// What was said last of why nothing is flown.
    said_problem: Option<String>,
    tasks: Tasks,
    pictures: Pictures,
}

/// Our own heartbeat, as MAVLink demands.
const HEARTBEAT_PERIOD: Duration = Duration::from_secs(1);

impl Bridge {
    /// Nobody was heard.
    pub(crate) fn new(config: &Config) -> Bridge {
        Bridge {
            config: config.clone(),
            peers: Peers::new(config.system),
            speaker: Speaker::default(),
            flown: None,
            next_heartbeat: Time::ZERO,
            answered: Answers::default(),
            outgoing: Vec::new(),
            setpoint: None,
            control: None,
            said_problem: None,
            tasks: Tasks::default(),
            pictures: Pictures::default(),
        }
    }

    /// The autopilot carries out those of these skills that have a command.
    pub(crate) fn carries_out(&mut self, skills: &DeclaredSkills) {
        self.tasks = Tasks::of(skills);
    }

    /// A task is ordered.
    pub(crate) fn task(&mut self, order: v1::TaskOrder, now: Now, effects: &mut Vec<Effect>) {
        let ends = self.tasks.order(order, now.time);
        self.say_to_vehicle(ends.map(Said::from));
        self.act(now, effects);
    }

    /// The frames to be sent.
    pub(crate) fn take_frames(&mut self) -> Vec<Frame> {
        std::mem::take(&mut self.outgoing)
    }

    /// The system of the autopilot that is flown, once one is.
    pub(crate) fn system(&self) -> Option<u8> {
        self.flown.as_ref().map(|it| it.system)
    }

    /// A frame has arrived.
    pub(crate) fn take_in(&mut self, frame: &Frame, now: Now, effects: &mut Vec<Effect>) {
        let Some(heard) = heard(frame) else { return };
        if let Heard::Heartbeat(heartbeat) = &heard {
            let personality = personality::of(heartbeat.autopilot);
            let whose = self.peers.beat(frame, heartbeat, personality.is_some(), now.time);
            if let (Whose::Flown { first: true }, Some(personality)) = (whose, personality) {
                tracing::info!(system = frame.system(), autopilot = personality.name(), "an autopilot is heard");
                self.flown = Some(Flown::new(frame.system(), personality, &self.config, now.time));
            }
        }
        if let (Heard::Picture(picture), Some(flown)) = (&heard, &self.flown) {
            let is_camera = self.peers.is_camera(frame);
            if is_camera || self.peers.is_flown(frame) {
                let by = Reporter {
                    is_autopilot: !is_camera,
                    report: picture.report,
                    component: frame.component(),
                    camera: picture.camera,
                };
                self.pictures.take_in(by, picture, &flown.vehicle, now);
                self.tasks.picture_reported();
            }
            return;
        }
        if self.peers.is_flown(frame)
            && let Some(flown) = &mut self.flown
            && (heard.is_event() || !flown.order.is_overtaken(frame.id(), frame.sequence(), now.time))
        {
            flown.take_in(&heard, now, effects);
            if let Heard::Ack(ack) = heard
                && ack.is_ours(flown.system)
            {
                self.tasks.acknowledged(ack.command, ack.result, now.time);
            }
        }
    }

    /// Why something that has arrived was not believed, if anything was.
    pub(crate) fn note_refused(&mut self, why: Option<String>) {
        self.peers.refused = why;
    }

    /// A command of the layers above.
    pub(crate) fn command(&mut self, it: VehicleCommand, now: Now, effects: &mut Vec<Effect>) {
        let VehicleCommand { id, command } = it;
        if let Some(result) = self.answered.get(&id) {
            effects.push(answer(id, result.clone()));
            return;
        }
        let starts = matches!(command, Command::Arm | Command::Takeoff { .. });
        let problem = self.peers.problem(now.time).filter(|_| starts || self.flown.is_none());
        let result = match (&mut self.flown, problem) {
            (_, Some(problem)) => Err(problem),
            (None, None) => Err("no autopilot is heard".into()),
            (Some(flown), None) => flown.begin(id, command, now.time),
        };
        if let Err(reason) = result {
            self.answer(id, CommandResult::Rejected { reason }, effects);
        }
        self.act(now, effects);
    }

    /// The layers above are alive.
    pub(crate) fn proof_of_life(&mut self, control: OffboardControl, now: Time) {
        self.control = Some((now, control));
    }

    /// Where the layers above want it to fly.
    pub(crate) fn setpoint(&mut self, setpoint: Setpoint, now: Time) {
        self.setpoint = Some((now, setpoint));
        if let (true, Some(flown)) = (self.has_setpoint(now), &mut self.flown) {
            let target = flown.follow(&setpoint, &self.config, now);
            self.say_to_vehicle(target.map(Said::Setpoint));
        }
    }

    /// Whether setpoint and proof of life belong together and are fresh.
    fn has_setpoint(&self, now: Time) -> bool {
        let limit = self.config.setpoint_age_limit_s.seconds();
        let (Some((set, setpoint)), Some((alive, control))) = (self.setpoint, self.control) else { return false };
        setpoint.control() == control && now - set <= limit && now - alive <= limit
    }

    /// Does what is due.
    pub(crate) fn act(&mut self, now: Now, effects: &mut Vec<Effect>) {
        self.say_problem(now.time);
        let has_setpoint = self.has_setpoint(now.time);
        let newest = self.setpoint.map(|(_, it)| it);
        let problem = self.peers.problem(now.time);
        let mut says = Vec::new();
        if self.next_heartbeat <= now.time {
            self.next_heartbeat = now.time + HEARTBEAT_PERIOD;
            says.push(Said::Heartbeat);
        }
        let Some(flown) = &mut self.flown else { return };
        says.extend(flown.streams.origin_due(now.time));
        says.extend(flown.streams.due(now.time));
        let result = flown.advance(newest.filter(|_| has_setpoint), &self.config, now.time, &mut says);
        flown.observe(now.time);
        flown.adopt(has_setpoint, now.time);
        if let Some((id, result)) = result {
            self.answered.remember(id, result.clone());
            effects.push(answer(id, result));
        }
        says.extend(flown.stop_without_setpoints(has_setpoint, now.time).map(Said::Setpoint));
        says.extend(flown.groom(now.time));
        self.pictures.act(now.time, effects);
        let mut sends = Vec::new();
        self.tasks.act(problem.is_none(), now.time, &mut sends, effects);
        says.extend(sends.into_iter().map(Said::from));
        effects.extend(flown.report(Surroundings { problem, has_setpoint }, &self.config, now.time));
        self.say_to_vehicle(says);
    }

    /// When something is due.
    pub(crate) fn deadline(&self) -> Option<Time> {
        let Some(flown) = &self.flown else { return Some(self.next_heartbeat) };
        [Some(self.next_heartbeat), flown.deadline(), self.tasks.deadline(), self.pictures.deadline()]
            .into_iter()
            .flatten()
            .min()
    }

    fn answer(&mut self, id: CommandId, result: CommandResult, effects: &mut Vec<Effect>) {
        self.answered.remember(id, result.clone());
        effects.push(answer(id, result));
    }

    fn say_to_vehicle(&mut self, says: impl IntoIterator<Item = Said>) {
        let Some(flown) = &mut self.flown else { return };
        let frames = says.into_iter().map(|it| {
            flown.told(&it);
            match it {
                Said::Setpoint(target) => self.speaker.frame(Said::Setpoint(flown.in_its_frame(target)), flown.system),
                it => self.speaker.frame(it, flown.system),
            }
        });
        self.outgoing.extend(frames);
    }

    /// Says in the log why nothing is flown, once.
    fn say_problem(&mut self, now: Time) {
        // A bridge that starts together with the autopilot does not hear it at once.
        const PATIENCE: Duration = Duration::from_secs(3);
        let problem = self.peers.problem(now).filter(|_| PATIENCE < now - Time::ZERO);
        if problem != self.said_problem {
            match &problem {
                Some(problem) => tracing::warn!("{problem}"),
                None => tracing::info!("one autopilot is on the link"),
            }
            self.said_problem = problem;
        }
    }
}

fn answer(id: CommandId, result: CommandResult) -> Effect {
    Effect::publish(v1::VehicleCommandAck::from(CommandAck { id, result }))
}
