//! A manager whose surroundings are played by the test; its effects are written down in words.

#![expect(clippy::disallowed_methods, reason = "the cost of a tick is measured on the wall clock")]
#![expect(unreachable_pub, reason = "no other crate uses a test: here `pub` means outside of the module")]

use std::path::{Path, PathBuf};
use std::sync::LazyLock;
use std::time::{Duration, Instant};

use domain::aircraft::Aircraft;
use domain::area::{Area, AreaKind};
use domain::contingency::Contingencies;
use domain::file::Source;
use domain::geometry::Ned;
use domain::mission::{Mission, MissionAreas};
use domain::plan::MissionStatus;
use domain::time::{Now, Pace, Time};
use kittiwake_proto::topics::{Message, Request, Response};
use kittiwake_proto::{PLANNING_PROTOCOL, v1};
use mcm::config::Config;
use mcm::{Mcm, Trees};
use node::{CallError, CallId, Effect, Event, Node, Token};
use signed_permissions::key::PublicKey;
use v1::mission_request::Request as Ask;

const CONFIG: &str = r#"
tick_period_ms = 10.0
request_timeout_s = 1.0
introspection_limit_s = 0.5
skill_silence_s = 2.0
permission_answer_s = 10.0
permission_tries = 3
permission_margin_s = 30.0
retry_pause_s = 1.0
arrival_radius_m = 1.5
transition_speed_m_s = 4.0
slow_speed_m_s = 5.0
climb_by_m = 20.0
braking_m_s2 = 3.0
farthest_out_m = 1000.0
barrier_limit_s = 60.0
leave_lead_s = 10.0
airspace_period_s = 0.2
go_ahead_limit_s = 600.0
start = "at-once"
plan_approval = "none"
plan_approval_limit_s = 60.0
plan_approval_default = "refuse"
"#;

/// The wall clock stands still.
const UTC_MS: i64 = 0;
/// What the manager calls its first flight.
const FLIGHT: &str = "1-0";

/// Of latitude.
const METRES_PER_DEGREE: f64 = 111_320.0;

fn now_ns() -> u64 {
    static START: LazyLock<Instant> = LazyLock::new(Instant::now);
    START.elapsed().as_nanos() as u64
}

pub struct Rig {
    pub mcm: Mcm,
    /// To the configuration.
    changes: Vec<(String, String)>,
    /// After those of the shipped table.
    rows: String,
    now: Time,
    /// Its effects since the last call, in words.
    pub log: Vec<String>,
    open: Vec<(CallId, Request)>,
    next_skill: u64,
    /// Request id and skill id of what executes.
    running: Option<(String, u64)>,
    flying: bool,
    mode: v1::FlightMode,
    position: v1::Ned,
    /// What the monitor reports of the gripper from the next introspection on.
    pub gripper: v1::Gripper,
    /// The wind that it reports from then on.
    pub wind: Option<v1::WindEstimate>,
    /// The vehicle's clock.
    timestamp_us: u64,
    /// Flags that the introspection lists.
    listed: Vec<v1::RaisedFlag>,
    undecided: Vec<String>,
    /// How often a flag has risen.
    rises: u64,
    /// The local frame that the vehicle is in, and how far north of the home of the stories it has its origin, in metres.
    pub frame: (u64, f64),
    /// What the autopilot flies by a failsafe of its own, in place of the mode of [`Rig::vehicle`]; and whether it misses setpoints.
    pub failsafe: Option<(v1::FlightMode, bool)>,
    /// Events are taken in, and acted on together.
    together: bool,
    /// Its newest status.
    status: v1::McmStatus,
    /// Its tree, as published last.
    pub tree: v1::TreeSnapshot,
    /// The answer to the command sent last.
    answer: Option<v1::OperatorReply>,
    commands: u64,
    reported: bool,
    /// The mission, as the planner would answer.
    mission: v1::MissionStatus,
    /// All its decisions, in words.
    pub decisions: Vec<String>,
    /// The same as records.
    pub records: Vec<v1::DecisionRecord>,
    /// The record of the last wake in which a leaf began or ceased to run.
    pub timing: v1::McmTiming,
}

/// A file of the shipped configuration. A bench includes this module, and its package lies at another depth.
fn shipped(name: &str) -> PathBuf {
    let folders = Path::new(env!("CARGO_MANIFEST_DIR")).ancestors();
    folders.map(|it| it.join("config").join(name)).find(|it| it.exists()).expect("it is shipped")
}

