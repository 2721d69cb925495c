//! The program `txt panel`, and its page in a browser.

use std::path::Path;
use std::process::Command;
use std::time::{Duration, Instant};

use anyhow::{bail, ensure, Context, Result};
use fantoccini::actions::{
    InputSource, KeyAction, KeyActions, MouseActions, PointerAction, MOUSE_BUTTON_LEFT,
};
use fantoccini::elements::Element;
use fantoccini::key::Key;
use fantoccini::Client;
use serde_json::{json, Value};

use super::driver::Beyond;
use crate::running::Running;

/// How long anything may take, also on a computer with many other things to do. Only a test that fails waits so long.
pub(crate) const LIMIT: Duration = Duration::from_secs(120);
const PAUSE: Duration = Duration::from_millis(10);

/// A running `txt panel`.
pub(crate) struct Panel {
    running: Running,
    pub(crate) url: String,
}

impl Panel {
    pub(crate) fn start(args: &[&str]) -> Result<Self> {
        Self::start_in(Path::new("."), args)
    }

    /// The same in this folder.
    pub(crate) fn start_in(folder: &Path, args: &[&str]) -> Result<Self> {
        let mut command = Command::new(env!("CARGO_BIN_EXE_txt"));
        command.args(["panel", "--no-browser"]).args(args).current_dir(folder);
        let running = Running::start(&mut command);
        let url = running.line();
        ensure!(url.starts_with("http://127.0.0.1:"), "instead of an address: {url:?}");
        Ok(Self { running, url })
    }

    /// `txt watch` before this controller, and the address for a program.
    pub(crate) fn watching(controller: &str, args: &[&str]) -> Result<(Self, String)> {
        let mut command = Command::new(env!("CARGO_BIN_EXE_txt"));
        command.args(["watch", controller, "--port", "0", "--no-browser"]);
        let running = Running::start(command.args(args));
        let main = running.line();
        let address = main.strip_prefix("main ").context("no main port")?.to_owned();
        let mut lines = std::iter::repeat_with(|| running.line());
        let url = lines.find_map(|line| line.strip_prefix("page ").map(str::to_owned));
        let url = url.context("no page")?;
        Ok((Self { running, url }, address))
    }

    /// Sends it a signal, such as STOP.
    pub(crate) fn signal(&self, signal: &str) {
        self.running.signal(signal);
    }

    /// A page that shows simulated TXTs with this world, and the address for a program that drives the first one.
    pub(crate) fn shown(world: &str) -> Result<(Self, String)> {
        let mut command = Command::new(env!("CARGO_BIN_EXE_txt"));
        command.args(["simulate", "--port", "0", "--world", world, "--show", "--no-browser"]);
        let running = Running::start(&mut command);
        // With several, each line begins with a name.
        let main = running.line();
        let address = main.split_once("main ").context("no main port")?.1.to_owned();
        let mut lines = std::iter::repeat_with(|| running.line());
        let url = lines.find_map(|line| line.strip_prefix("page ").map(str::to_owned));
        let url = url.context("no page")?;
        Ok((Self { running, url }, address))
    }
}

/// A running `txt lesson`.
pub(crate) struct Lesson {
    running: Running,
    pub(crate) url: String,
    /// Where programs connect to.
    pub(crate) program: String,
}

impl Lesson {
    pub(crate) fn start() -> Result<Self> {
        let mut command = Command::new(env!("CARGO_BIN_EXE_txt"));
        command.args(["lesson", "--port", "0", "--no-browser"]);
        let running = Running::start(&mut command);
        let line = |name: &str| {
            let line = running.line();
            line.strip_prefix(name).map(str::to_owned).with_context(|| format!("no {name}"))
        };
        let (program, url) = (line("program ")?, line("page ")?);
        Ok(Self { running, url, program })
    }

    /// Sends it a signal, such as STOP.
    pub(crate) fn signal(&self, signal: &str) {
        self.running.signal(signal);
    }
}

/// The page that the browser shows at present.
pub(crate) struct Page {
    pub(crate) client: Client,
}

impl Page {
    /// Opens the panel's page and waits until it shows values.
    pub(crate) async fn open(client: &Client, panel: &Panel) -> Result<Self> {
        let page = Self { client: client.clone() };
        // What the page before says when its panel is gone is not this one's.
        client.goto("about:blank").await?;
        page.console().await?;
        client.goto(&panel.url).await?;
        page.wait_for("[data-phase=running] .board .input").await?;
        Ok(page)
    }

    /// Waits until something matches this selector.
    pub(crate) async fn wait_for(&self, selector: &str) -> Result<()> {
        self.wait_with(selector, |_| true).await
    }

    /// Waits until the text of what matches the selector is as wanted.
    pub(crate) async fn wait_for_text(&self, selector: &str, wanted: &str) -> Result<()> {
        let waited = self.wait_with(selector, |text| text.contains(wanted)).await;
        waited.with_context(|| format!("{wanted:?} is not to be read"))
    }

    async fn wait_with(&self, selector: &str, fits: impl Fn(&str) -> bool) -> Result<()> {
        let script = "return document.querySelector(arguments[0])?.textContent ?? null";
        self.wait_for_value(script, selector, |text| text.as_str().is_some_and(&fits)).await?;
        Ok(())
    }

