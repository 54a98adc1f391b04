//! Every key expression with its message type and its quality of service, in one table.
//!
//! A new topic is one line in [`Topic`]'s table, a new request one line in [`Service`]'s; the
//! enums [`Message`], [`Request`] and [`Response`] follow from them, so a match over what a
//! process receives is complete or does not compile.
//!
//! Keys are relative to the vehicle's namespace, `kw/<vehicle>`.

use prost::Message as _;

use crate::v1;

/// How a topic travels. Chosen in the table below and nowhere else.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum Qos {
    /// Telemetry: dropped under pressure, low priority, the receiver keeps the newest only.
    Sampled,
    /// Refreshed state: the receiver keeps the newest only.
    State,
    /// Rare changes and events: queued in order at the receiver, never replaced by newer ones.
    Transition,
    /// Commands: high priority, express, queued. Correctness rests on acknowledgement, deadline
    /// and id, never on the transport's blocking.
    Command,
}

impl Qos {
    /// Whether a receiver only wants the newest sample.
    pub fn keeps_newest_only(self) -> bool {
        matches!(self, Qos::Sampled | Qos::State)
    }
}

/// A payload that is not the message its key promises.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Malformed {
    /// The key it came on.
    pub key: &'static str,
    /// What the decoder said.
    pub cause: String,
}

impl std::fmt::Display for Malformed {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        write!(f, "payload on `{}` is malformed: {}", self.key, self.cause)
    }
}

impl std::error::Error for Malformed {}

