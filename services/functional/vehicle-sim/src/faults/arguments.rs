//! Reads a fault's arguments one by one; every error says what was found and what was expected.

use std::ops::RangeInclusive;

use domain::file::did_you_mean;
use domain::fmu::TrafficKind;
use kittiwake_proto::topics::Topic;

use crate::pilot::Mode;
use crate::publisher::OUT_TOPICS;

/// The arguments that were not read yet.
#[derive(Debug)]
pub(crate) struct Arguments<'a>(&'a [String]);

impl<'a> Arguments<'a> {
    /// All of them.
    pub(crate) fn new(args: &'a [String]) -> Arguments<'a> {
        Arguments(args)
    }

    /// `fault`, if no argument is left.
    pub(crate) fn finish<T>(self, fault: T) -> Result<T, String> {
        match self.0.first() {
            None => Ok(fault),
            Some(extra) => Err(format!("`{extra}` is one argument too many")),
        }
    }

    /// A number.
    pub(crate) fn number(&mut self, name: &str, range: RangeInclusive<f64>) -> Result<f64, String> {
        let text = self.next().ok_or_else(|| format!("{name} is missing"))?;
        let number: f64 = text.parse().map_err(|_| format!("{name} is `{text}`, expected a number"))?;
        within(name, number, range)
    }

    /// A number, or `default` if the argument is left out.
    pub(crate) fn number_or(&mut self, name: &str, range: RangeInclusive<f64>, default: f64) -> Result<f64, String> {
        if self.0.is_empty() { Ok(default) } else { self.number(name, range) }
    }

    /// A whole number.
    pub(crate) fn count(&mut self, name: &str, range: RangeInclusive<u32>) -> Result<u32, String> {
        let text = self.next().ok_or_else(|| format!("{name} is missing"))?;
        let count: u32 = text.parse().map_err(|_| format!("{name} is `{text}`, expected a whole number"))?;
        within(name, count, range)
    }

    /// A whole number, or `default` if the argument is left out.
    pub(crate) fn count_or(&mut self, name: &str, range: RangeInclusive<u32>, default: u32) -> Result<u32, String> {
        if self.0.is_empty() { Ok(default) } else { self.count(name, range) }
    }

    /// `on` or `off`; nothing means on.
    pub(crate) fn switch(&mut self) -> Result<bool, String> {
        match self.next() {
            None | Some("on") => Ok(true),
            Some("off") => Ok(false),
            Some(other) => Err(format!("found `{other}`, expected on or off")),
        }
    }

    /// What a land detector is stuck at.
    pub(crate) fn detector(&mut self) -> Result<Option<bool>, String> {
        match self.next() {
            Some("landed") => Ok(Some(true)),
            Some("flying") => Ok(Some(false)),
            Some("works") => Ok(None),
            other => Err(format!("found `{}`, expected landed, flying or works", other.unwrap_or_default())),
        }
    }

    /// A mode that somebody or something else chooses; nothing means `otherwise`.
    pub(crate) fn mode(&mut self, otherwise: Mode) -> Result<Mode, String> {
        match self.next() {
            None => Ok(otherwise),
            Some("manual") => Ok(Mode::Manual),
            Some("hold") => Ok(Mode::Loiter),
            Some("return") => Ok(Mode::Return),
            Some("land") => Ok(Mode::Land),
            Some(other) => Err(format!("found `{other}`, expected manual, hold, return or land")),
        }
    }

    /// Whether an autopilot that starts again in the air holds.
    pub(crate) fn holds(&mut self) -> Result<bool, String> {
        match self.next() {
            None | Some("holds") => Ok(true),
            Some("falls") => Ok(false),
            Some(other) => Err(format!("found `{other}`, expected holds or falls")),
        }
    }

    /// Any text; `None` if it is left out.
    pub(crate) fn text(&mut self) -> Option<String> {
        self.next().map(str::to_owned)
    }

    /// Whether the next argument is this word, which is read then.
    pub(crate) fn is(&mut self, word: &str) -> bool {
        let is = self.0.first().is_some_and(|it| it == word);
        if is {
            self.0 = &self.0[1..];
        }
        is
    }

    /// What other traffic is; nothing means an aircraft with people in it.
    pub(crate) fn traffic_kind(&mut self) -> Result<TrafficKind, String> {
        match self.next() {
            None | Some("crewed") => Ok(TrafficKind::Crewed),
            Some("uncrewed") => Ok(TrafficKind::Uncrewed),
            Some("vessel") => Ok(TrafficKind::Vessel),
            Some(other) => Err(format!("found `{other}`, expected crewed, uncrewed or vessel")),
        }
    }

    /// One of the topics that the vehicle sends, by the last part of its key.
    pub(crate) fn topic(&mut self) -> Result<Topic, String> {
        let name = self.next().ok_or("TOPIC is missing")?;
        OUT_TOPICS.iter().copied().find(|it| topic_name(*it) == name).ok_or_else(|| {
            let known: Vec<_> = OUT_TOPICS.iter().map(|it| topic_name(*it)).collect();
            format!("there is no topic `{name}`; {}", did_you_mean(name, &known))
        })
    }

    fn next(&mut self) -> Option<&'a str> {
        let (first, rest) = self.0.split_first()?;
        self.0 = rest;
        Some(first)
    }
}

fn within<T: PartialOrd + std::fmt::Display>(name: &str, value: T, range: RangeInclusive<T>) -> Result<T, String> {
    if range.contains(&value) {
        Ok(value)
    } else {
        Err(format!("{name} is {value}, expected {} to {}", range.start(), range.end()))
    }
}

fn topic_name(topic: Topic) -> &'static str {
    topic.key().rsplit('/').next().unwrap_or_default()
}