    /// Runs a script again and again with the selector, until its value fits.
    pub(crate) async fn wait_for_value(
        &self,
        script: &str,
        selector: &str,
        fits: impl Fn(&Value) -> bool,
    ) -> Result<Value> {
        let begin = Instant::now();
        while begin.elapsed() < LIMIT {
            let value = self.run(script, json!(selector)).await?;
            if fits(&value) {
                return Ok(value);
            }
            tokio::time::sleep(PAUSE).await;
        }
        bail!("{selector} did not come; the console says {:?}", self.console().await?)
    }

    /// Runs a script in the page.
    pub(crate) async fn run(&self, script: &str, argument: Value) -> Result<Value> {
        Ok(self.client.execute(script, vec![argument]).await?)
    }

    /// Waits as a person does, until an element is to be seen and is not grey, and scrolls to it.
    async fn reveal(&self, selector: &str) -> Result<Element> {
        let script = "const element = document.querySelector(arguments[0]);
            if (!element?.checkVisibility() || element.matches(':disabled')) return null;
            element.scrollIntoView({ block: 'center' });
            return element";
        let found = self.wait_for_value(script, selector, |found| !found.is_null()).await?;
        let id = found.as_object().and_then(|found| found.values().next()?.as_str());
        let id = id.with_context(|| format!("{selector} is gone"))?.to_owned();
        Ok(Element::from_element_id(self.client.clone(), id.into()))
    }

    pub(crate) async fn click(&self, selector: &str) -> Result<()> {
        loop {
            match self.reveal(selector).await?.click().await {
                // The page has replaced it between two commands, as when an extension appears.
                Err(error) if error.is_stale_element_reference() => {}
                clicked => return Ok(clicked?),
            }
        }
    }

    /// Presses the mouse on an element. It stays pressed until `release_mouse`.
    pub(crate) async fn press_mouse(&self, selector: &str) -> Result<()> {
        let element = self.reveal(selector).await?;
        let mouse = MouseActions::new("mouse".to_owned())
            .then(PointerAction::MoveToElement { element, duration: None, x: 0.0, y: 0.0 })
            .then(PointerAction::Down { button: MOUSE_BUTTON_LEFT });
        Ok(self.client.perform_actions(mouse).await?)
    }

    pub(crate) async fn release_mouse(&self) -> Result<()> {
        let mouse = MouseActions::new("mouse".to_owned())
            .then(PointerAction::Up { button: MOUSE_BUTTON_LEFT });
        Ok(self.client.perform_actions(mouse).await?)
    }

    pub(crate) async fn hold_key(&self, key: char) -> Result<()> {
        let keys = KeyActions::new("keys".to_owned()).then(KeyAction::Down { value: key });
        Ok(self.client.perform_actions(keys).await?)
    }

    pub(crate) async fn release_key(&self, key: char) -> Result<()> {
        let keys = KeyActions::new("keys".to_owned()).then(KeyAction::Up { value: key });
        Ok(self.client.perform_actions(keys).await?)
    }

    pub(crate) async fn type_key(&self, key: Key) -> Result<()> {
        let key = char::from(key);
        self.hold_key(key).await?;
        self.release_key(key).await
    }

    /// Moves the keyboard's focus by the Tab key, as a user without a mouse.
    pub(crate) async fn tab_to(&self, from: &str, selector: &str) -> Result<()> {
        self.run("document.querySelector(arguments[0]).focus()", json!(from)).await?;
        for _ in 0..10 {
            self.type_key(Key::Tab).await?;
            let there = self
                .run("return document.activeElement.matches(arguments[0])", json!(selector))
                .await?;
            if there == json!(true) {
                return Ok(());
            }
        }
        bail!("the Tab key does not reach {selector}")
    }

    /// Makes the screen as large as this, like a phone's if it is narrow.
    pub(crate) async fn resize(&self, width: u32, height: u32) -> Result<()> {
        let params = json!({ "width": width, "height": height, "deviceScaleFactor": 1, "mobile": width < 500 });
        self.client
            .issue_cmd(Beyond::browser("Emulation.setDeviceMetricsOverride", params))
            .await?;
        Ok(())
    }

    /// Switches between "light" and "dark".
    pub(crate) async fn prefer(&self, scheme: &str) -> Result<()> {
        let params = json!({ "features": [{ "name": "prefers-color-scheme", "value": scheme }] });
        self.client.issue_cmd(Beyond::browser("Emulation.setEmulatedMedia", params)).await?;
        Ok(())
    }

    /// What the console has said since the last call, warnings and errors.
    pub(crate) async fn console(&self) -> Result<Vec<String>> {
        let said = self.client.issue_cmd(Beyond::console()).await?;
        let said = said.as_array().context("the console's messages are not a list")?;
        let loud =
            said.iter().filter(|one| matches!(one["level"].as_str(), Some("SEVERE" | "WARNING")));
        Ok(loud.map(|one| one["message"].to_string()).collect())
    }

    /// The page tells its user nothing, unless the computer was too busy for a page that drives.
    pub(crate) async fn ensure_not_told(&self) -> Result<()> {
        let script = "const texts = [...document.querySelectorAll('.toast')].map((toast) => toast.textContent);
            return texts.filter((text) => !text.includes('heard nothing from this page for a second'))";
        let reported = self.run(script, json!(null)).await?;
        ensure!(reported == json!([]), "the page tells its user {reported}");
        Ok(())
    }

    pub(crate) async fn ensure_no_console_errors(&self) -> Result<()> {
        let said = self.console().await?;
        ensure!(said.is_empty(), "the console says {said:#?}");
        Ok(())
    }
}
