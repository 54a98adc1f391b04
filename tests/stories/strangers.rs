//! Commands on a machine with other users, and behind a proxy: the operator's token reaches nobody but the gateway it is for.

use std::io::{BufRead, BufReader, ErrorKind, Write as _};
use std::net::TcpListener;
use std::os::unix::fs::PermissionsExt;
use std::path::Path;
use std::process::{Command, Stdio};

use crate::support::KITTIWAKE;
use crate::support::files::write_private;

/// Nobody may connect to it.
struct Stranger(TcpListener);

impl Stranger {
    fn new() -> Stranger {
        Stranger(TcpListener::bind("127.0.0.1:0").unwrap())
    }

    fn url(&self) -> String {
        format!("http://{}", self.0.local_addr().unwrap())
    }

    #[track_caller]
    fn was_left_alone(&self) {
        self.0.set_nonblocking(true).unwrap();
        assert_eq!(self.0.accept().unwrap_err().kind(), ErrorKind::WouldBlock, "somebody has connected");
    }
}

/// Runs the program with these variables, and no others that concern it; its exit code and what it said. If it waits for an answer from
/// a stranger it is ended.
fn run(line: &str, variables: &[(&str, &str)]) -> (Option<i32>, String) {
    let mut command = Command::new("timeout");
    command.args(["30", KITTIWAKE]).args(line.split(' ')).stdin(Stdio::null());
    for name in ["http_proxy", "HTTP_PROXY", "https_proxy", "all_proxy", "ALL_PROXY", "no_proxy", "NO_PROXY"] {
        command.env_remove(name);
    }
    let output = command.envs(variables.iter().copied()).output().unwrap();
    let said = [output.stdout, output.stderr].map(|it| String::from_utf8(it).unwrap()).concat();
    (output.status.code(), said)
}

/// The place of temporary files, in which somebody has made the folder of this user's running systems, with a run file.
fn temporary_files(url: &str, mode: u32) -> tempfile::TempDir {
    let shared = tempfile::tempdir().unwrap();
    let folder = shared.path().join(format!("kittiwake-{}", nix::unistd::getuid()));
    std::fs::create_dir(&folder).unwrap();
    let pid = std::process::id();
    let run_file = format!(
        r#"{{"pid":{pid},"connect":"tcp/127.0.0.1:1","http":"{url}","token":"","vehicle":"uav1","config":"x","ca":null,"locked":false}}"#
    );
    write_private(&folder.join("1-00c0ffee.json"), &run_file);
    std::fs::set_permissions(&folder, PermissionsExt::from_mode(mode)).unwrap();
    shared
}

#[test]
fn a_strangers_run_file_gets_no_token() {
    #[track_caller]
    fn check(files: &Path, stranger: &Stranger, line: &str, expected: &str) {
        let (code, said) = run(line, &[("TMPDIR", files.to_str().unwrap()), ("KITTIWAKE_TOKEN", "secret")]);
        assert!(code.is_some_and(|it| it == 1 || it == 2 || it == 5), "{line}: {code:?} {said}");
        assert!(said.contains(expected), "{line}: {said}");
        stranger.was_left_alone();
    }
    let stranger = Stranger::new();
    for line in ["status", "vehicle abort"] {
        // Everybody may have put the file there.
        let files = temporary_files(&stranger.url(), 0o777);
        check(files.path(), &stranger, line, "may be entered by others (mode 777): `chmod 700` it");
        // Of this user, but not the gateway that the token is for.
        let files = temporary_files(&stranger.url(), 0o700);
        check(files.path(), &stranger, line, "KITTIWAKE_TOKEN is sent to KITTIWAKE_URL only");
    }
}

#[test]
fn orders_on_this_machine_take_no_proxy() {
    let (proxy, gateway) = (Stranger::new(), TcpListener::bind("127.0.0.1:0").unwrap());
    let url = format!("http://{}", gateway.local_addr().unwrap());
    let serving = std::thread::spawn(move || {
        let (mut stream, _) = gateway.accept().unwrap();
        let lines = BufReader::new(stream.try_clone().unwrap()).lines().map(Result::unwrap);
        let head: Vec<String> = lines.take_while(|it| !it.is_empty()).map(|it| it.to_lowercase()).collect();
        let body = r#"{"vehicles":[]}"#;
        let length = body.len();
        write!(stream, "HTTP/1.1 200 OK\r\nContent-Length: {length}\r\nConnection: close\r\n\r\n{body}").unwrap();
        head
    });
    let through = proxy.url();
    let proxies = ["http_proxy", "https_proxy", "all_proxy"].map(|name| (name, through.as_str()));
    let variables = [&proxies[..], &[("KITTIWAKE_URL", &url), ("KITTIWAKE_TOKEN", "secret")]].concat();
    let (code, said) = run("vehicle list --json", &variables);
    assert_eq!(code, Some(0), "{said}");
    proxy.was_left_alone();
    let head = serving.join().unwrap();
    assert!(head.contains(&"authorization: bearer secret".to_owned()), "{head:?}");
}

#[test]
fn no_token_leaves_the_machine_without_encryption() {
    let proxy = Stranger::new();
    for line in ["vehicle list", "status"] {
        let url = "http://ground.invalid:8080";
        let (code, said) =
            run(line, &[("http_proxy", &proxy.url()), ("KITTIWAKE_URL", url), ("KITTIWAKE_TOKEN", "secret")]);
        assert!(code.is_some_and(|it| it == 1 || it == 2), "{code:?} {said}");
        assert!(said.contains("without encryption, where others could read it: use https://"), "{said}");
    }
    proxy.was_left_alone();
}
