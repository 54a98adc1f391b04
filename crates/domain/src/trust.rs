//! What is known over a restart, and what that permits. In one sentence: restored knowledge is enough to stay, not to begin.
//!
//! What a process has seen or heard and knows over a restart is [`Known`]: a value with its source and its time. [`Source::permits`] is the page
//! that says what each source permits. Two kinds of facts need no source:
//!
//! - What the process has decided itself: orders, progress, the end of a mission, a crash, numbers. Nobody else can tell it, so it is as good
//!   after a restart as before. If it is lost, the mission as a whole is doubted.
//! - What forbids: a flag, a denial, a closed area. It counts whatever its source, until a newer statement ends it.

use crate::time::Time;

/// A value, where it is from, and since when.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Known<T> {
    /// What is known.
    pub value: T,
    /// Where it is from.
    pub source: Source,
    /// Since when this process knows that; zero where it was restored.
    pub since: Time,
}

/// Where a value is from.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub enum Source {
    /// This process has seen or heard it.
    Live,
    /// The previous process has stored it, and it may still be confirmed.
    Restored,
    /// Something speaks against it.
    Doubted(Doubt),
}

/// Why a value is doubted.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub enum Doubt {
    /// It was restored, and its sender should have confirmed it by now.
    Unconfirmed,
    /// The state that it belongs to is lost, outdated, of another format version or of another mission file.
    StateLost,
}

/// What somebody wants to do by what is known.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub enum To {
    /// Stay in the place, or hold.
    Stay,
    /// Make a plan for a vehicle in the air. Before it goes on into something new, it is asked again.
    Plan,
    /// Go on, in the air, into something new that is right ahead.
    GoOn,
    /// Begin on the ground, where it costs nothing to wait.
    Begin,
}

impl Source {
    /// The page of rules: whether what is known from here is enough for this.
    #[rustfmt::skip]
    pub fn permits(self, to: To) -> bool {
        let row = match self {
            //                     stay  plan   go on  begin
            Source::Live       => [true, true,  true,  true],
            Source::Restored   => [true, true,  false, false],
            Source::Doubted(_) => [true, false, false, false],
        };
        row[to as usize]
    }
}

impl<T> Known<T> {
    /// Seen or heard by this process.
    pub fn live(value: T, since: Time) -> Known<T> {
        Known { value, source: Source::Live, since }
    }

    /// Stored by the previous process.
    pub fn restored(value: T) -> Known<T> {
        Known { value, source: Source::Restored, since: Time::ZERO }
    }

    /// Whether this process has seen or heard it.
    pub fn is_live(&self) -> bool {
        self.source == Source::Live
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The page, as a person reads it.
    #[test]
    fn restored_knowledge_is_enough_to_stay_not_to_begin() {
        let page = [
            ("live", Source::Live, "stay plan go-on begin"),
            ("restored", Source::Restored, "stay plan"),
            ("not confirmed in time", Source::Doubted(Doubt::Unconfirmed), "stay"),
            ("its state is lost", Source::Doubted(Doubt::StateLost), "stay"),
        ];
        let uses = [(To::Stay, "stay"), (To::Plan, "plan"), (To::GoOn, "go-on"), (To::Begin, "begin")];
        for (name, source, expected) in page {
            let permitted = uses.iter().filter(|(to, _)| source.permits(*to)).map(|(_, word)| *word);
            assert_eq!(permitted.collect::<Vec<_>>().join(" "), expected, "{name}");
        }
    }
}
