//! Whose turn it is in a loop with several nodes. It waits for nothing and knows no message.

/// Rounds after which the loop looks at its sockets and clocks again, although its nodes still have mail from each other: nodes that answer
/// each other for ever keep nobody else from being heard. A flag that becomes a command takes three.
const MOST_ROUNDS: usize = 16;

/// Gives a turn to each member that `is_due`, and then to each that `has_mail` by what the others have done, until nobody has any. The first
/// error ends it.
pub(crate) fn take_turns<M, E>(
    members: &mut [M],
    is_due: impl Fn(&M) -> bool,
    has_mail: impl Fn(&M) -> bool,
    mut turn: impl FnMut(&mut M) -> Result<(), E>,
) -> Result<(), E> {
    members.iter_mut().filter(|it| is_due(it)).try_for_each(&mut turn)?;
    for _ in 1..MOST_ROUNDS {
        let mut anybody = false;
        for member in members.iter_mut().filter(|it| has_mail(it)) {
            anybody = true;
            turn(member)?;
        }
        if !anybody {
            break;
        }
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use std::cell::RefCell;
    use std::collections::VecDeque;
    use std::convert::Infallible;

    use super::*;

    /// What each of three members has got and not seen yet, and who sends what to whom when it sees something.
    struct Members {
        mail: RefCell<[VecDeque<&'static str>; 3]>,
        answer: fn(usize, &str) -> Option<(usize, &'static str)>,
        seen: RefCell<Vec<(usize, &'static str)>>,
    }

    /// Runs the turns of one waking, in which `first` was in the mailboxes; what was seen by whom, in order, and whether mail is left.
    fn run(
        first: &[(usize, &'static str)],
        answer: fn(usize, &str) -> Option<(usize, &'static str)>,
    ) -> (Vec<(usize, &'static str)>, bool) {
        let members = Members { mail: RefCell::default(), answer, seen: RefCell::default() };
        first.iter().for_each(|(to, what)| members.mail.borrow_mut()[*to].push_back(what));
        let has_mail = |it: &usize| !members.mail.borrow()[*it].is_empty();
        let result = take_turns(&mut [0, 1, 2], has_mail, has_mail, |it| {
            let batch = std::mem::take(&mut members.mail.borrow_mut()[*it]);
            for what in batch {
                members.seen.borrow_mut().push((*it, what));
                if let Some((to, what)) = (members.answer)(*it, what) {
                    members.mail.borrow_mut()[to].push_back(what);
                }
            }
            Ok::<(), Infallible>(())
        });
        result.unwrap_or_else(|never| match never {});
        let is_left = [0, 1, 2].iter().any(has_mail);
        (members.seen.into_inner(), is_left)
    }

    #[test]
    fn what_one_says_the_other_hears_in_the_same_waking() {
        // A flag of the monitor (2) becomes a request of the manager (1) and a command of the skill manager (0).
        let answer = |at, what: &str| match (at, what) {
            (2, "sample") => Some((1, "flag")),
            (1, "flag") => Some((0, "request")),
            (0, "request") => Some((1, "answer")),
            _ => None,
        };
        let seen = vec![(2, "sample"), (1, "flag"), (0, "request"), (1, "answer")];
        assert_eq!(run(&[(2, "sample")], answer), (seen, false));
    }

    #[test]
    fn what_one_says_is_heard_in_its_order() {
        let answer = |at, what: &str| match (at, what) {
            (2, "a") => Some((0, "A")),
            (2, "b") => Some((0, "B")),
            (2, "c") => Some((0, "C")),
            _ => None,
        };
        let (seen, is_left) = run(&[(2, "a"), (2, "b"), (2, "c")], answer);
        assert_eq!((&seen[3..], is_left), (&[(0, "A"), (0, "B"), (0, "C")][..], false));
    }

    #[test]
    fn two_that_answer_each_other_for_ever_leave_the_loop_its_turn() {
        let (seen, is_left) = run(&[(0, "ping"), (2, "sample")], |at, _| match at {
            0 => Some((1, "pong")),
            1 => Some((0, "ping")),
            _ => None,
        });
        assert!(is_left, "what is left waits for the next turn of the loop");
        assert!(seen.contains(&(2, "sample")) && seen.len() <= 2 * MOST_ROUNDS + 1, "{seen:?}");
    }

    #[test]
    fn who_is_not_due_and_has_no_mail_has_no_turn() {
        let mut turns = Vec::new();
        let result = take_turns(
            &mut [0, 1, 2],
            |it| *it == 1,
            |_| false,
            |it| {
                turns.push(*it);
                Ok::<(), Infallible>(())
            },
        );
        assert_eq!((result, turns), (Ok(()), vec![1]));
    }

    #[test]
    fn an_error_ends_the_turns() {
        let mut turns = 0;
        let result = take_turns(
            &mut [0, 1, 2],
            |_| true,
            |_| true,
            |_| {
                turns += 1;
                Err("the bus refuses")
            },
        );
        assert_eq!((result, turns), (Err("the bus refuses"), 1));
    }
}
