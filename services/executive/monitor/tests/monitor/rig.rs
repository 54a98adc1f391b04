//! A monitor, its clock, and a vehicle whose sensors are never without noise.

use std::collections::BTreeMap;
use std::path::Path;
use std::time::Duration;

use domain::contingency::Contingencies;
use domain::file::Source;
use domain::testing;
use domain::time::{Now, Pace, Time};
use kittiwake_proto::topics::{Message, Topic};
use kittiwake_proto::v1;
use monitor::Monitor;
use node::{Effect, Event, Node};

const CONFIG: &str = "
    introspection_rate_hz = 100.0
    absent_after_s = 5.0
    own_transponders = []
    attitude_frozen_samples = 120
    position_frozen_samples = 60
    battery_frozen_samples = 100
";

/// The processes on board.
const PROCESSES: [&str; 4] = ["mcm", "planner", "skill-manager", "vehicle-sim"];

/// The shipped table, from the folder of this crate.
pub(crate) const SHIPPED: &str = "../../../config/contingencies.toml";

/// Between two samples of every source.
const STEP: Duration = Duration::from_millis(10);

/// The monitor, and everything that it published.
pub(crate) struct Rig {
    monitor: Monitor,
    now: Time,
    /// What the machine's wall clock shows; it stands still unless a test sets it.
    pub(crate) utc_ms: i64,
    pub(crate) vehicle: Vehicle,
    pub(crate) said: Vec<(Time, Message)>,
    /// Messages that were refused, and why.
    pub(crate) refused: Vec<String>,
}

impl Rig {
    /// With one flag `watched`; `keys` are the lines of its row that raise it.
    pub(crate) fn watching(keys: &str) -> Rig {
        Rig::with(&table(&[("watched", keys)]), Pace::REAL_TIME)
    }

    pub(crate) fn with(table: &Contingencies, pace: Pace) -> Rig {
        Rig {
            monitor: monitor(table, pace),
            now: Time::ZERO,
            utc_ms: 0,
            vehicle: Vehicle::default(),
            said: Vec::new(),
            refused: Vec::new(),
        }
    }

    /// Messages arrive together.
    pub(crate) fn hear(&mut self, messages: impl IntoIterator<Item = Message>) {
        let mut effects = Vec::new();
        for message in messages {
            self.monitor.on(self.moment(), Event::Message { vehicle: "uav1".into(), message }, &mut effects);
        }
        self.monitor.act(self.moment(), &mut effects);
        self.keep(effects);
    }

    /// Every source that is not silent sends a sample every 10 ms.
    pub(crate) fn fly(&mut self, seconds: f64) {
        for _ in 0..(seconds / STEP.as_secs_f64()).round() as u32 {
            self.hear_every_source();
            self.wait(STEP);
        }
    }

    /// Every source that is not silent sends one sample.
    pub(crate) fn hear_every_source(&mut self) {
        let samples = self.vehicle.samples();
        self.hear(samples);
    }

    /// Nothing arrives for a while.
    pub(crate) fn wait(&mut self, duration: Duration) {
        let end = self.now + duration;
        while let Some(deadline) = self.monitor.deadline().filter(|it| *it <= end) {
            self.now = self.now.max(deadline);
            self.hear([]);
            assert!(self.monitor.deadline() > Some(self.now), "the deadline has come and stays");
        }
        self.now = end;
    }

    /// The process pauses.
    pub(crate) fn stall(&mut self, duration: Duration) {
        self.now = self.now + duration;
    }

    pub(crate) fn inject(&mut self, name: &str, raised: bool) {
        self.hear([v1::FlagEvent { name: name.into(), raised, ..Default::default() }.into()]);
    }

    /// What the monitor said about its flags, without the rule: `3.000 watched up: <values>`.
    pub(crate) fn story(&self) -> Vec<String> {
        let values = |line: String| line.split("; the rule is").next().unwrap_or_default().to_owned();
        self.story_with_rules().into_iter().map(values).collect()
    }

    /// The same with the rule.
    pub(crate) fn story_with_rules(&self) -> Vec<String> {
        let line = |it: &Change| match &it.raised {
            Some(flag) => format!("{:.3} {} up: {}", it.at.as_secs_f64(), it.name, flag.reason),
            None => format!("{:.3} {} down", it.at.as_secs_f64(), it.name),
        };
        self.changes().iter().map(line).collect()
    }

