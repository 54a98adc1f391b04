//! Weekly hours as a human writes them: `Mon-Fri 08:00-18:00`, in UTC.

use super::{DAY, InvalidHours, WeeklyHours};

/// How to write them, for messages.
pub const HELP: &str =
    "write it like \"Mon-Fri 08:00-18:00\" or \"Sat,Sun 22:00-02:00\", in UTC; a whole day is 00:00-24:00";

/// The days from Monday on, as they are written.
const DAYS: [&str; 7] = ["Mon", "Tue", "Wed", "Thu", "Fri", "Sat", "Sun"];

impl WeeklyHours {
    /// The hours that these texts cover together.
    ///
    /// # Errors
    /// The first text that makes no sense, with its index, or 0 if they make none together.
    pub fn parse<T: AsRef<str>>(texts: &[T]) -> Result<WeeklyHours, (usize, InvalidHours)> {
        let mut spans = Vec::new();
        for (index, text) in texts.iter().enumerate() {
            spans.extend(spans_of(text.as_ref()).map_err(|invalid| (index, invalid))?);
        }
        WeeklyHours::new(spans).map_err(|invalid| (0, invalid))
    }

    /// Texts that mean these hours, one for each time of day; hours over midnight stand at the day on which they begin.
    pub fn to_texts(&self) -> Vec<String> {
        let mut times: Vec<((i64, i64), Vec<usize>)> = Vec::new();
        for (day, time) in self.windows().into_iter().flat_map(by_days) {
            match times.iter_mut().find(|it| it.0 == time) {
                Some((_, days)) => days.push(day),
                None => times.push((time, vec![day])),
            }
        }
        let in_words = |((from, to), days): ((i64, i64), Vec<usize>)| {
            format!("{} {}-{}", days_in_words(days), time_in_words(from), time_in_words(to))
        };
        times.into_iter().map(in_words).collect()
    }
}

/// Of a window: the days on which it begins or goes on, each with the time of that day.
fn by_days((from, to): (i64, i64)) -> Vec<(usize, (i64, i64))> {
    let day_of = |minute: i64| usize::try_from(minute / DAY % 7).unwrap_or_default();
    if to - from < DAY {
        let ends = if to % DAY == 0 { DAY } else { to % DAY };
        return vec![(day_of(from), (from % DAY, ends))];
    }
    let mut days = Vec::new();
    let mut begins = from;
    while begins < to {
        let ends = to.min((begins / DAY + 1) * DAY);
        days.push((day_of(begins), (begins % DAY, ends - begins / DAY * DAY)));
        begins = ends;
    }
    days
}

/// Three days or more in a row as a range.
fn days_in_words(mut days: Vec<usize>) -> String {
    days.sort_unstable();
    let mut rows: Vec<(usize, usize)> = Vec::new();
    for day in days {
        match rows.last_mut() {
            Some(row) if day <= row.1 + 1 => row.1 = day,
            _ => rows.push((day, day)),
        }
    }
    let in_words = |(first, last): (usize, usize)| match last - first {
        0 => DAYS[first].to_owned(),
        1 => format!("{},{}", DAYS[first], DAYS[last]),
        _ => format!("{}-{}", DAYS[first], DAYS[last]),
    };
    rows.into_iter().map(in_words).collect::<Vec<_>>().join(",")
}

fn time_in_words(minute: i64) -> String {
    format!("{:02}:{:02}", minute / 60, minute % 60)
}

/// The spans of one text, each with its beginning and its length in minutes.
fn spans_of(text: &str) -> Result<Vec<(i64, i64)>, InvalidHours> {
    let form = || InvalidHours::Form(short(text));
    let (days, times) = text.trim().split_once(char::is_whitespace).ok_or_else(form)?;
    let (from, to) = times.trim_start().split_once('-').ok_or_else(form)?;
    let (from_minute, to_minute) = (minute_of_day(from)?, minute_of_day(to)?);
    // Not after the beginning means on the next day.
    let lasts = if from_minute < to_minute { to_minute - from_minute } else { to_minute + DAY - from_minute };
    if from_minute == to_minute || lasts == 0 {
        return Err(InvalidHours::Empty(short(text)));
    }
    let mut spans = Vec::new();
    for part in days.split(',') {
        let (first, last) = part.split_once('-').unwrap_or((part, part));
        let (first, last) = (day(first)?, day(last)?);
        // From Saturday to Monday is three days.
        let count = (last - first).rem_euclid(7) + 1;
        spans.extend((first..first + count).map(|day| (day * DAY + from_minute, lasts)));
    }
    Ok(spans)
}

fn day(text: &str) -> Result<i64, InvalidHours> {
    let index = DAYS.iter().position(|it| it.eq_ignore_ascii_case(text));
    index.and_then(|it| i64::try_from(it).ok()).ok_or_else(|| InvalidHours::Day(short(text)))
}

fn minute_of_day(text: &str) -> Result<i64, InvalidHours> {
    let number = |digits: &str| -> Option<i64> {
        let is_number = digits.len() == 2 && digits.bytes().all(|it| it.is_ascii_digit());
        if is_number { digits.parse().ok() } else { None }
    };
    let minute = || {
        let (hours, minutes) = text.split_once(':')?;
        let (hours, minutes) = (number(hours)?, number(minutes)?);
        (minutes < 60).then_some(hours * 60 + minutes)
    };
    minute().filter(|it| *it <= DAY).ok_or_else(|| InvalidHours::Time(short(text)))
}

/// Messages repeat what stands in a file, which may be long.
fn short(text: &str) -> String {
    text.chars().take(40).collect()
}
