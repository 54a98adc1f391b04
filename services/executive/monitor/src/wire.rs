//! The monitor's messages, from and to its own types.

use std::time::Duration;

use domain::contingency::source::DataSource;
use domain::measured::Measured;
use domain::time::{LONGEST_FLIGHT, Time};
use domain::wire::{InvalidMessage, duration};
use kittiwake_proto::topics::Message;
use kittiwake_proto::v1;

use crate::derived::{Derived, derived};
use crate::flag::{Flag, Injection, Level, RaisedFlag};
use crate::sources::{Before, Sample, Sources};

/// The sample in a message; `None` where the message comes from no source.
pub(crate) fn sample(message: Message) -> Result<Option<Sample>, InvalidMessage> {
    Ok(Some(match message {
        Message::VehicleStatus(it) => Sample::Status(it.into()),
        Message::VehicleAttitude(it) => Sample::Attitude(it.try_into()?),
        Message::VehicleLocalPosition(it) => Sample::LocalPosition(it.try_into()?),
        Message::VehicleGlobalPosition(it) => Sample::GlobalPosition(it.try_into()?),
        Message::VehicleLandDetected(it) => Sample::LandDetected(it.into()),
        Message::BatteryStatus(it) => Sample::Battery(it.try_into()?),
        Message::WindEstimate(it) => Sample::Wind(it.try_into()?),
        Message::TransponderReport(it) => Sample::Traffic(it.try_into()?),
        Message::GroundContact(it) => ground_contact(it)?,
        Message::PermissionLedger(_) => Sample::Ledger,
        Message::McmStatus(it) => {
            Sample::Manager((&it).try_into()?, before(it.told.unwrap_or_default())?, it.skills_needed)
        }
        Message::TaskReport(it) => Sample::Task(it),
        Message::Heartbeat(it) => return Ok(process(&it.service)),
        _ => return Ok(None),
    }))
}

/// What somebody says by hand about a flag.
impl From<v1::FlagEvent> for Injection {
    fn from(event: v1::FlagEvent) -> Injection {
        Injection { flag: event.name, raised: event.raised, reason: event.reason }
    }
}

/// Why an injection is refused: the table has no row for its flag.
pub(crate) fn unknown_flag(name: &str) -> InvalidMessage {
    let expected = "a flag of the contingency table";
    InvalidMessage::OutOfRange { field: "name", value: format!("{name:?}"), expected }
}

/// Everything that is known at `now`; `flags_changed` if it is published since a flag has risen or fallen.
pub(crate) fn introspection(now: Time, sources: &Sources, flags: &[Flag], flags_changed: bool) -> v1::Introspection {
    let (mut up, mut undecided) = (Vec::new(), Vec::new());
    for flag in flags {
        match flag.level(now) {
            Level::Up(it) => up.push(it.into()),
            Level::Undecided(name) => undecided.push(name.to_owned()),
            Level::Down => {}
        }
    }
    v1::Introspection {
        status: sources.status.latest().cloned().map(Into::into),
        attitude: sources.attitude.latest().copied().map(Into::into),
        local_position: sources.local_position.latest().copied().map(Into::into),
        global_position: sources.global_position.latest().copied().map(Into::into),
        land_detected: sources.land_detected.latest().copied().map(Into::into),
        battery: sources.battery.latest().copied().map(Into::into),
        ages: Some(ages(now, sources)),
        derived: derived(now, sources).map(Into::into),
        flags: up,
        wind: sources.wind(now).map(Into::into),
        undecided_flags: undecided,
        flags_changed,
        traffic: sources.near_traffic(now).into_iter().map(Into::into).collect(),
        occupied: sources.occupied(now).iter().map(Into::into).collect(),
        skills: Vec::new(),
    }
}

fn ages(now: Time, sources: &Sources) -> v1::SourceAges {
    let age_s = |source| sources.last_update(source).map(|it| (now - it.at).as_secs_f64());
    v1::SourceAges {
        status_s: age_s(DataSource::Status),
        attitude_s: age_s(DataSource::Attitude),
        local_position_s: age_s(DataSource::LocalPosition),
        global_position_s: age_s(DataSource::GlobalPosition),
        land_detected_s: age_s(DataSource::LandDetected),
        battery_s: age_s(DataSource::Battery),
        ground_link_s: age_s(DataSource::GroundLink),
        control_tower_s: age_s(DataSource::ControlTower),
    }
}

impl From<Derived> for v1::Derived {
    fn from(derived: Derived) -> v1::Derived {
        let Derived { height_m, ground_speed_m_s, climb_rate_m_s, distance_home_m, tilt_rad, flying, flight_s } =
            derived;
        v1::Derived { height_m, ground_speed_m_s, climb_rate_m_s, distance_home_m, tilt_rad, flying, flight_s }
    }
}

impl From<RaisedFlag<'_>> for v1::RaisedFlag {
    fn from(flag: RaisedFlag<'_>) -> v1::RaisedFlag {
        let measured = flag.measured;
        v1::RaisedFlag {
            name: flag.name.into(),
            since_s: flag.up_for.as_secs_f64(),
            reason: flag.reason.into(),
            value: measured.map(Measured::value),
            threshold: measured.map(Measured::threshold),
            unit: measured.map_or("", |it| it.unit().symbol()).to_owned(),
            rise: flag.rise,
        }
    }
}

/// The process that a heartbeat is from; `None` for one that nothing on board waits for.
fn process(service: &str) -> Option<Sample> {
    match service {
        "planner" => Some(Sample::Planner),
        "skill-manager" => Some(Sample::SkillManager),
        "mcm" => Some(Sample::MissionManager),
        _ => None,
    }
}

fn before(told: v1::ToldByMonitor) -> Result<Before, InvalidMessage> {
    let v1::ToldByMonitor { ground_link, control_tower, flight_s } = told;
    let field = "told.flight_s";
    let flown = duration(field, flight_s)?;
    if LONGEST_FLIGHT < flown {
        let expected = "seconds from 0 to 10,000,000";
        return Err(InvalidMessage::OutOfRange { field, value: format!("{flight_s:?}"), expected });
    }
    Ok(Before { ground_link, control_tower, flown })
}

fn ground_contact(contact: v1::GroundContact) -> Result<Sample, InvalidMessage> {
    let age_s = contact.heard_age_wall_s;
    if (0.0..=1e9).contains(&age_s) {
        let record_fails = !contact.record_trouble.is_empty();
        Ok(Sample::GroundContact { ago: Duration::from_secs_f64(age_s), record_fails })
    } else {
        let (field, expected) = ("heard_age_wall_s", "seconds from 0 to 1,000,000,000");
        Err(InvalidMessage::OutOfRange { field, value: format!("{age_s:?}"), expected })
    }
}
