//! "Did you mean ..?"

/// The known name most like `name`, if one is so like it that it may have been meant.
pub(crate) fn nearest<'a>(name: &str, known: impl IntoIterator<Item = &'a str>) -> Option<String> {
    // Hints are for names that people type; a long one is not a slip of the finger.
    if 64 < name.len() {
        return None;
    }
    let tolerated = 1 + name.chars().count() / 4;
    known
        .into_iter()
        .filter(|candidate| candidate.len() <= 64 && *candidate != name)
        .map(|candidate| (distance(name, candidate), candidate))
        .filter(|(distance, _)| *distance <= tolerated)
        .min()
        .map(|(_, candidate)| candidate.to_owned())
}

/// The number of letters to insert, drop, change or swap with their neighbour; capitals do not count.
fn distance(this: &str, that: &str) -> usize {
    let this: Vec<char> = this.chars().flat_map(char::to_lowercase).collect();
    let that: Vec<char> = that.chars().flat_map(char::to_lowercase).collect();
    let mut before_last: Vec<usize> = Vec::new();
    let mut last: Vec<usize> = (0..=that.len()).collect();
    for row in 1..=this.len() {
        let mut current = vec![row];
        for column in 1..=that.len() {
            let change = usize::from(this[row - 1] != that[column - 1]);
            let mut best = (last[column - 1] + change).min(last[column] + 1).min(current[column - 1] + 1);
            let is_swap =
                1 < row && 1 < column && this[row - 1] == that[column - 2] && this[row - 2] == that[column - 1];
            if is_swap {
                best = best.min(before_last[column - 2] + 1);
            }
            current.push(best);
        }
        before_last = std::mem::replace(&mut last, current);
    }
    last[that.len()]
}

#[cfg(test)]
mod tests {
    use super::nearest;

    #[test]
    fn a_slip_of_the_finger_is_recognised() {
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
