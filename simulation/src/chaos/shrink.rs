//! The shortest list that still fails: delta debugging.

/// Takes away from `items` as long as `fails` says so of what is left: first halves, then smaller parts, in the end single ones. The
/// result fails, and does not without any one of its items. `items` themselves must fail.
pub fn shrink<T: Clone>(items: &[T], mut fails: impl FnMut(&[T]) -> bool) -> Vec<T> {
    let mut kept = items.to_vec();
    let mut size = kept.len().div_ceil(2);
    while 0 < size {
        let removed = without_parts(&mut kept, size, &mut fails);
        // Without one of them, another one may have become superfluous.
        size = if size == 1 { usize::from(removed) } else { size / 2 };
    }
    kept
}

/// Takes away each part of this size without which it still fails; whether there was one.
fn without_parts<T: Clone>(kept: &mut Vec<T>, size: usize, fails: &mut impl FnMut(&[T]) -> bool) -> bool {
    let (before, mut from) = (kept.len(), 0);
    while from < kept.len() {
        let to = kept.len().min(from + size);
        let rest = [&kept[..from], &kept[to..]].concat();
        if fails(&rest) {
            *kept = rest;
        } else {
            from = to;
        }
    }
    kept.len() < before
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    /// Fails if all of `guilty` are there, whatever else is.
    #[track_caller]
    fn check(items: &[u32], guilty: &[u32]) {
        let mut tries = 0;
        let kept = shrink(items, |rest| {
            tries += 1;
            guilty.iter().all(|it| rest.contains(it))
        });
        assert_eq!(kept, guilty, "of {items:?}");
        assert!(tries <= items.len() * (items.len() + 3), "{tries} flights for {} troubles", items.len());
    }

    #[test]
    fn only_what_is_needed_to_fail_is_left() {
        check(&[], &[]);
        check(&[1], &[]);
        check(&[1], &[1]);
        check(&[1, 2, 3, 4, 5, 6, 7, 8], &[]);
        check(&[1, 2, 3, 4, 5, 6, 7, 8], &[5]);
        check(&[1, 2, 3, 4, 5, 6, 7, 8], &[1, 8]);
        check(&[1, 2, 3], &[1, 2, 3]);
    }

    #[test]
    fn what_is_superfluous_only_without_another_one_goes_too() {
        // Two and three fail together or not at all; one of both alone does not.
        let fails = |rest: &[u32]| rest.contains(&1) && rest.contains(&2) == rest.contains(&3);
        let kept = shrink(&[3, 2, 1], fails);
        assert!(fails(&kept), "{kept:?}");
        for at in 0..kept.len() {
            let mut less = kept.clone();
            less.remove(at);
            assert!(!fails(&less), "{kept:?} is not the shortest: {less:?} fails");
        }
    }

    proptest! {
        #[test]
        fn the_guilty_are_found_among_any(count in 0_u32..24, guilty in any::<u32>()) {
            let items: Vec<u32> = (0..count).collect();
            let guilty: Vec<u32> = items.iter().copied().filter(|it| (guilty >> it) & 1 == 1).collect();
            check(&items, &guilty);
        }
    }
}