pub fn shipped_table() -> (Trees, Contingencies) {
    table_with("")
}

/// With these rows after those of the shipped table.
fn table_with(rows: &str) -> (Trees, Contingencies) {
    let trees = Trees::read(&shipped("trees")).unwrap();
    let Source { path, text } = Source::read(&shipped("contingencies.toml")).unwrap();
    let source = Source { path, text: format!("{text}\n{rows}") };
    let table = Contingencies::read(&source, &trees.actions()).unwrap_or_else(|mistakes| panic!("{mistakes}"));
    (trees, table)
}

/// The vehicle's figures of the shipped configuration.
fn shipped_aircraft() -> Aircraft {
    Source::read(&shipped("kittiwake.toml")).unwrap().parse().unwrap()
}

impl Rig {
    pub fn new() -> Rig {
        Rig::with(&[])
    }

    /// With these changes to the configuration.
    pub fn with(changes: &[(&str, &str)]) -> Rig {
        let mut rig = Rig::unseen(changes);
        rig.vehicle(false, v1::FlightMode::Loiter, (0.0, 0.0, 0.0));
        rig
    }

    /// Nothing has been heard of the vehicle yet.
    pub fn without_vehicle() -> Rig {
        Rig::unseen(&[])
    }

    /// With these rows after those of the shipped table; on the ground.
    pub fn with_rows(rows: &str) -> Rig {
        let mut rig = Rig::of(&[], rows);
        rig.vehicle(false, v1::FlightMode::Loiter, (0.0, 0.0, 0.0));
        rig
    }

    fn unseen(changes: &[(&str, &str)]) -> Rig {
        Rig::of(changes, "")
    }

    fn of(changes: &[(&str, &str)], rows: &str) -> Rig {
        let (trees, table) = table_with(rows);
        let text = changes.iter().fold(CONFIG.to_owned(), |text, (from, to)| text.replace(from, to));
        let config: Config = Source { path: "test".into(), text }.parse().unwrap();
        let loaded = trees.load(&table).unwrap();
        let areas = mission().areas;
        Rig {
            changes: changes.iter().map(|&(from, to)| (from.to_owned(), to.to_owned())).collect(),
            rows: rows.to_owned(),
            mcm: Mcm::new(&config, &shipped_aircraft(), "uav1", 1, &loaded, table, Pace::REAL_TIME)
                .unwrap()
                .of_mission(&mission())
                .measured_with(now_ns),
            now: Time::ZERO,
            log: Vec::new(),
            open: Vec::new(),
            next_skill: 1,
            running: None,
            flying: false,
            mode: v1::FlightMode::Loiter,
            position: v1::Ned::default(),
            gripper: v1::Gripper::Unspecified,
            wind: None,
            timestamp_us: 0,
            listed: Vec::new(),
            undecided: Vec::new(),
            rises: 0,
            frame: (0, 0.0),
            failsafe: None,
            together: false,
            status: v1::McmStatus::default(),
            tree: v1::TreeSnapshot::default(),
            answer: None,
            commands: 0,
            reported: false,
            mission: v1::MissionStatus { areas: areas.iter().map(Into::into).collect(), ..Default::default() },
            decisions: Vec::new(),
            records: Vec::new(),
            timing: v1::McmTiming::default(),
        }
    }

    /// Its process has ended, and another one continues from the persisted state. It has not heard of the vehicle yet.
    pub fn started_again(self) -> Rig {
        let changes: Vec<_> = self.changes.iter().map(|(from, to)| (from.as_str(), to.as_str())).collect();
        let mut rig = Rig::of(&changes, &self.rows);
        rig.mcm.resume(self.mcm.memory()).unwrap();
        rig.mission = self.mission;
        (rig.now, rig.flying, rig.mode, rig.position) = (self.now, self.flying, self.mode, self.position);
        (rig.timestamp_us, rig.listed, rig.gripper) = (self.timestamp_us, self.listed, self.gripper);
        rig.rises = self.rises;
        (rig.frame, rig.failsafe) = (self.frame, self.failsafe);
        rig.act();
        rig
    }

    /// It believes only permissions that are signed with the other half of this key.
    pub fn that_verifies_with(self, key: PublicKey) -> Rig {
        Rig { mcm: self.mcm.that_verifies_with(key), ..self }
    }

