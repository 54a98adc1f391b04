//! Files that are replaced while a process runs.

/// Why content is not taken over.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum Unusable<E> {
    /// It cannot be used until it is replaced.
    Content(E),
    /// It cannot be used now, and is parsed again at the next look.
    Now(E),
}

/// What was made of the last usable content of such files. Content that cannot be used takes nothing away: a typing error, or a file
/// that is just being copied, must not leave an aircraft without its operators or its link.
#[derive(Debug)]
pub struct Followed<C, T, E> {
    /// What the last look found, and what was parsed last.
    newest: C,
    settled: C,
    value: T,
    /// Why `settled`, and why `newest`, is not taken over.
    refusal: Option<E>,
    waiting: Option<E>,
}

impl<C: Clone + PartialEq, T, E: Clone + PartialEq> Followed<C, T, E> {
    /// Begins with a value that was made of this content.
    pub fn new(content: C, value: T) -> Followed<C, T, E> {
        Followed { newest: content.clone(), settled: content, value, refusal: None, waiting: None }
    }

    /// Begins with content that cannot be used, and a value in its place.
    pub fn refused(content: C, value: T, why: E) -> Followed<C, T, E> {
        Followed { refusal: Some(why), ..Followed::new(content, value) }
    }

    /// What is in use.
    pub fn value(&self) -> &T {
        &self.value
    }

    /// Why the files as they are now are not in use.
    pub fn problem(&self) -> Option<&E> {
        self.waiting.as_ref().or(self.refusal.as_ref())
    }

    /// Takes over `content` if it has changed and `parse`, which gets the value in use too, can use it. Returns the new value, or why there is
    /// none; `None` without news.
    pub fn look(&mut self, content: C, parse: impl FnOnce(&C, &T) -> Result<T, Unusable<E>>) -> Option<Result<&T, &E>> {
        let told = self.problem().cloned();
        self.newest = content.clone();
        self.waiting = None;
        if content == self.settled {
            return None;
        }
        match parse(&content, &self.value) {
            Ok(value) => {
                (self.settled, self.value, self.refusal) = (content, value, None);
                return Some(Ok(&self.value));
            }
            Err(Unusable::Content(why)) => (self.settled, self.refusal) = (content, Some(why)),
            Err(Unusable::Now(why)) => self.waiting = Some(why),
        }
        self.problem().filter(|it| told.as_ref() != Some(it)).map(Err)
    }

    /// The same for content of which a part can be mistaken for the whole: it counts when it is found twice in a row.
    pub fn look_twice(
        &mut self,
        content: C,
        parse: impl FnOnce(&C, &T) -> Result<T, Unusable<E>>,
    ) -> Option<Result<&T, &E>> {
        if content == self.newest {
            return self.look(content, parse);
        }
        self.newest = content;
        None
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Numbers are used, `no` is refused until it is replaced, and `wait` until it can be used.
    fn parse(content: &&str, _: &u32) -> Result<u32, Unusable<String>> {
        let refused = |it: &str| if it == "wait" { Unusable::Now(it.into()) } else { Unusable::Content(it.into()) };
        content.parse().map_err(|_| refused(content))
    }

    #[test]
    fn the_last_usable_content_stays_in_use_and_each_problem_is_told_once() {
        let mut followed = Followed::new("1", 1);
        let mut check = |content, expected: Option<Result<u32, &str>>, value, problem: Option<&str>| {
            let news = followed.look(content, parse).map(|it| it.copied().map_err(String::as_str));
            assert_eq!(news, expected, "{content}");
            assert_eq!((*followed.value(), followed.problem().map(String::as_str)), (value, problem), "{content}");
        };
        check("1", None, 1, None);
        check("2", Some(Ok(2)), 2, None);
        check("no", Some(Err("no")), 2, Some("no"));
        check("no", None, 2, Some("no"));
        check("wait", Some(Err("wait")), 2, Some("wait"));
        check("wait", None, 2, Some("wait"));
        check("2", Some(Ok(2)), 2, None);
        check("wait", Some(Err("wait")), 2, Some("wait"));
        // As it was when it was used: nothing waits any more.
        check("2", None, 2, None);
        check("wait", Some(Err("wait")), 2, Some("wait"));
        check("3", Some(Ok(3)), 3, None);
    }

    #[test]
    fn what_cannot_be_used_now_is_parsed_again_and_what_cannot_be_used_at_all_is_not() {
        let mut followed = Followed::new("1", 1);
        for content in ["wait", "no"] {
            assert!(matches!(followed.look(content, parse), Some(Err(_))));
        }
        assert_eq!(followed.look("no", |_, _| panic!("it has not changed")), None);
        assert!(followed.look("wait", parse).is_some());
        assert_eq!(followed.look("wait", |_, used| Ok(used + 1)), Some(Ok(&2)), "the same content");
    }

    #[test]
    fn content_that_may_be_half_written_counts_when_it_is_found_twice() {
        let mut followed = Followed::new("1", 1);
        assert_eq!(followed.look_twice("2", parse), None);
        assert_eq!(followed.look_twice("23", parse), None);
        assert_eq!(followed.look_twice("23", parse), Some(Ok(&23)));
    }
}
