//! Headless Chromium, driven by chromedriver with the W3C WebDriver protocol.

use base64::Engine as _;
use serde_json::{Value, json};
use std::fs;
use std::io::{BufRead, BufReader};
use std::path::{Path, PathBuf};
use std::process::{Child, Command, Stdio};
use std::sync::mpsc;
use std::time::{Duration, Instant};
use tempfile::TempDir;

const DRIVER: &str = "/usr/bin/chromedriver";
const BROWSER: &str = "/usr/bin/chromium";
/// Time limit of a driver response and of a condition in the page.
const PATIENCE: Duration = Duration::from_secs(120);

/// Key of an element reference in the protocol.
const ELEMENT: &str = "element-6066-11e4-a52e-4f735466cecf";

/// Flags for a quiet browser without network, as root and with WebGL in software.
const FLAGS: [&str; 10] = [
    "--headless",
    "--no-sandbox",
    "--use-angle=swiftshader",
    "--enable-unsafe-swiftshader",
    "--disable-quic",
    "--no-first-run",
    "--disable-background-networking",
    "--disable-component-update",
    "--disable-sync",
    "--hide-scrollbars",
];

/// Browser with one page, ended when dropped.
pub struct Browser {
    driver: Driver,
    agent: ureq::Agent,
    session: String,
}

/// Process of the driver, killed when dropped.
struct Driver {
    child: Child,
    address: String,
    _profile: TempDir,
}

impl Drop for Driver {
    fn drop(&mut self) {
        let _ = self.child.kill();
        let _ = self.child.wait();
    }
}

impl Drop for Browser {
    fn drop(&mut self) {
        // Ends Chromium. The driver is killed next.
        let url = format!("{}{}", self.driver.address, self.session);
        let _ = self.agent.delete(&url).call();
    }
}

impl Browser {
    /// Starts a browser with a window of `width` by `height` pixels.
    pub fn start(width: u32, height: u32) -> Self {
        Self::start_with(width, height, &[])
    }

    /// Starts a browser without WebGL.
    pub fn without_graphics(width: u32, height: u32) -> Self {
        Self::start_with(width, height, &["--disable-3d-apis"])
    }

    fn start_with(width: u32, height: u32, more: &[&str]) -> Self {
        let profile = tempfile::tempdir().unwrap();
        let mut flags: Vec<String> =
            FLAGS.iter().chain(more).map(|&flag| flag.to_owned()).collect();
        flags.push(format!("--user-data-dir={}", profile.path().display()));
        let driver = Driver::start(profile);
        let config = ureq::Agent::config_builder()
            .timeout_global(Some(PATIENCE))
            .http_status_as_error(false)
            .proxy(None);
        let agent: ureq::Agent = config.build().into();
        // Software rendering may take long while other tests run.
        let wanted = json!({ "capabilities": { "alwaysMatch": {
            "timeouts": { "script": PATIENCE.as_millis() as u64 - 10_000 },
            "goog:chromeOptions": { "binary": BROWSER, "args": flags },
            "goog:loggingPrefs": { "browser": "ALL" },
        } } });
        let mut browser = Self { driver, agent, session: "/session".to_owned() };
        let answer = browser.post("", wanted);
        browser.session = format!("/session/{}", answer["sessionId"].as_str().unwrap());
        browser.resize(width, height, false);
        // Errors that are missing in the driver's console log.
        let heard = "globalThis.raised = []; \
                     addEventListener('error', (event) => globalThis.raised.push(event.message))";
        browser.devtools("Page.addScriptToEvaluateOnNewDocument", json!({ "source": heard }));
        browser
    }

    fn post(&self, command: &str, body: Value) -> Value {
        let url = format!("{}{}{command}", self.driver.address, self.session);
        let request = self.agent.post(&url).header("Content-Type", "application/json");
        let mut response = request.send(body.to_string()).unwrap();
        self.value(command, response.body_mut())
    }

    fn get(&self, command: &str) -> Value {
        let url = format!("{}{}{command}", self.driver.address, self.session);
        let mut response = self.agent.get(&url).call().unwrap();
        self.value(command, response.body_mut())
    }

