//! The whole system in one thread: the seven services on a virtual bus and a virtual clock.
//!
//! The same nodes that run as processes, from the same configuration files, but with a bus and a clock of their own.
//! The same setup gives the same flight, to the bit.

use std::cell::{Cell, RefCell};
use std::collections::BTreeMap;
use std::path::Path;
use std::rc::Rc;
use std::time::Duration;

use control_tower::policy::Policy;
use domain::contingency::{Contingencies, OPERATOR_ABORT};
use domain::declared_skill::DeclaredSkills;
use domain::file::{Mistake, Mistakes, Source};
use domain::geometry::Ned;
use domain::mission::Mission;
use domain::quantity::Positive;
use domain::time::{Now, Pace, Time};
use kittiwake_proto::topics::{Request, Service, Topic};
use kittiwake_proto::v1;
use node::virtual_bus::VirtualBus;
pub use node::virtual_bus::{Disturbance, Machine};
use node::{Node, Scope};
use signed_permissions::key::SecretKey;

pub mod bounds;
pub mod chaos;
mod files;
mod ground;
mod lying;
pub mod proof;
pub mod recording;
mod restart;
pub mod resumable;
mod seen;
mod shared;
mod skill_process;

use bounds::Excursion;
use files::Files;
use ground::Ground;
use lying::Lying;
use recording::{Header, Recorded, Tape};
pub use restart::Memory;
use restart::Starts;
use seen::Seen;
use shared::Shared;
pub use skill_process::Conduct;
use skill_process::SkillProcess;
use vehicle_sim::VehicleSim;
use vehicle_sim::ground::{Ground as Relief, Patch, Surface};
pub use witness::Breach;
use witness::modes::ModeStorm;
use witness::setpoints::StaleSetpoint;
use witness::truth::Figures;

/// The side of the ground at a place to land at that is higher or lower than what is round it.
pub(crate) const PLACE_M: f64 = 50.0;

/// The vehicle that flies.
const VEHICLE: &str = "uav1";

fn simulated(files: &Files, setup: &Setup<'_>, ground: Relief) -> Shared<VehicleSim> {
    Shared::of(VehicleSim::new(&files.vehicle_sim, Pace::REAL_TIME, setup.seed).over(ground))
}

/// What is flown, and how the control tower answers.
#[derive(Debug, Clone)]
pub struct Setup<'a> {
    /// The folder of `kittiwake.toml`, or a configuration file of another name.
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

/// What is flown otherwise than the files say.
#[derive(Debug, Clone, Default)]
pub struct Changes {
    /// The mission, in place of that of the files.
    pub mission: Option<Mission>,
    /// Mission seconds for which a grant of the control tower holds.
    pub grant_valid_s: Option<Positive>,
    /// What the mission manager and the planner are given and decide goes here.
    pub tape: Option<Tape>,
    /// The planner's answers are falsified, as this seed draws it.
    pub lies: Option<u64>,
    /// The ground.
    pub ground: Relief,
}

/// Files that were read once, for many short flights without a gateway and with telemetry that is as seldom as the services allow.
pub struct System {
    files: Rc<Files>,
}

impl System {
    /// Reads the files of this configuration: a folder with `kittiwake.toml`, or a configuration file.
    ///
    /// # Errors
    /// Every mistake in them.
    pub fn read(config: &Path) -> Result<System, Mistakes> {
        let setup = Setup { config, mission: None, permissions: Policy::Grant, seed: 1, machine: Machine::Ideal };
        let files = Files::read(&setup)?.made_coarse().map_err(|message| {
            Mistakes(vec![Mistake { path: config.to_owned(), place: None, message, help: String::new() }])
        })?;
        Ok(System { files: Rc::new(files) })
    }

    /// The contingency table.
    pub fn table(&self) -> &Contingencies {
        &self.files.contingencies
    }

    /// The declared skills.
    pub fn skills(&self) -> &DeclaredSkills {
        &self.files.skills
    }

