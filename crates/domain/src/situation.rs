//! Where the vehicle is between standing and flying: one table for every decision that depends on it.

use serde::Deserialize;

/// Between standing and flying. Rows of the contingency table name the situations in which they begin to respond.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Situation {
    /// A process that was just started has not seen the vehicle yet. It looks first.
    Unseen,
    /// On the ground, before or between flights.
    Standing,
    /// In the air, and hardly off the ground.
    LiftingOff,
    /// In the air.
    Flying,
    /// A landing touches the ground, or the vehicle stands where a step has landed it and that step is not over.
    TouchingDown,
    /// On the ground after the end of the mission.
    Ended,
}

impl Situation {
    /// Every situation.
    pub const ALL: [Situation; 6] = [
        Situation::Unseen,
        Situation::Standing,
        Situation::LiftingOff,
        Situation::Flying,
        Situation::TouchingDown,
        Situation::Ended,
    ];

    /// What `sight` shows.
    pub fn of(sight: Sight) -> Situation {
        let row = TRUTH.iter().find(|row| row.covers(sight));
        row.map_or(Situation::Flying, |row| row.situation)
    }

    /// Whether the vehicle is in the air near the ground, where nothing is flown to but the ground.
    pub fn is_near_ground(self) -> bool {
        matches!(self, Situation::LiftingOff | Situation::TouchingDown)
    }
}

/// The name as users read it.
impl std::fmt::Display for Situation {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.write_str(match self {
            Situation::Unseen => "unseen",
            Situation::Standing => "standing",
            Situation::LiftingOff => "lifting off",
            Situation::Flying => "flying",
            Situation::TouchingDown => "touching down",
            Situation::Ended => "ended",
        })
    }
}

/// Where the vehicle was seen.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Seen {
    /// Not since the start; there is still time to look.
    NotYet,
    /// Not since the start, and the time to look is over.
    Never,
    /// On the ground, by [`crate::flight_state::FlightState::flying`].
    OnGround,
    /// In the air.
    InAir,
}

/// What the situation follows from.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Sight {
    /// Where the vehicle was seen.
    pub seen: Seen,
    /// [`crate::flight_state::FlightState::is_near_ground`].
    pub near_ground: bool,
    /// In the air: a skill lands. On the ground: the landing of a step, and the step is not over.
    pub lands: bool,
    /// The mission is over.
    pub over: bool,
}

/// A row of the truth table; `None`: either.
struct Truth {
    seen: Seen,
    near_ground: Option<bool>,
    lands: Option<bool>,
    over: Option<bool>,
    situation: Situation,
}

impl Truth {
    fn covers(&self, sight: Sight) -> bool {
        let agrees = |cell: Option<bool>, value: bool| cell.is_none_or(|it| it == value);
        self.seen == sight.seen
            && agrees(self.near_ground, sight.near_ground)
            && agrees(self.lands, sight.lands)
            && agrees(self.over, sight.over)
    }
}

const fn truth(
    seen: Seen,
    near_ground: Option<bool>,
    lands: Option<bool>,
    over: Option<bool>,
    situation: Situation,
) -> Truth {
    Truth { seen, near_ground, lands, over, situation }
}

const YES: Option<bool> = Some(true);
const NO: Option<bool> = Some(false);
const EITHER: Option<bool> = None;

#[rustfmt::skip]
const TRUTH: [Truth; 8] = [
    //    seen            near    lands   over    situation
    truth(Seen::NotYet,   EITHER, EITHER, EITHER, Situation::Unseen),
    // An unknown vehicle counts as one in the air.
    truth(Seen::Never,    EITHER, EITHER, EITHER, Situation::Flying),
    truth(Seen::OnGround, EITHER, EITHER, YES,    Situation::Ended),
    truth(Seen::OnGround, EITHER, YES,    NO,     Situation::TouchingDown),
    truth(Seen::OnGround, EITHER, NO,     NO,     Situation::Standing),
    truth(Seen::InAir,    NO,     EITHER, EITHER, Situation::Flying),
    truth(Seen::InAir,    YES,    YES,    EITHER, Situation::TouchingDown),
    truth(Seen::InAir,    YES,    NO,     EITHER, Situation::LiftingOff),
];

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn exactly_one_row_covers_each_sight() {
        for seen in [Seen::NotYet, Seen::Never, Seen::OnGround, Seen::InAir] {
            for bits in 0..8 {
                let [near_ground, lands, over] = [1, 2, 4].map(|bit| bits & bit != 0);
                let sight = Sight { seen, near_ground, lands, over };
                assert_eq!(TRUTH.iter().filter(|it| it.covers(sight)).count(), 1, "{sight:?}");
            }
        }
    }
}
