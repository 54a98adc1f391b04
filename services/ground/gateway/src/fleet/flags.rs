//! Which flags are up, by the list of the monitor, and which of them have risen or fallen since the list before.

use domain::time::Time;
use kittiwake_proto::v1;
use kittiwake_proto::v1::vehicle::Flag;

/// The flags of one vehicle.
#[derive(Debug, Clone, Default)]
pub(crate) struct Flags {
    listed: Vec<v1::RaisedFlag>,
    listed_at: Option<Time>,
}

impl Flags {
    /// The monitor lists the flags that are up. Returns what has risen or fallen since its last list; the first list is
    /// not news.
    pub(crate) fn on_listed(&mut self, now: Time, flags: &[v1::RaisedFlag]) -> Vec<v1::FlagEvent> {
        let is_first = self.listed_at.replace(now).is_none();
        let before = std::mem::replace(&mut self.listed, flags.to_vec());
        if is_first {
            return Vec::new();
        }
        let has = |list: &[v1::RaisedFlag], flag: &v1::RaisedFlag| list.iter().any(|it| it.name == flag.name);
        let fallen = before.iter().filter(|it| !has(flags, it));
        let fallen = fallen.map(|it| v1::FlagEvent { name: it.name.clone(), ..Default::default() });
        let risen = flags.iter().filter(|it| !has(&before, it)).cloned().map(raised);
        fallen.chain(risen).collect()
    }

    /// The flags that are up at `now`.
    pub(crate) fn up(&self, now: Time) -> Vec<Flag> {
        let listed_for_s = self.listed_at.map_or(0.0, |at| (now - at).as_secs_f64());
        let up = |it: &v1::RaisedFlag| Flag {
            name: it.name.clone(),
            since_s: it.since_s + listed_for_s,
            reason: it.reason.clone(),
        };
        self.listed.iter().map(up).collect()
    }
}

fn raised(flag: v1::RaisedFlag) -> v1::FlagEvent {
    let v1::RaisedFlag { name, reason, value, threshold, unit, .. } = flag;
    v1::FlagEvent { name, raised: true, reason, value, threshold, unit }
}

#[cfg(test)]
mod tests {
    use std::time::Duration;

    use super::*;

    #[test]
    fn what_differs_between_two_lists_has_risen_or_fallen() {
        let mut flags = Flags::default();
        let list = |names: &[&str]| -> Vec<v1::RaisedFlag> {
            names.iter().map(|it| v1::RaisedFlag { name: it.to_string(), since_s: 1.0, ..Default::default() }).collect()
        };
        let mut check = |names: &[&str], expected: &[(&str, bool)]| {
            let changes = flags.on_listed(Time::ZERO, &list(names));
            let changes: Vec<_> = changes.iter().map(|it| (it.name.as_str(), it.raised)).collect();
            assert_eq!(changes, expected, "{names:?}");
        };
        // They may have been up for long.
        check(&["wind"], &[]);
        check(&["wind"], &[]);
        check(&["wind", "battery_low"], &[("battery_low", true)]);
        check(&["battery_low", "gust"], &[("wind", false), ("gust", true)]);
        check(&[], &[("battery_low", false), ("gust", false)]);
        check(&["wind"], &[("wind", true)]);
        let up = flags.up(Time::after(Duration::from_secs(2)));
        assert_eq!(up.iter().map(|it| (it.name.as_str(), it.since_s)).collect::<Vec<_>>(), [("wind", 3.0)]);
    }
}
