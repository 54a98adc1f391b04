//! A headless browser, driven over WebDriver.

use std::fmt;
use std::io::{BufRead, BufReader};
use std::path::PathBuf;
use std::process::{Child, Command, Stdio};

use fantoccini::actions::{InputSource, KeyAction, KeyActions, MOUSE_BUTTON_LEFT, MouseActions, PointerAction};
use fantoccini::error::{CmdError, ErrorStatus};
use fantoccini::wd::WebDriverCompatibleCommand;
use fantoccini::{Client, ClientBuilder, Locator};
use hyper_util::client::legacy::connect::HttpConnector;
use serde_json::{Value, json};
use tokio::runtime::Runtime;

use super::seats::Seat;
use super::{System, wait_for};

/// Keys of WebDriver.
pub const TAB: &str = "\u{e004}";
pub const ENTER: &str = "\u{e007}";
pub const ESCAPE: &str = "\u{e00c}";
/// Gives an order that was not answered once more.
const AGAIN: &str = "#again";
/// More than the number of elements of the page that can have the focus.
const MAX_TABS: usize = 80;

/// Chromium with one page. It ends with the value.
pub struct Browser {
    runtime: Runtime,
    client: Client,
    driver: Child,
    /// Freed last.
    _seat: Seat,
}

impl Browser {
    /// Without a page yet. Tests that need one are ignored unless they are asked for.
    pub fn start() -> Browser {
        let seat = Seat::take();
        let started = Command::new("chromedriver").arg("--port=0").stdout(Stdio::piped()).stderr(Stdio::null()).spawn();
        let mut driver = started.expect("chromedriver can be started: install chromium and chromedriver");
        let stdout = driver.stdout.take().expect("its output is read");
        let mut lines = BufReader::new(stdout).lines().map_while(Result::ok);
        let port =
            lines.find_map(|it| it.split("successfully on port ").nth(1)?.trim_end_matches('.').parse::<u16>().ok());
        let port = port.expect("chromedriver prints its port");
        // Read on, so that chromedriver does not block.
        std::thread::spawn(move || lines.for_each(drop));
        let runtime = Runtime::new().expect("a runtime can be made");
        let capabilities = json!({
            "goog:loggingPrefs": { "browser": "ALL" },
            "goog:chromeOptions": { "args": ["--headless=new", "--no-sandbox", "--disable-gpu", "--disable-dev-shm-usage", "--hide-scrollbars"] },
        });
        let Value::Object(capabilities) = capabilities else { unreachable!("it is written as an object") };
        let client = runtime.block_on(async {
            let client = ClientBuilder::new(HttpConnector::new())
                .capabilities(capabilities)
                .connect(&format!("http://127.0.0.1:{port}"))
                .await;
            client.expect("chromium starts")
        });
        let browser = Browser { runtime, client, driver, _seat: seat };
        browser.size(1440, 900);
        browser
    }

    /// Opens a page.
    #[track_caller]
    pub fn visit(&self, url: &str) {
        self.runtime.block_on(self.client.goto(url)).expect("the page can be opened");
        // All panels, where there are any.
        let all = "const it = document.getElementById('layout'); if (it) { it.value = 'engineer'; it.dispatchEvent(new Event('change')) }";
        self.run(all, vec![]);
    }

    /// The text of the first element that matches; `None` if none is visible.
    pub fn text(&self, selector: &str) -> Option<String> {
        let script =
            "const it = document.querySelector(arguments[0]); return it && it.checkVisibility() ? it.innerText : null";
        self.run(script, vec![json!(selector)]).as_str().map(str::to_owned)
    }

    /// Waits until an element that matches is visible with `part` in its text. As long as the page offers to try an order again, since a
    /// busy machine has not answered it in time, that is what an operator does.
    #[track_caller]
    pub fn wait_for(&self, selector: &str, part: &str) -> String {
        wait_for(&Sought { browser: self, selector, part }, || {
            let found = self.text(selector).filter(|it| it.contains(part));
            if found.is_none() && self.text(AGAIN).is_some() {
                self.click(AGAIN);
            }
            found
        })
    }

