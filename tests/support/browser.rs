//! A browser without a window, told what to do over WebDriver.

use std::io::{BufRead, BufReader};
use std::path::PathBuf;
use std::process::{Child, Command, Stdio};

use fantoccini::wd::WebDriverCompatibleCommand;
use fantoccini::{Client, ClientBuilder, Locator};
use hyper_util::client::legacy::connect::HttpConnector;
use serde_json::{Value, json};
use tokio::runtime::Runtime;

use super::wait_for;

/// Chromium with one page open. It ends with the value.
pub struct Browser {
    runtime: Runtime,
    client: Client,
    driver: Child,
}

impl Browser {
    /// `None`, said aloud, where chromium or chromedriver are not installed.
    pub fn open(url: &str) -> Option<Browser> {
        let started = Command::new("chromedriver").arg("--port=0").stdout(Stdio::piped()).stderr(Stdio::null()).spawn();
        let Ok(mut driver) = started else {
            eprintln!("SKIPPED: chromedriver is not installed, the page is not looked at");
            return None;
        };
        let mut lines = BufReader::new(driver.stdout.take()?).lines().map_while(Result::ok);
        let port =
            lines.find_map(|it| it.split("successfully on port ").nth(1)?.trim_end_matches('.').parse::<u16>().ok());
        let port = port.expect("chromedriver tells its port");
        // Read on, lest it blocks.
        std::thread::spawn(move || lines.for_each(drop));
        let runtime = Runtime::new().expect("a runtime can be made");
        let wishes = json!({
            "goog:loggingPrefs": { "browser": "ALL" },
            "goog:chromeOptions": { "args": ["--headless=new", "--no-sandbox", "--disable-gpu", "--disable-dev-shm-usage", "--hide-scrollbars"] },
        });
        let Value::Object(wishes) = wishes else { return None };
        let client = runtime.block_on(async {
            let client = ClientBuilder::new(HttpConnector::new())
                .capabilities(wishes)
                .connect(&format!("http://127.0.0.1:{port}"))
                .await;
            let client = client.expect("chromium starts");
            client.set_window_size(1440, 900).await.expect("the window can be sized");
            client.goto(url).await.expect("the page can be opened");
            client
        });
        Some(Browser { runtime, client, driver })
    }

    /// The text of the first element that matches; `None` if there is none to be seen.
    pub fn text(&self, selector: &str) -> Option<String> {
        let script =
            "const it = document.querySelector(arguments[0]); return it && it.checkVisibility() ? it.innerText : null";
        self.run(script, vec![json!(selector)]).as_str().map(str::to_owned)
    }

    /// Waits until an element that matches is seen with `part` in its text.
    #[track_caller]
    pub fn wait_for(&self, selector: &str, part: &str) -> String {
        let what = format!("`{part}` in `{selector}`");
        wait_for(&what, || self.text(selector).filter(|it| it.contains(part)))
    }

    /// Clicks what an operator could click: visible, enabled and not covered.
    #[track_caller]
    pub fn click(&self, selector: &str) {
        let enabled = format!("{selector}:enabled");
        wait_for(&format!("`{selector}` to be enabled"), || self.text(&enabled));
        let click = async { self.client.find(Locator::Css(selector)).await?.click().await };
        self.runtime.block_on(click).unwrap_or_else(|error| panic!("{selector}: {error}"));
    }

    /// Runs a script in the page.
    #[track_caller]
    pub fn run(&self, script: &str, args: Vec<Value>) -> Value {
        self.runtime.block_on(self.client.execute(script, args)).expect("the script runs")
    }

    /// Sizes the window as a tablet or a screen.
    pub fn size(&self, width: u32, height: u32) {
        self.runtime.block_on(self.client.set_window_size(width, height)).expect("the window can be sized");
    }

    /// Keeps a picture of the page for review.
    pub fn picture(&self, name: &str) {
        let folder = PathBuf::from(env!("CARGO_TARGET_TMPDIR")).join("screenshots");
        std::fs::create_dir_all(&folder).expect("the folder can be made");
        let png = self.runtime.block_on(self.client.screenshot()).expect("a picture can be taken");
        std::fs::write(folder.join(format!("{name}.png")), png).expect("the picture can be written");
    }

    /// Fails if the page wrote an error to the console. What the browser itself notes about an
    /// answer of the API is none: a gateway that is gone is part of the stories.
    #[track_caller]
    pub fn expect_no_error(&self) {
        let log = self.runtime.block_on(self.client.issue_cmd(ConsoleLog)).expect("the console can be read");
        let of_the_api =
            |it: &Value| it["source"] == "network" && it["message"].as_str().is_some_and(|it| it.contains("/api/"));
        let errors = log.as_array().into_iter().flatten().filter(|it| it["level"] == "SEVERE" && !of_the_api(it));
        assert_eq!(errors.collect::<Vec<_>>(), Vec::<&Value>::new());
    }
}

impl Drop for Browser {
    fn drop(&mut self) {
        let _ = self.runtime.block_on(self.client.clone().close());
        let _ = self.driver.kill();
        let _ = self.driver.wait();
    }
}

/// chromedriver's own command: what the page wrote to the console.
#[derive(Debug)]
struct ConsoleLog;

impl WebDriverCompatibleCommand for ConsoleLog {
    fn endpoint(&self, base: &url::Url, session: Option<&str>) -> Result<url::Url, url::ParseError> {
        base.join(&format!("session/{}/se/log", session.unwrap_or_default()))
    }

    fn method_and_body(&self, _: &url::Url) -> (http::Method, Option<String>) {
        (http::Method::POST, Some(json!({ "type": "browser" }).to_string()))
    }
}