    /// The rises and falls by the lists of the introspections.
    pub(crate) fn changes(&self) -> Vec<Change> {
        let (mut changes, mut up) = (Vec::new(), BTreeMap::new());
        for (at, it) in self.introspections() {
            let listed: BTreeMap<_, _> = it.flags.iter().map(|it| (it.name.clone(), it.clone())).collect();
            let fallen = up.keys().filter(|name| !listed.contains_key(*name));
            changes.extend(fallen.map(|name: &String| Change { at, name: name.clone(), raised: None }));
            let rose =
                |it: &&v1::RaisedFlag| up.get(&it.name).is_none_or(|before: &v1::RaisedFlag| before.rise != it.rise);
            let risen = it.flags.iter().filter(rose);
            changes.extend(risen.map(|it| Change { at, name: it.name.clone(), raised: Some(it.clone()) }));
            up = listed;
        }
        changes
    }

    /// Whether the flag has risen or fallen, each time.
    pub(crate) fn changes_of(&self, flag: &str) -> Vec<bool> {
        self.changes().iter().filter(|it| it.name == flag).map(|it| it.raised.is_some()).collect()
    }

    pub(crate) fn introspections(&self) -> impl Iterator<Item = (Time, &v1::Introspection)> {
        self.said.iter().filter_map(|(at, it)| if let Message::Introspection(it) = it { Some((*at, it)) } else { None })
    }

    pub(crate) fn last(&self) -> &v1::Introspection {
        self.introspections().last().expect("an introspection").1
    }

    /// Names of the flags in the last introspection.
    pub(crate) fn up(&self) -> Vec<&str> {
        self.last().flags.iter().map(|it| it.name.as_str()).collect()
    }

    pub(crate) fn now(&self) -> Time {
        self.now
    }

    fn keep(&mut self, effects: Vec<Effect>) {
        for effect in effects {
            match effect {
                Effect::Publish { vehicle: None, message } => self.said.push((self.now, message)),
                Effect::Refused { what, why } => self.refused.push(format!("{}: {why}", what.key())),
                _ => panic!("unexpected {effect:?}"),
            }
        }
    }

    fn moment(&self) -> Now {
        Now { time: self.now, utc_ms: self.utc_ms }
    }
}

/// A flag has risen or fallen.
pub(crate) struct Change {
    pub(crate) at: Time,
    pub(crate) name: String,
    /// As it is listed first; `None`: it fell.
    pub(crate) raised: Option<v1::RaisedFlag>,
}

/// The vehicle, with the samples that it sends next.
pub(crate) struct Vehicle {
    pub(crate) status: v1::VehicleStatus,
    pub(crate) attitude: v1::VehicleAttitude,
    pub(crate) local_position: v1::VehicleLocalPosition,
    pub(crate) global_position: v1::VehicleGlobalPosition,
    pub(crate) land_detected: v1::VehicleLandDetected,
    pub(crate) battery: v1::BatteryStatus,
    /// `None`: it estimates none.
    pub(crate) wind: Option<v1::WindEstimate>,
    /// Another aircraft, if there is one.
    pub(crate) traffic: Option<v1::TransponderReport>,
    /// These topics do not arrive.
    pub(crate) silent: Vec<Topic>,
    /// These topics arrive without noise, and a status with the time that it has.
    pub(crate) frozen: Vec<Topic>,
    /// These processes do not turn.
    pub(crate) hung: Vec<&'static str>,
    /// How long ago the ground heard it.
    pub(crate) unheard_s: f64,
    /// Why the ground does not record the flight.
    pub(crate) record_trouble: String,
    /// What the mission manager says.
    pub(crate) manager: v1::McmStatus,
    drawn: u32,
}

impl Default for Vehicle {
    /// In the air, and all is well.
    fn default() -> Vehicle {
        Vehicle {
            status: v1::VehicleStatus { armed: true, vibration_m_s2: Some(5.0), timestamp_us: 1, ..Default::default() },
            attitude: v1::VehicleAttitude { q_w: 1.0, ..Default::default() },
            local_position: v1::VehicleLocalPosition {
                position: Some(v1::Ned { north_m: 30.0, east_m: 40.0, down_m: -10.0 }),
                velocity: Some(v1::NedVelocity::default()),
                heading_rad: 0.0,
                horizontal_valid: true,
                vertical_valid: true,
                eph_m: 0.4,
                epv_m: 0.6,
                ..Default::default()
            },
            global_position: v1::VehicleGlobalPosition {
                latitude_deg: 54.0,
                longitude_deg: 6.6,
                altitude_amsl_m: 30.0,
                eph_m: 0.4,
                epv_m: 0.6,
            },
            land_detected: v1::VehicleLandDetected::default(),
            battery: v1::BatteryStatus {
                voltage_v: 22.0,
                current_a: Some(10.0),
                remaining: 0.8,
                temperature_c: Some(20.0),
            },
            wind: Some(v1::WindEstimate::default()),
            traffic: None,
            silent: Vec::new(),
            frozen: Vec::new(),
            hung: Vec::new(),
            unheard_s: 0.0,
            record_trouble: String::new(),
            manager: all_is_well(),
            drawn: 0,
        }
    }
}

