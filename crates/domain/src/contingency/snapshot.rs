//! What a rule can read: every field with its unit and its range, in one table, and the values at one moment.

use super::source::DataSource;
use super::unit::Unit;

/// What a field holds.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Kind {
    /// A measured number.
    Number {
        /// Its unit.
        unit: Unit,
        /// The least value that a rule may compare it with.
        least: f64,
        /// The greatest.
        most: f64,
    },
    /// One of two or more names; a yes or no is one of [`TRUTH`].
    Choice(&'static [&'static str]),
}

/// The names of no and yes.
pub const TRUTH: &[&str] = &["false", "true"];
/// The names of the flight modes; one that has no name here is `other`.
pub const MODES: &[&str] = &["loiter", "takeoff", "land", "offboard", "return", "other"];

/// Without an aircraft near, [`Field::ClosestApproach`] has this value, in metres.
pub const NO_TRAFFIC_M: f64 = 100_000.0;

const fn number(unit: Unit, least: f64, most: f64) -> Kind {
    Kind::Number { unit, least, most }
}

macro_rules! fields {
    ($($(#[doc = $doc:literal])+ $variant:ident $name:literal $kind:expr;)+) => {
        /// A field that a rule can read.
        #[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
        pub enum Field { $($(#[doc = $doc])+ $variant,)+ }

        impl Field {
            /// Every field.
            pub const ALL: &[Field] = &[$(Field::$variant),+];

            /// As a rule names it; the name of a number ends in its unit.
            pub fn name(self) -> &'static str {
                match self { $(Field::$variant => $name,)+ }
            }

            /// What it holds.
            pub fn kind(self) -> Kind {
                match self { $(Field::$variant => $kind,)+ }
            }

            /// What it is, in a sentence.
            pub fn meaning(self) -> &'static str {
                match self { $(Field::$variant => concat!($($doc),+).trim(),)+ }
            }
        }
    };
}

fields! {
    /// Charge of the battery.
    BatteryCharge "battery.charge_percent" number(Unit::PERCENT, 0.0, 100.0);
    /// Voltage at the terminals.
    BatteryVoltage "battery.voltage_v" number(Unit::VOLT, 0.0, 1000.0);
    /// Current that is drawn; negative while charging.
    BatteryCurrent "battery.current_a" number(Unit::AMPERE, -1000.0, 1000.0);
    /// Temperature of the battery's cells.
    BatteryTemperature "battery.temperature_c" number(Unit::CELSIUS, -100.0, 200.0);
    /// Standard deviation of the position over ground.
    HorizontalDeviation "position.horizontal_deviation_m" number(Unit::METRE, 0.0, 1000.0);
    /// Standard deviation of the height.
    VerticalDeviation "position.vertical_deviation_m" number(Unit::METRE, 0.0, 1000.0);
    /// Height above the origin; not known while the estimator does not vouch for it.
    Height "position.height_m" number(Unit::METRE, -1000.0, 10_000.0);
    /// Distance over ground from the origin; not known while the estimator does not vouch for it.
    DistanceHome "position.distance_home_m" number(Unit::METRE, 0.0, 1_000_000.0);
    /// Speed over ground; not known while the estimator does not vouch for it.
    GroundSpeed "motion.ground_speed_m_s" number(Unit::METRE_PER_SECOND, 0.0, 200.0);
    /// Speed upwards; not known while the estimator does not vouch for it.
    Climb "motion.climb_m_s" number(Unit::METRE_PER_SECOND, -100.0, 100.0);
    /// Height above the origin at which a climb would come to rest now; not known while the estimator does not vouch for it.
    HeightAtRest "position.height_at_rest_m" number(Unit::METRE, -1000.0, 10_000.0);
    /// The greatest jump of the position within the last ten seconds or more: how far it was from where the one before it and its
    /// velocity lead, beyond what a vehicle can brake or turn meanwhile.
    PositionJump "position.jump_m" number(Unit::METRE, 0.0, 1_000_000.0);
    /// Angle between the thrust axis and the vertical.
    Tilt "attitude.tilt_deg" number(Unit::DEGREE, 0.0, 180.0);
    /// Angle between the heading of the attitude and that of the position estimate.
    HeadingDifference "attitude.heading_difference_deg" number(Unit::DEGREE, 0.0, 180.0);
    /// How much the frame shakes: the standard deviation of the accelerometer's fast part.
    Vibration "vehicle.vibration_m_s2" number(Unit::METRE_PER_SECOND_SQUARED, 0.0, 1000.0);
    /// Mission seconds since the vehicle has flown without a landing; 0 on the ground.
    FlightTime "flight.time_s" number(Unit::SECOND, 0.0, 1_000_000.0);
    /// Speed of the wind as the autopilot estimates it, averaged over some seconds.
    WindSpeed "wind.speed_m_s" number(Unit::METRE_PER_SECOND, 0.0, 100.0);
    /// The vehicle's airspeed less that wind: below 0 it is blown away. Known in flight.
    AirspeedLeft "wind.airspeed_left_m_s" number(Unit::METRE_PER_SECOND, -100.0, 100.0);
    /// The strongest wind of the last minute, each averaged over three estimates.
    Gust "wind.gust_m_s" number(Unit::METRE_PER_SECOND, 0.0, 100.0);
    /// The least distance over ground to a moving aircraft with people in it, or of unknown kind, within 76 m of the
    /// vehicle's height, now or within the next minute: if the vehicle stays, goes on as it does, or flies its mission.
    /// The least found counts until the aircraft has passed and flies away, whatever the vehicle does; 100 km without
    /// one.
    ClosestApproach "traffic.closest_approach_m" number(Unit::METRE, 0.0, NO_TRAFFIC_M);
    /// The same for aircraft without people in them, within 25 m of the vehicle's height.
    UncrewedApproach "traffic.uncrewed_approach_m" number(Unit::METRE, 0.0, NO_TRAFFIC_M);
    /// The same for ships and boats, at whatever height the vehicle is.
    VesselApproach "traffic.vessel_approach_m" number(Unit::METRE, 0.0, NO_TRAFFIC_M);
    /// Charge that a flight home and a landing there would leave above the reserve, of the full battery, in the present wind and by
    /// what the flight was measured to take; negative: it would use the reserve. Known in flight, if there is a way home.
    HomeMargin "energy.home_margin_percent" number(Unit::PERCENT, -100.0, 100.0);
    /// The same for the place to land at that leaves most: home, a site, a place of the mission, or one that was ordered.
    PlaceMargin "energy.place_margin_percent" number(Unit::PERCENT, -100.0, 100.0);
    /// The recent consumption, as a share of what the vehicle's figures say. Known after half a minute of flight.
    Consumption "energy.consumption_percent" number(Unit::PERCENT, 0.0, 10_000.0);
    /// Mission seconds for which the vehicle could hover here before only the reserve is left.
    Endurance "energy.endurance_s" number(Unit::SECOND, 0.0, 1_000_000.0);
    /// Distance from the straight line of the leg that is flown; not known while none is flown.
    PathDeviation "path.deviation_m" number(Unit::METRE, 0.0, 1_000_000.0);
    /// How fast the vehicle comes nearer to its goals, of the speed that is asked for, over the last 30 s; less than 0 leads away. Not known
    /// while it flies nowhere.
    Pace "skill.pace_percent" number(Unit::PERCENT, -1000.0, 1000.0);
    /// Mission seconds since a skill was to end and did not; 0 without one.
    CancelWait "skill.cancel_s" number(Unit::SECOND, 0.0, 1_000_000.0);
    /// Mission seconds since the vehicle has held in the air, or come no farther than 20 m, but for a stay or a task of its mission, or the approval
    /// of a plan.
    OperatorWait "operator.awaited_s" number(Unit::SECOND, 0.0, 1_000_000.0);
    /// Mission seconds since there has been nothing to fly although the mission goes on; 0 if there is.
    PlanWait "plan.awaited_s" number(Unit::SECOND, 0.0, 1_000_000.0);
    /// Whether the rest of the mission uses a declared skill that no process offers.
    SkillMissing "mission.skill_missing" Kind::Choice(TRUTH);
    /// Whether the ground cannot record the flight although it is to.
    RecordFails "ground.record_fails" Kind::Choice(TRUTH);
    /// The greatest step of the machine's wall clock within the last half minute or more, either way.
    ClockStep "clock.step_s" number(Unit::SECOND, 0.0, 1e9);
    /// Whether the motors may turn.
    Armed "vehicle.armed" Kind::Choice(TRUTH);
    /// Whether the vehicle flies, by motors, height, speed and land detector.
    Flying "vehicle.flying" Kind::Choice(TRUTH);
    /// Whether one of the autopilot's own failsafes flies.
    Failsafe "autopilot.failsafe" Kind::Choice(TRUTH);
    /// The mode that is flown.
    Mode "autopilot.mode" Kind::Choice(MODES);
    /// The mode that was asked for.
    IntendedMode "autopilot.intended_mode" Kind::Choice(MODES);
    /// Whether the autopilot flies something else than what was asked for, for a reason of its own.
    Preempts "autopilot.preempts" Kind::Choice(TRUTH);
    /// Whether the autopilot would not arm, by its own checks; no while it is armed.
    NotReady "autopilot.not_ready" Kind::Choice(TRUTH);
    /// Whether the autopilot reports that it has lost the proof of life that goes with setpoints.
    SetpointsLost "autopilot.setpoints_lost" Kind::Choice(TRUTH);
    /// Whether the autopilot reports that its own link to the ground is lost.
    OwnLinkLost "autopilot.link_lost" Kind::Choice(TRUTH);
    /// Whether the estimator does not vouch for the position, or is reported as failed.
    EstimatorInvalid "estimator.invalid" Kind::Choice(TRUTH);
    /// Whether satellite navigation is reported as lost.
    GnssLost "gnss.lost" Kind::Choice(TRUTH);
    /// Whether a motor is reported as failed.
    MotorFailed "motor.failed" Kind::Choice(TRUTH);
    /// Whether the battery is reported as faulty.
    BatteryFaulty "battery.faulty" Kind::Choice(TRUTH);
    /// Whether the land detector says the opposite of what motors, height and speed show; not known while it says nothing.
    DetectorContradicts "land_detector.contradicts" Kind::Choice(TRUTH);
    /// Whether the autopilot sees the target of a landing on one; known during such a landing, where the autopilot says.
    TargetSeen "landing.target_seen" Kind::Choice(TRUTH);
    /// The fastest descent in the last seconds before the vehicle was on the ground; 0 in the air, not known where it was not seen to come
    /// down.
    TouchdownSpeed "touchdown.speed_m_s" number(Unit::METRE_PER_SECOND, 0.0, 100.0);
    /// For how long the autopilot's status has brought nothing new.
    StatusSilence "status.silent_s" SILENCE;
    /// For how long the attitude has brought nothing new.
    AttitudeSilence "attitude.silent_s" SILENCE;
    /// For how long the local position has brought nothing new.
    PositionSilence "position.silent_s" SILENCE;
    /// For how long the global position has brought nothing new.
    GlobalPositionSilence "global_position.silent_s" SILENCE;
    /// For how long the land detector has brought nothing new.
    DetectorSilence "land_detector.silent_s" SILENCE;
    /// For how long the battery has brought nothing new.
    BatterySilence "battery.silent_s" SILENCE;
    /// Wall seconds since the ground and the vehicle last heard each other; not known where there was no link in this flight.
    LinkSilence "link.silent_s" SILENCE;
    /// Wall seconds since the control tower was last heard; not known where there was none in this flight.
    TowerSilence "tower.silent_s" SILENCE;
    /// Wall seconds since the planner last showed that its loop turns.
    PlannerSilence "planner.silent_s" SILENCE;
    /// The same of the skill manager.
    SkillManagerSilence "skill_manager.silent_s" SILENCE;
    /// The same of the mission manager.
    ManagerSilence "mission_manager.silent_s" SILENCE;
}

/// How long a source has been silent.
const SILENCE: Kind = number(Unit::SECOND, 0.0, 1_000_000.0);

impl Field {
    /// The field of this name.
    pub fn named(name: &str) -> Option<Field> {
        Field::ALL.iter().copied().find(|it| it.name() == name)
    }

    /// The source whose silence it is.
    pub fn silence(self) -> Option<DataSource> {
        Some(match self {
            Field::StatusSilence => DataSource::Status,
            Field::AttitudeSilence => DataSource::Attitude,
            Field::PositionSilence => DataSource::LocalPosition,
            Field::GlobalPositionSilence => DataSource::GlobalPosition,
            Field::DetectorSilence => DataSource::LandDetected,
            Field::BatterySilence => DataSource::Battery,
            Field::LinkSilence => DataSource::GroundLink,
            Field::TowerSilence => DataSource::ControlTower,
            Field::PlannerSilence => DataSource::Planner,
            Field::SkillManagerSilence => DataSource::SkillManager,
            Field::ManagerSilence => DataSource::MissionManager,
            _ => return None,
        })
    }

    /// Whether it lasts by itself, as a silence and the greatest value of some time do: no single sample decides.
    pub fn lasts(self) -> bool {
        self.silence().is_some() || matches!(self, Field::ClockStep | Field::TouchdownSpeed)
    }

    /// A value of this field in words, with its unit: `4.20 %`, `offboard`.
    pub fn in_words(self, value: f64) -> String {
        match self.kind() {
            Kind::Number { unit, .. } => format!("{value:.2} {unit}"),
            Kind::Choice(names) => names.get(value as usize).copied().unwrap_or("unknown").to_owned(),
        }
    }
}

/// The values of all fields at one moment; nothing is known of a field that was not set.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Snapshot([Option<f64>; Field::ALL.len()]);

impl Snapshot {
    /// Nothing is known.
    pub const UNKNOWN: Snapshot = Snapshot([None; Field::ALL.len()]);

    /// The fields that have another value than they had in `earlier`.
    pub fn differs_in(&self, earlier: &Snapshot) -> Fields {
        let differs = |field: &Field| self.get(*field) != earlier.get(*field);
        Fields::of(Field::ALL.iter().copied().filter(differs))
    }

    /// The value of a field, a choice as its place in the list of names; `None`: it is not known.
    pub fn get(&self, field: Field) -> Option<f64> {
        self.0[field as usize]
    }

    /// Sets a number in the field's unit. What is not a finite number is not known.
    pub fn set(&mut self, field: Field, value: Option<f64>) {
        self.0[field as usize] = value.filter(|it| it.is_finite());
    }

    /// Sets a yes or no.
    pub fn set_truth(&mut self, field: Field, value: Option<bool>) {
        self.set(field, value.map(|it| if it { 1.0 } else { 0.0 }));
    }

    /// Sets a choice by its name. A name that the field does not have is not known.
    pub fn set_choice(&mut self, field: Field, name: &str) {
        let place = match field.kind() {
            Kind::Choice(names) => names.iter().position(|it| *it == name),
            Kind::Number { .. } => None,
        };
        self.set(field, place.map(|it| it as f64));
    }
}

/// A set of fields.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Fields(u64);

impl Fields {
    /// The set of these.
    pub fn of(fields: impl IntoIterator<Item = Field>) -> Fields {
        const { assert!(Field::ALL.len() <= u64::BITS as usize, "a set of fields is 64 bits wide") };
        Fields(fields.into_iter().fold(0, |set, field| set | 1 << field as u32))
    }

    /// No field.
    pub const NONE: Fields = Fields(0);

    /// Whether any field is in both.
    pub fn meets(self, other: Fields) -> bool {
        self.0 & other.0 != 0
    }

    /// The fields that are in either.
    pub fn and(self, other: Fields) -> Fields {
        Fields(self.0 | other.0)
    }
}

#[cfg(test)]
mod tests {
    use std::collections::BTreeSet;

    use super::*;

    #[test]
    fn every_field_has_a_name_a_meaning_and_a_range() {
        let names: BTreeSet<&str> = Field::ALL.iter().map(|it| it.name()).collect();
        assert_eq!(names.len(), Field::ALL.len(), "two fields share a name");
        for (place, field) in Field::ALL.iter().copied().enumerate() {
            assert_eq!((field as usize, Field::named(field.name())), (place, Some(field)));
            assert!(field.meaning().ends_with('.'), "{field:?}");
            match field.kind() {
                Kind::Number { least, most, .. } => assert!(least < most, "{field:?}"),
                Kind::Choice(names) => assert!(1 < names.len(), "{field:?}"),
            }
        }
    }

    #[test]
    fn what_is_no_number_is_not_known() {
        let mut snapshot = Snapshot::UNKNOWN;
        snapshot.set(Field::Height, Some(f64::NAN));
        snapshot.set_choice(Field::Mode, "sideways");
        assert_eq!(snapshot, Snapshot::UNKNOWN);
        snapshot.set_choice(Field::Mode, "land");
        snapshot.set_truth(Field::Armed, Some(true));
        assert_eq!(snapshot.get(Field::Mode).map(|it| Field::Mode.in_words(it)).as_deref(), Some("land"));
        assert_eq!(snapshot.get(Field::Armed).map(|it| Field::Armed.in_words(it)).as_deref(), Some("true"));
    }

    #[test]
    fn what_differs_between_two_snapshots_is_a_set_of_fields() {
        #[track_caller]
        fn check(change: impl FnOnce(&mut Snapshot), expected: &[Field]) {
            let mut earlier = Snapshot::UNKNOWN;
            earlier.set(Field::Height, Some(40.0));
            let mut later = earlier;
            change(&mut later);
            assert_eq!(later.differs_in(&earlier), Fields::of(expected.iter().copied()), "{expected:?}");
        }
        check(|_| {}, &[]);
        check(|it| it.set(Field::Height, Some(40.0)), &[]);
        check(|it| it.set(Field::Height, Some(41.0)), &[Field::Height]);
        check(|it| it.set(Field::Height, None), &[Field::Height]);
        check(|it| it.set_truth(Field::Armed, Some(false)), &[Field::Armed]);
        let (few, many) = (Fields::of([Field::Height]), Fields::of(Field::ALL.iter().copied()));
        assert!(
            many.meets(few) && few.meets(many) && !few.meets(Fields::of([Field::Armed])) && !few.meets(Fields::of([]))
        );
    }
}
