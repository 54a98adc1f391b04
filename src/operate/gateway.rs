//! The gateway as an operator's command sees it: found, asked, and asked again with the same key
//! while it does not answer, where a second time does no harm.

#![expect(clippy::disallowed_methods, reason = "somebody waits for the answer, and nothing tells when to ask again")]

use std::path::PathBuf;
use std::time::{Duration, Instant};

use kittiwake_proto::json::from_json;
use kittiwake_proto::v1;
use reqwest::blocking::{Client, RequestBuilder};
use reqwest::{Method, Url};
use serde_json::Value;

use crate::http_client::{client, parse, root_cause};
use crate::operate::args::GatewayArgs;
use crate::operate::failure::{Failure, judge};
use crate::output;
use crate::run::run_file::{self, Running};
use crate::setup::access::random_hex;
use crate::target::Environment;

/// A request without an answer is repeated until this has passed.
const LIMIT: Duration = Duration::from_secs(5);
/// Longer than the gateway's own limit.
const ANSWER_LIMIT: Duration = Duration::from_secs(8);
/// Between two attempts.
const PAUSE: Duration = Duration::from_millis(100);
/// Random, so that no two commands have the same key.
const KEY_BYTES: usize = 16;

/// A gateway, and the token for it.
pub struct Gateway {
    client: Client,
    url: Url,
    token: String,
    ca: Option<PathBuf>,
    vehicle: Option<String>,
    hand_over: bool,
}

/// When a request is sent again.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Repeat {
    /// While there is no answer: nothing is changed by it, or who carries it out recognises its key.
    WhileUnanswered,
    /// While it is certain that nothing was done: who carries it out recognises no key.
    WhileNothingWasDone,
}

/// No answer has come.
struct NoAnswer {
    cause: String,
    /// The gateway may have read the request.
    may_have_arrived: bool,
}

/// Where a gateway is, and the token in its run file, if there is one.
#[derive(Debug, PartialEq, Eq)]
struct Location {
    url: String,
    token: String,
    ca: Option<PathBuf>,
    vehicle: Option<String>,
}

impl Gateway {
    /// The gateway that the arguments name, or that of the only system that runs here.
    pub fn find(args: &GatewayArgs) -> Result<Gateway, Failure> {
        let environment = Environment::read();
        let mut location = choose(args, environment.url.clone(), run_file::running())?;
        location.token = match &args.token_file {
            Some(path) => read_token(path),
            None => environment.token_for(&location.url, location.token),
        }
        .map_err(Failure::bad_input)?;
        let url = parse(&location.url).map_err(Failure::bad_input)?;
        let Location { token, ca, vehicle, .. } = location;
        let client = client(&url, &token, ca.as_deref(), Some(ANSWER_LIMIT)).map_err(Failure::bad_input)?;
        Ok(Gateway { client, url, token, ca, vehicle, hand_over: args.hand_over })
    }

    /// The vehicle that was named, or the only one that the gateway knows. A gateway that was just started has seen none yet: that is
    /// waited for, for `LIMIT`.
    pub fn vehicle(&self) -> Result<String, Failure> {
        let until = Instant::now() + LIMIT;
        loop {
            let fleet = self.ask(Method::GET, &["vehicles"], None)?;
            let known = fleet["vehicles"].as_array().into_iter().flatten().filter_map(|it| it["vehicle"].as_str());
            match (&self.vehicle, known.collect::<Vec<_>>().as_slice()) {
                (_, []) if Instant::now() < until => std::thread::sleep(PAUSE),
                // What the gateway says of one that it does not know names it.
                (Some(named), _) => return Ok(named.clone()),
                (None, []) => return Err(Failure::unreachable("the gateway has seen no vehicle yet")),
                (None, [one]) => return Ok((*one).to_owned()),
                (None, several) => {
                    return Err(Failure::bad_input(format!("name one with --vehicle: {}", several.join(", "))));
                }
            }
        }
    }

    /// The same gateway, with this vehicle named.
    #[must_use]
    pub fn of_vehicle(self, vehicle: &str) -> Gateway {
        Gateway { vehicle: Some(vehicle.to_owned()), ..self }
    }

    /// A document about the vehicle.
    pub fn read(&self, path: &[&str]) -> Result<Value, Failure> {
        let vehicle = self.vehicle()?;
        self.ask(Method::GET, &[&["vehicles", vehicle.as_str()][..], path].concat(), None)
    }