    /// The monitor reports the state of the vehicle.
    pub fn vehicle(&mut self, flying: bool, mode: v1::FlightMode, at: (f64, f64, f64)) {
        (self.flying, self.mode) = (flying, mode);
        self.position = v1::Ned { north_m: at.0, east_m: at.1, down_m: -at.2 };
        self.timestamp_us += 1;
        let other = if flying && mode == v1::FlightMode::Unspecified { "a pilot has chosen the mode" } else { "" };
        self.say(v1::SkillControl { flown_by_other: other.to_owned() });
        let introspection = self.introspection();
        self.say(introspection);
    }

    /// The monitor's report of the vehicle as it is now.
    pub fn introspection(&self) -> v1::Introspection {
        let (flying, mode, timestamp_us) = (self.flying, self.mode, self.timestamp_us);
        let (frame_epoch, north_m) = self.frame;
        // Slowly, so that it rests within a metre.
        let east_m_s = if flying && mode == v1::FlightMode::Offboard { 2.0 } else { 0.0 };
        let (actual, misses) = self.failsafe.unwrap_or((mode, false));
        let missed = misses.then_some(v1::FailureFlag::OffboardSignalLost as i32);
        v1::Introspection {
            status: Some(v1::VehicleStatus {
                armed: flying,
                intended_mode: mode as i32,
                actual_mode: actual as i32,
                failsafe: self.failsafe.is_some(),
                failures: missed.into_iter().collect(),
                gripper: self.gripper as i32,
                frame_epoch,
                origin: Some(v1::Origin {
                    latitude_deg: 57.0 + north_m / METRES_PER_DEGREE,
                    longitude_deg: 10.0,
                    altitude_amsl_m: Some(0.0),
                }),
                ..Default::default()
            }),
            local_position: Some(v1::VehicleLocalPosition {
                position: Some(self.position),
                velocity: Some(v1::NedVelocity { east_m_s, ..Default::default() }),
                timestamp_us,
                vertical_valid: true,
                ..Default::default()
            }),
            land_detected: Some(v1::VehicleLandDetected { landed: !flying, timestamp_us, ..Default::default() }),
            battery: Some(v1::BatteryStatus { remaining: 1.0, ..Default::default() }),
            ages: Some(v1::SourceAges {
                status_s: Some(0.0),
                local_position_s: Some(0.0),
                land_detected_s: Some(0.0),
                battery_s: Some(0.0),
                ..Default::default()
            }),
            flags: self.listed.clone(),
            undecided_flags: self.undecided.clone(),
            wind: self.wind,
            ..Default::default()
        }
    }

    pub fn say(&mut self, message: impl Into<Message>) {
        let mut message = message.into();
        if let Message::PermissionLedger(ledger) = &mut message {
            ledger.permissions.iter_mut().for_each(|it| self.complete(it));
        }
        self.event(Event::Message { vehicle: "uav1".into(), message });
    }

    /// What a line that is not signed does not say is said as the tower would answer this vehicle.
    pub fn complete(&self, line: &mut v1::Permission) {
        if !line.signature.is_empty() {
            return;
        }
        let or = |text: &mut String, other: &str| {
            if text.is_empty() {
                other.clone_into(text)
            }
        };
        or(&mut line.vehicle, "uav1");
        or(&mut line.flight, FLIGHT);
        if line.expires_utc_ms == 0 {
            line.expires_utc_ms = UTC_MS + (1000.0 * line.valid_for_s) as i64;
        }
        let told = self.mission.areas.iter().find(|it| it.name == line.area);
        let area = told.map_or(far_away(&line.area), |it| it.clone().try_into().expect("an area"));
        line.extent.get_or_insert(area.extent().into());
    }

    /// Another process of the monitor has appeared.
    pub fn monitor_started(&mut self) {
        let (vehicle, service, instance) = ("uav1".into(), "monitor".into(), "2".into());
        self.event(Event::Peer { vehicle, service, instance, alive: true });
    }

    /// The monitor raises a flag, or has it down from now on, and says so at once.
    pub fn flag(&mut self, name: &str, raised: bool) {
        self.listed.retain(|it| it.name != name);
        if raised {
            self.raise(v1::RaisedFlag { name: name.into(), reason: "by hand".into(), ..Default::default() });
        } else {
            self.say_flags();
        }
    }

    /// The monitor raises a flag, and says so at once.
    pub fn raise(&mut self, flag: v1::RaisedFlag) {
        self.rises += 1;
        self.listed.push(v1::RaisedFlag { rise: self.rises, ..flag });
        self.say_flags();
    }

