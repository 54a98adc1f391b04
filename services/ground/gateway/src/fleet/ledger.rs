//! A vehicle's ledger, put together from the parts in which the control tower publishes a large one.

use std::time::Duration;

use kittiwake_proto::v1;

/// All that is known once `part` was heard: it says all about the areas in its range, and nothing about the others.
/// About those `before` holds, with its age.
pub(crate) fn with_part(
    before: Option<(&v1::PermissionLedger, Duration)>,
    part: v1::PermissionLedger,
) -> v1::PermissionLedger {
    let v1::PermissionLedger { permissions, after_area, through_area, .. } = part;
    let is_outside = |area: &String| *area <= after_area || (!through_area.is_empty() && through_area < *area);
    let mut known = permissions;
    if let Some((before, passed)) = before {
        let kept = before.permissions.iter().filter(|it| is_outside(&it.area));
        known.extend(kept.map(|it| {
            let valid_for_s = (it.valid_for_s - passed.as_secs_f64()).max(0.0);
            v1::Permission { valid_for_s, ..it.clone() }
        }));
        known.sort_by(|one, other| one.area.cmp(&other.area));
    }
    v1::PermissionLedger {
        permissions: known,
        tower_start: part.tower_start,
        memory: part.memory,
        after_area: String::new(),
        through_area: String::new(),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn ledger(areas: &str, [after_area, through_area]: [&str; 2]) -> v1::PermissionLedger {
        let permission = |area| v1::Permission { area: String::from(area), valid_for_s: 60.0, ..Default::default() };
        let permissions = areas.split_whitespace().map(permission).collect();
        let (after_area, through_area) = (after_area.into(), through_area.into());
        v1::PermissionLedger { permissions, after_area, through_area, ..Default::default() }
    }

    #[test]
    fn a_part_replaces_what_is_in_its_range_and_nothing_else() {
        #[track_caller]
        fn check(range: [&str; 2], areas: &str, expected: &[(&str, f64)]) {
            let before = ledger("a b c d", ["", ""]);
            let after = with_part(Some((&before, Duration::from_secs(10))), ledger(areas, range));
            let known: Vec<_> = after.permissions.iter().map(|it| (it.area.as_str(), it.valid_for_s)).collect();
            assert_eq!(known, expected);
        }
        check(["", ""], "a e", &[("a", 60.0), ("e", 60.0)]);
        check(["", "b"], "b", &[("b", 60.0), ("c", 50.0), ("d", 50.0)]);
        check(["a", "c"], "", &[("a", 50.0), ("d", 50.0)]);
        check(["b", ""], "c e", &[("a", 50.0), ("b", 50.0), ("c", 60.0), ("e", 60.0)]);
    }
}