    fn value(&self, command: &str, body: &mut ureq::Body) -> Value {
        let text = body.with_config().limit(1 << 28).read_to_string().unwrap();
        let mut answer: Value = serde_json::from_str(&text).unwrap();
        let value = answer["value"].take();
        assert!(value["error"].is_null(), "{command}: {} {}", value["error"], value["message"]);
        value
    }

    /// Sends a command of Chrome's DevTools protocol.
    fn devtools(&self, command: &str, parameters: Value) {
        self.post("/goog/cdp/execute", json!({ "cmd": command, "params": parameters }));
    }

    /// Sets the size of the page. A phone has touch input and twice the pixel density.
    pub fn resize(&self, width: u32, height: u32, is_phone: bool) {
        let ratio = if is_phone { 2 } else { 1 };
        let size = json!({
            "width": width, "height": height, "deviceScaleFactor": ratio, "mobile": is_phone,
        });
        self.devtools("Emulation.setDeviceMetricsOverride", size);
        self.devtools("Emulation.setTouchEmulationEnabled", json!({ "enabled": is_phone }));
    }

    /// Sets the colour scheme, `light` or `dark`.
    pub fn colour_scheme(&self, scheme: &str) {
        let features = json!([{ "name": "prefers-color-scheme", "value": scheme }]);
        self.devtools("Emulation.setEmulatedMedia", json!({ "features": features }));
    }

    pub fn open(&self, page: &Path) {
        self.open_at(page, "");
    }

    /// Opens a page with a fragment such as `#t=1`.
    pub fn open_at(&self, page: &Path, fragment: &str) {
        self.open_url(&format!("file://{}{fragment}", page.display()));
    }

    /// Opens the page of an address.
    pub fn open_url(&self, url: &str) {
        self.post("/url", json!({ "url": url }));
        self.settle();
    }

    /// Sets the directory of downloads.
    pub fn save_to(&self, directory: &Path) {
        let wanted =
            json!({ "behavior": "allow", "downloadPath": directory.display().to_string() });
        self.devtools("Browser.setDownloadBehavior", wanted);
    }

    /// Hides the page as another tab in front would: it is told so and gets no more pictures. Headless
    /// Chromium itself shows all tabs.
    pub fn hide(&self) {
        self.run(
            "globalThis.drawLater = requestAnimationFrame; globalThis.held = []; \
             window.requestAnimationFrame = (call) => held.push(call); \
             Object.defineProperty(document, 'hidden', { get: () => true, configurable: true }); \
             document.dispatchEvent(new Event('visibilitychange'))",
        );
    }

    /// Shows the page again.
    pub fn unhide(&self) {
        self.run(
            "delete document.hidden; window.requestAnimationFrame = drawLater; \
             document.dispatchEvent(new Event('visibilitychange')); \
             held.splice(0).forEach((call) => requestAnimationFrame(call))",
        );
    }

    /// Runs a script in the page and returns its value.
    pub fn run(&self, script: &str) -> Value {
        self.post("/execute/sync", json!({ "script": script, "args": [] }))
    }

    /// Waits until the page has painted.
    pub fn settle(&self) {
        let script = "const done = arguments[0]; \
                      requestAnimationFrame(() => requestAnimationFrame(() => done()));";
        self.post("/execute/async", json!({ "script": script, "args": [] }));
    }

    /// Waits until `condition` holds in the page.
    pub fn wait_for(&self, condition: &str) {
        let start = Instant::now();
        while self.run(&format!("return Boolean({condition})")) != true {
            assert!(start.elapsed() < PATIENCE, "never came true: {condition}");
            std::thread::sleep(Duration::from_millis(20));
        }
    }

    /// Clicks the centre of an element with the mouse.
    pub fn click(&self, selector: &str) {
        let found = self.post("/element", json!({ "using": "css selector", "value": selector }));
        let id = found[ELEMENT].as_str().unwrap();
        self.post(&format!("/element/{id}/click"), json!({}));
        self.settle();
    }

    /// Presses and releases a key while `held` is down.
    pub fn press(&self, key: &str, held: Option<&str>) {
        let act = |kind: &str, key: &str| json!({ "type": kind, "value": key });
        let mut actions = vec![act("keyDown", key), act("keyUp", key)];
        if let Some(held) = held {
            actions.insert(0, act("keyDown", held));
            actions.push(act("keyUp", held));
        }
        self.act(json!([{ "type": "key", "id": "keyboard", "actions": actions }]));
    }

