//! Who has chosen the mode that an autopilot flies: we, a failsafe of its own, or somebody else.
//!
//! No autopilot says so, and each obeys the last command, from any sender. A mode that it was asked for, that no command of ours has set just now, and
//! that it does not change to by itself, is somebody else's until a command of ours takes effect. This only observes. Not to take a vehicle
//! back that somebody else has taken is the skill manager's rule, which outlives a restart of the autopilot and of its bridge.

use std::time::Duration;

use crate::time::Time;

/// A command shows within this time. (PX4: within 60 ms of an acknowledgement that took at most 390 ms; heartbeats come once a second.)
const SHOWS: Duration = Duration::from_secs(3);
/// A failsafe says so at about the same time as it changes the mode: 3 ms apart where it was measured.
const EVIDENCE: Duration = Duration::from_millis(1_500);
/// As many commands may be on their way.
const MOST: usize = 8;

/// Who has chosen the mode.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Author<M> {
    /// We, or nobody yet.
    Ours,
    /// A mode was seen that is not ours, and it is not known yet whose it is.
    InDoubt,
    /// A failsafe of the autopilot.
    Failsafe,
    /// Somebody else.
    Other(Taken<M>),
}

/// How it is seen that somebody else flies.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Taken<M> {
    /// This mode was set.
    Set(M),
    /// This mode was flown when the vehicle was first heard.
    Found(M),
    /// Something else was done.
    Did(&'static str),
}

impl<M> Taken<M> {
    /// As users read it.
    pub fn in_words(self, name: impl Fn(M) -> String) -> String {
        match self {
            Taken::Set(mode) => format!("{} was set by somebody else", name(mode)),
            Taken::Found(mode) => format!("{} was flown when it was first heard", name(mode)),
            Taken::Did(what) => what.to_owned(),
        }
    }
}

/// What the autopilot says.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Seen<M> {
    /// Whether the motors may turn.
    pub armed: bool,
    /// The mode that was asked for, by anybody; the one that is flown where it does not say.
    pub intended: M,
    /// The mode that is flown.
    pub flown: M,
    /// A command of ours can have set the intended one.
    pub may_be_ours: bool,
    /// The newest sign of a failsafe.
    pub failsafe_at: Option<Time>,
}

/// Follows the modes of an autopilot, which has them as `M`.
#[derive(Debug)]
pub struct ModeObserver<M> {
    /// As long it is not judged who has changed the mode.
    doubt: Duration,
    /// The mode that we set last, or found, or that the autopilot has changed to by itself.
    ours: Option<M>,
    /// What commands of ours set that have not shown yet.
    sent: Vec<(M, Time)>,
    arming: Option<Time>,
    last: Option<Seen<M>>,
    changed: Option<Time>,
    author: Author<M>,
}

impl<M: Copy + PartialEq> ModeObserver<M> {
    /// Nothing was seen. Where a failsafe changes the intended mode, `doubt` is the time within which it says so.
    pub fn new(doubt: Duration) -> ModeObserver<M> {
        let author = Author::Ours;
        ModeObserver { doubt, ours: None, sent: Vec::new(), arming: None, last: None, changed: None, author }
    }

    /// Who has chosen the mode.
    pub fn author(&self) -> Author<M> {
        self.author
    }

    /// How it is seen that somebody else has chosen the mode, if that is so.
    pub fn other(&self) -> Option<Taken<M>> {
        if let Author::Other(how) = self.author { Some(how) } else { None }
    }

    /// The mode that we set last, or that counts as ours.
    pub fn ours(&self) -> Option<M> {
        self.ours
    }

    /// A command that sets this mode was sent.
    pub fn sent(&mut self, mode: M, now: Time) {
        if self.sent.len() == MOST {
            self.sent.remove(0);
        }
        self.sent.push((mode, now));
    }

    /// The autopilot takes a command that sets this mode: where that is the mode already, no change will show it. While another one of ours
    /// has not shown, it is the mode from before: answers come sooner than statuses. (PX4: 1 to 12 ms and 12 to 40 ms; a stop of a real
    /// flight, replaced 10 ms later, looked like somebody else's.)
    pub fn accepted(&mut self, mode: M) {
        let is_last = self.sent.iter().all(|(it, _)| *it == mode);
        if is_last && self.last.is_some_and(|it| it.intended == mode) {
            self.obeys(mode);
        }
    }