/// What the mission manager says of a flight that has all the time and energy that it needs.
fn all_is_well() -> v1::McmStatus {
    let place = || Some(v1::PlaceOutlook { margin: 0.5, ..Default::default() });
    let energy = v1::EnergyOutlook {
        home: place(),
        best: place(),
        consumption: Some(0.96),
        endurance_s: 900.0,
        ..Default::default()
    };
    let progress = v1::FlightProgress { path_deviation_m: Some(0.3), pace: Some(1.0), ..Default::default() };
    v1::McmStatus { energy: Some(energy), progress: Some(progress), ..Default::default() }
}

impl Vehicle {
    /// It stands on the ground, by every source.
    pub(crate) fn touch_down(&mut self) {
        self.land_detected.landed = true;
        self.local_position.velocity = Some(v1::NedVelocity::default());
        self.local_position.position = Some(v1::Ned { north_m: 30.0, east_m: 40.0, down_m: 0.0 });
    }

    /// It flies again.
    pub(crate) fn lift_off(&mut self) {
        let Vehicle { land_detected, local_position, .. } = Vehicle::default();
        (self.land_detected, self.local_position) = (land_detected, local_position);
    }

    fn samples(&mut self) -> Vec<Message> {
        self.drawn += 1;
        let drawn = f64::from(self.drawn);
        let noise = |topic| if self.frozen.contains(&topic) { 0.0 } else { 1e-9 * drawn };
        if !self.frozen.contains(&Topic::VehicleStatus) {
            self.status.timestamp_us = 10_000 * u64::from(self.drawn);
        }
        let mut samples: Vec<Message> = vec![self.status.clone().into()];
        let roll_rate_rad_s = self.attitude.roll_rate_rad_s + noise(Topic::VehicleAttitude);
        samples.push(v1::VehicleAttitude { roll_rate_rad_s, ..self.attitude }.into());
        let velocity = self
            .local_position
            .velocity
            .map(|it| v1::NedVelocity { north_m_s: it.north_m_s + noise(Topic::VehicleLocalPosition), ..it });
        samples.push(v1::VehicleLocalPosition { velocity, ..self.local_position }.into());
        // A land detector follows what the position shows.
        samples.push(self.land_detected.into());
        let latitude_deg = self.global_position.latitude_deg + noise(Topic::VehicleGlobalPosition);
        samples.push(v1::VehicleGlobalPosition { latitude_deg, ..self.global_position }.into());
        let current_a = self.battery.current_a.map(|it| it + noise(Topic::BatteryStatus));
        samples.push(v1::BatteryStatus { current_a, ..self.battery }.into());
        samples.extend(self.wind.map(Message::from));
        samples.extend(self.traffic.clone().map(Message::from));
        samples.push(
            v1::GroundContact { heard_age_wall_s: self.unheard_s, record_trouble: self.record_trouble.clone() }.into(),
        );
        samples.push(self.manager.clone().into());
        samples.push(v1::PermissionLedger::default().into());
        samples.retain(|it| !self.silent.contains(&it.topic()));
        let processes = PROCESSES.iter().filter(|it| !self.hung.contains(it));
        samples.extend(processes.map(|it| v1::Heartbeat { service: (*it).into(), ..Default::default() }.into()));
        samples
    }
}

pub(crate) fn monitor(table: &Contingencies, pace: Pace) -> Monitor {
    Monitor::new(&toml::from_str(CONFIG).unwrap(), table, pace)
}

/// A table of flags, each with the lines of its row that raise it.
pub(crate) fn table(flags: &[(&str, &str)]) -> Contingencies {
    let mut text = String::new();
    for (priority, (flag, keys)) in flags.iter().enumerate() {
        text += &format!(
            "
            [[contingency]]
            flag = '{flag}'
            priority = {priority}
            {keys}
            actions = ['stop']
            emergency = 'stop'
            clears = 'with-condition'
            then = 'resume'
            "
        );
    }
    read(Source { path: "table.toml".into(), text: testing::table(&text) })
}

/// A table whose actions all have a tree.
pub(crate) fn read(source: Source) -> Contingencies {
    let file: toml::Table = toml::from_str(&source.text).unwrap();
    let actions: Vec<&str> = file["action"].as_table().unwrap().keys().map(String::as_str).collect();
    Contingencies::read(&source, &actions).unwrap_or_else(|it| panic!("{it}"))
}

pub(crate) fn shipped() -> Contingencies {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join(SHIPPED);
    read(Source::read(&path).unwrap_or_else(|it| panic!("{it}")))
}

pub(crate) fn s(seconds: f64) -> Duration {
    Duration::from_secs_f64(seconds)
}
