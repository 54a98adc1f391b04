//! The planner's notes for itself: sent with an answer, returned with the next question, not stored here.

use std::time::Duration;

use domain::state::State;
use domain::time::Time;
use domain::wire::InvalidMessage;
use domain::wire::plan::to_ns;
use kittiwake_proto::v1;

use crate::hold::Hold;
use crate::permissions::{Permissions, Record, ShortGrant, Standing};
use crate::stuck::{Failure, Stuck};

/// The notes in domain types.
#[derive(Debug, Clone, Default, PartialEq)]
pub(crate) struct Notes {
    /// Of the steps given out so far.
    pub(crate) last_step_id: u64,
    /// When the mission's first plan was made.
    pub(crate) begun: Option<Time>,
    /// Since when the vehicle stays at the present objective.
    pub(crate) dwells_since: Option<Time>,
    pub(crate) permissions: Permissions,
    pub(crate) hold: Option<Hold>,
    pub(crate) stuck: Stuck,
}

fn time(ns: u64) -> Time {
    Time::after(Duration::from_nanos(ns))
}

fn ns(time: Time) -> u64 {
    to_ns(time.since_start())
}

impl From<Notes> for v1::PlannerNotes {
    fn from(notes: Notes) -> v1::PlannerNotes {
        let hold = notes.hold.map(|it| v1::HoldNotes {
            area: it.area,
            since_ns: ns(it.since),
            wait_ns: to_ns(it.wait),
            reason: it.reason,
            outlasts_grant: it.outlasts_grant,
        });
        v1::PlannerNotes {
            last_step_id: notes.last_step_id,
            begun_ns: notes.begun.map(ns),
            dwells_since_ns: notes.dwells_since.map(ns),
            areas: notes.permissions.records.into_iter().map(from_record).collect(),
            hold,
            failures: Some(from_stuck(notes.stuck)),
        }
    }
}

impl TryFrom<v1::PlannerNotes> for Notes {
    type Error = InvalidMessage;
    fn try_from(notes: v1::PlannerNotes) -> Result<Notes, InvalidMessage> {
        let hold = notes.hold.map(|it| Hold {
            area: it.area,
            since: time(it.since_ns),
            wait: Duration::from_nanos(it.wait_ns),
            reason: it.reason,
            outlasts_grant: it.outlasts_grant,
        });
        Ok(Notes {
            last_step_id: notes.last_step_id,
            begun: notes.begun_ns.map(time),
            dwells_since: notes.dwells_since_ns.map(time),
            permissions: Permissions { records: notes.areas.into_iter().map(to_record).collect() },
            hold,
            stuck: to_stuck(notes.failures.unwrap_or_default())?,
        })
    }
}

fn from_record((area, record): (String, Record)) -> v1::AreaNotes {
    let (denied, retry_at) = match record.standing {
        Standing::Open => (String::new(), None),
        Standing::DeniedOnce { reason, retry_at } => (reason, Some(retry_at)),
        Standing::DeniedForGood { reason } => (reason, None),
    };
    v1::AreaNotes {
        area,
        denied,
        retry_at_ns: retry_at.map(ns),
        held_for_ns: to_ns(record.held),
        short_grant_ns: record.short_grant.map(|it| to_ns(it.length)),
        short_grant_ends_ns: record.short_grant.map_or(0, |it| ns(it.ends)),
    }
}

fn to_record(notes: v1::AreaNotes) -> (String, Record) {
    let standing = match (notes.denied, notes.retry_at_ns) {
        (reason, _) if reason.is_empty() => Standing::Open,
        (reason, Some(retry_at_ns)) => Standing::DeniedOnce { reason, retry_at: time(retry_at_ns) },
        (reason, None) => Standing::DeniedForGood { reason },
    };
    let ends = time(notes.short_grant_ends_ns);
    let short_grant = notes.short_grant_ns.map(|it| ShortGrant { length: Duration::from_nanos(it), ends });
    (notes.area, Record { standing, held: Duration::from_nanos(notes.held_for_ns), short_grant })
}

fn from_stuck(stuck: Stuck) -> v1::FailureNotes {
    let Stuck { last, takeoffs, landings, misses } = stuck;
    let counted = v1::FailureNotes { takeoffs, landings, misses, ..v1::FailureNotes::default() };
    match last {
        None => counted,
        Some(Failure { action, goal, vehicle, count }) => {
            v1::FailureNotes { action, goal: Some(goal.into()), vehicle: Some(vehicle.into()), count, ..counted }
        }
    }
}

fn to_stuck(notes: v1::FailureNotes) -> Result<Stuck, InvalidMessage> {
    let v1::FailureNotes { action, goal, vehicle, count, takeoffs, landings, misses } = notes;
    let [goal, vehicle] = [goal, vehicle].map(|it| it.map(State::try_from).transpose());
    let last = goal?.zip(vehicle?).map(|(goal, vehicle)| Failure { action, goal, vehicle, count });
    Ok(Stuck { last, takeoffs, landings, misses })
}

#[cfg(test)]
mod tests {
    use std::collections::BTreeMap;

    use domain::geometry::Ned;
    use proptest::prelude::*;

    use super::*;

    fn moment() -> impl Strategy<Value = Time> {
        any::<u64>().prop_map(time)
    }

    fn record() -> impl Strategy<Value = Record> {
        let standing = prop_oneof![
            Just(Standing::Open),
            moment().prop_map(|retry_at| Standing::DeniedOnce { reason: "denied".into(), retry_at }),
            Just(Standing::DeniedForGood { reason: "denied twice".into() }),
        ];
        let short_grant = prop::option::of((any::<u64>(), moment()));
        (standing, any::<u64>(), short_grant).prop_map(|(standing, held, short_grant)| Record {
            standing,
            held: Duration::from_nanos(held),
            short_grant: short_grant.map(|(length, ends)| ShortGrant { length: Duration::from_nanos(length), ends }),
        })
    }

    fn hold() -> impl Strategy<Value = Hold> {
        (moment(), any::<u64>(), any::<bool>()).prop_map(|(since, wait, outlasts_grant)| Hold {
            area: "A".into(),
            since,
            wait: Duration::from_nanos(wait),
            reason: "it is closed".into(),
            outlasts_grant,
        })
    }

    fn stuck() -> impl Strategy<Value = Stuck> {
        let state = |flying| State::new(Ned::new(1.0, 2.0, -3.0), flying);
        let last = (any::<bool>(), any::<u32>()).prop_map(move |(flying, count)| Failure {
            action: "position".into(),
            goal: state(flying),
            vehicle: state(true),
            count,
        });
        (prop::option::of(last), any::<u32>(), any::<u32>(), any::<u32>())
            .prop_map(|(last, takeoffs, landings, misses)| Stuck { last, takeoffs, landings, misses })
    }

    proptest! {
        #[test]
        fn what_is_noted_is_given_back(
            last_step_id in any::<u64>(),
            (begun, dwells_since) in (prop::option::of(moment()), prop::option::of(moment())),
            records in prop::collection::vec(record(), 0..3),
            hold in prop::option::of(hold()),
            stuck in stuck(),
        ) {
            let records: BTreeMap<String, Record> = ["A", "B", "C"].map(str::to_owned).into_iter().zip(records).collect();
            let permissions = Permissions { records };
            let notes = Notes { last_step_id, begun, dwells_since, permissions, hold, stuck };
            prop_assert_eq!(Notes::try_from(v1::PlannerNotes::from(notes.clone())), Ok(notes));
        }
    }
}
