//! A headless Chromium and its driver.

use std::env;
use std::future::Future;
use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};
use std::sync::{Mutex, PoisonError};

use anyhow::{bail, Context, Result};
use fantoccini::wd::{Capabilities, WebDriverCompatibleCommand};
use fantoccini::{Client, ClientBuilder};
use hyper_util::client::legacy::connect::HttpConnector;
use serde_json::{json, Value};
use tempfile::TempDir;

use super::page::LIMIT;
use crate::running::Running;

/// Names the browser; then a test without it is a failure.
const NAMED: &str = "TXT_BROWSER";
const BROWSERS: [&str; 4] =
    ["chromium", "chromium-browser", "google-chrome", "google-chrome-stable"];
const DRIVERS: [&str; 2] = ["chromedriver", "chromium.chromedriver"];

struct Installed {
    browser: PathBuf,
    driver: PathBuf,
}

fn in_path(names: &[&str]) -> Option<PathBuf> {
    let path = env::var_os("PATH")?;
    let folders: Vec<_> = env::split_paths(&path).collect();
    names
        .iter()
        .flat_map(|name| folders.iter().map(move |folder| folder.join(name)))
        .find(|file| file.is_file())
}

/// What to use, or `None` if there is no browser and none is asked for.
fn installed() -> Result<Option<Installed>> {
    let named = env::var_os(NAMED).map(PathBuf::from);
    let driver = in_path(&DRIVERS);
    if let Some(browser) = named {
        if !browser.is_file() {
            bail!("{NAMED} names {}, which is not a file", browser.display());
        }
        let driver = driver.context("there is no chromedriver in the PATH")?;
        return Ok(Some(Installed { browser, driver }));
    }
    Ok(in_path(&BROWSERS).zip(driver).map(|(browser, driver)| Installed { browser, driver }))
}

/// How often the driver is started until it serves.
const STARTS: usize = 5;

/// One browser at a time: a page that the computer leaves alone for a second loses control, as it should.
static BROWSER: Mutex<()> = Mutex::new(());

/// Runs a test in a browser of its own, which is ended whatever comes of it.
pub(crate) fn browse<F: Future<Output = Result<()>>>(test: impl FnOnce(Client) -> F) -> Result<()> {
    let Some(installed) = installed()? else {
        eprintln!("skipped: no Chromium with its chromedriver was found (Debian: chromium, chromium-driver)");
        return Ok(());
    };
    let _only = BROWSER.lock().unwrap_or_else(PoisonError::into_inner);
    let runtime = tokio::runtime::Builder::new_current_thread().enable_all().build()?;
    let driver = Driver::start(&installed.driver)?;
    runtime.block_on(async {
        let client = driver.client(&installed.browser).await?;
        let tested = test(client.clone()).await;
        let closed = client.close().await;
        tested?;
        Ok(closed?)
    })
}

struct Driver {
    _running: Running,
    port: u16,
    /// Where both leave their temporary files, removed after them.
    _folder: TempDir,
}

impl Driver {
    /// It ends at once when another program has the port that it finds, as that of IPv6: then it is started again.
    fn start(program: &Path) -> Result<Self> {
        for _ in 0..STARTS {
            if let Some(driver) = Self::start_once(program)? {
                return Ok(driver);
            }
        }
        bail!("{} ends without a port", program.display())
    }

    fn start_once(program: &Path) -> Result<Option<Self>> {
        let folder = tempfile::tempdir()?;
        let mut command = Command::new(program);
        // The variables of Unix and Windows.
        command.envs(["TMPDIR", "TMP", "TEMP"].map(|name| (name, folder.path())));
        let running = Running::start(command.arg("--port=0").stderr(Stdio::null()));
        while let Some(line) = running.line_if_any() {
            if let Some((_, port)) = line.split_once("started successfully on port ") {
                let port = port.trim().trim_end_matches('.').parse()?;
                return Ok(Some(Self { _running: running, port, _folder: folder }));
            }
        }
        Ok(None)
    }

    async fn client(&self, browser: &Path) -> Result<Client> {
        let args = [
            "--headless=new",
            // For a test that runs as root, as in a container.
            "--no-sandbox",
            "--disable-gpu",
            "--hide-scrollbars",
            "--disable-dev-shm-usage",
            "--lang=en-US",
            "--window-size=1280,900",
            // Nothing is loaded from elsewhere.
            "--host-resolver-rules=MAP * ~NOTFOUND, EXCLUDE 127.0.0.1",
            // A page behind another one lives on as one beside it.
            "--disable-background-timer-throttling",
            "--disable-renderer-backgrounding",
            "--disable-backgrounding-occluded-windows",
        ];
        let Value::Object(capabilities) = json!({
            "browserName": "chrome",
            "goog:chromeOptions": { "binary": browser, "args": args },
            "goog:loggingPrefs": { "browser": "ALL" },
            "timeouts": { "script": LIMIT.as_millis() },
        }) else {
            unreachable!("it is written as an object above");
        };
        let capabilities: Capabilities = capabilities;
        let address = format!("http://127.0.0.1:{}", self.port);
        Ok(ClientBuilder::new(HttpConnector::new())
            .capabilities(capabilities)
            .connect(&address)
            .await?)
    }
}

/// A command of chromedriver beyond the WebDriver standard.
#[derive(Debug)]
pub(crate) struct Beyond {
    path: &'static str,
    body: Value,
}

impl Beyond {
    /// The messages of the console since the last call.
    pub(crate) fn console() -> Self {
        Self { path: "se/log", body: json!({ "type": "browser" }) }
    }

    /// A command of the browser's own protocol.
    pub(crate) fn browser(command: &str, params: Value) -> Self {
        Self { path: "goog/cdp/execute", body: json!({ "cmd": command, "params": params }) }
    }
}

impl WebDriverCompatibleCommand for Beyond {
    fn endpoint(
        &self,
        base: &url::Url,
        session: Option<&str>,
    ) -> Result<url::Url, url::ParseError> {
        base.join(&format!("session/{}/{}", session.unwrap_or_default(), self.path))
    }

    fn method_and_body(&self, _: &url::Url) -> (http::Method, Option<String>) {
        (http::Method::POST, Some(self.body.to_string()))
    }
}
