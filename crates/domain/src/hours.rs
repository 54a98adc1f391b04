//! Weekly hours: on which days, and between which times of day in UTC, an area applies.
//!
//! They are kept as the minutes of a week that they cover, so that two texts that mean the same hours are equal. There is no
//! local time, no daylight saving time and no holiday here: the publisher of such hours has to convert them.

use std::iter::successors;

pub mod text;

/// Minutes of a day.
pub(crate) const DAY: i64 = 24 * 60;
/// Minutes of a week.
const WEEK: i64 = 7 * DAY;
const MINUTE_MS: i64 = 60_000;
const WEEK_MS: i64 = WEEK * MINUTE_MS;
/// The first Monday after the Unix epoch, 1970-01-05T00:00:00Z.
const FIRST_MONDAY_MS: i64 = 4 * DAY * MINUTE_MS;
/// The most windows of a week: seven a day and one more. What needs more is a mistake.
const MOST_WINDOWS: usize = 50;
/// Windows that begin more than two weeks ahead are not told apart: no flight lasts that long.
const HORIZON_MS: i64 = 2 * WEEK_MS;

/// Days of the week and times of day in UTC at which something applies.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct WeeklyHours {
    /// In minutes since Monday 00:00: ascending, apart from each other, none empty, at least one. Hours over Sunday's midnight are
    /// two of them.
    spans: Vec<(i64, i64)>,
}

/// Why there are no such hours.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
pub enum InvalidHours {
    /// No time of the week is covered.
    #[error("no hours, so that it would never apply")]
    Never,
    /// They begin and end too often.
    #[error("more than {MOST_WINDOWS} separate times in a week")]
    TooMany,
    /// It is not a list of days and a time of day with a beginning and an end.
    #[error("found `{0}`, expected days and hours")]
    Form(String),
    /// It is not a day.
    #[error("found `{0}`, expected a day: Mon, Tue, Wed, Thu, Fri, Sat or Sun")]
    Day(String),
    /// It is not a time of day.
    #[error("found `{0}`, expected a time of day from 00:00 to 24:00")]
    Time(String),
    /// The beginning is the end.
    #[error("`{0}` begins and ends at the same time")]
    Empty(String),
}

impl WeeklyHours {
    /// The hours that `spans` cover together, each with the minute at which it begins, counted from Monday 00:00 UTC and by weeks
    /// round it, and how many minutes it lasts.
    ///
    /// # Errors
    /// If that is nothing, or more than 50 windows a week.
    pub fn new(spans: impl IntoIterator<Item = (i64, i64)>) -> Result<WeeklyHours, InvalidHours> {
        let mut all: Vec<(i64, i64)> = spans.into_iter().filter(|it| 0 < it.1).flat_map(within_week).collect();
        all.sort_unstable();
        let mut spans: Vec<(i64, i64)> = Vec::new();
        for (from, to) in all {
            match spans.last_mut() {
                Some(last) if from <= last.1 => last.1 = last.1.max(to),
                _ => spans.push((from, to)),
            }
        }
        match spans.len() {
            0 => Err(InvalidHours::Never),
            count if MOST_WINDOWS < count => Err(InvalidHours::TooMany),
            _ => Ok(WeeklyHours { spans }),
        }
    }

    /// Whether they cover all of the week.
    pub fn is_whole_week(&self) -> bool {
        self.spans == [(0, WEEK)]
    }

    /// Whether they cover this moment, in milliseconds since the Unix epoch. The beginning of a window belongs to it, its end
    /// does not.
    pub fn covers(&self, utc_ms: i64) -> bool {
        let at = ms_of_week(utc_ms);
        self.spans.iter().any(|(from, to)| from * MINUTE_MS <= at && at < to * MINUTE_MS)
    }

    /// The first moment after this one at which [`WeeklyHours::covers`] changes; `None` if it never does.
    pub fn next_change(&self, utc_ms: i64) -> Option<i64> {
        let at = ms_of_week(utc_ms);
        // At a border the next one is meant, at the latest the same one a week later.
        let left_ms = |border: i64| match (border * MINUTE_MS - at).rem_euclid(WEEK_MS) {
            0 => WEEK_MS,
            left_ms => left_ms,
        };
        let nearest_ms = self.borders().map(left_ms).min()?;
        Some(utc_ms.saturating_add(nearest_ms))
    }

    /// The windows that are not over at this moment, ascending, as moments from which and until which they last; the first begins
    /// at `utc_ms` if that is inside of one. A window without an end lasts until `i64::MAX`; so does one that begins more than two
    /// weeks ahead, which is the last.
    pub fn windows_after(&self, utc_ms: i64) -> impl Iterator<Item = (i64, i64)> {
        let ends = move |from: i64| match from.saturating_sub(utc_ms) {
            ahead_ms if HORIZON_MS < ahead_ms => i64::MAX,
            _ => self.next_change(from).unwrap_or(i64::MAX),
        };
        let first = if self.covers(utc_ms) { Some(utc_ms) } else { self.next_change(utc_ms) };
        successors(first.map(|from| (from, ends(from))), move |&(_, until)| {
            let from = if until < i64::MAX { self.next_change(until)? } else { return None };
            Some((from, ends(from)))
        })
    }

    /// Whether hours at the end of Sunday go on on Monday.
    fn goes_over_sunday(&self) -> bool {
        self.spans.first().is_some_and(|it| it.0 == 0) && self.spans.last().is_some_and(|it| it.1 == WEEK)
    }

    /// Where windows begin and end.
    fn borders(&self) -> impl Iterator<Item = i64> {
        let goes_over_sunday = self.goes_over_sunday();
        let borders = self.spans.iter().flat_map(|(from, to)| [*from, *to % WEEK]);
        borders.filter(move |it| !(goes_over_sunday && *it == 0))
    }

    /// The windows, of which the last may end after the end of the week.
    fn windows(&self) -> Vec<(i64, i64)> {
        let mut windows = self.spans.clone();
        if 1 < windows.len() && self.goes_over_sunday() {
            let (_, ends) = windows.remove(0);
            if let Some(last) = windows.last_mut() {
                last.1 += ends;
            }
        }
        windows
    }
}

/// A span as one or two that do not go over the end of the week.
fn within_week((begins, lasts): (i64, i64)) -> impl Iterator<Item = (i64, i64)> {
    let from = begins.rem_euclid(WEEK);
    let parts = match from.saturating_add(lasts) {
        _ if WEEK <= lasts => [(0, WEEK), (0, 0)],
        to if to <= WEEK => [(from, to), (0, 0)],
        to => [(from, WEEK), (0, to - WEEK)],
    };
    parts.into_iter().filter(|(from, to)| from < to)
}

fn ms_of_week(utc_ms: i64) -> i64 {
    (utc_ms.rem_euclid(WEEK_MS) - FIRST_MONDAY_MS).rem_euclid(WEEK_MS)
}

#[cfg(test)]
mod tests;