    /// The autopilot did not take it.
    pub fn refused(&mut self, mode: M) {
        self.sent.retain(|(it, _)| *it != mode);
    }

    /// A command to arm was sent.
    pub fn arming(&mut self, now: Time) {
        self.arming = Some(now);
    }

    /// Somebody else has done something else than set a mode. What we have sent before does not take it back.
    pub fn taken(&mut self, how: &'static str) {
        self.sent.clear();
        self.author = Author::Other(Taken::Did(how));
    }

    /// The autopilot was started again: it does what it does by itself.
    pub fn restarted(&mut self) {
        *self = ModeObserver::new(self.doubt);
    }

    /// Judges what the autopilot says. `by_itself`: it may change from this mode to the intended one without anybody. Only the mode of a
    /// vehicle whose motors may turn can be somebody else's choice.
    pub fn saw(&mut self, seen: Seen<M>, by_itself: impl Fn(M) -> bool, now: Time) {
        let recent = |at: Time| now - at <= SHOWS;
        let arms = self.arming.is_some_and(recent);
        self.sent.retain(|(_, at)| recent(*at));
        let before = self.last.replace(seen);
        let has_changed = before.is_some_and(|it| it.intended != seen.intended);
        let shows = self.sent.iter().rposition(|(it, _)| has_changed && *it == seen.intended);
        match (shows, self.ours) {
            (Some(index), _) => {
                self.sent.drain(..=index);
                self.obeys(seen.intended);
            }
            (None, None) => self.first(seen),
            (None, Some(ours)) if ours == seen.intended => {
                self.changed = None;
                if self.other().is_none() {
                    self.author = Author::Ours;
                }
            }
            // With its motors off nobody flies it: a switch of its remote control, or its crew, has changed the mode. While an arming of
            // ours is on its way, that mode is about to be flown.
            (None, Some(ours)) if by_itself(ours) || (!seen.armed && (!arms || seen.may_be_ours)) => {
                self.ours = Some(seen.intended);
            }
            (None, Some(_)) => self.doubt(seen, now),
        }
        if seen.armed && before.is_some_and(|it| !it.armed) && !arms {
            self.taken("it was armed by somebody else");
        }
        if self.author == Author::Ours && seen.intended != seen.flown {
            self.author = Author::Failsafe;
        }
    }

    /// When the judgement may change by time alone.
    pub fn deadline(&self) -> Option<Time> {
        self.changed.filter(|_| self.author == Author::InDoubt).map(|it| it + self.doubt)
    }

    fn obeys(&mut self, mode: M) {
        self.refused(mode);
        (self.ours, self.changed, self.author) = (Some(mode), None, Author::Ours);
    }

    /// The first mode that is seen. On the ground nobody has chosen it; in the air we may have, before this process was started again.
    fn first(&mut self, seen: Seen<M>) {
        self.ours = Some(seen.intended);
        if seen.armed && !seen.may_be_ours {
            self.author = Author::Other(Taken::Found(seen.intended));
        }
    }

