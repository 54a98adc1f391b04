//! Permissions as the control tower's ledger tells them, and the asking for them.

use std::collections::BTreeMap;
use std::time::Duration;

use domain::time::Time;
use kittiwake_proto::topics::Request;
use kittiwake_proto::v1;
use node::CallError;

use crate::config::Limits;
use crate::outbox::{Outbox, Purpose};

/// How the asking for one area goes.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(crate) enum Asking {
    /// No answer yet.
    Awaited,
    /// Granted.
    Granted,
    /// Refused, or never answered.
    Denied {
        /// True when the tower never answered.
        silent: bool,
        /// Why.
        reason: String,
    },
}

#[derive(Debug, Default)]
pub(crate) struct Permissions {
    ledger: BTreeMap<String, Entry>,
    asks: BTreeMap<String, Ask>,
    last_request: u64,
    /// Makes request ids unique among starts of this process.
    instance: u64,
    /// Counts decisions that changed something, so that whoever waits can tell.
    pub(crate) revision: u64,
}

#[derive(Debug, Clone, PartialEq)]
struct Entry {
    state: v1::PermissionState,
    reason: String,
    request_id: String,
    decision: u64,
    expires: Time,
}

#[derive(Debug)]
struct Ask {
    request_id: String,
    tries: u32,
    answer_by: Time,
    /// Decisions up to this one were made before we asked.
    after_decision: u64,
    step_id: u64,
    trouble: Option<CallError>,
}

impl Permissions {
    pub(crate) fn new(instance: u64) -> Permissions {
        Permissions { instance, ..Permissions::default() }
    }

    /// Whether `area` may be entered and stayed in now, with a margin before its expiry.
    pub(crate) fn holds(&self, area: &str, now: Time, margin: Duration) -> bool {
        self.ledger.get(area).is_some_and(|it| it.state == v1::PermissionState::Granted && now + margin < it.expires)
    }

    /// The areas that may be entered now.
    pub(crate) fn held(&self, now: Time, margin: Duration) -> Vec<String> {
        self.ledger.keys().filter(|it| self.holds(it, now, margin)).cloned().collect()
    }

    /// Takes in the tower's ledger; returns what changed, in words.
    pub(crate) fn on_ledger(&mut self, now: Time, ledger: &v1::PermissionLedger) -> Vec<String> {
        let mut news = Vec::new();
        for it in &ledger.permissions {
            let valid = Duration::try_from_secs_f64(it.valid_for_s).unwrap_or_default();
            let entry = Entry {
                state: it.state(),
                reason: it.reason.clone(),
                request_id: it.request_id.clone(),
                decision: it.decision,
                expires: now + valid,
            };
            let before = self.ledger.insert(it.area.clone(), entry);
            let changed = before.as_ref().is_none_or(|old| old.state != it.state() || old.decision != it.decision);
            if changed && it.state() != v1::PermissionState::Requested {
                self.revision += 1;
                news.push(in_words(it));
            }
        }
        news
    }

    /// Asks for `area`, unless that is under way already.
    pub(crate) fn ask(&mut self, now: Time, area: &str, step_id: u64, limits: &Limits, outbox: &mut Outbox) {
        let decided = self.ledger.get(area).map_or(0, |it| it.decision);
        let ask = Ask {
            request_id: String::new(),
            tries: 0,
            answer_by: now,
            after_decision: decided,
            step_id,
            trouble: None,
        };
        self.asks.entry(area.to_owned()).or_insert(ask);
        self.try_again(now, area, limits, outbox);
    }

    /// How the asking goes; asks again when the answer is overdue.
    pub(crate) fn asking(&mut self, now: Time, area: &str, limits: &Limits, outbox: &mut Outbox) -> Asking {
        if self.holds(area, now, limits.permission_margin) {
            return Asking::Granted;
        }
        let Some(ask) = self.asks.get(area) else { return Asking::Awaited };
        if let Some(entry) = self.ledger.get(area)
            && ask.after_decision < entry.decision
            && matches!(entry.state, v1::PermissionState::Denied | v1::PermissionState::Revoked)
        {
            return Asking::Denied { silent: false, reason: entry.reason.clone() };
        }
        if now < ask.answer_by {
            return Asking::Awaited;
        }
        if ask.tries < limits.permission_tries {
            self.try_again(now, area, limits, outbox);
            return Asking::Awaited;
        }
        let reason = match ask.trouble {
            Some(CallError::Unavailable) => "the control tower is unavailable".to_owned(),
            _ => format!("no answer from the control tower after {} tries", ask.tries),
        };
        Asking::Denied { silent: true, reason }
    }

    /// When the answer to the asking for `area` is overdue.
    pub(crate) fn answer_by(&self, area: &str) -> Option<Time> {
        self.asks.get(area).map(|it| it.answer_by)
    }

    /// The asking for `area` is over, whatever came of it; a late grant counts all the same.
    pub(crate) fn stop_asking(&mut self, area: &str) {
        self.asks.remove(area);
    }

    /// The request could not be delivered.
    pub(crate) fn on_trouble(&mut self, area: &str, error: CallError) {
        if let Some(ask) = self.asks.get_mut(area) {
            ask.trouble = Some(error);
        }
    }

    fn try_again(&mut self, now: Time, area: &str, limits: &Limits, outbox: &mut Outbox) {
        let Some(ask) = self.asks.get_mut(area) else { return };
        if now < ask.answer_by {
            return;
        }
        self.last_request += 1;
        ask.tries += 1;
        ask.answer_by = now + limits.permission_answer;
        ask.request_id = format!("mcm-{:x}-p{}", self.instance, self.last_request);
        let request =
            v1::PermissionRequest { request_id: ask.request_id.clone(), area: area.to_owned(), step_id: ask.step_id };
        outbox.call(Purpose::Permission(area.to_owned()), Request::Permission(request), limits.permission_answer);
    }
}

fn in_words(it: &v1::Permission) -> String {
    let area = &it.area;
    match it.state() {
        v1::PermissionState::Granted => format!("area {area}: granted"),
        v1::PermissionState::Denied => format!("area {area}: denied ({})", it.reason),
        v1::PermissionState::Revoked => format!("area {area}: revoked ({})", it.reason),
        v1::PermissionState::Expired => format!("area {area}: expired"),
        v1::PermissionState::Requested | v1::PermissionState::Unspecified => format!("area {area}: asked"),
    }
}
