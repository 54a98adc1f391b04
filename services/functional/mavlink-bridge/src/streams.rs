//! Asks for messages, one request at a time. Neither autopilot remembers it when it is started again.

use std::time::Duration;

use domain::time::Time;

use crate::heard::Ack;
use crate::personality::Stream;
use crate::said::{CommandLong, Said, command};

/// A request that is not answered is sent again after this time, and given up after some tries.
const RETRY: Duration = Duration::from_millis(500);
const TRIES: u32 = 3;
/// All are asked for again if the land detector, which both send whatever they know, was not heard for this long.
const SILENT: Duration = Duration::from_secs(5);

/// GPS_GLOBAL_ORIGIN.
const ORIGIN: f32 = 49.0;
/// One that is not heard is requested again after this time.
const ORIGIN_AGAIN: Duration = Duration::from_secs(1);

/// The requests.
#[derive(Debug)]
pub(crate) struct Streams {
    wanted: &'static [Stream],
    next: usize,
    sent: Option<Time>,
    tries: u32,
    /// When the land detector was heard last, or all was asked for.
    heard: Option<Time>,
    /// When the origin is requested next, as long as it was not heard.
    origin_due: Option<Time>,
}

impl Streams {
    /// Nothing was asked for.
    pub(crate) fn new(wanted: &'static [Stream]) -> Streams {
        Streams { wanted, next: 0, sent: None, tries: 0, heard: None, origin_due: Some(Time::ZERO) }
    }

    /// Asks for everything again.
    pub(crate) fn restart(&mut self) {
        *self = Streams::new(self.wanted);
    }

    /// The land detector was heard.
    pub(crate) fn heard_land_detector(&mut self, now: Time) {
        self.heard = Some(now);
    }

    /// The origin of the local frame was heard.
    pub(crate) fn heard_origin(&mut self) {
        self.origin_due = None;
    }

    /// The origin is requested by itself, until it is heard: PX4 says it when it changes, whatever interval is asked for.
    pub(crate) fn origin_due(&mut self, now: Time) -> Option<Said> {
        self.origin_due.filter(|it| *it <= now)?;
        self.origin_due = Some(now + ORIGIN_AGAIN);
        let command = CommandLong::new(command::REQUEST_MESSAGE, [ORIGIN]);
        Some(Said::Command { command, confirmation: 0 })
    }

    /// A request was answered; a refusal is an answer.
    pub(crate) fn acknowledged(&mut self, ack: Ack) {
        if ack.command == command::SET_INTERVAL && self.sent.is_some() {
            self.advance();
        }
    }

    fn advance(&mut self) {
        self.next += 1;
        (self.sent, self.tries) = (None, 0);
    }

    /// The request to be sent now.
    pub(crate) fn due(&mut self, now: Time) -> Option<Said> {
        if self.next == self.wanted.len() && self.heard.is_some_and(|it| SILENT < now - it) {
            self.restart();
        }
        if self.sent.is_some_and(|it| now - it < RETRY) {
            return None;
        }
        if TRIES <= self.tries {
            self.advance();
        }
        let (id, period_us) = *self.wanted.get(self.next)?;
        self.heard.get_or_insert(now);
        self.sent = Some(now);
        self.tries += 1;
        let command = CommandLong::new(command::SET_INTERVAL, [id as f32, period_us as f32]);
        Some(Said::Command { command, confirmation: (self.tries - 1) as u8 })
    }

    /// When something is due.
    pub(crate) fn deadline(&self) -> Option<Time> {
        let next = match self.sent {
            Some(sent) => Some(sent + RETRY),
            None if self.next < self.wanted.len() => Some(Time::ZERO),
            None => self.heard.map(|it| it + SILENT + Duration::from_millis(1)),
        };
        next.into_iter().chain(self.origin_due).min()
    }
}