    /// The monitor says how its flags stand, and nothing of the vehicle.
    fn say_flags(&mut self) {
        self.say(v1::Introspection { flags: self.listed.clone(), flags_changed: true, ..Default::default() });
    }

    /// From the next introspection on the monitor lists these flags.
    pub fn listed_flags(&mut self, names: &[&str]) {
        let listed = |name: &&str| v1::RaisedFlag { name: name.to_string(), ..Default::default() };
        self.listed = names.iter().map(listed).collect();
    }

    /// From the next introspection on the monitor cannot say whether these flags are up.
    pub fn undecided_flags(&mut self, names: &[&str]) {
        self.undecided = names.iter().map(|it| it.to_string()).collect();
    }

    /// All events of `happens` arrive in one batch.
    pub fn together(&mut self, happens: impl FnOnce(&mut Rig)) {
        self.together = true;
        happens(self);
        self.together = false;
        self.act();
    }

    /// Time passes while the monitor reports.
    pub fn wait(&mut self, seconds: f64) {
        let end = self.now + Duration::from_secs_f64(seconds);
        while self.now < end {
            self.now = end.min(self.now + Duration::from_millis(100));
            let at = (self.position.north_m, self.position.east_m, -self.position.down_m);
            self.vehicle(self.flying, self.mode, at);
        }
    }

    /// Time passes, and nobody says anything.
    pub fn silence(&mut self, seconds: f64) {
        self.now = self.now + Duration::from_secs_f64(seconds);
        self.act();
    }

    /// Answers the open request that `answer` has an answer for.
    #[track_caller]
    pub fn answer(&mut self, mut answer: impl FnMut(&Request) -> Option<Result<Response, CallError>>) {
        let found = self.open.iter().enumerate().find_map(|(index, (_, request))| Some((index, answer(request)?)));
        let (index, result) = found.unwrap_or_else(|| panic!("no open request fits; open are {:?}", self.open));
        let (call, _) = self.open.remove(index);
        self.event(Event::Reply { call, result });
    }

    /// An operator changes the mission, which does not touch what is flown.
    #[track_caller]
    pub fn mission(&mut self, mission: v1::MissionStatus) {
        self.change_mission(mission, false);
    }

    /// An operator changes the mission; the present plan is void by that, or not.
    #[track_caller]
    pub fn change_mission(&mut self, mission: v1::MissionStatus, voids_plan: bool) {
        let request =
            v1::MissionRequest { request: Some(Ask::Upload(v1::MissionText::default())), ..Default::default() };
        let request = Request::Mission(request);
        let together = std::mem::take(&mut self.together);
        let was_asked = self.open().any(|it| matches!(it, Request::Replan(_)));
        self.event(Event::Request { vehicle: "uav1".into(), token: Token(8), request });
        self.mission = mission;
        let areas = self.mission.areas.iter().cloned().map(|it| it.try_into().expect("an area")).collect::<Vec<_>>();
        let edited = v1::EditReply {
            protocol: PLANNING_PROTOCOL,
            reply: Some(v1::MissionReply { accepted: true, ..Default::default() }),
            mission: Some(self.course(false)),
            areas: Some(MissionAreas::of(&areas, &[]).encoded().clone()),
            voids_plan,
            ..Default::default()
        };
        self.together = together;
        self.answer(|it| matches!(it, Request::Edit(_)).then(|| Ok(Response::Edit(edited.clone()))));
        if was_asked && !together {
            // The answer is for the previous mission, so the manager asks again.
            let log = self.log.len();
            self.plan(v1::replan_reply::Reply::Hold(v1::HoldUntil::default()));
            self.log.truncate(log);
        }
    }

    /// The mission as it stands in an answer.
    fn course(&self, is_settled: bool) -> v1::MissionStatus {
        let mut objectives = self.mission.objectives.clone();
        if objectives.is_empty() {
            objectives = v1::MissionStatus::from(MissionStatus::beginning(&mission())).objectives;
        }
        for it in objectives.iter_mut().filter(|it| is_settled && it.state() == v1::ObjectiveState::Waiting) {
            it.set_state(v1::ObjectiveState::Success);
        }
        v1::MissionStatus { objectives, areas: Vec::new(), ..self.mission.clone() }
    }

    /// The mission has every area that these steps ask for; those of which the story says nothing are far away from it.
    fn tell_areas(&mut self, steps: &[v1::PlanStep]) {
        let mut mission = self.mission.clone();
        for name in steps.iter().flat_map(|it| &it.ask_permissions) {
            if mission.areas.iter().all(|it| it.name != *name) {
                mission.areas.push((&far_away(name)).into());
            }
        }
        if mission != self.mission {
            self.mission(mission);
        }
    }

