//! What was heard of one aircraft or vessel.

use std::time::Duration;

use domain::area::Area;
use domain::contingency::snapshot::NO_TRAFFIC_M;
use domain::fmu::TransponderReport;
use domain::geometry::{Ned, NedVelocity};
use domain::time::{Pace, Time};
use domain::traffic::{AHEAD_S, Mover};

use super::{Own, least_m, place};

/// The echo of the vehicle's own transponder: nearer than this, and as fast, within this. (ENG: a second of delay at cruise speed, and
/// what two receivers differ by.)
const ECHO_M: f64 = 20.0;
const ECHO_M_S: f64 = 3.0;
/// What was elsewhere this often in a row is another one. (ENG: an echo that is late in a turn is elsewhere once.)
const ELSEWHERE: u32 = 3;
/// It stands if it is slower than this, and for this wall time no farther than this from one place. (ENG: what an estimate varies by,
/// and a helicopter that hovers.)
const STANDS_M_S: f64 = 2.0;
const STANDS_WITHIN_M: f64 = 30.0;
const STANDS_FOR: Duration = Duration::from_secs(10);
/// It turns if its course changes by more than this between two reports, in radians per second: what circles comes back. (ENG: a
/// circle of 3 km at 50 m/s.)
const TURNS_RAD_S: f64 = 0.016;
/// A faster change is an error of one report. (A standard rate turn has 0.05 rad/s.)
const MOST_RAD_S: f64 = 0.3;
/// Slower than this it has no course, in metres per second.
const HAS_COURSE_M_S: f64 = 3.0;

/// Its reports.
#[derive(Debug, Clone)]
pub(super) struct Track {
    pub(super) report: TransponderReport,
    /// When it said something new.
    pub(super) at: Time,
    /// When it was reported last, with something new or without.
    pub(super) reported_at: Time,
    turn_rad_s: f64,
    /// How often in a row it was elsewhere than the vehicle; [`ELSEWHERE`]: it is another one, for good.
    elsewhere: u32,
    /// Near which place it has been, and since when.
    stays: (Ned, Time),
    /// The nearest that it would have come, since it did not only fly away.
    least_m: f64,
}

impl Track {
    pub(super) fn new(now: Time, own: Option<Own<'_>>, report: TransponderReport) -> Track {
        let stays = (report.position, now);
        let mut track =
            Track { report, at: now, reported_at: now, turn_rad_s: 0.0, elsewhere: 0, stays, least_m: NO_TRAFFIC_M };
        if own.is_some_and(|it| !track.is_with(it)) {
            track.elsewhere = ELSEWHERE;
        }
        track.judge(now, own);
        track
    }

    /// It was reported again. One that has speed but repeats its position is frozen: it has flown on, and counts as silent since its last
    /// new report.
    pub(super) fn hear(&mut self, now: Time, own: Option<Own<'_>>, report: TransponderReport) {
        self.reported_at = now;
        if report == self.report && STANDS_M_S < report.velocity.speed_m_s() {
            return;
        }
        self.turn_rad_s = turn_rad_s(self.report.velocity, report.velocity, (now - self.at).as_secs_f64());
        let (place, _) = self.stays;
        if STANDS_WITHIN_M < place.distance_m(report.position) || STANDS_M_S < report.velocity.speed_m_s() {
            self.stays = (report.position, now);
        }
        (self.report, self.at) = (report, now);
        self.judge(now, own);
    }

    fn judge(&mut self, now: Time, own: Option<Own<'_>>) {
        let Some(own) = own else { return };
        if self.elsewhere < ELSEWHERE {
            self.elsewhere = if self.is_with(own) { 0 } else { self.elsewhere + 1 };
        }
        self.least_m =
            if self.flies_away(now, own) { NO_TRAFFIC_M } else { self.present_m(now, own).min(self.least_m) };
    }

    fn is_with(&self, own: Own<'_>) -> bool {
        let (ours, theirs) = (own.local.velocity, self.report.velocity);
        let apart = NedVelocity::new(
            theirs.north_m_s - ours.north_m_s,
            theirs.east_m_s - ours.east_m_s,
            theirs.down_m_s - ours.down_m_s,
        );
        self.report.position.distance_m(own.local.position) < ECHO_M && apart.speed_m_s() < ECHO_M_S
    }

    /// Whether it is the vehicle itself, as far as it was heard: it has been with it from the first.
    pub(super) fn is_own(&self) -> bool {
        self.elsewhere < ELSEWHERE
    }