    /// Gives an order to the vehicle; takes command where the order needs it and nobody has it.
    pub fn order(&self, method: Method, path: &[&str], body: Option<Value>) -> Result<Value, Failure> {
        self.give(method, path, body, Repeat::WhileUnanswered)
    }

    /// The same to the control tower, which recognises no key: a decision that is carried out a second time would undo what somebody
    /// else has decided since the first. So it is not repeated once it may have been carried out.
    pub fn decide(&self, path: &[&str], body: Option<Value>) -> Result<Value, Failure> {
        let path = [&["permissions"], path].concat();
        self.give(Method::POST, &path, body, Repeat::WhileNothingWasDone)
    }

    fn give(&self, method: Method, path: &[&str], body: Option<Value>, repeat: Repeat) -> Result<Value, Failure> {
        let vehicle = self.vehicle()?;
        let path = [&["vehicles", vehicle.as_str()][..], path].concat();
        let refusal = match self.send(method.clone(), &path, body.clone(), repeat) {
            Err(refusal) if refusal.command_authority().is_some() => refusal,
            answer => return answer,
        };
        may_take_command(&refusal, self.hand_over)?;
        self.ask(Method::POST, &["vehicles", &vehicle, "command", "take"], None)?;
        output::error_line(format_args!(
            "took command of {vehicle}; `kittiwake vehicle release` releases it, else it lapses after a while"
        ));
        self.send(method, &path, body, repeat)
    }

    /// Repeats a request until there is an answer, or `LIMIT` has passed.
    pub fn ask(&self, method: Method, path: &[&str], body: Option<Value>) -> Result<Value, Failure> {
        self.send(method, path, body, Repeat::WhileUnanswered)
    }

    /// Repeats a request for `LIMIT`, if it may be repeated. All repetitions have the same key: by it the gateway gives the answer that it
    /// gave before, and where it has none any more, the mission manager recognises an order that it has carried out.
    fn send(&self, method: Method, path: &[&str], body: Option<Value>, repeat: Repeat) -> Result<Value, Failure> {
        self.send_to(self.at(path), method, body, repeat)
    }

    fn send_to(&self, url: Url, method: Method, body: Option<Value>, repeat: Repeat) -> Result<Value, Failure> {
        let key = random_hex(KEY_BYTES).map_err(|it| Failure::unreachable(format!("no random numbers: {it}")))?;
        let until = Instant::now() + LIMIT;
        loop {
            let mut request = self.client.request(method.clone(), url.clone());
            if method != Method::GET {
                request = request.header("Idempotency-Key", &key);
            }
            if let Some(body) = &body {
                request = request.header("Content-Type", "application/json").body(body.to_string());
            }
            let (failure, may_be_done) = match answer(request) {
                Ok((status, text)) => match judge(status, &text) {
                    Err(failure) if 500 <= status => {
                        let may_be_done = !failure.says_that_nothing_was_done();
                        (failure, may_be_done)
                    }
                    answer => return answer,
                },
                Err(NoAnswer { cause, .. }) if cause.contains("certificate") => {
                    let hint = "name the CA that signed its certificate with --ca";
                    return Err(Failure::unreachable(format!("{} is not trusted: {cause}; {hint}", self.url)));
                }
                Err(NoAnswer { cause, may_have_arrived }) => {
                    (Failure::unreachable(format!("{} does not answer: {cause}", self.url)), may_have_arrived)
                }
            };
            if may_be_done && repeat == Repeat::WhileNothingWasDone {
                return Err(not_repeated(&failure));
            }
            if until <= Instant::now() {
                return Err(failure);
            }
            std::thread::sleep(PAUSE);
        }
    }

    /// The decisions of this vehicle after the one with this number.
    pub fn decisions(&self, vehicle: &str, after: u64) -> Result<Vec<v1::DecisionRecord>, Failure> {
        let mut url = self.at(&["vehicles", vehicle, "decisions"]);
        if 0 < after {
            url.query_pairs_mut().append_pair("after", &after.to_string());
        }
        let document = self.send_to(url, Method::GET, None, Repeat::WhileUnanswered)?;
        let entries = document["decisions"].as_array().into_iter().flatten();
        entries.map(|it| from_json(&it["record"]).map_err(of_another_version)).collect()
    }

    /// The whole state of this vehicle.
    pub fn state(&self, vehicle: &str) -> Result<v1::Vehicle, Failure> {
        from_json(&self.ask(Method::GET, &["vehicles", vehicle], None)?).map_err(of_another_version)
    }