    /// The planner answers the open request for a plan.
    #[track_caller]
    pub fn plan(&mut self, reply: v1::replan_reply::Reply) {
        self.answer_plan(reply, PLANNING_PROTOCOL);
    }

    /// The same by a planner of this version.
    #[track_caller]
    pub fn answer_plan(&mut self, reply: v1::replan_reply::Reply, protocol: u32) {
        let is_finished = matches!(reply, v1::replan_reply::Reply::Finished(_));
        let steps = match &reply {
            v1::replan_reply::Reply::Plan(plan) => plan.steps.clone(),
            _ => Vec::new(),
        };
        let mission = Some(self.course(is_finished));
        let reply = v1::ReplanReply { reply: Some(reply), protocol, mission, ..Default::default() };
        self.answer(|it| matches!(it, Request::Replan(_)).then(|| Ok(Response::Replan(reply.clone()))));
        self.tell_areas(&steps);
    }

    /// The skill manager takes the open request and executes it; returns its request id.
    #[track_caller]
    pub fn execute(&mut self) -> String {
        let (id, mut request_id) = (self.next_skill, String::new());
        self.next_skill += 1;
        self.answer(|it| match it {
            Request::Skill(skill) => {
                request_id = skill.request_id.clone();
                Some(Ok(Response::Skill(v1::SkillReply { skill_id: id, ..Default::default() })))
            }
            _ => None,
        });
        if let Some((old, old_id)) = self.running.replace((request_id.clone(), id)) {
            self.skill(&old, old_id, v1::SkillState::Ended, v1::SkillOutcome::Aborted, "overwritten");
        }
        self.skill(&request_id, id, v1::SkillState::Execute, v1::SkillOutcome::Unspecified, "");
        request_id
    }

    /// A skill ends.
    pub fn end(&mut self, request_id: &str, outcome: v1::SkillOutcome, reason: &str) {
        let id = self.running.take().map_or(0, |(_, id)| id);
        self.skill(request_id, id, v1::SkillState::Ended, outcome, reason);
    }

    fn skill(&mut self, id: &str, skill_id: u64, state: v1::SkillState, outcome: v1::SkillOutcome, reason: &str) {
        self.say(v1::SkillEvent {
            skill_id,
            request_id: id.to_owned(),
            // Only the end of the skill matters here; what it confirms about the vehicle has its own story.
            kind: v1::SkillKind::Offboard as i32,
            state: state as i32,
            outcome: outcome as i32,
            reason: reason.to_owned(),
            ..Default::default()
        });
    }

    /// Requests that wait for their answer.
    pub fn open(&self) -> impl Iterator<Item = &Request> {
        self.open.iter().map(|(_, request)| request)
    }

    /// The skill that executes succeeds, or ends otherwise.
    pub fn end_present(&mut self, outcome: v1::SkillOutcome) {
        let request_id = self.running.as_ref().map_or(String::new(), |(id, _)| id.clone());
        self.end(&request_id, outcome, "");
    }

    /// The operator Anna gives an order.
    pub fn command(&mut self, verb: v1::operator_command::Verb) -> v1::OperatorReply {
        self.commands += 1;
        self.command_as(&format!("c{}", self.commands), verb)
    }

    pub fn command_as(&mut self, request_id: &str, verb: v1::operator_command::Verb) -> v1::OperatorReply {
        let command = v1::OperatorCommand { request_id: request_id.into(), operator: "anna".into(), verb: Some(verb) };
        let request = Request::OperatorCommand(command);
        self.event(Event::Request { vehicle: "uav1".into(), token: Token(7), request });
        self.answer.take().expect("every command is answered at once")
    }

    /// Its newest status.
    pub fn status(&mut self) -> v1::McmStatus {
        self.status.clone()
    }

    /// Its effects since the last call, one line each.
    pub fn story(&mut self) -> String {
        std::mem::take(&mut self.log).join("\n")
    }

    fn event(&mut self, event: Event) {
        let now = Now { time: self.now, utc_ms: UTC_MS };
        let mut effects = Vec::new();
        self.mcm.on(now, event, &mut effects);
        effects.into_iter().for_each(|it| self.write_down(it));
        if !self.together {
            self.act();
        }
    }

    fn act(&mut self) {
        let mut effects = Vec::new();
        self.mcm.act(Now { time: self.now, utc_ms: UTC_MS }, &mut effects);
        effects.into_iter().for_each(|it| self.write_down(it));
    }