    fn doubt(&mut self, seen: Seen<M>, now: Time) {
        if self.other().is_some() {
            return;
        }
        let changed = *self.changed.get_or_insert(now);
        let since = Time::ZERO + (changed - Time::ZERO).saturating_sub(EVIDENCE);
        if seen.failsafe_at.is_some_and(|it| since <= it) {
            self.author = Author::Failsafe;
        } else if self.author != Author::Failsafe {
            let is_over = self.doubt <= now - changed;
            self.author = if is_over { Author::Other(Taken::Set(seen.intended)) } else { Author::InDoubt };
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use Mode::{Follow, Hold, Land, Stick, Takeoff};

    #[derive(Debug, Clone, Copy, PartialEq, Eq)]
    enum Mode {
        Hold,
        Takeoff,
        Follow,
        Land,
        Stick,
    }

    /// What happens, the time in seconds before it.
    #[derive(Debug, Clone, Copy)]
    enum Event {
        Says(f64, Mode),
        SaysDisarmed(f64, Mode),
        Flies(f64, Mode),
        SaysFailsafe(f64, Mode),
        Sends(f64, Mode),
        Arms(f64),
        Accepts(Mode),
        Refuses(Mode),
        Taken,
        Restarts,
    }
    use Event::{Accepts, Arms, Flies, Refuses, Restarts, Says, SaysDisarmed, SaysFailsafe, Sends};

    /// After these events, with and without a time in which a failsafe says so.
    fn after(doubt: Duration, events: &[Event]) -> ModeObserver<Mode> {
        let mut observer = ModeObserver::new(doubt);
        let mut now = Time::ZERO;
        for event in events {
            if let Says(s, _) | SaysDisarmed(s, _) | Flies(s, _) | SaysFailsafe(s, _) | Sends(s, _) | Arms(s) = event {
                now = now + Duration::from_secs_f64(*s);
            }
            let seen = |armed: bool, intended: Mode, flown: Mode, failsafe: bool| Seen {
                armed,
                intended,
                flown,
                may_be_ours: intended != Stick,
                failsafe_at: failsafe.then_some(now),
            };
            let mut saw = |seen: Seen<Mode>| {
                observer.saw(seen, |from| (from, seen.intended) == (Takeoff, Hold), now);
            };
            match *event {
                Says(_, mode) => saw(seen(true, mode, mode, false)),
                SaysDisarmed(_, mode) => saw(seen(false, mode, mode, false)),
                Flies(_, mode) => saw(seen(true, Follow, mode, false)),
                SaysFailsafe(_, mode) => saw(seen(true, mode, mode, true)),
                Sends(_, mode) => observer.sent(mode, now),
                Arms(_) => observer.arming(now),
                Accepts(mode) => observer.accepted(mode),
                Refuses(mode) => observer.refused(mode),
                Event::Taken => observer.taken("a setpoint"),
                Restarts => observer.restarted(),
            }
        }
        observer
    }

    const DOUBT: Duration = Duration::from_millis(300);
    const OURS: &str = "ours";
    const IN_DOUBT: &str = "in doubt";
    const FAILSAFE: &str = "failsafe";

    fn name(author: Author<Mode>) -> String {
        match author {
            Author::Ours => OURS.to_owned(),
            Author::InDoubt => IN_DOUBT.to_owned(),
            Author::Failsafe => FAILSAFE.to_owned(),
            Author::Other(how) => how.in_words(|it| format!("{it:?}")),
        }
    }

    #[test]
    fn every_event_in_every_state() {
        /// The events that lead to a state, and who has chosen the mode after one more.
        #[track_caller]
        fn check(state: &[Event], expected: [&str; 10]) {
            let events: [&[Event]; 10] = [
                &[Says(1.0, Follow)],
                &[Says(1.0, Land)],
                &[Says(1.0, Land), Says(0.3, Land)],
                &[SaysFailsafe(1.0, Land)],
                &[SaysDisarmed(1.0, Hold)],
                &[Flies(1.0, Land)],
                &[Sends(1.0, Land), Says(0.1, Land)],
                &[Sends(1.0, Stick), Accepts(Stick)],
                &[Event::Taken],
                &[Restarts],
            ];
            for (event, expected) in events.iter().zip(expected) {
                let observer = after(DOUBT, &[state, event].concat());
                assert_eq!(name(observer.author()), expected, "{state:?}, then {event:?}");
                assert_eq!(observer.deadline().is_some(), expected == IN_DOUBT, "{event:?}");
            }
        }
        let (set, did) = ("Stick was set by somebody else", "a setpoint");
        let land = "Land was set by somebody else";
        //    same mode, another, for longer, by failsafe, disarmed, flies another, ours shows, ours is flown, taken, restarted
        let flown = [Says(0.0, Follow)];
        check(&flown, [OURS, IN_DOUBT, land, FAILSAFE, OURS, FAILSAFE, OURS, OURS, did, OURS]);
        let in_doubt = [Says(0.0, Follow), Says(9.0, Stick)];
        check(
            &in_doubt,
            [OURS, "Land was set by somebody else", land, FAILSAFE, IN_DOUBT, FAILSAFE, OURS, OURS, did, OURS],
        );
        let failsafe = [Says(0.0, Follow), SaysFailsafe(9.0, Stick)];
        check(&failsafe, [OURS, FAILSAFE, FAILSAFE, FAILSAFE, FAILSAFE, FAILSAFE, OURS, OURS, did, OURS]);
        let other = [Says(0.0, Follow), Says(9.0, Stick), Says(1.0, Stick)];
        check(&other, [set, set, set, set, set, set, OURS, OURS, did, OURS]);
        let nothing = [];
        check(&nothing, [OURS, OURS, OURS, OURS, OURS, FAILSAFE, OURS, OURS, did, OURS]);
    }

    /// Who has chosen the mode where a failsafe never changes the intended one.
    #[track_caller]
    fn check(events: &[Event], is_by_other: bool) {
        assert_eq!(after(Duration::ZERO, events).other().is_some(), is_by_other, "{events:?}");
    }

    #[test]
    fn what_was_commanded_and_what_it_does_by_itself_is_ours_and_everything_else_is_not() {
        let flown = |mode: Mode| [SaysDisarmed(0.0, Hold), Arms(0.0), Sends(0.0, mode), Says(0.1, mode)];
        let then = |mode: Mode, next: &[Event]| [&flown(mode)[..], next].concat();
        check(&then(Follow, &[Says(20.0, Follow)]), false);
        check(&then(Follow, &[Says(20.0, Hold)]), true);
        check(&then(Follow, &[Says(20.0, Stick)]), true);
        check(&then(Takeoff, &[Says(20.0, Hold)]), false);
        check(&then(Takeoff, &[Says(20.0, Land)]), true);
        check(&then(Takeoff, &[Says(20.0, Hold), Says(20.0, Takeoff)]), true);
        check(&then(Land, &[SaysDisarmed(20.0, Follow)]), false);
        // What was chosen on the ground flies nothing. An arming by somebody else takes the vehicle.
        check(&[SaysDisarmed(0.0, Hold), SaysDisarmed(1.0, Stick)], false);
        check(&[SaysDisarmed(0.0, Hold), Says(1.0, Hold)], true);
        check(&[SaysDisarmed(0.0, Hold), Arms(1.0), Says(4.0, Hold)], true);
        // A pilot's mode that is chosen while our arming is on its way is flown by the pilot.
        check(&[SaysDisarmed(0.0, Hold), Arms(1.0), SaysDisarmed(0.1, Stick), Says(0.1, Stick)], true);
        check(&[SaysDisarmed(0.0, Stick), Arms(1.0), Says(0.1, Stick)], false);
        // A bridge that starts in flight takes a mode of ours for ours, and a pilot's for the pilot's.
        check(&[Says(0.0, Follow)], false);
        check(&[Says(0.0, Stick)], true);
        check(&[SaysDisarmed(0.0, Stick)], false);
    }

    #[test]
    fn it_is_ours_again_once_a_command_takes_effect() {
        let then = |next: &[Event]| [&[Says(0.0, Follow), Says(20.0, Stick), Says(1.0, Hold)], next].concat();
        check(&then(&[]), true);
        check(&then(&[Says(9.0, Follow)]), true);
        check(&then(&[Sends(9.0, Follow)]), true);
        check(&then(&[Sends(9.0, Follow), Says(0.1, Hold)]), true);
        check(&then(&[Sends(9.0, Follow), Says(0.1, Follow)]), false);
        check(&then(&[Sends(9.0, Hold), Accepts(Hold)]), false);
        check(&then(&[Sends(9.0, Hold), Says(0.1, Hold)]), true);
        check(&then(&[Sends(9.0, Follow), Refuses(Follow), Says(0.1, Follow)]), true);
        check(&then(&[Sends(9.0, Follow), Says(4.0, Follow)]), true);
        // One that is replaced before it shows is ours, too.
        let replaced = [Sends(9.0, Hold), Accepts(Hold), Sends(0.005, Follow), Accepts(Follow)];
        check(&[&[Says(0.0, Follow)], &replaced[..], &[Says(0.01, Hold), Says(0.01, Follow)]].concat(), false);
    }
}