macro_rules! topics {
    ($($(#[$doc:meta])* $name:ident $key:literal $qos:ident;)*) => {
        /// A topic: a key with one message type and one quality of service.
        #[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, PartialOrd, Ord)]
        pub enum Topic { $($(#[$doc])* $name,)* }

        impl Topic {
            /// Every topic there is.
            pub const ALL: &[Topic] = &[$(Topic::$name),*];

            /// The key, relative to the vehicle's namespace.
            pub const fn key(self) -> &'static str {
                match self { $(Topic::$name => $key,)* }
            }

            /// How it travels.
            pub const fn qos(self) -> Qos {
                match self { $(Topic::$name => Qos::$qos,)* }
            }

            /// The full protobuf name of its message.
            pub fn type_name(self) -> String {
                match self { $(Topic::$name => <v1::$name as prost::Name>::full_name(),)* }
            }
        }

        /// A message of any topic.
        #[derive(Debug, Clone, PartialEq)]
        pub enum Message { $($(#[$doc])* $name(v1::$name),)* }

        impl Message {
            /// The topic it belongs to.
            pub fn topic(&self) -> Topic {
                match self { $(Message::$name(_) => Topic::$name,)* }
            }

            /// Its bytes on the wire.
            pub fn encode(&self) -> Vec<u8> {
                match self { $(Message::$name(it) => it.encode_to_vec(),)* }
            }

            /// The message of `topic` in `bytes`.
            pub fn decode(topic: Topic, bytes: &[u8]) -> Result<Message, Malformed> {
                Ok(match topic { $(Topic::$name => Message::$name(decode($key, bytes)?),)* })
            }

            /// Canonical proto3 JSON.
            pub fn to_json(&self) -> serde_json::Value {
                match self { $(Message::$name(it) => crate::json::to_json(it),)* }
            }
        }

        $(impl From<v1::$name> for Message {
            fn from(it: v1::$name) -> Message { Message::$name(it) }
        })*
    };
}

topics! {
    /// Commands to the autopilot; each is answered by a [`Topic::VehicleCommandAck`].
    VehicleCommand "fmu/in/vehicle_command" Command;
    /// The offboard proof of life.
    OffboardControlMode "fmu/in/offboard_control_mode" Command;
    /// Where, or how, to fly offboard; streamed with the proof of life.
    TrajectorySetpoint "fmu/in/trajectory_setpoint" Command;
    /// One per command.
    VehicleCommandAck "fmu/out/vehicle_command_ack" Transition;
    /// 2 Hz and on every change.
    VehicleStatus "fmu/out/vehicle_status" Transition;
    /// 240 Hz.
    VehicleAttitude "fmu/out/vehicle_attitude" Sampled;
    /// 123 Hz.
    VehicleLocalPosition "fmu/out/vehicle_local_position" Sampled;
    /// 123 Hz.
    VehicleGlobalPosition "fmu/out/vehicle_global_position" Sampled;
    /// 1 Hz and on every change.
    VehicleLandDetected "fmu/out/vehicle_land_detected" Transition;
    /// 99 Hz.
    BatteryStatus "fmu/out/battery_status" Sampled;
    /// Other traffic, 1 Hz each.
    TransponderReport "fmu/out/transponder_report" Transition;
    /// The wind, 1 Hz.
    WindEstimate "fmu/out/wind" Sampled;
    /// One per picture.
    Picture "fmu/out/picture" Transition;
    /// What became of a skill.
    SkillEvent "skill/event" Transition;
    /// Who flies the vehicle, 2 Hz and on every change.
    SkillControl "skill/control" Transition;
    /// 10 Hz while a skill executes.
    SkillFeedback "skill/feedback" State;
    /// To the process that carries out a declared skill.
    TaskOrder "task/order" Command;
    /// From such a process, 1 Hz and on every change.
    TaskReport "task/report" Transition;
    /// 100 Hz, and at once when a flag rises or falls: more urgent than what it is made of.
    Introspection "monitor/introspection" State;
    /// A flag is raised or lowered by hand: by tests, measurements and the operators of a simulation.
    FlagEvent "monitor/flag" Transition;
    /// What the control tower has decided.
    PermissionLedger "permission/ledger" Transition;
    /// The mission: objectives, areas and plan.
    MissionStatus "mission/status" Transition;
    /// What the mission manager does.
    McmStatus "mcm/status" Transition;
    /// What the mission manager decided and why.
    DecisionRecord "mcm/decision" Transition;
    /// When what happened inside the mission manager; for measurements.
    McmTiming "mcm/timing" Transition;
    /// The tree with its statuses, 2 Hz.
    TreeSnapshot "mcm/tree" State;
    /// Each process's proof of progress, 4 Hz.
    Heartbeat "health" Transition;
    /// The ground is there and hears the vehicle, 2 Hz.
    GroundContact "ground/contact" Transition;
}

impl Message {
    /// Whether it is an event that others act on: an event without a traced cause begins
    /// a trace, so that what follows from it can be distinguished.
    pub fn begins_trace(&self) -> bool {
        match self {
            Message::FlagEvent(_) | Message::SkillEvent(_) | Message::PermissionLedger(_) => true,
            Message::Introspection(it) => it.flags_changed,
            _ => false,
        }
    }
}

macro_rules! services {
    ($($(#[$doc:meta])* $name:ident $key:literal $request:ident => $response:ident;)*) => {
        /// A request with exactly one reply.
        #[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, PartialOrd, Ord)]
        pub enum Service { $($(#[$doc])* $name,)* }

        impl Service {
            /// Every service there is.
            pub const ALL: &[Service] = &[$(Service::$name),*];

            /// The key, relative to the vehicle's namespace.
            pub const fn key(self) -> &'static str {
                match self { $(Service::$name => $key,)* }
            }
        }

        /// A request to any service.
        #[derive(Debug, Clone, PartialEq)]
        pub enum Request { $($(#[$doc])* $name(v1::$request),)* }

        impl Request {
            /// The service it is for.
            pub fn service(&self) -> Service {
                match self { $(Request::$name(_) => Service::$name,)* }
            }

            /// Its bytes on the wire.
            pub fn encode(&self) -> Vec<u8> {
                match self { $(Request::$name(it) => it.encode_to_vec(),)* }
            }

            /// The request to `service` in `bytes`.
            pub fn decode(service: Service, bytes: &[u8]) -> Result<Request, Malformed> {
                Ok(match service { $(Service::$name => Request::$name(decode($key, bytes)?),)* })
            }
        }

        /// The reply of any service.
        #[derive(Debug, Clone, PartialEq)]
        pub enum Response { $($(#[$doc])* $name(v1::$response),)* }

        impl Response {
            /// Its bytes on the wire.
            pub fn encode(&self) -> Vec<u8> {
                match self { $(Response::$name(it) => it.encode_to_vec(),)* }
            }

            /// The reply of `service` in `bytes`.
            pub fn decode(service: Service, bytes: &[u8]) -> Result<Response, Malformed> {
                Ok(match service { $(Service::$name => Response::$name(decode($key, bytes)?),)* })
            }
        }
    };
}

services! {
    /// Start a skill.
    Skill "skill/request" SkillRequest => SkillReply;
    /// Cancel a skill.
    SkillCancel "skill/cancel" SkillCancelRequest => SkillCancelReply;
    /// Ask what runs and what became of recent skills.
    SkillTable "skill/table" SkillTableRequest => SkillTable;
    /// Ask for a plan.
    Replan "planner/replan" ReplanRequest => ReplanReply;
    /// Ask what a request about the mission comes to.
    Edit "planner/edit" EditRequest => EditReply;
    /// Order something of the mission manager.
    OperatorCommand "mcm/command" OperatorCommand => OperatorReply;
    /// Read, try out or change the mission.
    Mission "mission/request" MissionRequest => MissionReply;
    /// Ask to enter an area.
    Permission "permission/request" PermissionRequest => PermissionReceipt;
    /// Decide about an area by hand.
    Decide "permission/decide" DecideRequest => DecideReply;
    /// Let the tower grant again although it has lost decisions.
    AcceptLoss "permission/accept_loss" AcceptLossRequest => AcceptLossReply;
    /// What the party at a site says of its readiness; it holds for every vehicle.
    SiteReport "site/report" SiteReport => SiteReportReply;
    /// Inject a fault into the simulator.
    Fault "sim/fault" FaultRequest => FaultReply;
}

impl Service {
    /// Whether people ask it, as often as they please, such as an operator who tries out missions.
    pub const fn is_order(self) -> bool {
        matches!(
            self,
            Service::OperatorCommand
                | Service::Mission
                | Service::Decide
                | Service::AcceptLoss
                | Service::SiteReport
                | Service::Fault
        )
    }
}

fn decode<M: prost::Message + Default>(key: &'static str, bytes: &[u8]) -> Result<M, Malformed> {
    M::decode(bytes).map_err(|cause| Malformed { key, cause: cause.to_string() })
}
