//! Where a process may stay away because something that it is to have cannot be had.

use crate::settings::Settings;

/// Whether nothing flies, as far as can be known: at the first start of a process by an `up` that flies a simulator, until that process has been
/// seen. A launcher may itself be started again while a real aircraft flies, and other supervisors do not say whether a process has run before.
pub fn nothing_flies(settings: &Settings) -> bool {
    settings.simulated && !settings.has_run
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::path::Path;

    #[test]
    fn nothing_flies_for_certain_only_at_the_first_start_over_a_simulator() {
        #[track_caller]
        fn check(simulated: bool, has_run: bool, expected: bool) {
            let settings = Settings { simulated, has_run, ..Settings::of_file(Path::new("kittiwake.toml")) };
            assert_eq!(nothing_flies(&settings), expected);
        }
        check(true, false, true);
        check(true, true, false);
        check(false, false, false);
        check(false, true, false);
    }
}