    /// Clicks what an operator could click: visible, enabled and not covered. A click that misses, since an update of the page has
    /// moved or disabled the element in the meantime, is seen to do nothing, and is done again.
    #[track_caller]
    pub fn click(&self, selector: &str) {
        let enabled = format!("{selector}:not(:disabled)");
        let watch = "const [selector] = arguments; window.hasArrived = false; document.addEventListener('click', \
                     (it) => { window.hasArrived = it.target.closest(selector) !== null }, { capture: true, once: true })";
        // It is gone with the page that the click has left.
        let has_arrived = "return window.hasArrived ?? true";
        wait_for(&format!("`{selector}` to be clicked"), || {
            self.text(&enabled)?;
            self.run(watch, vec![json!(selector)]);
            let click = async { self.client.find(Locator::Css(selector)).await?.click().await };
            match self.runtime.block_on(click) {
                Ok(()) => self.run(has_arrived, vec![]).as_bool().filter(|it| *it),
                Err(CmdError::Standard(it)) if it.error == ErrorStatus::ElementClickIntercepted => None,
                Err(error) => panic!("{selector}: {error}"),
            }
        });
    }

    /// Takes command of the selected vehicle.
    #[track_caller]
    pub fn take_command(&self) {
        self.click("#take-command");
        self.wait_for("#take-command", "Release");
    }

    /// Clicks at an offset, right and down, in pixels from the middle of an element.
    #[track_caller]
    pub fn click_off(&self, selector: &str, x: i64, y: i64) {
        let click = async {
            let element = self.client.find(Locator::Css(selector)).await?;
            let mouse = MouseActions::new("mouse".into())
                .then(PointerAction::MoveToElement { element, duration: None, x: x as f64, y: y as f64 })
                .then(PointerAction::Down { button: MOUSE_BUTTON_LEFT })
                .then(PointerAction::Up { button: MOUSE_BUTTON_LEFT });
            self.client.perform_actions(mouse).await
        };
        self.runtime.block_on(click).unwrap_or_else(|error| panic!("{selector}: {error}"));
    }

    /// Presses at one offset from the middle of an element, moves to another one, and lets go. Equal offsets only move there.
    #[track_caller]
    pub fn drag(&self, selector: &str, from: (f64, f64), to: (f64, f64)) {
        let drag = async {
            let at = |element, (x, y)| PointerAction::MoveToElement { element, duration: None, x, y };
            let element = self.client.find(Locator::Css(selector)).await?;
            let mut mouse = MouseActions::new("mouse".into()).then(at(element.clone(), from));
            if from != to {
                mouse = mouse.then(PointerAction::Down { button: MOUSE_BUTTON_LEFT }).then(at(element, to));
                mouse = mouse.then(PointerAction::Up { button: MOUSE_BUTTON_LEFT });
            }
            self.client.perform_actions(mouse).await
        };
        self.runtime.block_on(drag).unwrap_or_else(|error| panic!("{selector}: {error}"));
    }

    /// Types into the element that has the focus.
    #[track_caller]
    pub fn type_keys(&self, keys: &str) {
        let press = |all: KeyActions, value| all.then(KeyAction::Down { value }).then(KeyAction::Up { value });
        let actions = keys.chars().fold(KeyActions::new("keys".into()), press);
        let typed = self.runtime.block_on(self.client.perform_actions(actions));
        typed.unwrap_or_else(|error| panic!("{keys:?}: {error}"));
    }

    /// Presses Tab until the element with this id has the focus: it can be reached without a mouse.
    #[track_caller]
    pub fn tab_to(&self, id: &str) {
        for _ in 0..MAX_TABS {
            if self.run("return document.activeElement.id", vec![]) == id {
                return;
            }
            self.type_keys(TAB);
        }
        panic!("`{id}` is not reached with {MAX_TABS} tabs");
    }

    /// Replaces the text of a field.
    #[track_caller]
    pub fn fill(&self, selector: &str, text: &str) {
        self.wait_for(&format!("{selector}:enabled"), "");
        let script = "const it = document.querySelector(arguments[0]); it.value = arguments[1]; \
                      it.dispatchEvent(new Event('input', { bubbles: true })); it.dispatchEvent(new Event('change'))";
        self.run(script, vec![json!(selector), json!(text)]);
    }

    /// The value of a field.
    #[track_caller]
    pub fn value(&self, selector: &str) -> String {
        let value = self.run("return document.querySelector(arguments[0]).value", vec![json!(selector)]);
        value.as_str().unwrap_or_default().to_owned()
    }

