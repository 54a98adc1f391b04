//! The autopilot's status as published to the layers above: mode, health and reasons.

use std::time::Duration;

use domain::fmu::{self, Author};
use domain::time::Time;
use kittiwake_proto::v1;
use node::Effect;

use crate::config::Config;
use crate::flown::Flown;
use crate::telemetry;

/// What was said last.
#[derive(Debug, Default)]
pub(crate) struct Reporter {
    published: Option<(Time, fmu::Status)>,
    was_silent: bool,
    /// A message that the status follows from has arrived.
    pub(crate) has_news: bool,
}

/// What the autopilot is not asked for, and follows from what is around it.
#[derive(Debug)]
pub(crate) struct Surroundings {
    /// Why it must not take off.
    pub(crate) problem: Option<String>,
    /// The setpoints of the layers above are fresh.
    pub(crate) has_setpoint: bool,
}

/// The status is sent at most this often if it does not change.
const STATUS_PERIOD: Duration = Duration::from_millis(100);
/// What an autopilot knows of its origin it says within this time after it is asked. One that starts learns it much later.
const ORIGIN_PATIENCE: Duration = Duration::from_secs(4);
/// A text that is older does not explain the present.
const EXPLAINS: Duration = Duration::from_secs(30);

impl Flown {
    /// The status, if it is due.
    pub(crate) fn report(&mut self, around: Surroundings, config: &Config, now: Time) -> Option<Effect> {
        let silence = config.silence_s.seconds();
        let is_silent = self.vehicle.heartbeat.is_none_or(|(at, _)| silence < now - at);
        if is_silent != self.reporter.was_silent && self.vehicle.heartbeat.is_some() {
            self.reporter.was_silent = is_silent;
            match is_silent {
                true => tracing::warn!("the autopilot is silent"),
                false => tracing::info!("the autopilot is heard again"),
            }
        }
        // Without the origin the frame has no name: one that comes late would look like a frame that has moved.
        let awaits_origin = self.vehicle.origin.is_none() && now - self.heard_first < ORIGIN_PATIENCE;
        if is_silent || awaits_origin || self.adopts {
            return None;
        }
        let status = self.status(around, config, now);
        let Reporter { published, has_news, .. } = &mut self.reporter;
        let is_new = published.as_ref().is_none_or(|(_, it)| *it != status);
        let is_due = *has_news && published.as_ref().is_none_or(|(at, _)| STATUS_PERIOD <= now - *at);
        if !is_new && !is_due {
            return None;
        }
        *has_news = false;
        *published = Some((now, status.clone()));
        Some(Effect::publish(v1::VehicleStatus::from(status)))
    }

    fn status(&self, around: Surroundings, config: &Config, now: Time) -> fmu::Status {
        let Surroundings { problem, has_setpoint } = around;
        let Flown { vehicle, personality, modes, submode, .. } = self;
        let landing = self.landing();
        let flown = landing.or(vehicle.custom_mode()).unwrap_or_default();
        let mut actual = personality.mode(flown, *submode);
        let (author, is_other) = (modes.author(), modes.other().is_some());
        let intended = match (landing.or(vehicle.intended(now)), modes.ours()) {
            (Some(mode), _) => personality.mode(mode, *submode),
            (None, Some(ours)) if !is_other => personality.mode(ours, *submode),
            _ => actual,
        };
        let signal_lost = vehicle.is_armed() && self.misses_us(intended, actual, is_other, has_setpoint, now);
        // ArduPilot keeps one that has landed it until it is started again: on the ground it flies nothing.
        let is_critical = vehicle.is_armed() && vehicle.critical_since.is_some();
        // While the autopilot flies a failsafe, or somebody else flies, nobody expects it to fly our setpoints.
        let is_ours = author == Author::Ours && !is_critical;
        let unflown = is_ours && self.setpoints.are_unflown(config.unflown_s.seconds(), now);
        // It stands although it is to fly: by our own stop, or because the autopilot swallows its commands.
        let stands = (signal_lost && personality.stop().is_some() && intended == actual) || unflown;
        if stands {
            actual = actual.and(Some(fmu::FlightMode::Loiter));
        }
        let lands = actual == Some(fmu::FlightMode::Land) && !vehicle.is_on_ground();
        let is_ground_mode = flown == personality.ground_mode();
        let can_arm = vehicle.prearm(now).filter(|_| is_ground_mode || vehicle.is_armed());
        let failsafe = author == Author::Failsafe || is_critical;
        let unable = can_arm == Some(false) && !vehicle.is_armed();
        let mut reasons = self.reasons(problem.as_deref(), unflown);
        if failsafe || is_other || unable {
            reasons.extend(self.explanation(now));
        }
        fmu::Status {
            armed: vehicle.is_armed(),
            intended,
            actual,
            failsafe,
            failures: telemetry::failures(vehicle, signal_lost || unflown, now),
            origin: telemetry::origin(vehicle),
            gripper: self.gripper(),
            landing_target_seen: self.landing_target_seen(lands, now),
            commanded_by_other: is_other,
            reason: reasons.join("; "),
            can_arm: if problem.is_some() || vehicle.origin.is_none() { Some(false) } else { can_arm },
            frame_epoch: self.epoch.number(),
            vibration_m_s2: telemetry::vibration_m_s2(vehicle, personality.as_ref(), now),
            // That it stands is our conclusion, and no failsafe of the autopilot.
            failsafe_reason: (stands && !failsafe).then_some(fmu::FailsafeReason::Setpoints),
            // A heartbeat has none.
            timestamp_us: 0,
        }
    }

    /// Whether the setpoints of the layers above do not reach the vehicle. Where this process was started again in flight, it holds for
    /// want of them, and it is our own absence that the autopilot reports: unless it names a failure of its own, or somebody else flies.
    fn misses_us(
        &self,
        intended: Option<fmu::FlightMode>,
        actual: Option<fmu::FlightMode>,
        is_other: bool,
        has_setpoint: bool,
        now: Time,
    ) -> bool {
        if self.setpoints.are_followed() {
            return !has_setpoint;
        }
        let holds_instead = intended == Some(fmu::FlightMode::Offboard) && actual == Some(fmu::FlightMode::Loiter);
        holds_instead && !is_other && telemetry::failures(&self.vehicle, false, now).is_empty()
    }

    /// What is otherwise than it should be, as far as the bridge itself knows it.
    fn reasons(&self, problem: Option<&str>, unflown: bool) -> Vec<String> {
        let other = self.modes.other().map(|how| how.in_words(|mode| self.personality.mode_name(mode)));
        let no_origin = "the autopilot has not said where the origin of its local frame is";
        let not_flown = "the vehicle does not fly its setpoints: they may lie beyond the autopilot's fence, or wind or a slow \
                         link may hold it back";
        let moved = Some(self.moved.as_str()).filter(|it| !it.is_empty());
        let reasons = [
            other.as_deref(),
            problem,
            self.vehicle.origin.is_none().then_some(no_origin),
            unflown.then_some(not_flown),
            moved,
        ];
        reasons.into_iter().flatten().map(str::to_owned).collect()
    }

    /// The autopilot's own explanation: texts, or else its health.
    fn explanation(&self, now: Time) -> Option<String> {
        let since = Time::ZERO + (now - Time::ZERO).saturating_sub(EXPLAINS);
        let (texts, unhealthy) = (self.vehicle.texts.warnings_since(since), self.vehicle.unhealthy(now));
        match (texts.is_empty(), unhealthy.is_empty()) {
            (false, _) => Some(texts),
            (true, false) => Some(format!("not healthy: {}", unhealthy.join(", "))),
            (true, true) => None,
        }
    }
}
