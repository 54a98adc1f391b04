//! What the oracle may have against a run.

use std::fmt;
use std::time::Duration;

use domain::time::Time;
use witness::Breach;

use crate::trouble::{Order, Victim};

/// What must not happen.
#[derive(Debug, Clone, PartialEq)]
pub enum Violation {
    /// A rule of the airspace or of takeoffs, or nobody responds.
    Breach(Breach),
    /// The vehicle flew, was heard, and its mission manager was not heard for too long.
    NobodyInCharge {
        /// When.
        at: Time,
        /// How long until then, in mission time.
        silent_for: Duration,
    },
    /// An order was accepted, and the vehicle still flies.
    Disobeyed {
        /// Which.
        order: Order,
        /// When it should have been on the ground.
        at: Time,
    },
    /// An order to come down was accepted, and the vehicle took off after it.
    TookOffAfter {
        /// Which.
        order: Order,
        /// When.
        at: Time,
    },
    /// No order was accepted in flight, for a long time.
    Refused {
        /// Which.
        order: Order,
        /// What was answered last.
        said: String,
    },
    /// The vehicle obeys an order that nobody has given lately, and that was not accepted.
    ObeyedLate {
        /// Which.
        order: Order,
        /// When it was first seen to obey.
        at: Time,
        /// When the order was last given, if it ever was.
        given: Option<Time>,
    },
    /// The vehicle crashed.
    Crashed,
    /// The launcher ended, as after a landing, while the vehicle flew.
    LeftInFlight {
        /// When the vehicle was heard last.
        at: Time,
    },
    /// The launcher gave up, or the system did not come back.
    NotKeptUp(String),
    /// A process was lost. Others on its side were heard, its successor not for too long.
    NotBack {
        /// Which.
        victim: Victim,
        /// When it was given up.
        at: Time,
    },
    /// It neither landed nor holds for a reason.
    NeverEnded(String),
}

impl fmt::Display for Violation {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let s = |at: &Time| at.as_secs_f64();
        match self {
            Violation::Breach(breach) => fmt::Display::fmt(breach, f),
            Violation::NobodyInCharge { at, silent_for } => {
                write!(f, "at {:.0} s it flew and the mission manager had not been heard for {silent_for:.0?}", s(at))
            }
            Violation::Disobeyed { order, at } => {
                write!(f, "{} was accepted, and at {:.0} s the vehicle still flew", order.verb(), s(at))
            }
            Violation::TookOffAfter { order, at } => {
                write!(f, "at {:.0} s it took off, though {} had been accepted", s(at), order.verb())
            }
            Violation::Refused { order, said } => write!(f, "{} was not accepted in flight: {said}", order.verb()),
            Violation::ObeyedLate { order, at, given } => {
                let given = given.map_or("never".to_owned(), |it| format!("last at {:.0} s", s(&it)));
                write!(f, "at {:.0} s it obeyed {}, which was given {given} and not accepted", s(at), order.verb())
            }
            Violation::Crashed => f.write_str("the vehicle crashed"),
            Violation::LeftInFlight { at } => {
                write!(f, "the launcher ended as after a landing, and at {:.0} s the vehicle still flew", s(at))
            }
            Violation::NotKeptUp(last_words) => write!(f, "the system was not kept up: {last_words}"),
            Violation::NotBack { victim, at } => {
                write!(f, "{victim} was lost, and at {:.0} s its successor had not been heard", s(at))
            }
            Violation::NeverEnded(how) => write!(f, "it neither landed nor holds for a reason: {how}"),
        }
    }
}
