//! Why a command failed; the kind of failure decides the exit code.

use serde_json::{Value, json};

use crate::outcome::Outcome;

/// The gateway's problem of this type means that nothing was done.
const NOTHING_DONE: &str = "urn:kittiwake:problem:unavailable";

/// Why a command failed.
#[derive(Debug, Clone, PartialEq)]
pub struct Failure {
    /// The exit code.
    pub outcome: Outcome,
    /// In a sentence, with what to do about it.
    pub why: String,
    /// What the gateway answered, for programs.
    pub document: Value,
}

impl Failure {
    /// A file or an argument is invalid.
    pub fn bad_input(why: impl Into<String>) -> Failure {
        Failure::new(Outcome::BadInput, why)
    }

    /// The system refused.
    pub fn refused(why: impl Into<String>) -> Failure {
        Failure::new(Outcome::Refused, why)
    }

    /// No gateway answers.
    pub fn unreachable(why: impl Into<String>) -> Failure {
        Failure::new(Outcome::Unreachable, why)
    }

    fn new(outcome: Outcome, why: impl Into<String>) -> Failure {
        let why = why.into();
        Failure { outcome, document: json!({ "detail": &why }), why }
    }

    /// Whether the gateway says so. A proxy before it does not know, nor does a gateway that has made a mistake.
    pub fn says_that_nothing_was_done(&self) -> bool {
        self.document["type"] == NOTHING_DONE
    }

    /// Who has command, if that is why the gateway refused.
    pub fn command_authority(&self) -> Option<&Value> {
        self.document.get("command")
    }
}

/// The document that the gateway answered, or the failure that its status means.
pub fn judge(status: u16, body: &str) -> Result<Value, Failure> {
    let document: Option<Value> = serde_json::from_str(body).ok();
    if (200..300).contains(&status) {
        return document.ok_or_else(|| Failure::unreachable("the answer is not that of a Kittiwake gateway"));
    }
    let outcome = match status {
        400 | 404 | 405 | 413 | 422 => Outcome::BadInput,
        401 | 403 | 409 | 429 => Outcome::Refused,
        _ => Outcome::Unreachable,
    };
    let document = document.filter(Value::is_object).unwrap_or_else(|| json!({ "status": status }));
    Err(Failure { outcome, why: words(status, &document), document })
}

/// The detail, and a line for each mistake in a file.
fn words(status: u16, document: &Value) -> String {
    let detail = document["detail"].as_str().map_or_else(|| format!("the gateway answered {status}"), str::to_owned);
    let hint = match status {
        401 => "; give one with --token-file, or with KITTIWAKE_URL and KITTIWAKE_TOKEN",
        _ => "",
    };
    let mistakes = document["mistakes"].as_array().into_iter().flatten().filter_map(Value::as_str);
    mistakes.fold(format!("{detail}{hint}"), |text, mistake| format!("{text}\n{mistake}"))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_status_decides_the_exit_code() {
        #[track_caller]
        fn check(status: u16, body: &str, code: u8, why: &str) {
            let failure = judge(status, body).unwrap_err();
            assert_eq!((u8::from(failure.outcome), failure.why.as_str()), (code, why), "{status}");
        }
        let problem = r#"{"status":0,"detail":"the reason"}"#;
        for (status, code) in [(400, 2), (404, 2), (413, 2), (422, 2), (403, 3), (409, 3), (429, 3), (503, 5), (502, 5)]
        {
            check(status, problem, code, "the reason");
        }
        check(401, problem, 3, "the reason; give one with --token-file, or with KITTIWAKE_URL and KITTIWAKE_TOKEN");
        check(
            422,
            r#"{"detail":"2 mistakes","mistakes":["m:1:1: a","m:2:1: b"]}"#,
            2,
            "2 mistakes\nm:1:1: a\nm:2:1: b",
        );
        check(500, "<html>", 5, "the gateway answered 500");
        check(200, "<html>", 5, "the answer is not that of a Kittiwake gateway");
        assert_eq!(judge(200, "{}"), Ok(json!({})));
    }

    #[test]
    fn who_has_command_is_known_only_where_that_is_the_reason() {
        let refused = judge(409, r#"{"detail":"anna has command","command":{"holder":"anna"}}"#).unwrap_err();
        assert_eq!(refused.command_authority().map(|it| &it["holder"]), Some(&json!("anna")));
        assert_eq!(judge(409, r#"{"detail":"already holding"}"#).unwrap_err().command_authority(), None);
    }
}