    /// Opens the vehicle's event stream after the event with this id; without a limit in time.
    pub fn events(&self, after: &str) -> Result<reqwest::blocking::Response, Failure> {
        let vehicle = self.vehicle()?;
        let url = self.at(&["vehicles", &vehicle, "events"]);
        let client = client(&url, &self.token, self.ca.as_deref(), None).map_err(Failure::bad_input)?;
        let mut request = client.get(url);
        if !after.is_empty() {
            request = request.header("Last-Event-ID", after);
        }
        let unreachable =
            |it: reqwest::Error| Failure::unreachable(format!("{} does not answer: {}", self.url, root_cause(&it)));
        let response = request.send().map_err(unreachable)?;
        let status = response.status();
        if status.is_success() {
            return Ok(response);
        }
        let text = response.text().map_err(unreachable)?;
        Err(judge(status.as_u16(), &text).err().unwrap_or_else(|| Failure::unreachable(text)))
    }

    fn at(&self, path: &[&str]) -> Url {
        let mut url = self.url.clone();
        // A URL that can be a base has segments; `find` has checked it.
        if let Ok(mut segments) = url.path_segments_mut() {
            segments.pop_if_empty().extend(["api", "v1"]).extend(path);
        }
        url
    }
}

fn of_another_version(cause: String) -> Failure {
    Failure::unreachable(format!("the gateway's answer is not understood, it may be of another version: {cause}"))
}

/// The status and the text that the gateway answers.
fn answer(request: RequestBuilder) -> Result<(u16, String), NoAnswer> {
    let no_answer = |it: reqwest::Error| NoAnswer { cause: root_cause(&it), may_have_arrived: !it.is_connect() };
    let response = request.send().map_err(no_answer)?;
    let status = response.status().as_u16();
    Ok((status, response.text().map_err(no_answer)?))
}

/// A decision that may have been carried out, by this failure.
fn not_repeated(failure: &Failure) -> Failure {
    let why = format!(
        "it is not known whether this was carried out, so it is not repeated: look at `kittiwake permission list` before you decide again ({})",
        failure.why
    );
    Failure { why, ..failure.clone() }
}

/// Whether command may be taken: nobody has it, or its holder offers it and the operator said `--hand-over`.
fn may_take_command(refusal: &Failure, hand_over: bool) -> Result<(), Failure> {
    let authority = refusal.command_authority().cloned().unwrap_or_default();
    let (holder, offered_to) = (authority["holder"].as_str(), authority["offeredTo"].as_str());
    let advice = match (holder, offered_to) {
        (None, _) => return Ok(()),
        (Some(_), Some(_)) if hand_over => return Ok(()),
        (Some(_), Some(to)) => format!("command is offered to {to}, who takes it with --hand-over"),
        (Some(holder), None) => format!("{holder} can offer command with `kittiwake vehicle hand-over NAME`"),
    };
    Err(Failure { why: format!("{}; {advice}", refusal.why), ..refusal.clone() })
}

/// Where the gateway is, by the arguments, else by the variable, else by the system that runs here.
fn choose(args: &GatewayArgs, variable: Option<String>, running: Vec<Running>) -> Result<Location, Failure> {
    let named = args.vehicle.as_ref().map(|it| it.as_str().to_owned());
    let variable = variable.filter(|_| args.pid.is_none());
    let url = args.url.clone().or(variable).map(|it| it.trim_end_matches('/').to_owned());
    let is_meant = |system: &Running| {
        args.pid.is_none_or(|pid| pid == system.pid)
            && url.as_ref().is_none_or(|url| *url == system.http)
            && named.as_ref().is_none_or(|vehicle| *vehicle == system.vehicle)
    };
    let (mut found, others): (Vec<_>, Vec<_>) = running.into_iter().partition(is_meant);
    if found.len() == 1 {
        let system = found.remove(0);
        return Ok(Location {
            url: system.http,
            token: system.token,
            ca: args.ca.clone().or(system.ca),
            vehicle: Some(system.vehicle),
        });
    }
    if let Some(url) = url {
        return Ok(Location { url, token: String::new(), ca: args.ca.clone(), vehicle: named });
    }
    if found.is_empty() && others.is_empty() {
        return Err(Failure::unreachable("no system runs here; start one with `kittiwake up`, or name one with --url"));
    }
    let line = |system: &Running| format!("\n  --pid {}  {}  --url {}", system.pid, system.vehicle, system.http);
    let list = |systems: &[Running]| systems.iter().map(line).collect::<String>();
    Err(match found.is_empty() {
        true => Failure::bad_input(format!("no such system runs here; these do:{}", list(&others))),
        false => Failure::bad_input(format!("several systems run here; name one with --pid or --url:{}", list(&found))),
    })
}

