//! In which order to reach objectives whose order is free: the one that takes the least time and keeps precedence and deadlines.
//!
//! Exact for up to [`EXACT_TO`] objectives, by dynamic programming over the sets of those that were reached (Held and Karp, A
//! Dynamic Programming Approach to Sequencing Problems, J. SIAM 10 (1), 1962): of two ways to reach the same set and end at the
//! same place, the earlier one is never worse, with deadlines either. Above that by cheapest insertion, improved by moving pieces
//! (Or, 1976) and reversing them (Croes, 1958). A lower bound says how far from the best order that may be: every order is a
//! spanning tree of the places, and none is shorter than the least one.

/// Objectives up to which the best order is found.
pub(crate) const EXACT_TO: usize = 10;
/// Orders that are tried at most to improve one; the same on every machine.
const TRIES_AT_MOST: usize = 200_000;
/// Objectives moved together at most. (Or: three.)
const LONGEST_PIECE: usize = 3;
/// A gain below this is rounding, in seconds.
const LEAST_GAIN_S: f64 = 1e-6;

/// What is to be ordered; all times in seconds.
#[derive(Debug, Clone, Default)]
pub(crate) struct Problem {
    /// From where the vehicle is to each.
    pub from_start_s: Vec<f64>,
    /// From the first to the second.
    pub between_s: Vec<Vec<f64>>,
    /// From each to the end, if it is the last.
    pub to_end_s: Vec<f64>,
    pub stay_s: Vec<f64>,
    /// Those that come before each.
    pub after: Vec<Vec<usize>>,
    /// When each must be arrived at, from the start.
    pub deadline_s: Vec<Option<f64>>,
}

/// An order, and how good it is.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Ordering {
    /// The objectives, first to reach first.
    pub order: Vec<usize>,
    pub time_s: f64,
    /// No order takes less, in seconds; as much as this one where that is the best.
    pub least_s: f64,
}

/// The best order that was found; `None` if none keeps precedence and deadlines, or, above [`EXACT_TO`], none was found.
pub(crate) fn solve(problem: &Problem) -> Option<Ordering> {
    if problem.len() <= EXACT_TO {
        let (order, time_s) = exact(problem)?;
        return Some(Ordering { order, time_s, least_s: time_s });
    }
    let (order, cost) = heuristic(problem)?;
    let least_s = bound_s(problem).min(cost.time_s);
    (cost.late_s <= LEAST_GAIN_S).then_some(Ordering { order, time_s: cost.time_s, least_s })
}

/// What an order costs: lateness comes first, so that a search removes it.
#[derive(Debug, Clone, Copy, PartialEq)]
struct Cost {
    late_s: f64,
    time_s: f64,
}

impl Cost {
    fn is_better_than(self, other: Cost) -> bool {
        let less_late_s = other.late_s - self.late_s;
        LEAST_GAIN_S < less_late_s || (less_late_s.abs() <= LEAST_GAIN_S && self.time_s + LEAST_GAIN_S < other.time_s)
    }
}

impl Problem {
    fn len(&self) -> usize {
        self.from_start_s.len()
    }

    /// From the one that was reached last, or from the start.
    fn leg_s(&self, last: Option<usize>, to: usize) -> f64 {
        last.map_or(self.from_start_s[to], |last| self.between_s[last][to])
    }

    /// The cost of an order of all of them or of some; `None` if it breaks a precedence among those.
    fn cost(&self, order: &[usize]) -> Option<Cost> {
        let mut place = vec![usize::MAX; self.len()];
        order.iter().enumerate().for_each(|(at, index)| place[*index] = at);
        let (mut late_s, mut time_s, mut last) = (0.0, 0.0, None);
        for (at, &index) in order.iter().enumerate() {
            if self.after[index].iter().any(|before| place[*before] != usize::MAX && at < place[*before]) {
                return None;
            }
            time_s += self.leg_s(last, index);
            late_s += self.deadline_s[index].map_or(0.0, |deadline_s| (time_s - deadline_s).max(0.0));
            time_s += self.stay_s[index];
            last = Some(index);
        }
        time_s += last.map_or(0.0, |last| self.to_end_s[last]);
        Some(Cost { late_s, time_s })
    }
}