    /// As it moves now, without its name.
    pub(super) fn mover(&self, now: Time) -> Mover {
        let TransponderReport { position, velocity, kind, .. } = self.report;
        let reported = Mover { id: String::new(), kind, position, velocity, turn_rad_s: self.turn_rad_s };
        let age_s = (now - self.at).as_secs_f64();
        let (sin, cos) = (self.turn_rad_s * age_s).sin_cos();
        let (north_m_s, east_m_s) = (velocity.north_m_s, velocity.east_m_s);
        let velocity = NedVelocity {
            north_m_s: north_m_s * cos - east_m_s * sin,
            east_m_s: north_m_s * sin + east_m_s * cos,
            ..velocity
        };
        Mover { position: reported.after(age_s), velocity, ..reported }
    }

    /// How near it comes, in metres. While it does not only fly away that does not become more by what the vehicle does, but
    /// by how far away it is: it comes nearer no faster than it flies.
    pub(super) fn approach_m(&self, now: Time, own: Own<'_>) -> f64 {
        let present_m = self.present_m(now, own);
        if self.flies_away(now, own) {
            return present_m;
        }
        let mover = self.mover(now);
        let away_m = mover.position.horizontal_distance_m(own.local.position);
        self.least_m.min(present_m).max(away_m - mover.velocity.ground_speed_m_s() * AHEAD_S)
    }

    /// How near it comes if the vehicle stays, goes on as it does, or as its mission leads.
    fn present_m(&self, now: Time, own: Own<'_>) -> f64 {
        let (mover, here) = (self.mover(now), own.local.position);
        let moves = [(NedVelocity::default(), 0.0), (own.local.velocity, AHEAD_S)].into_iter().chain(intended(own));
        moves.map(|(velocity, for_s)| least_m(&mover, here, velocity, for_s)).fold(NO_TRAFFIC_M, f64::min)
    }

    /// Whether it gets farther away from now on, by a straight course, from a vehicle that stays or goes on as its mission leads.
    fn flies_away(&self, now: Time, own: Own<'_>) -> bool {
        let (mover, here) = (self.mover(now), own.local.position);
        let (north_m, east_m) = (mover.position.north_m - here.north_m, mover.position.east_m - here.east_m);
        let recedes = |ours: NedVelocity| {
            let (north_m_s, east_m_s) =
                (mover.velocity.north_m_s - ours.north_m_s, mover.velocity.east_m_s - ours.east_m_s);
            0.0 < north_m * north_m_s + east_m * east_m_s
        };
        mover.turn_rad_s == 0.0
            && std::iter::once(NedVelocity::default()).chain(intended(own).map(|it| it.0)).all(recedes)
    }

    /// Whether it has stood for a while.
    pub(super) fn stands(&self, now: Time, pace: Pace) -> bool {
        pace.wall(STANDS_FOR) <= now - self.stays.1
    }

    /// The area that it takes while it stands.
    pub(super) fn takes(&self, now: Time, pace: Pace) -> Option<Area> {
        self.stands(now, pace).then(|| place::taken_by(&self.report.id, self.report.kind, self.stays.0))
    }
}

/// How the vehicle moves on its mission, and for how long.
fn intended(own: Own<'_>) -> Option<(NedVelocity, f64)> {
    let ((goal, speed_m_s), here) = (own.intends?, own.local.position);
    let flight_s = here.distance_m(goal) / speed_m_s;
    let share = (0.0 < flight_s).then(|| 1.0 / flight_s)?;
    let velocity = NedVelocity::new(
        (goal.north_m - here.north_m) * share,
        (goal.east_m - here.east_m) * share,
        (goal.down_m - here.down_m) * share,
    );
    Some((velocity, flight_s))
}

/// How fast the course turns to the right from `before` to `after`; 0 where it does not turn.
fn turn_rad_s(before: NedVelocity, after: NedVelocity, seconds: f64) -> f64 {
    let has_course = HAS_COURSE_M_S < before.ground_speed_m_s().min(after.ground_speed_m_s());
    if !has_course || seconds <= 0.0 {
        return 0.0;
    }
    let cross = before.north_m_s * after.east_m_s - before.east_m_s * after.north_m_s;
    let dot = before.north_m_s * after.north_m_s + before.east_m_s * after.east_m_s;
    let turn = cross.atan2(dot) / seconds;
    if (TURNS_RAD_S..=MOST_RAD_S).contains(&turn.abs()) { turn } else { 0.0 }
}
