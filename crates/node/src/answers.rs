//! What requests were answered, for requests that are repeated: a retry gets the first answer, and nothing is done again.

use std::collections::VecDeque;

/// The answers to the newest requests, by request id. A request is repeated within seconds, long before 64 new ones have come.
#[derive(Debug, Clone)]
pub struct Answers<R, Id = String, const MOST: usize = 64> {
    oldest_first: VecDeque<(Id, R)>,
}

impl<R, Id, const MOST: usize> Default for Answers<R, Id, MOST> {
    fn default() -> Answers<R, Id, MOST> {
        Answers { oldest_first: VecDeque::new() }
    }
}

impl<R, Id, const MOST: usize> Answers<R, Id, MOST> {
    /// The answer that was given to the request `id`.
    pub fn get<Q: ?Sized>(&self, id: &Q) -> Option<&R>
    where
        Id: PartialEq<Q>,
    {
        self.oldest_first.iter().find(|(known, _)| known == id).map(|(_, answer)| answer)
    }

    /// Remembers an answer; the oldest one makes room.
    pub fn remember(&mut self, id: Id, answer: R) {
        if self.oldest_first.len() == MOST {
            self.oldest_first.pop_front();
        }
        self.oldest_first.push_back((id, answer));
    }

    /// Forgets all answers but those for which `stays` holds.
    pub fn retain(&mut self, mut stays: impl FnMut(&R) -> bool) {
        self.oldest_first.retain(|(_, answer)| stays(answer));
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_newest_answers_are_known_by_their_ids() {
        let mut answers = Answers::<u32, String, 3>::default();
        for number in 0..5 {
            answers.remember(number.to_string(), number);
        }
        let known = |answers: &Answers<u32, String, 3>| ["0", "1", "2", "3", "4"].map(|id| answers.get(id).copied());
        assert_eq!(known(&answers), [None, None, Some(2), Some(3), Some(4)]);
        answers.retain(|answer| *answer != 3);
        assert_eq!(known(&answers), [None, None, Some(2), None, Some(4)]);
    }
}