    /// Drags pointers of type `mouse` or `touch`, each from one point to another.
    pub fn drag(&self, kind: &str, ways: &[[(f64, f64); 2]]) {
        let pointers = ways.iter().enumerate().map(|(i, [from, to])| {
            let place = |at: &(f64, f64), duration: u32| {
                json!({
                    "type": "pointerMove", "origin": "viewport", "duration": duration,
                    "x": at.0.round() as i64, "y": at.1.round() as i64,
                })
            };
            json!({
                "type": "pointer", "id": format!("{kind}{i}"),
                "parameters": { "pointerType": kind },
                "actions": [
                    place(from, 0), { "type": "pointerDown", "button": 0 }, place(to, 100),
                    { "type": "pointerUp", "button": 0 },
                ],
            })
        });
        self.act(pointers.collect());
    }

    /// Clicks at a point while `held` is down.
    pub fn click_at(&self, at: (f64, f64), held: &str) {
        let pause = || json!({ "type": "pause" });
        let keys = json!([
            { "type": "keyDown", "value": held }, pause(), pause(), { "type": "keyUp", "value": held },
        ]);
        let (x, y) = (at.0.round() as i64, at.1.round() as i64);
        let mouse = json!([
            { "type": "pointerMove", "origin": "viewport", "duration": 0, "x": x, "y": y },
            { "type": "pointerDown", "button": 0 }, { "type": "pointerUp", "button": 0 },
        ]);
        self.act(json!([
            { "type": "key", "id": "keyboard", "actions": keys },
            { "type": "pointer", "id": "mouse", "parameters": { "pointerType": "mouse" },
              "actions": mouse },
        ]));
    }

    /// Turns the mouse wheel at a point.
    pub fn wheel(&self, at: (f64, f64), lines: i32) {
        let scroll = json!({
            "type": "scroll", "origin": "viewport", "duration": 0, "deltaX": 0,
            "deltaY": 100 * lines, "x": at.0.round() as i64, "y": at.1.round() as i64,
        });
        self.act(json!([{ "type": "wheel", "id": "wheel", "actions": [scroll] }]));
    }

    fn act(&self, actions: Value) {
        self.post("/actions", json!({ "actions": actions }));
        self.settle();
    }

    /// Console messages since the last call.
    pub fn console(&self) -> Vec<String> {
        let entries = self.post("/se/log", json!({ "type": "browser" }));
        entries.as_array().unwrap().iter().map(|entry| entry["message"].to_string()).collect()
    }

    /// Saves a screenshot as `target/view-screenshots/NAME.png`.
    pub fn screenshot(&self, name: &str) {
        let tmp = PathBuf::from(env!("CARGO_TARGET_TMPDIR"));
        let directory = tmp.parent().unwrap().join("view-screenshots");
        fs::create_dir_all(&directory).unwrap();
        let text = self.get("/screenshot");
        let engine = base64::engine::general_purpose::STANDARD;
        let bytes = engine.decode(text.as_str().unwrap()).unwrap();
        fs::write(directory.join(format!("{name}.png")), bytes).unwrap();
    }
}

impl Driver {
    /// Starts the driver on a free port that it prints.
    fn start(profile: TempDir) -> Self {
        let mut command = Command::new(DRIVER);
        command.arg("--port=0").stdin(Stdio::null()).stdout(Stdio::piped()).stderr(Stdio::null());
        let mut child = command.spawn().unwrap();
        let stdout = child.stdout.take().unwrap();
        let mut driver = Self { child, address: String::new(), _profile: profile };
        let (sender, receiver) = mpsc::channel();
        // Reads to the end, so that the driver is never blocked on its output.
        std::thread::spawn(move || {
            for line in BufReader::new(stdout).lines().map_while(Result::ok) {
                if let Some((_, port)) = line.split_once("successfully on port ") {
                    let _ = sender.send(port.trim_end_matches('.').to_owned());
                }
            }
        });
        let port = receiver.recv_timeout(PATIENCE).expect("chromedriver says its port");
        driver.address = format!("http://127.0.0.1:{port}");
        driver
    }
}