    /// Runs a script in the page.
    #[track_caller]
    pub fn run(&self, script: &str, args: Vec<Value>) -> Value {
        self.runtime.block_on(self.client.execute(script, args)).expect("the script runs")
    }

    /// The vehicle's document, read with the page's own token; null while no gateway answers.
    #[track_caller]
    pub fn document(&self, vehicle: &str) -> Value {
        let script = "return fetch(`/api/v1/vehicles/${arguments[0]}`, \
            { headers: { Authorization: `Bearer ${sessionStorage.getItem('kittiwake.token')}` } }).then((it) => it.json()).catch(() => null)";
        self.run(script, vec![json!(vehicle)])
    }

    /// Sets the size of the viewport.
    pub fn size(&self, width: u32, height: u32) {
        // The window has a frame, although it is headless.
        let frame = |script: &str| self.run(script, vec![]).as_u64().and_then(|it| u32::try_from(it).ok()).unwrap_or(0);
        let (width, height) =
            (width + frame("return outerWidth - innerWidth"), height + frame("return outerHeight - innerHeight"));
        self.runtime.block_on(self.client.set_window_size(width, height)).expect("the window can be sized");
    }

    /// Saves a screenshot for review.
    pub fn picture(&self, name: &str) {
        let folder = PathBuf::from(env!("CARGO_TARGET_TMPDIR")).join("screenshots");
        std::fs::create_dir_all(&folder).expect("the folder can be made");
        let png = self.runtime.block_on(self.client.screenshot()).expect("a screenshot can be taken");
        std::fs::write(folder.join(format!("{name}.png")), png).expect("the screenshot can be written");
    }

    /// Saves screenshots as on a desk and on a tablet, in both themes, and fails where the page is wider than the
    /// viewport.
    #[track_caller]
    pub fn views(&self, name: &str) {
        let choose = "const it = document.getElementById('theme'); it.value = arguments[0]; it.dispatchEvent(new Event('change'))";
        for (place, width, height) in
            [("telephone", 390, 844), ("standing", 820, 1180), ("tablet", 1024, 768), ("desk", 1440, 900)]
        {
            self.size(width, height);
            for theme in ["dark", "light"] {
                self.run(choose, vec![json!(theme)]);
                // Canvases are drawn again a frame after their size has changed.
                let width = || self.run("return document.documentElement.scrollWidth - innerWidth", vec![]);
                let fits = || width().as_i64().filter(|it| *it <= 0);
                wait_for(&format!("{name}, {place}, {theme} not to be too wide"), fits);
                self.picture(&format!("{name}-{place}-{theme}"));
            }
        }
    }

    /// Fails if the page wrote an error to the console. The browser's own notes about answers of the API do not
    /// count: a gateway that is down is part of the stories.
    #[track_caller]
    pub fn expect_no_error(&self) {
        let log = self.runtime.block_on(self.client.issue_cmd(ConsoleLog)).expect("the console can be read");
        let of_the_api =
            |it: &Value| it["source"] == "network" && it["message"].as_str().is_some_and(|it| it.contains("/api/"));
        let errors = log.as_array().into_iter().flatten().filter(|it| it["level"] == "SEVERE" && !of_the_api(it));
        assert_eq!(errors.collect::<Vec<_>>(), Vec::<&Value>::new());
    }
}

/// What is waited for, in words that are asked for once it did not come.
struct Sought<'a> {
    browser: &'a Browser,
    selector: &'a str,
    part: &'a str,
}

impl fmt::Display for Sought<'_> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Sought { browser, selector, part } = self;
        let (found, said) = (browser.text(selector), browser.text("#said"));
        write!(f, "`{part}` in `{selector}`, where it says {found:?}; of the orders it says {said:?}")
    }
}

impl Drop for Browser {
    fn drop(&mut self) {
        let _ = self.runtime.block_on(self.client.clone().close());
        let _ = self.driver.kill();
        let _ = self.driver.wait();
    }
}

/// A system and a browser that shows it. The browser starts first: that takes longer than some missions. Where somebody acts, it flies at
/// real time: what waits for a person must not be over before a browser on a busy machine has shown it.
pub fn watch(args: &[&str]) -> (System, Browser) {
    let browser = Browser::start();
    let system = System::up(args, &[]);
    browser.visit(&system.link());
    (system, browser)
}

/// A command of chromedriver: reads what the page wrote to the console.
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