/// The first line of a file that only its owner may read.
fn read_token(path: &std::path::Path) -> Result<String, String> {
    use std::os::unix::fs::PermissionsExt;
    let unreadable = |cause: std::io::Error| format!("{}: cannot be read: {cause}", path.display());
    let text = regular_file::read_text(path).map_err(unreadable)?;
    let mode = std::fs::metadata(path).map_err(unreadable)?.permissions().mode() & 0o7777;
    if mode & 0o077 != 0 {
        return Err(format!("{}: its mode is {mode:04o}; only its owner may have access (chmod 600)", path.display()));
    }
    match text.lines().map(str::trim).find(|it| !it.is_empty()) {
        Some(token) if token.chars().all(|it| it.is_ascii_graphic()) => Ok(token.to_owned()),
        _ => Err(format!("{}: holds no token, expected one line of printable characters", path.display())),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn system(pid: u32) -> Running {
        Running {
            pid,
            connect: String::new(),
            http: format!("http://127.0.0.1:{pid}"),
            token: format!("of {pid}"),
            vehicle: format!("uav{pid}"),
            config: "kittiwake.toml".into(),
            ca: None,
        }
    }

    /// `expected`: the gateway's address, the token and the vehicle; or the exit code and a part of the message.
    #[track_caller]
    fn check(args: GatewayArgs, variable: Option<&str>, running: &[u32], expected: Result<&str, (u8, &str)>) {
        let running = running.iter().map(|it| system(*it)).collect();
        match (choose(&args, variable.map(str::to_owned), running), expected) {
            (Ok(it), Ok(text)) => assert_eq!(format!("{} `{}` {:?}", it.url, it.token, it.vehicle), text),
            (Err(it), Err((code, part))) => {
                assert_eq!(u8::from(it.outcome), code);
                assert!(it.why.contains(part), "{}", it.why);
            }
            (found, expected) => panic!("found {found:?}, expected {expected:?}"),
        }
    }

    #[test]
    fn the_gateway_is_the_one_named_or_the_only_one() {
        let none = GatewayArgs::default;
        let url = |it: &str| GatewayArgs { url: Some(it.into()), ..none() };
        let named = |it: &str| GatewayArgs { vehicle: Some(it.parse().unwrap()), ..none() };
        let first = "http://127.0.0.1:1 `of 1` Some(\"uav1\")";
        check(none(), None, &[1], Ok(first));
        check(url("http://127.0.0.1:1/"), None, &[1, 2], Ok(first));
        check(named("uav1"), None, &[1, 2], Ok(first));
        check(GatewayArgs { pid: Some(1), ..none() }, Some("http://far"), &[1, 2], Ok(first));
        check(url("https://far"), None, &[1], Ok("https://far `` None"));
        check(none(), Some("https://far"), &[1], Ok("https://far `` None"));
        check(none(), None, &[], Err((5, "no system runs here")));
        check(none(), None, &[1, 2], Err((2, "--pid 2  uav2  --url http://127.0.0.1:2")));
        check(named("uav3"), None, &[1], Err((2, "no such system runs here")));
    }

    #[test]
    fn command_is_taken_only_from_nobody_or_from_a_holder_who_offers_it() {
        #[track_caller]
        fn check(command: &str, hand_over: bool, expected: Result<(), &str>) {
            let refusal = judge(409, &format!(r#"{{"detail":"no","command":{command}}}"#)).unwrap_err();
            let found = may_take_command(&refusal, hand_over).map_err(|it| it.why);
            assert_eq!(found, expected.map_err(str::to_owned));
        }
        check("{}", false, Ok(()));
        let advice = Err("no; anna can offer command with `kittiwake vehicle hand-over NAME`");
        check(r#"{"holder":"anna"}"#, false, advice);
        check(r#"{"holder":"anna"}"#, true, advice);
        let offered = Err("no; command is offered to ben, who takes it with --hand-over");
        check(r#"{"holder":"anna","offeredTo":"ben"}"#, false, offered);
        check(r#"{"holder":"anna","offeredTo":"ben"}"#, true, Ok(()));
    }

    /// Answers each connection with the next of `answers`, each a status and a body; an empty one breaks the connection off instead.
    /// Returns where, and the requests that were read until the answers were used up.
    fn fake(answers: &'static [&'static str]) -> (Url, std::thread::JoinHandle<Vec<String>>) {
        use std::io::{BufRead, BufReader, Write};
        let listener = std::net::TcpListener::bind("127.0.0.1:0").unwrap();
        let url = parse(&format!("http://{}", listener.local_addr().unwrap())).unwrap();
        let serve = move || {
            let each = answers.iter().map(|answer| {
                let (mut stream, _) = listener.accept().unwrap();
                let reader = BufReader::new(stream.try_clone().unwrap());
                let head: Vec<_> = reader.lines().map(Result::unwrap).take_while(|it| !it.is_empty()).collect();
                if let Some((status, body)) = answer.split_once(' ') {
                    let length = body.len();
                    let head =
                        format!("HTTP/1.1 {status} said\r\nContent-Length: {length}\r\nConnection: close\r\n\r\n");
                    stream.write_all(format!("{head}{body}").as_bytes()).unwrap();
                }
                head[0].clone()
            });
            each.collect()
        };
        (url, std::thread::spawn(serve))
    }

    fn gateway_at(url: Url) -> Gateway {
        // Fails if another test was quicker.
        let _ = rustls::crypto::ring::default_provider().install_default();
        let client = client(&url, "", None, Some(ANSWER_LIMIT)).unwrap();
        Gateway { client, url, token: String::new(), ca: None, vehicle: None, hand_over: false }
    }

    const FLEET: &str = r#"200 {"vehicles":[{"vehicle":"uav1"}]}"#;
    const DONE: &str = r#"200 {"text":"done"}"#;
    const UNKNOWN: &str = r#"503 {"type":"urn:kittiwake:problem:outcome-unknown","detail":"no answer"}"#;
    const NOTHING_DONE: &str = r#"503 {"type":"urn:kittiwake:problem:unavailable","detail":"too many"}"#;
    const BROKEN_OFF: &str = "";

    #[test]
    fn a_decision_that_may_have_been_carried_out_is_not_repeated() {
        for uncertain in [
            &[FLEET, UNKNOWN][..],
            &[FLEET, BROKEN_OFF],
            &[FLEET, "502 <html>"],
            &[FLEET, "500 {}"],
            &[FLEET, NOTHING_DONE, UNKNOWN],
        ] {
            let (url, requests) = fake(uncertain);
            let refused = gateway_at(url).decide(&["harbour", "decision"], None).unwrap_err();
            assert_eq!(u8::from(refused.outcome), 5);
            assert!(
                refused.why.contains("look at `kittiwake permission list` before you decide again"),
                "{}",
                refused.why
            );
            let sent = requests.join().unwrap();
            assert_eq!(sent.last().unwrap(), "POST /api/v1/vehicles/uav1/permissions/harbour/decision HTTP/1.1");
        }
    }

    #[test]
    fn a_request_is_repeated_where_a_second_time_does_no_harm() {
        let (url, requests) = fake(&[FLEET, NOTHING_DONE, NOTHING_DONE, DONE]);
        let done = gateway_at(url).decide(&["accept-loss"], None).unwrap();
        assert_eq!((done["text"].as_str(), requests.join().unwrap().len()), (Some("done"), 4));
        let (url, requests) = fake(&[FLEET, UNKNOWN, BROKEN_OFF, "502 <html>", DONE]);
        let done = gateway_at(url).order(Method::POST, &["pause"], None).unwrap();
        assert_eq!((done["text"].as_str(), requests.join().unwrap().len()), (Some("done"), 5));
    }

    #[test]
    fn a_token_file_that_others_may_read_is_refused() {
        use std::os::unix::fs::PermissionsExt;
        let path = std::env::temp_dir().join(format!("kittiwake-token-{}", std::process::id()));
        let read = |text: &str, mode| {
            std::fs::write(&path, text).unwrap();
            std::fs::set_permissions(&path, std::fs::Permissions::from_mode(mode)).unwrap();
            read_token(&path)
        };
        let found = [read("secret\n", 0o600), read("", 0o600), read("sec ret", 0o600), read("secret", 0o604)];
        std::fs::remove_file(&path).unwrap();
        assert_eq!(found[0], Ok("secret".into()));
        for (said, part) in found[1..].iter().zip(["holds no token", "holds no token", "its mode is 0604"]) {
            assert!(said.as_ref().unwrap_err().contains(part), "{said:?}");
        }
    }
}