    fn write_down(&mut self, effect: Effect) {
        match effect {
            Effect::Call { call, request, .. } => {
                match &request {
                    Request::Skill(it) => self.log.push(format!("start {}", skill(it))),
                    Request::SkillCancel(it) => self.log.push(format!("cancel skill {}", it.skill_id)),
                    Request::Replan(it) => {
                        let denials: Vec<_> = it.denials.iter().map(|it| it.area.as_str()).collect();
                        let rest = it.basis.as_ref().and_then(|it| it.rest.first());
                        let failed = rest.filter(|_| it.failed).map_or(0, |it| it.id);
                        self.log.push(format!("replan after {failed} ({}) {denials:?}", it.failure));
                    }
                    Request::Permission(it) => self.log.push(format!("ask {}", it.area)),
                    _ => {}
                }
                self.open.push((call, request));
            }
            Effect::Reply { token: Token(7), response: Response::OperatorCommand(reply) } => self.answer = Some(reply),
            Effect::Refused { what, why } => self.log.push(format!("{} refused: {why}", what.key())),
            Effect::Publish { message: Message::McmTiming(timing), .. } => self.timing = timing,
            Effect::Publish { message: Message::TreeSnapshot(tree), .. } => self.tree = tree,
            Effect::Publish { message: Message::DecisionRecord(it), .. } => {
                self.decisions.push(it.text.clone());
                self.records.push(it);
            }
            Effect::Publish { message: Message::McmStatus(status), .. } => {
                self.status = status.clone();
                if let Some(report) = status.report.filter(|_| !std::mem::replace(&mut self.reported, true)) {
                    self.log.push(format!("report {:?}: {}", report.outcome(), report.reason));
                }
            }
            _ => {}
        }
    }
}

/// The mission of every story that names no other one.
pub fn mission() -> Mission {
    let text =
        "name = \"story\"\n[[objective]]\nname = \"there\"\nnorth_m = 0\neast_m = 500\nheight_m = 10\nflying = true\n";
    let mission = Mission::read(&Source { path: "mission".into(), text: text.into() }).expect("a mission");
    Mission { areas: ["A", "B", "C"].map(far_away).to_vec(), ..mission }
}

fn far_away(name: &str) -> Area {
    let corner = |(north_m, east_m)| Ned::new(50_000.0 + north_m, 50_000.0 + east_m, 0.0);
    Area::new(name, AreaKind::Permission, [(0.0, 0.0), (9.0, 0.0), (0.0, 9.0)].map(corner).to_vec())
}

fn skill(it: &v1::SkillRequest) -> String {
    use v1::skill_goal::Goal as G;
    let what = match it.goal.as_ref().and_then(|it| it.goal.as_ref()) {
        Some(G::Land(_)) => "land".to_owned(),
        Some(G::Takeoff(it)) => format!("takeoff {}", it.climb_m),
        Some(G::Stop(_)) => "stop".to_owned(),
        Some(G::Position(it)) => {
            let at = it.target.unwrap();
            format!("fly {} {} {}", at.north_m + 0.0, at.east_m + 0.0, -at.down_m)
        }
        Some(G::Release(it)) => {
            let over = it.over.unwrap();
            format!("release over {} {}", over.north_m + 0.0, over.east_m + 0.0)
        }
        other => format!("{other:?}"),
    };
    if it.gave_up_skill_id == 0 { what } else { format!("{what}, giving up {}", it.gave_up_skill_id) }
}

/// A step that flies `goal`.
pub fn step(id: u64, goal: domain::skill::Goal, ask: &[&str]) -> v1::PlanStep {
    let asking = if ask.is_empty() { String::new() } else { format!(", asking {}", ask.join(" and ")) };
    v1::PlanStep {
        id,
        text: format!("{goal}{asking}"),
        from: Some(v1::Ned::default()),
        goal_state: Some(v1::PlanningState { position: Some(v1::Ned::default()), ..Default::default() }),
        nominal: Some(v1::ParameterSet { goal: Some(goal.into()), ..Default::default() }),
        ask_permissions: ask.iter().map(|&it| it.to_owned()).collect(),
        ..Default::default()
    }
}

pub fn plan(steps: &[v1::PlanStep]) -> v1::replan_reply::Reply {
    v1::replan_reply::Reply::Plan(v1::Plan { steps: steps.to_vec(), ..Default::default() })
}