fn exact(problem: &Problem) -> Option<(Vec<usize>, f64)> {
    let count = problem.len();
    if count == 0 {
        return Some((Vec::new(), 0.0));
    }
    let needs: Vec<usize> =
        problem.after.iter().map(|it| it.iter().fold(0, |set, before| set | (1 << before))).collect();
    // For each set and the one reached last: when the vehicle leaves that one at best, and which one came before it.
    let mut best = vec![vec![(f64::INFINITY, None); count]; 1 << count];
    for set in 1usize..1 << count {
        for last in (0..count).filter(|last| set & (1 << last) != 0) {
            let before = set & !(1 << last);
            if before & needs[last] != needs[last] {
                continue;
            }
            let froms: Vec<(f64, Option<usize>)> = match before {
                0 => vec![(0.0, None)],
                _ => (0..count).filter(|it| before & (1 << it) != 0).map(|it| (best[before][it].0, Some(it))).collect(),
            };
            for (leaves_s, from) in froms {
                let arrives_s = leaves_s + problem.leg_s(from, last);
                let is_late = problem.deadline_s[last].is_some_and(|deadline_s| deadline_s < arrives_s);
                if !is_late && arrives_s + problem.stay_s[last] < best[set][last].0 {
                    best[set][last] = (arrives_s + problem.stay_s[last], from);
                }
            }
        }
    }
    let mut set = (1 << count) - 1;
    let total_s = |last: usize| best[set][last].0 + problem.to_end_s[last];
    let last = (0..count).min_by(|a, b| total_s(*a).total_cmp(&total_s(*b)))?;
    let time_s = total_s(last);
    if !time_s.is_finite() {
        return None;
    }
    let (mut order, mut next) = (Vec::with_capacity(count), Some(last));
    while let Some(index) = next {
        order.push(index);
        next = best[set][index].1;
        set &= !(1 << index);
    }
    order.reverse();
    Some((order, time_s))
}

/// A good order and its cost; `None` if the precedences lead in a circle.
fn heuristic(problem: &Problem) -> Option<(Vec<usize>, Cost)> {
    let mut order: Vec<usize> = Vec::with_capacity(problem.len());
    for index in by_urgency(problem)? {
        let inserted = |at: usize| {
            let mut order = order.clone();
            order.insert(at, index);
            order
        };
        let tried = (0..=order.len()).map(inserted).filter_map(|it| problem.cost(&it).map(|cost| (it, cost)));
        order = tried.reduce(|best, it| if it.1.is_better_than(best.1) { it } else { best })?.0;
    }
    let mut cost = problem.cost(&order)?;
    let mut tries = 0;
    loop {
        let tried = neighbours(&order).take(TRIES_AT_MOST - tries).inspect(|_| tries += 1);
        let mut costs = tried.filter_map(|it| problem.cost(&it).map(|cost| (it, cost)));
        let Some(better) = costs.find(|it| it.1.is_better_than(cost)) else { break };
        drop(costs);
        (order, cost) = better;
    }
    Some((order, cost))
}

/// All objectives, each behind those that come before it, and otherwise the nearest deadline first.
fn by_urgency(problem: &Problem) -> Option<Vec<usize>> {
    let mut order: Vec<usize> = Vec::with_capacity(problem.len());
    while order.len() < problem.len() {
        let is_free =
            |it: &usize| !order.contains(it) && problem.after[*it].iter().all(|before| order.contains(before));
        let deadline_s = |it: usize| problem.deadline_s[it].unwrap_or(f64::INFINITY);
        let next = (0..problem.len()).filter(is_free).min_by(|a, b| deadline_s(*a).total_cmp(&deadline_s(*b)))?;
        order.push(next);
    }
    Some(order)
}

