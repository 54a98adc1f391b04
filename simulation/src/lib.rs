//! The whole system in one thread: the seven services on a virtual bus and a virtual clock.
//!
//! The same nodes that run as processes, from the same configuration files, but with a bus and a clock of their own.
//! The same setup gives the same flight, to the bit.

use std::cell::RefCell;
use std::collections::BTreeMap;
use std::path::Path;
use std::rc::Rc;
use std::time::Duration;

use control_tower::policy::Policy;
use domain::contingency::Contingencies;
use domain::file::{Mistakes, Source};
use domain::mission::Mission;
use domain::time::{Now, Pace, Time};
use kittiwake_proto::topics::{Message, Request, Service};
use kittiwake_proto::v1;
use node::Scope;
pub use node::virtual_bus::Machine;
use node::virtual_bus::{UTC_START_MS, VirtualBus};
use signed_permissions::key::SecretKey;

mod files;

pub use witness::Breach;
use witness::Witness;

/// The ground of the simulated vehicle is at height 0; below this the vehicle may stand there.
const LOW_M: f64 = 1.0;
/// The vehicle that flies.
const VEHICLE: &str = "uav1";

/// What is flown, and how the control tower answers.
#[derive(Debug, Clone)]
pub struct Setup<'a> {
    /// The folder of `kittiwake.toml`.
    pub config: &'a Path,
    /// The mission file; `None`: the one that the configuration names.
    pub mission: Option<&'a Path>,
    /// How the control tower answers.
    pub permissions: Policy,
    /// The seed of every random draw.
    pub seed: u64,
    /// The machine on which it flies.
    pub machine: Machine,
}

/// A system in flight.
pub struct Simulation<'a> {
    bus: VirtualBus<'a>,
    seen: Rc<RefCell<Seen>>,
}

#[derive(Debug, Default)]
struct Seen {
    decisions: Vec<(Time, v1::DecisionRecord)>,
    report: Option<v1::MissionReport>,
    aircraft: Option<v1::VehicleLocalPosition>,
    landed: bool,
    armed: bool,
    responder: String,
    alternates: Vec<v1::Alternate>,
    witness: Witness,
}