    /// A flight of the mission of this text over this ground.
    ///
    /// # Errors
    /// Mistakes in the text.
    pub fn simulation(
        &self,
        mission: &str,
        permissions: Policy,
        ground: Relief,
    ) -> Result<Simulation<'static>, Mistakes> {
        let mission = Mission::read(&Source { path: "the mission of the proof".into(), text: mission.to_owned() })?;
        // Without a folder: all files have been read.
        let setup = Setup { config: Path::new(""), mission: None, permissions, seed: 1, machine: Machine::Ideal };
        let world = simulated(&self.files, &setup, ground);
        let simulation = Simulation::without_gateway(&setup, &self.files, mission, Changes::default(), world.clone())?;
        Ok(simulation.in_sight(world))
    }

    /// A flight of a mission over its ground, in contact with the ground.
    pub(crate) fn over(&self, mission: Mission, seed: u64, ground: Relief) -> Result<Simulation<'static>, Mistakes> {
        let (permissions, machine) = (Policy::Grant, Machine::Ideal);
        let setup = Setup { config: Path::new(""), mission: None, permissions, seed, machine };
        let world = simulated(&self.files, &setup, ground);
        let mut simulation =
            Simulation::without_gateway(&setup, &self.files, mission, Changes::default(), world.clone())?;
        simulation.bus.add(Scope::Fleet, Ground::default());
        Ok(simulation.in_sight(world))
    }
}

/// With which the control tower signs: the same in every flight.
fn tower_key() -> SecretKey {
    SecretKey::of_seed([1; 32]).expect("32 bytes make a key")
}

/// A node whose inputs and decisions go to the tape, the one of this number; `start` is 0 for the first of its kind.
fn recorded<N: Node>(node: N, number: u8, tape: &Tape, start: u64, now: Now, instance: u64) -> Recorded<N, Tape> {
    match start {
        0 => Recorded::new(node, number, tape.clone()),
        _ => Recorded::restarted(node, number, tape.clone(), now, instance),
    }
}

/// A system in flight.
pub struct Simulation<'a> {
    bus: VirtualBus<'a>,
    starts: Starts,
    /// Of the process that carries out declared skills, where the mission uses one.
    conduct: Rc<Cell<Conduct>>,
    seen: Rc<RefCell<Seen>>,
    /// Requests from outside so far.
    requests: u64,
}

