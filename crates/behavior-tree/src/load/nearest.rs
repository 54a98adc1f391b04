//! "Did you mean ..?"

/// Hints are for names that people type. A longer name is hardly a typing mistake, and to compare it takes long.
const LONGEST: usize = 64;

/// The known name most similar to `name`, if it may have been meant. Capitals do not count.
pub(crate) fn nearest<'a>(name: &str, known: impl IntoIterator<Item = &'a str>) -> Option<String> {
    if LONGEST < name.len() {
        return None;
    }
    let tolerated = 1 + name.chars().count() / 4;
    let wanted = name.to_lowercase();
    known
        .into_iter()
        .filter(|candidate| candidate.len() <= LONGEST && *candidate != name)
        .map(|candidate| (strsim::osa_distance(&wanted, &candidate.to_lowercase()), candidate))
        .filter(|(distance, _)| *distance <= tolerated)
        .min()
        .map(|(_, candidate)| candidate.to_owned())
}

#[cfg(test)]
mod tests {
    use super::nearest;

    #[test]
    fn a_typing_mistake_is_recognised() {
        #[track_caller]
        fn check(name: &str, expected: Option<&str>) {
            let known = ["Sequence", "Fallback", "BatteryOk"];
            assert_eq!(nearest(name, known).as_deref(), expected, "{name}");
        }
        check("Sequnece", Some("Sequence"));
        check("sequence", Some("Sequence"));
        check("FallBack", Some("Fallback"));
        check("BateryOk", Some("BatteryOk"));
        check("Takeoff", None);
        check("", None);
    }
}