impl Simulation<'_> {
    /// All seven services, on the ground, at virtual time zero.
    ///
    /// # Errors
    /// Every mistake in the files.
    pub fn new(setup: &Setup<'_>) -> Result<Simulation<'static>, Mistakes> {
        let access = gateway::AccessControl { tokens: Default::default(), audit: gateway::audit::Audit::in_memory() };
        Ok(Simulation::with_gateway(setup, access)?.0)
    }

    /// The same with the HTTP half of its gateway, which accepts the tokens of `access` and answers while the
    /// simulation flies.
    ///
    /// # Errors
    /// Every mistake in the files.
    pub fn with_gateway(
        setup: &Setup<'_>,
        access: gateway::AccessControl,
    ) -> Result<(Simulation<'static>, gateway::http::Api), Mistakes> {
        let files = files::Files::read(setup)?;
        let pace = Pace::REAL_TIME;
        let seen = Rc::new(RefCell::new(Seen::default()));
        let mut bus = VirtualBus::new(setup.machine);
        let on_board = || Scope::Vehicle(VEHICLE.into());
        let record = seen.clone();
        bus.tap(move |time, message| record.borrow_mut().take_in(time, message));
        bus.add(on_board(), vehicle_sim::VehicleSim::new(&files.vehicle_sim, pace, setup.seed));
        bus.add(on_board(), skill_manager::SkillManager::new(&files.skill_manager, pace));
        bus.add(on_board(), monitor::Monitor::new(&files.monitor, &files.contingencies, pace));
        bus.add(on_board(), planner::Planner::new(&files.planner, &files.energy, files.mission, pace));
        let key = SecretKey::of_seed([1; 32]).expect("32 bytes make a key");
        bus.add(on_board(), files.mcm.that_verifies_with(key.public()));
        let tower = control_tower::ControlTower::new(&files.control_tower, setup.permissions, setup.seed, pace, 1);
        bus.add(Scope::Fleet, tower.that_signs_with(key));
        let (gateway, api) = gateway::Gateway::new(&files.gateway, pace, access, files.contingencies.rows(), || {});
        bus.add(Scope::Fleet, gateway);
        Ok((Simulation { bus, seen }, api))
    }

    /// Flies until the report is there, or `limit` of virtual time has passed.
    pub fn fly(&mut self, limit: Duration) -> Option<v1::MissionReport> {
        let seen = self.seen.clone();
        self.bus.run_until(limit, || seen.borrow().report.is_some());
        self.seen.borrow().report.clone()
    }

    /// Lets this much virtual time pass, whether the mission is over or not.
    pub fn pass(&mut self, time: Duration) {
        self.bus.run_until(time, || false);
    }

    /// Flies until a decision contains `text`, or `limit` of virtual time has passed; returns whether the decision
    /// came.
    pub fn fly_until(&mut self, text: &str, limit: Duration) -> bool {
        let seen = self.seen.clone();
        self.bus.run_until(limit, || seen.borrow().decisions.iter().any(|(_, it)| it.text.contains(text)))
    }

    /// Raises a flag by hand.
    pub fn inject_flag(&mut self, name: &str) {
        let reason = "by hand".to_owned();
        let source = "injector".to_owned();
        let flag = v1::FlagEvent { name: name.to_owned(), raised: true, source, reason, ..Default::default() };
        self.bus.publish(VEHICLE, flag);
    }

    /// The operator Anna gives an order.
    pub fn order(&mut self, verb: v1::operator_command::Verb) {
        let command =
            v1::OperatorCommand { request_id: self.request_id(), operator: "anna".to_owned(), verb: Some(verb) };
        self.request(Request::OperatorCommand(command));
    }

    /// The operator Anna makes a request about the mission.
    pub fn ask(&mut self, request: v1::mission_request::Request) {
        let request = v1::MissionRequest {
            request_id: self.request_id(),
            operator: "anna".to_owned(),
            state: None,
            request: Some(request),
        };
        self.request(Request::Mission(request));
    }

    fn request(&mut self, request: Request) {
        self.bus.request(VEHICLE, request);
    }

    /// Distinguishes requests; no two are made at one moment.
    fn request_id(&self) -> String {
        format!("{:?}", self.bus.now())
    }

    /// Injects a fault into the simulated vehicle.
    pub fn inject_fault(&mut self, name: &str, args: &[&str]) {
        let args = args.iter().map(|&it| it.to_owned()).collect();
        self.request(Request::Fault(v1::FaultRequest { name: name.to_owned(), args }));
    }

    /// Stops the process of this name for a while, as if it hung: it does nothing, and sends no heartbeat.
    ///
    /// # Panics
    /// If there is no such process.
    pub fn freeze(&mut self, process: &str, time: Duration) {
        self.bus.freeze(process, time);
    }

    /// Takes down a flag raised by hand.
    pub fn lower_flag(&mut self, name: &str) {
        let source = "injector".to_owned();
        self.bus.publish(VEHICLE, v1::FlagEvent { name: name.to_owned(), source, ..Default::default() });
    }

    /// The control tower decides by hand.
    pub fn decide(&mut self, area: &str, decision: v1::Decision) {
        self.decide_for(area, decision, None);
    }

    /// The same; a grant ends after `valid_for_s` mission seconds.
    pub fn decide_for(&mut self, area: &str, decision: v1::Decision, valid_for_s: Option<f64>) {
        self.request(Request::Decide(v1::DecideRequest {
            vehicle: VEHICLE.to_owned(),
            area: area.to_owned(),
            decision: decision as i32,
            reason: "by hand".to_owned(),
            valid_for_s,
        }));
    }

    /// The breaches that the witness has seen.
    pub fn breaches(&self) -> Vec<Breach> {
        self.seen.borrow().witness.breaches().to_vec()
    }

    /// Requests without a reply: service, request, how often.
    pub fn unanswered(&self) -> &BTreeMap<(&'static str, Service), u64> {
        self.bus.unanswered()
    }

    /// Virtual time.
    pub fn now(&self) -> Time {
        self.bus.now()
    }

    /// The vehicle's position as it reports it.
    pub fn position(&self) -> Option<v1::Ned> {
        self.seen.borrow().aircraft.as_ref().and_then(|it| it.position)
    }

    /// Whether the vehicle stands on the ground, disarmed.
    pub fn is_on_ground(&self) -> bool {
        let seen = self.seen.borrow();
        let height_m = seen.aircraft.as_ref().and_then(|it| it.position).map(|it| -it.down_m);
        let is_low = height_m.is_some_and(|it| it < LOW_M);
        !seen.armed && (seen.landed || is_low)
    }

    /// The flag that is answered, empty if none is.
    pub fn responder(&self) -> String {
        self.seen.borrow().responder.clone()
    }

    /// Where the flight may end early, best first, as the mission manager tells it.
    pub fn alternates(&self) -> Vec<v1::Alternate> {
        self.seen.borrow().alternates.clone()
    }

    /// Every decision so far with its time, one line each.
    pub fn decision_log(&self) -> String {
        let line =
            |(at, it): &(Time, v1::DecisionRecord)| format!("{:7.2}  {:<11} {}", at.as_secs_f64(), it.topic, it.text);
        self.seen.borrow().decisions.iter().map(line).collect::<Vec<_>>().join("\n")
    }

    /// The texts of the decisions about `topics`, in order.
    pub fn story(&self, topics: &[&str]) -> Vec<String> {
        let seen = self.seen.borrow();
        let wanted = seen.decisions.iter().filter(|(_, it)| topics.contains(&it.topic.as_str()));
        wanted.map(|(_, it)| it.text.clone()).collect()
    }
}

impl Seen {
    fn take_in(&mut self, time: Time, message: &Message) {
        let utc_ms = UTC_START_MS + time.since_start().as_millis() as i64;
        self.witness.take_in(Now { time, utc_ms }, message);
        match message {
            Message::DecisionRecord(it) => self.decisions.push((time, it.clone())),
            Message::McmStatus(it) => {
                self.report = self.report.take().or_else(|| it.report.clone());
                self.responder.clone_from(&it.acting);
                self.alternates.clone_from(&it.alternates);
            }
            Message::VehicleLandDetected(it) => self.landed = it.landed,
            Message::VehicleStatus(it) => self.armed = it.armed,
            Message::VehicleLocalPosition(it) => self.aircraft = Some(*it),
            _ => {}
        }
    }
}

/// A tree folder, a table and a mission, read as the program reads them.
pub(crate) fn read_table(config: &Path) -> Result<(mcm::LoadedTrees, Contingencies), Mistakes> {
    let trees = mcm::Trees::read(&config.join("trees"))?;
    let table = Contingencies::read(&Source::read(&config.join("contingencies.toml"))?, &trees.actions())?;
    Ok((trees.load(&table)?, table))
}

pub(crate) fn read_mission(path: &Path) -> Result<Mission, Mistakes> {
    Mission::read(&Source::read(path)?)
}