impl Simulation<'_> {
    /// All seven services, on the ground, at virtual time zero.
    ///
    /// # Errors
    /// Every mistake in the files.
    pub fn new(setup: &Setup<'_>) -> Result<Simulation<'static>, Mistakes> {
        Simulation::changed(setup, Changes::default())
    }

    /// The same, with changes.
    ///
    /// # Errors
    /// Every mistake in the files.
    pub fn changed(setup: &Setup<'_>, changes: Changes) -> Result<Simulation<'static>, Mistakes> {
        let mut files = Files::read(setup)?;
        files.mission = changes.mission.clone().unwrap_or(files.mission);
        files.control_tower.grant_valid_s = changes.grant_valid_s.unwrap_or(files.control_tower.grant_valid_s);
        // Nobody sees it, unless it is recorded.
        files.shows_tree = changes.tape.is_some();
        let world = simulated(&files, setup, changes.ground.clone());
        let simulation = Simulation::of(setup, &Rc::new(files), changes, world.clone(), Ground::default())?;
        Ok(simulation.in_sight(world))
    }

    /// The ground as the mission has it: level, but for its places to land at.
    ///
    /// # Errors
    /// Every mistake in the files.
    pub fn ground(setup: &Setup<'_>) -> Result<Relief, Mistakes> {
        let mission = Files::read(setup)?.mission;
        let objectives = mission.objectives.iter().filter(|it| !it.flying).map(|it| it.position);
        let sites = mission.sites.iter().map(|it| it.position);
        let raised = objectives.chain(sites).filter(|it| it.height_m() != 0.0);
        let patch = |it: Ned| Patch::square((it.north_m, it.east_m), PLACE_M, it.height_m(), Surface::Land);
        Ok(Relief { patches: raised.map(patch).collect(), ..Relief::default() })
    }

    /// The same with another vehicle backend in place of the simulated vehicle, which is made of that one's configuration.
    ///
    /// # Errors
    /// Every mistake in the files.
    pub fn with_vehicle<N: Node + 'static>(
        setup: &Setup<'_>,
        vehicle: impl FnOnce(&vehicle_sim::config::Config) -> N,
    ) -> Result<Simulation<'static>, Mistakes> {
        let files = Files::read(setup)?;
        let vehicle = vehicle(&files.vehicle_sim);
        Simulation::of(setup, &Rc::new(files), Changes::default(), vehicle, Ground::default())
    }

    /// What stands at the beginning of a recording of such a flight; `mission` is its text, if it is not a file.
    ///
    /// # Errors
    /// Every mistake in the files.
    pub fn header(setup: &Setup<'_>, mission: Option<String>) -> Result<Header, Mistakes> {
        Ok(Header {
            program: env!("CARGO_PKG_VERSION").to_owned(),
            vehicle: VEHICLE.to_owned(),
            instance: setup.seed,
            speed: 1.0,
            tower_key: tower_key().public().to_string(),
            files: Files::texts(setup, mission)?,
        })
    }

    /// The same with this gateway, which is made of the contingency table, in place of one that only keeps contact.
    ///
    /// # Errors
    /// Every mistake in the files.
    pub fn with_gateway<N: Node + 'static>(
        setup: &Setup<'_>,
        gateway: impl FnOnce(&Contingencies) -> N,
    ) -> Result<Simulation<'static>, Mistakes> {
        let files = Files::read(setup)?;
        let (world, gateway) = (simulated(&files, setup, Relief::default()), gateway(&files.contingencies));
        Ok(Simulation::of(setup, &Rc::new(files), Changes::default(), world.clone(), gateway)?.in_sight(world))
    }

    fn of(
        setup: &Setup<'_>,
        files: &Rc<Files>,
        changes: Changes,
        vehicle: impl Node + 'static,
        gateway: impl Node + 'static,
    ) -> Result<Simulation<'static>, Mistakes> {
        let mut simulation = Simulation::without_gateway(setup, files, files.mission.clone(), changes, vehicle)?;
        simulation.bus.add(Scope::Fleet, gateway);
        Ok(simulation)
    }

    /// The services that fly, and the control tower: a vehicle that has never heard the ground.
    fn without_gateway(
        setup: &Setup<'_>,
        files: &Rc<Files>,
        mission: Mission,
        changes: Changes,
        vehicle: impl Node + 'static,
    ) -> Result<Simulation<'static>, Mistakes> {
        let pace = Pace::REAL_TIME;
        let seen = Rc::new(RefCell::new(Seen::of(files)));
        let mut bus = VirtualBus::new(setup.machine);
        let on_board = || Scope::Vehicle(VEHICLE.into());
        let record = seen.clone();
        bus.tap(move |time, message| record.borrow_mut().take_in(time, message));
        let conduct = Rc::new(Cell::new(Conduct::default()));
        if mission.objectives.iter().any(|it| !(it.terms.tasks.is_empty() && it.terms.along.is_empty())) {
            // An autopilot carries out its own.
            let has_own = vehicle.subscriptions().contains(&Topic::TaskOrder);
            let others = files.skills.all().iter().filter(|it| !has_own || it.payload_command.is_none());
            bus.add(on_board(), SkillProcess::new(DeclaredSkills::of(others.cloned().collect()), conduct.clone()));
        }
        bus.add(on_board(), vehicle);
        let mut starts = Starts::default();
        let of = |files: &Rc<Files>| files.clone();
        let (skills, rules, plans, flies) = (of(files), of(files), of(files), of(files));
        bus.add(
            on_board(),
            starts.of_forgetful(move |_, _| skill_manager::SkillManager::new(&skills.skill_manager, pace)),
        );
        bus.add(
            on_board(),
            starts.of_forgetful(move |_, _| {
                monitor::Monitor::new(&rules.monitor, &rules.contingencies, pace).with_skills(rules.skills.clone())
            }),
        );
        // Whether a manager can be made of these files is known after the first one.
        files.manager(setup.seed)?;
        let Setup { permissions, seed, .. } = *setup;
        let manager = move |start: u64| {
            // As a process has one: unique among all starts.
            let instance = seed.wrapping_add(start << 32);
            let manager = flies.manager(instance).expect("these files have made one before");
            let manager = manager.of_mission(&mission);
            (manager.that_verifies_with(tower_key().public()), instance)
        };
        let planner = move || plans.planner(Pace::REAL_TIME);
        match changes.tape {
            None => {
                let planner = starts.of_forgetful(move |_, _| planner());
                match changes.lies {
                    Some(seed) => bus.add(on_board(), Lying::new(planner, seed)),
                    None => bus.add(on_board(), planner),
                }
                bus.add(on_board(), starts.of_resumable(move |start, _| manager(start).0));
            }
            // By their numbers in `recording::RECORDED`.
            Some(tape) => {
                let of_planner = tape.clone();
                let planner = move |start, now| recorded(planner(), 1, &of_planner, start, now, start);
                let manager = move |start, now| {
                    let (manager, instance) = manager(start);
                    recorded(manager, 0, &tape, start, now, instance)
                };
                bus.add(on_board(), starts.of_forgetful(planner));
                bus.add(on_board(), starts.of_resumable(manager));
            }
        }
        let grants = files.clone();
        let tower = move |start: u64, _| {
            let tower = control_tower::ControlTower::new(&grants.control_tower, permissions, seed, pace, 1 + start);
            tower.that_signs_with(tower_key())
        };
        bus.add(Scope::Fleet, starts.of_resumable(tower));
        Ok(Simulation { bus, starts, conduct, seen, requests: 0 })
    }

    /// The same, with the truth shown to those who judge.
    fn in_sight(self, world: Shared<VehicleSim>) -> Self {
        self.seen.borrow_mut().world = Some(world);
        self
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

    /// Something from outside that the mode of the vehicle may change for.
    fn trouble(&mut self) {
        let mut seen = self.seen.borrow_mut();
        seen.modes.troubled();
        seen.witness.troubled();
    }

    /// The process of the declared skills carries out its orders like this from now on.
    pub fn skills_conduct(&self, conduct: Conduct) {
        self.conduct.set(conduct);
    }

    /// Raises a flag by hand.
    pub fn inject_flag(&mut self, name: &str) {
        let reason = "by hand".to_owned();
        self.seen.borrow_mut().witness.troubled();
        self.seen.borrow_mut().ordered_to_land_here(name);
        let flag = v1::FlagEvent { name: name.to_owned(), raised: true, reason, ..Default::default() };
        self.bus.publish(VEHICLE, flag);
    }

    /// The operator Anna gives an order.
    pub fn order(&mut self, verb: v1::operator_command::Verb) {
        match verb {
            v1::operator_command::Verb::Start(_) => self.seen.borrow_mut().ordered_to_start(),
            v1::operator_command::Verb::Abort(_) => self.seen.borrow_mut().ordered_to_land_here(OPERATOR_ABORT),
            _ => {}
        }
        let command =
            v1::OperatorCommand { request_id: self.request_id(), operator: "anna".to_owned(), verb: Some(verb) };
        self.request(Request::OperatorCommand(command));
    }

    /// The operator Anna makes a request about the mission. On the ground it says where the vehicle is, as the gateway does; in flight
    /// the mission manager knows.
    pub fn ask(&mut self, request: v1::mission_request::Request) {
        let request_id = self.request_id();
        let on_ground = || v1::PlanningState { position: self.position(), flying: false, ..Default::default() };
        let request = v1::MissionRequest {
            request_id,
            operator: "anna".to_owned(),
            state: self.is_on_ground().then(on_ground),
            request: Some(request),
        };
        self.request(Request::Mission(request));
    }

    fn request(&mut self, request: Request) {
        self.trouble();
        self.bus.request(VEHICLE, request);
    }

    /// Distinguishes requests.
    fn request_id(&mut self) -> String {
        self.requests += 1;
        format!("request-{}", self.requests)
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
        self.trouble();
        self.bus.freeze(process, time);
    }

    /// Kills a process; it is there again after this time. `vehicle-sim`, which is the world, and the gateway are never killed.
    ///
    /// # Panics
    /// If there is no such process.
    pub fn restart(&mut self, process: &str, time: Duration, memory: Memory) {
        self.trouble();
        let successor = self.starts.again(process, memory, self.bus.moment());
        self.bus.restart(time, successor);
    }

    /// Has the bus lose, repeat and hold back messages for this long.
    pub fn disturb(&mut self, disturbance: Disturbance, time: Duration) {
        self.trouble();
        if 0.0 < disturbance.lost {
            self.seen.borrow_mut().witness.losing(self.bus.moment().time + time);
        }
        self.bus.disturb(disturbance, time);
    }

    /// Sets the wall clock of every machine by this many milliseconds, forward or back.
    pub fn set_clock(&mut self, by_ms: i64) {
        self.trouble();
        self.bus.set_clock(by_ms);
        let ahead = &mut self.seen.borrow_mut().ahead;
        (ahead.aircraft_ms, ahead.ground_ms) = (ahead.aircraft_ms + by_ms, ahead.ground_ms + by_ms);
    }

    /// Takes down a flag raised by hand.
    pub fn lower_flag(&mut self, name: &str) {
        self.bus.publish(VEHICLE, v1::FlagEvent { name: name.to_owned(), ..Default::default() });
    }

    /// Whether the mission manager says that this flag is up.
    pub fn is_up(&self, flag: &str) -> bool {
        self.seen.borrow().manager.contingencies.iter().any(|it| it.flag == flag)
    }

    /// The flags that call for a human: a caution or a warning that the mission manager lists and nobody has acknowledged.
    pub fn alarms(&self) -> Vec<String> {
        let seen = self.seen.borrow();
        let listed = seen.manager.contingencies.iter();
        let calling = listed.filter(|it| v1::Alarm::Caution <= it.alarm() && it.acknowledged_by.is_empty());
        calling.map(|it| it.flag.clone()).collect()
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

    /// What the control tower has published last.
    pub fn ledger(&self) -> v1::PermissionLedger {
        self.seen.borrow().ledger.clone()
    }

    /// Somebody plays this ledger on the bus.
    pub fn hear_again(&mut self, recorded: &v1::PermissionLedger) {
        self.bus.publish(VEHICLE, recorded.clone());
    }

    /// The party at site `wt12` reports the state of its deck.
    pub fn report_deck(&mut self, deck: v1::Deck) {
        let report = v1::SiteReport { site: "wt12".to_owned(), deck: deck as i32, ..Default::default() };
        self.request(Request::SiteReport(report));
    }

    /// The control tower may grant again, although it has forgotten what it had decided; one that has not refuses that.
    pub fn accept_loss(&mut self) {
        self.request(Request::AcceptLoss(v1::AcceptLossRequest { vehicle: VEHICLE.to_owned() }));
    }

    /// What the witness has seen against the flight. The rules over the truth are for drawn missions: a story may empty the battery over
    /// a blocked landing.
    pub fn breaches(&self) -> Vec<Breach> {
        self.all_breaches().into_iter().filter(|it| !matches!(it, Breach::Truth { .. })).collect()
    }

    /// The same, with the rules over the truth.
    pub(crate) fn all_breaches(&self) -> Vec<Breach> {
        self.seen.borrow().witness.breaches().to_vec()
    }

    /// What the witness has counted.
    pub fn figures(&self) -> Figures {
        self.seen.borrow().witness.figures()
    }

    /// Where the vehicle was each time that its gripper let go of a load.
    pub fn loads_released_at(&self) -> Vec<Ned> {
        self.seen.borrow().witness.loads_released_at().to_vec()
    }

    /// How often the autopilot was commanded to release the load.
    pub fn release_commands(&self) -> usize {
        self.seen.borrow().releases
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
        self.seen.borrow().is_on_ground()
    }

    /// Where a flight may end as planned or as listed: home, the places of the objectives, the sites of the mission, and where an
    /// operator has ordered to land. With their names.
    pub fn places(&self) -> Vec<(String, v1::Ned)> {
        self.seen.borrow().places()
    }

    /// Why the vehicle stays where it is: a response, an operator, the planner. Empty if nothing says so.
    pub fn reason_to_stay(&self) -> String {
        self.seen.borrow().reason_to_stay()
    }

    /// What the mission manager says it does.
    pub fn phase(&self) -> v1::MissionPhase {
        self.seen.borrow().manager.phase()
    }

    /// The report, once the mission is over.
    pub fn report(&self) -> Option<v1::MissionReport> {
        self.seen.borrow().report.clone()
    }

    /// The first change of the commanded mode that no cause explains.
    pub fn mode_storm(&self) -> Option<ModeStorm> {
        self.seen.borrow().modes.storm()
    }

    /// Each time the vehicle flew offboard after a setpoint that was too old.
    pub fn stale_setpoints(&self) -> Vec<StaleSetpoint> {
        self.seen.borrow().setpoints.stale().to_vec()
    }

    /// What was outside of the bounds of height and energy, the first of each kind.
    pub fn excursions(&self) -> Vec<Excursion> {
        self.seen.borrow().bounds.found().to_vec()
    }

    /// The flag that is answered, empty if none is.
    pub fn responder(&self) -> String {
        self.seen.borrow().manager.acting.clone()
    }

    /// Where the flight may end early, best first, as the mission manager tells it.
    pub fn alternates(&self) -> Vec<v1::Alternate> {
        self.seen.borrow().manager.alternates.clone()
    }

    /// How far the battery suffices, as the mission manager tells it; `None` on the ground.
    pub fn energy(&self) -> Option<v1::EnergyOutlook> {
        self.seen.borrow().manager.energy.clone()
    }

    /// The charge of the battery as it was sent last, 0 to 1.
    pub fn charge(&self) -> Option<f64> {
        self.seen.borrow().charge
    }

    /// Every decision so far with its time.
    pub fn decisions(&self) -> Vec<(Time, v1::DecisionRecord)> {
        self.seen.borrow().decisions.clone()
    }

    /// Every decision so far with its time, one line each.
    pub fn decision_log(&self) -> String {
        let line =
            |(at, it): &(Time, v1::DecisionRecord)| format!("{:7.2}  {:<11} {}", at.as_secs_f64(), it.topic, it.text);
        self.seen.borrow().decisions.iter().map(line).collect::<Vec<_>>().join("\n")
    }

    /// How tasks along flights have begun and ended, such as `camera begins` and `camera cancelled`.
    pub fn tasks_along(&self) -> Vec<String> {
        self.seen.borrow().along.clone()
    }

    /// The pictures that were taken.
    pub fn pictures(&self) -> Vec<v1::Picture> {
        self.seen.borrow().pictures.clone()
    }

    /// The texts of the decisions about `topics`, in order.
    pub fn story(&self, topics: &[&str]) -> Vec<String> {
        let seen = self.seen.borrow();
        let wanted = seen.decisions.iter().filter(|(_, it)| topics.contains(&it.topic.as_str()));
        wanted.map(|(_, it)| it.text.clone()).collect()
    }
}

// The stories use this crate as others do, in the program of its unit tests: one program links faster than two.
#[cfg(test)]
extern crate self as simulation;
#[cfg(test)]
#[path = "../tests/main.rs"]
mod stories;
