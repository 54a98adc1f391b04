//! The bridge to an autopilot that speaks MAVLink 2: commands and setpoints of the `fmu/` topics become its messages, and what it says
//! becomes telemetry.
//!
//! What two real autopilots do, and do differently, is in two files of one interface (`personality`): which one it is says its
//! heartbeat. Everything else is common: who is believed (`peers`), how a command is carried out (`procedure`), who has
//! chosen the mode ([`domain::fmu::ModeObserver`]), whether positions can be compared (`epoch`).
//!
//! It knows no skills, missions or permissions. It sends no parameter, no mission and no origin to the autopilot. What the autopilot
//! does not say is not said here, and what is silent stays silent.

use domain::declared_skill::DeclaredSkills;
use domain::fmu::{CommandAck, CommandId, CommandResult, VehicleCommand};
use domain::time::{Now, Time};
use domain::wire::InvalidMessage;
use kittiwake_proto::topics::{Message, Topic};
use kittiwake_proto::v1;
use node::{Effect, Event, Node};

mod ardupilot;
mod bridge;
mod carrot;
pub mod check;
pub mod config;
mod epoch;
mod flown;
pub mod frame;
mod grooming;
pub mod ground;
pub mod heard;
mod intake;
mod landing_target;
pub mod link;
mod order;
mod peers;
mod personality;
mod pictures;
mod procedure;
mod px4;
mod said;
mod sent;
mod setpoints;
pub mod signing;
pub mod socket;
mod status;
mod streams;
mod telemetry;
mod vector;
mod vehicle;

use bridge::Bridge;
use config::Config;
use frame::Found;
use ground::Ground;
use intake::Intake;
use link::Link;
pub use peers::autopilot_voice;

/// The bridge as a service.
#[derive(Debug)]
pub struct MavlinkBridge<L> {
    bridge: Bridge,
    link: L,
    intake: Intake,
    /// The ground stations that watch, if any may.
    ground: Option<Ground>,
    /// Frames of MAVLink 1 that were heard.
    version_1: u64,
}

impl<L: Link> MavlinkBridge<L> {
    /// A bridge over `link`; nobody was heard.
    pub fn new(config: &Config, link: L) -> MavlinkBridge<L> {
        MavlinkBridge { bridge: Bridge::new(config), link, intake: Intake::default(), ground: None, version_1: 0 }
    }

    /// The same, with ground stations behind `link`: see [`ground`].
    pub fn seen_from_the_ground(mut self, link: impl Link + 'static) -> MavlinkBridge<L> {
        self.ground = Some(Ground::new(Box::new(link)));
        self
    }

    /// The same, with declared skills: the autopilot carries out those that have a command.
    #[must_use]
    pub fn with_skills(mut self, skills: &DeclaredSkills) -> MavlinkBridge<L> {
        self.bridge.carries_out(skills);
        self
    }

    fn receive(&mut self, now: Now, effects: &mut Vec<Effect>) {
        self.intake.begin_turn();
        while let Some(found) = self.intake.next(&mut self.link, now.time) {
            self.link.admit(autopilot_voice(&found));
            for it in found {
                match it {
                    Found::Frame(frame) => {
                        self.bridge.take_in(&frame, now, effects);
                        if let Some(ground) = &mut self.ground {
                            ground.forward_to_ground(&frame, now.time);
                        }
                    }
                    Found::Version1 => {
                        if self.version_1 == 0 {
                            tracing::warn!(
                                "somebody speaks MAVLink 1, which is not understood: set the autopilot to MAVLink 2"
                            );
                        }
                        self.version_1 += 1;
                    }
                }
            }
        }
        self.bridge.note_refused(self.link.refused());
    }

    fn take_in(&mut self, message: Message, now: Now, effects: &mut Vec<Effect>) -> Result<(), InvalidMessage> {
        match message {
            Message::VehicleCommand(it) => {
                let id = CommandId(it.id);
                match VehicleCommand::try_from(it) {
                    Ok(command) => self.bridge.command(command, now, effects),
                    Err(invalid) => {
                        let result = CommandResult::Rejected { reason: format!("the command is invalid: {invalid}") };
                        effects.push(Effect::publish(v1::VehicleCommandAck::from(CommandAck { id, result })));
                        return Err(invalid);
                    }
                }
            }
            Message::OffboardControlMode(it) => self.bridge.proof_of_life(it.try_into()?, now.time),
            Message::TrajectorySetpoint(it) => self.bridge.setpoint(it.try_into()?, now.time),
            Message::TaskOrder(order) => self.bridge.task(order, now, effects),
            Message::DecisionRecord(it) => {
                if let Some(ground) = &mut self.ground {
                    ground.tell(&it, self.bridge.system(), now.time);
                }
            }
            _ => {}
        }
        Ok(())
    }

    fn serve_ground(&mut self, now: Time) {
        let Some(ground) = &mut self.ground else { return };
        let system = self.bridge.system();
        for frame in ground.take_from_ground(system, now) {
            self.link.send(frame.bytes(), now);
        }
        if let Some(why) = ground.tell_refused() {
            tracing::warn!("{why}");
        }
        ground.act(system, now);
    }

    fn send(&mut self, now: Time) {
        for frame in self.bridge.take_frames() {
            self.link.send(frame.bytes(), now);
        }
    }
}

impl<L: Link> Node for MavlinkBridge<L> {
    fn name(&self) -> &'static str {
        "mavlink-bridge"
    }

    fn subscriptions(&self) -> &'static [Topic] {
        &[
            Topic::VehicleCommand,
            Topic::OffboardControlMode,
            Topic::TrajectorySetpoint,
            Topic::DecisionRecord,
            Topic::TaskOrder,
        ]
    }

    fn on(&mut self, now: Now, event: Event, effects: &mut Vec<Effect>) {
        if let Event::Message { message, .. } = event {
            let topic = message.topic();
            if let Err(invalid) = self.take_in(message, now, effects) {
                effects.push(Effect::refused(topic, invalid));
            }
        }
        self.send(now.time);
    }

    fn act(&mut self, now: Now, effects: &mut Vec<Effect>) {
        self.receive(now, effects);
        self.serve_ground(now.time);
        self.bridge.act(now, effects);
        self.send(now.time);
    }

    fn deadline(&self) -> Option<Time> {
        let ground = self.ground.as_ref().and_then(Ground::deadline);
        [self.link.arrival(), self.intake.deadline(), self.bridge.deadline(), ground].into_iter().flatten().min()
    }
}
