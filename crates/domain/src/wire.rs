//! The conversions between messages and the domain types that several services share, in both directions.
//!
//! Messages of a single service are converted in its own `wire.rs`. A message is converted where it is taken in, and is
//! refused there if a value is not a number or a part is missing.

use std::time::Duration;

use kittiwake_proto::{PLANNING_PROTOCOL, v1};

use crate::area::{Area, AreaKind};
use crate::fmu::{FailsafeReason, FlightMode, Gripper};
use crate::geometry::{Ned, NedVelocity};
use crate::harm::Ground;
use crate::hours::WeeklyHours;
use crate::site::{Site, SiteKind};
use crate::survey::InvalidSurvey;

mod alarm;
mod alternate;
pub mod decision;
mod feed;
mod fmu;
mod mission;
mod origin;
pub mod permission;
pub mod plan;
mod skill;
pub mod task;
mod traffic;

pub(crate) use feed::{feeds_from_wire, feeds_to_wire};

/// A message that decodes and whose content makes no sense.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum InvalidMessage {
    /// A required field is missing.
    #[error("`{0}` is missing")]
    Missing(&'static str),
    /// A list whose entries must differ holds one twice.
    #[error("`{0}` has the same entry twice")]
    Twice(&'static str),
    /// A value is not a number, or out of its range.
    #[error("`{field}` is {value}, expected {expected}")]
    OutOfRange {
        /// The field's name.
        field: &'static str,
        /// Its value.
        value: String,
        /// The values that it may have.
        expected: &'static str,
    },
    /// A step of a plan that nothing ends.
    #[error("`goal` never ends, expected a step that flies to a place, and stays there only while it asks for an area")]
    Endless,
    /// Bytes that do not make such a message.
    #[error("`{0}` is garbled")]
    Garbled(&'static str),
    /// The other side of the exchange between mission manager and planner is of another version of the program.
    #[error(
        "the {of} speaks version {found} of the questions about plans, expected {PLANNING_PROTOCOL}: start both from one version of the program"
    )]
    OtherProtocol {
        /// The other side.
        of: &'static str,
        /// Its version.
        found: u32,
    },
    /// A survey cannot be flown.
    #[error("`survey`: {0}")]
    Survey(#[from] InvalidSurvey),
}

impl From<Ned> for v1::Ned {
    fn from(it: Ned) -> v1::Ned {
        // On the wire a negative zero is a zero: so is one in a message that is handed over in memory.
        v1::Ned { north_m: it.north_m + 0.0, east_m: it.east_m + 0.0, down_m: it.down_m + 0.0 }
    }
}

impl TryFrom<v1::Ned> for Ned {
    type Error = InvalidMessage;
    fn try_from(it: v1::Ned) -> Result<Ned, InvalidMessage> {
        let ned = Ned::new(it.north_m, it.east_m, it.down_m);
        let expected = "metres within 1,000 km";
        if ned.is_sound() { Ok(ned) } else { Err(unsound("position", [it.north_m, it.east_m, it.down_m], expected)) }
    }
}

impl From<NedVelocity> for v1::NedVelocity {
    fn from(it: NedVelocity) -> v1::NedVelocity {
        v1::NedVelocity { north_m_s: it.north_m_s, east_m_s: it.east_m_s, down_m_s: it.down_m_s }
    }
}

impl TryFrom<v1::NedVelocity> for NedVelocity {
    type Error = InvalidMessage;
    fn try_from(it: v1::NedVelocity) -> Result<NedVelocity, InvalidMessage> {
        let velocity = NedVelocity::new(it.north_m_s, it.east_m_s, it.down_m_s);
        let expected = "below 1,000 m/s";
        if velocity.is_sound() {
            Ok(velocity)
        } else {
            Err(unsound("velocity", [it.north_m_s, it.east_m_s, it.down_m_s], expected))
        }
    }
}

impl From<FlightMode> for v1::FlightMode {
    fn from(mode: FlightMode) -> v1::FlightMode {
        match mode {
            FlightMode::Loiter => v1::FlightMode::Loiter,
            FlightMode::Takeoff => v1::FlightMode::Takeoff,
            FlightMode::Land => v1::FlightMode::Land,
            FlightMode::Offboard => v1::FlightMode::Offboard,
            FlightMode::Return => v1::FlightMode::Return,
        }
    }
}

/// The mode in a field that may be unspecified; `None` if it is.
pub fn flight_mode(mode: v1::FlightMode) -> Option<FlightMode> {
    match mode {
        v1::FlightMode::Unspecified => None,
        v1::FlightMode::Loiter => Some(FlightMode::Loiter),
        v1::FlightMode::Takeoff => Some(FlightMode::Takeoff),
        v1::FlightMode::Land => Some(FlightMode::Land),
        v1::FlightMode::Offboard => Some(FlightMode::Offboard),
        v1::FlightMode::Return => Some(FlightMode::Return),
    }
}

/// The gripper in a field that may be unspecified; `None` if it is.
pub fn gripper(gripper: v1::Gripper) -> Option<Gripper> {
    match gripper {
        v1::Gripper::Unspecified => None,
        v1::Gripper::Holding => Some(Gripper::Holding),
        v1::Gripper::Released => Some(Gripper::Released),
        v1::Gripper::Silent => Some(Gripper::Silent),
    }
}

/// The reason of a failsafe in a field that may be unspecified; `None` if it is.
pub fn failsafe_reason(reason: v1::FailsafeReason) -> Option<FailsafeReason> {
    match reason {
        v1::FailsafeReason::Unspecified => None,
        v1::FailsafeReason::Setpoints => Some(FailsafeReason::Setpoints),
        v1::FailsafeReason::Other => Some(FailsafeReason::Other),
    }
}

impl From<&Area> for v1::Area {
    fn from(it: &Area) -> v1::Area {
        v1::Area {
            name: it.name.clone(),
            kind: match it.kind {
                AreaKind::Permission => v1::AreaKind::Permission,
                AreaKind::KeepOut => v1::AreaKind::KeepOut,
            } as i32,
            corners: it.corners.iter().map(|&it| it.into()).collect(),
            holes: it
                .holes
                .iter()
                .map(|hole| v1::Ring { corners: hole.iter().map(|&it| it.into()).collect() })
                .collect(),
            floor_m: it.floor_m,
            ceiling_m: it.ceiling_m,
            from_utc_ms: it.from_utc_ms,
            until_utc_ms: it.until_utc_ms,
            hours_utc: it.hours.as_ref().map(WeeklyHours::to_texts).unwrap_or_default(),
            ground: match it.ground {
                // Said where silence would mean people.
                Ground::Nobody if it.among_people().only_bars_landings() => v1::GroundKind::Nobody,
                Ground::Nobody => v1::GroundKind::Unspecified,
                Ground::Water => v1::GroundKind::Water,
                Ground::People => v1::GroundKind::People,
            } as i32,
        }
    }
}

impl TryFrom<v1::Area> for Area {
    type Error = InvalidMessage;
    fn try_from(it: v1::Area) -> Result<Area, InvalidMessage> {
        let kind = match it.kind() {
            v1::AreaKind::Permission => AreaKind::Permission,
            v1::AreaKind::KeepOut => AreaKind::KeepOut,
            v1::AreaKind::Unspecified => return Err(InvalidMessage::Missing("kind")),
        };
        let ground = match it.ground() {
            v1::GroundKind::Unspecified => None,
            v1::GroundKind::Nobody => Some(Ground::Nobody),
            v1::GroundKind::Water => Some(Ground::Water),
            v1::GroundKind::People => Some(Ground::People),
        };
        let ring = |corners: Vec<v1::Ned>| corners.into_iter().map(Ned::try_from).collect::<Result<Vec<Ned>, _>>();
        let area = Area {
            name: it.name,
            kind,
            corners: ring(it.corners)?,
            holes: it.holes.into_iter().map(|it| ring(it.corners)).collect::<Result<_, _>>()?,
            floor_m: it.floor_m.map(|it| finite("floor_m", it)).transpose()?,
            ceiling_m: it.ceiling_m.map(|it| finite("ceiling_m", it)).transpose()?,
            from_utc_ms: it.from_utc_ms,
            until_utc_ms: it.until_utc_ms,
            hours: hours(&it.hours_utc)?,
            ground: ground.unwrap_or_default(),
        };
        let is_unsaid = ground.is_none() && area.among_people().only_bars_landings();
        Ok(if is_unsaid { area.among_people() } else { area })
    }
}

/// None means at all hours.
fn hours(texts: &[String]) -> Result<Option<WeeklyHours>, InvalidMessage> {
    if texts.is_empty() {
        return Ok(None);
    }
    let invalid = |_| out_of_range("hours_utc", texts, "days and hours like Mon-Fri 08:00-18:00");
    WeeklyHours::parse(texts).map(Some).map_err(invalid)
}

impl From<SiteKind> for v1::SiteKind {
    fn from(kind: SiteKind) -> v1::SiteKind {
        match kind {
            SiteKind::Landing => v1::SiteKind::Landing,
            SiteKind::Ditch => v1::SiteKind::Ditch,
        }
    }
}

impl From<&Site> for v1::Site {
    fn from(it: &Site) -> v1::Site {
        v1::Site { name: it.name.clone(), position: Some(it.position.into()), kind: v1::SiteKind::from(it.kind) as i32 }
    }
}

impl TryFrom<v1::Site> for Site {
    type Error = InvalidMessage;
    fn try_from(it: v1::Site) -> Result<Site, InvalidMessage> {
        let kind = match it.kind() {
            v1::SiteKind::Landing => SiteKind::Landing,
            v1::SiteKind::Ditch => SiteKind::Ditch,
            v1::SiteKind::Unspecified => return Err(InvalidMessage::Missing("kind")),
        };
        let position = it.position.ok_or(InvalidMessage::Missing("position"))?.try_into()?;
        Ok(Site { name: it.name, position, kind })
    }
}

/// `value` if it is a finite number.
pub fn finite(field: &'static str, value: f64) -> Result<f64, InvalidMessage> {
    if value.is_finite() { Ok(value) } else { Err(out_of_range(field, value, "a finite number")) }
}

/// `value` if it is finite and at least zero.
pub(crate) fn not_negative(field: &'static str, value: f64) -> Result<f64, InvalidMessage> {
    if (0.0..=f64::MAX).contains(&value) {
        Ok(value)
    } else {
        Err(out_of_range(field, value, "a number of at least 0"))
    }
}

/// `value` if it is finite and more than zero.
pub(crate) fn positive(field: &'static str, value: f64) -> Result<f64, InvalidMessage> {
    if value.is_finite() && 0.0 < value { Ok(value) } else { Err(out_of_range(field, value, "more than zero")) }
}

fn out_of_range(field: &'static str, value: impl std::fmt::Debug, expected: &'static str) -> InvalidMessage {
    InvalidMessage::OutOfRange { field, value: format!("{value:?}"), expected }
}

fn unsound(field: &'static str, [north, east, down]: [f64; 3], expected: &'static str) -> InvalidMessage {
    InvalidMessage::OutOfRange { field, value: format!("north {north:?}, east {east:?}, down {down:?}"), expected }
}

/// `text` if it is not empty.
pub fn not_empty(field: &'static str, text: String) -> Result<String, InvalidMessage> {
    if text.is_empty() { Err(InvalidMessage::Missing(field)) } else { Ok(text) }
}

/// `seconds` as a duration; refused if it is not a number, negative or too long.
pub fn duration(field: &'static str, seconds: f64) -> Result<Duration, InvalidMessage> {
    Duration::try_from_secs_f64(seconds).map_err(|_| out_of_range(field, seconds, "seconds, zero or more"))
}

#[cfg(test)]
pub(crate) mod generators {
    //! Values for the round-trip properties.

    use proptest::prelude::*;

    use super::*;
    use crate::geodesy::{LatLon, Origin};

    pub(crate) fn ned() -> impl Strategy<Value = Ned> {
        (-1e6..1e6, -1e6..1e6, -1e4..1e4).prop_map(|(north, east, down)| Ned::new(north, east, down))
    }

    pub(crate) fn velocity() -> impl Strategy<Value = NedVelocity> {
        (-99.0..99.0, -99.0..99.0, -99.0..99.0).prop_map(|(north, east, down)| NedVelocity::new(north, east, down))
    }

    pub(crate) fn mode() -> impl Strategy<Value = FlightMode> {
        use FlightMode::*;
        prop::sample::select(vec![Loiter, Takeoff, Land, Offboard, Return])
    }

    pub(crate) fn name() -> impl Strategy<Value = String> {
        "[a-zA-Z][a-zA-Z0-9 ]{0,8}"
    }

    pub(crate) fn site() -> impl Strategy<Value = Site> {
        let kind = prop::sample::select(vec![SiteKind::Landing, SiteKind::Ditch]);
        (name(), ned(), kind).prop_map(|(name, position, kind)| Site { name, position, kind })
    }

    pub(crate) fn origin() -> impl Strategy<Value = Origin> {
        let place = (-90.0..=90.0, -180.0..=180.0).prop_map(|(latitude_deg, longitude_deg)| {
            LatLon::new(latitude_deg, longitude_deg).expect("these ranges are those of places")
        });
        (place, prop::option::of(-500.0..9000.0)).prop_map(|(place, altitude_m)| Origin { place, altitude_m })
    }

    pub(crate) fn area() -> impl Strategy<Value = Area> {
        let kind = prop::sample::select(vec![AreaKind::Permission, AreaKind::KeepOut]);
        let ground = prop::sample::select(vec![Ground::Nobody, Ground::Water, Ground::People]);
        let height = || prop::option::of(-500.0..500.0);
        let moment = || prop::option::of(any::<i64>());
        let span = (0..10_000_i64, 1..3_000_i64);
        let hours = prop::option::of(prop::collection::vec(span, 1..5));
        let ring = || prop::collection::vec(ned(), 0..5);
        let rings = (ring(), prop::collection::vec(ring(), 0..3));
        (name(), kind, rings, height(), height(), moment(), moment(), hours, ground).prop_map(
            |(name, kind, (corners, holes), floor_m, ceiling_m, from_utc_ms, until_utc_ms, hours, ground)| Area {
                name,
                kind,
                corners,
                holes,
                floor_m,
                ceiling_m,
                from_utc_ms,
                until_utc_ms,
                hours: hours.map(|spans| WeeklyHours::new(spans).expect("some, and few")),
                ground,
            },
        )
    }
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    proptest! {
        #[test]
        fn places_velocities_areas_and_sites_survive_the_wire(
            ned in generators::ned(),
            velocity in generators::velocity(),
            mode in generators::mode(),
            area in generators::area(),
            site in generators::site(),
        ) {
            prop_assert_eq!(Ned::try_from(v1::Ned::from(ned)), Ok(ned));
            prop_assert_eq!(NedVelocity::try_from(v1::NedVelocity::from(velocity)), Ok(velocity));
            prop_assert_eq!(flight_mode(mode.into()), Some(mode));
            prop_assert_eq!(Area::try_from(v1::Area::from(&area)), Ok(area));
            prop_assert_eq!(Site::try_from(v1::Site::from(&site)), Ok(site));
        }
    }

    #[test]
    fn hours_that_make_no_sense_are_refused() {
        let area = v1::Area { kind: v1::AreaKind::KeepOut as i32, hours_utc: vec!["Mon".into()], ..Default::default() };
        let told = Area::try_from(area).unwrap_err().to_string();
        assert_eq!(told, "`hours_utc` is [\"Mon\"], expected days and hours like Mon-Fri 08:00-18:00");
    }

    #[test]
    fn a_site_of_an_unknown_kind_or_without_a_place_is_refused() {
        #[track_caller]
        fn check(site: v1::Site, expected: &str) {
            assert_eq!(Site::try_from(site).unwrap_err().to_string(), expected);
        }
        let kind = v1::SiteKind::Ditch as i32;
        let position = Some(v1::Ned::default());
        check(v1::Site { position, ..Default::default() }, "`kind` is missing");
        check(v1::Site { position, kind: 99, ..Default::default() }, "`kind` is missing");
        check(v1::Site { kind, ..Default::default() }, "`position` is missing");
        let nowhere = Some(v1::Ned { north_m: f64::NAN, ..Default::default() });
        assert!(Site::try_from(v1::Site { position: nowhere, kind, ..Default::default() }).is_err());
    }
}