/// The orders in which a piece is reversed, or stands elsewhere.
fn neighbours(order: &[usize]) -> impl Iterator<Item = Vec<usize>> {
    let count = order.len();
    let reversals = (0..count).flat_map(move |from| (from + 2..=count).map(move |to| (from, to))).map(|(from, to)| {
        let mut changed = order.to_vec();
        changed[from..to].reverse();
        changed
    });
    let moves = (1..=LONGEST_PIECE).flat_map(move |length| {
        let froms = 0..(count + 1).saturating_sub(length);
        froms.flat_map(move |from| (0..=count - length).filter(move |to| *to != from).map(move |to| (from, to, length)))
    });
    let moves = moves.map(|(from, to, length)| {
        let mut changed = order.to_vec();
        let piece: Vec<usize> = changed.drain(from..from + length).collect();
        changed.splice(to..to, piece);
        changed
    });
    reversals.chain(moves)
}

/// No order takes less: the stays, the least spanning tree of start and objectives, and the shortest way to the end.
fn bound_s(problem: &Problem) -> f64 {
    // Prim's algorithm from the start; between two objectives the cheaper direction counts.
    let mut near_s = problem.from_start_s.clone();
    let mut open: Vec<usize> = (0..problem.len()).collect();
    let mut tree_s = 0.0;
    while let Some(at) = (0..open.len()).min_by(|a, b| near_s[open[*a]].total_cmp(&near_s[open[*b]])) {
        let index = open.swap_remove(at);
        tree_s += near_s[index];
        for &other in &open {
            let leg_s = problem.between_s[index][other].min(problem.between_s[other][index]);
            near_s[other] = near_s[other].min(leg_s);
        }
    }
    let to_end_s = problem.to_end_s.iter().copied().fold(f64::INFINITY, f64::min);
    tree_s + problem.stay_s.iter().sum::<f64>() + if to_end_s.is_finite() { to_end_s } else { 0.0 }
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    /// Places on a line, in seconds of flight from the start; the end is the start.
    fn on_a_line(places_s: &[f64]) -> Problem {
        let between = |a: &f64| places_s.iter().map(|b| (a - b).abs()).collect();
        Problem {
            from_start_s: places_s.iter().map(|it| it.abs()).collect(),
            between_s: places_s.iter().map(between).collect(),
            to_end_s: places_s.iter().map(|it| it.abs()).collect(),
            stay_s: vec![0.0; places_s.len()],
            after: vec![Vec::new(); places_s.len()],
            deadline_s: vec![None; places_s.len()],
        }
    }

    #[test]
    fn the_order_takes_the_least_time_and_keeps_what_is_asked() {
        #[track_caller]
        fn check(change: impl FnOnce(&mut Problem), expected: Option<(&[usize], f64)>) {
            let mut problem = on_a_line(&[20.0, -5.0, 10.0]);
            // It ends where it is.
            problem.to_end_s = vec![0.0; 3];
            change(&mut problem);
            let found = solve(&problem);
            assert_eq!(found.as_ref().map(|it| (it.order.as_slice(), it.time_s)), expected);
        }
        check(|_| {}, Some((&[1, 2, 0], 30.0)));
        check(|it| it.after[2] = vec![0], Some((&[1, 0, 2], 40.0)));
        check(|it| it.deadline_s[0] = Some(20.0), Some((&[2, 0, 1], 45.0)));
        check(|it| it.deadline_s[0] = Some(19.0), None);
        check(|it| it.stay_s[1] = 100.0, Some((&[1, 2, 0], 130.0)));
        // The stay does not count for its own deadline, and counts for that of the next.
        let stays =
            |it: &mut Problem| (it.stay_s[1], it.deadline_s[1], it.deadline_s[2]) = (9.0, Some(5.0), Some(29.0));
        check(stays, Some((&[1, 2, 0], 39.0)));
        check(|it| (it.after[0], it.after[2]) = (vec![2], vec![0]), None);
        assert_eq!(solve(&Problem::default()).map(|it| it.order), Some(Vec::new()));
    }

    #[test]
    fn many_places_on_a_line_are_reached_one_after_the_other() {
        let places: Vec<f64> = (0..40).map(|it| f64::from(it * 17 % 40 + 1)).collect();
        let mut problem = on_a_line(&places);
        problem.to_end_s = vec![0.0; 40];
        let found = solve(&problem).unwrap();
        let reached: Vec<f64> = found.order.iter().map(|it| places[*it]).collect();
        assert!(reached.is_sorted(), "{reached:?}");
        assert_eq!((found.time_s, found.least_s), (40.0, 40.0));
    }

    fn permutations(count: usize) -> Vec<Vec<usize>> {
        if count == 0 {
            return vec![Vec::new()];
        }
        let insert = |rest: Vec<usize>| {
            (0..count).map(move |at| {
                let mut order = rest.clone();
                order.insert(at, count - 1);
                order
            })
        };
        permutations(count - 1).into_iter().flat_map(insert).collect()
    }

    /// Any times, which need not be those of a plane; precedences lead in no circle.
    fn problems(counts: std::ops::RangeInclusive<usize>) -> impl Strategy<Value = Problem> {
        counts.prop_flat_map(|count| {
            let times = || prop::collection::vec(0.0..100.0, count);
            let after = prop::collection::vec(prop::collection::vec(any::<prop::sample::Index>(), 0..2), count);
            let deadlines = prop::collection::vec(prop::option::weighted(0.2, 0.0..400.0), count);
            (times(), prop::collection::vec(times(), count), times(), times(), after, deadlines).prop_map(
                |(from_start_s, between_s, to_end_s, stay_s, after, deadline_s)| {
                    let earlier = |(index, befores): (usize, Vec<prop::sample::Index>)| {
                        befores.iter().filter(|_| 0 < index).map(|it| it.index(index)).collect()
                    };
                    let after = after.into_iter().enumerate().map(earlier).collect();
                    Problem { from_start_s, between_s, to_end_s, stay_s, after, deadline_s }
                },
            )
        })
    }

    proptest! {
        #[test]
        fn no_permutation_is_better_than_the_exact_order(problem in problems(1..=7)) {
            let costs = permutations(problem.len()).into_iter().filter_map(|it| problem.cost(&it));
            let best_s = costs.filter(|it| it.late_s == 0.0).map(|it| it.time_s).fold(f64::INFINITY, f64::min);
            let found = solve(&problem);
            prop_assert_eq!(found.is_some(), best_s.is_finite());
            if let Some(Ordering { order, time_s, .. }) = found {
                prop_assert!((time_s - best_s).abs() < 1e-6, "{} s, and {} s is possible", time_s, best_s);
                let cost = problem.cost(&order);
                prop_assert!(cost.is_some_and(|it| (it.time_s - time_s).abs() < 1e-6 && it.late_s == 0.0));
            }
        }

        #[test]
        fn the_heuristic_keeps_what_is_asked_and_the_bound_holds(problem in problems(1..=8)) {
            let Some((order, cost)) = heuristic(&problem) else { panic!("no order of {problem:?}") };
            prop_assert_eq!(problem.cost(&order), Some(cost));
            if let Some((_, best_s)) = exact(&problem) {
                prop_assert!(bound_s(&problem) <= best_s + 1e-6);
                prop_assert!(0.0 < cost.late_s || best_s <= cost.time_s + 1e-6);
            }
        }

        #[test]
        fn an_order_of_many_reaches_each_once(problem in problems(11..=25)) {
            if let Some(Ordering { mut order, time_s, least_s }) = solve(&problem) {
                prop_assert!(least_s <= time_s);
                prop_assert!(problem.cost(&order).is_some_and(|it| it.late_s <= LEAST_GAIN_S));
                order.sort_unstable();
                prop_assert_eq!(order, (0..problem.len()).collect::<Vec<_>>());
            }
        }
    }
}
