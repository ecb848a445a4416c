//! A live run in a real browser: pulls in one and two windows, a hidden window, the record.

use super::driver::Browser;
use super::pages::{Pages, tumble};
use crate::ROOT;
use serde_json::Value;
use std::io::{BufRead as _, BufReader};
use std::process::{Child, Command, Stdio};
use std::time::Duration;
use tempfile::TempDir;

/// Rows of the page are every tenth step from k = 30 on.
#[test]
#[ignore = "a browser"]
fn a_page_shows_the_command_that_takes_over_from_its_moment() {
    let pages = Pages::new();
    let scene = format!("{ROOT}/scenarios/stack.toml");
    let kept = ["--start-index", "30", "--steps", "101", "--every", "10"];
    let page = pages.simulate("run", &[&["run", &scene], &kept[..]].concat(), 0);
    let browser = Browser::start(1280, 800);
    browser.open_at(&page, "#t=0.1");
    browser.run("document.getElementById('more').open = true");
    browser.click("#takeover");
    browser.settle();
    let command = browser.run("return document.querySelector('#takeover-note code').textContent");
    assert_eq!(command, "tumble run --live --from steps.csv --at 80");
    browser.screenshot("takeover");
    browser.assert_quiet();
}

/// A live run of the tower of ten boxes.
struct Live {
    child: Child,
    directory: TempDir,
    url: String,
}

impl Live {
    fn start() -> Self {
        let directory = tempfile::tempdir().unwrap();
        let mut child = Command::new(env!("CARGO_BIN_EXE_tumble"))
            .args(["run", &format!("{ROOT}/scenarios/stack.toml"), "--live", "--out"])
            .arg(directory.path().join("out"))
            .stdout(Stdio::piped())
            .spawn()
            .unwrap();
        let mut url = String::new();
        BufReader::new(child.stdout.as_mut().unwrap()).read_line(&mut url).unwrap();
        let url = url.trim().to_owned();
        Self { child, directory, url }
    }

    fn open(&self, browser: &Browser) {
        browser.open_url(&self.url);
        browser.wait_for("document.getElementById('clock')?.textContent.startsWith('t =')");
    }

    /// Ends the run by Ctrl-C, verifies it, and returns its run.json.
    fn end(self) -> Value {
        self.end_with(|| {})
    }

    /// Ends the run as [`Live::end`] and makes further checks of its files.
    fn end_with(mut self, check: impl Fn()) -> Value {
        let id = self.child.id().to_string();
        assert!(Command::new("kill").args(["-INT", &id]).status().unwrap().success());
        assert!(self.child.wait().unwrap().success());
        let out = self.directory.path().join("out");
        tumble(&["verify", out.join("states.csv").to_str().unwrap()], 0);
        check();
        let run_json = std::fs::read_to_string(out.join("run.json")).unwrap();
        serde_json::from_str(&run_json).unwrap()
    }
}

impl Drop for Live {
    fn drop(&mut self) {
        let _ = self.child.kill();
        let _ = self.child.wait();
    }
}

fn index(browser: &Browser) -> u64 {
    let text = browser.run("return document.getElementById('index').textContent");
    text.as_str().unwrap().replace('\u{202f}', "").parse().unwrap_or(0)
}

fn pulled_bodies(run_json: &Value) -> usize {
    let bodies = run_json["model"]["bodies"].as_array().unwrap();
    bodies.iter().filter(|body| !body["load"].is_null()).count()
}

#[test]
#[ignore = "a browser"]
fn a_body_is_thrown_in_a_live_run_and_the_record_is_verified() {
    let live = Live::start();
    let browser = Browser::start(1280, 800);
    live.open(&browser);
    let from = browser.place(".stage canvas", 0.5, 0.5);
    browser.drag("mouse", &[[from, (from.0 + 150.0, from.1 - 20.0)]]);
    browser.wait_for("Number(document.getElementById('index').textContent) > 20");
    browser.click("#play");
    browser.wait_for("!document.querySelector('.holding')");
    browser.screenshot("live-thrown");
    let clock = "return document.getElementById('clock').textContent";
    let before = browser.run(clock);
    live.open(&browser);
    assert_eq!(browser.run(clock), before, "a reloaded page continues");
    assert_eq!(browser.run("return document.getElementById('alert').hidden"), true);
    assert_eq!(browser.console(), [""; 0]);
    assert_eq!(pulled_bodies(&live.end()), 1, "the pull is a load");
}

#[test]
#[ignore = "a browser"]
fn two_windows_draw_and_pull_in_one_live_run() {
    let live = Live::start();
    let windows = [Browser::start(1000, 700), Browser::start(1000, 700)];
    windows.iter().for_each(|window| live.open(window));
    let [first, second] = &windows;
    let still = second.pixels(0);
    // The first window runs. The second one is paused and shows the same motion.
    for (window, share) in [(first, 0.5), (second, 0.3)] {
        let from = window.place(".stage canvas", 0.5, share);
        window.drag("mouse", &[[from, (from.0 + 120.0, from.1 - 30.0)]]);
        window.wait_for("!document.querySelector('.holding')");
    }
    let running = |window: &Browser| {
        window.run("return document.getElementById('play').classList.contains('playing')")
    };
    assert_eq!([running(first), running(second)], [true, true], "a pull runs the scene");
    second.click("#play");
    let before = [index(first), index(second)];
    for (window, before) in windows.iter().zip(before) {
        window.wait_for(&format!(
            "Number(document.getElementById('index').textContent.replace('\u{202f}', '')) > {}",
            before + 100
        ));
    }
    assert_ne!(second.pixels(0), still);
    first.click("#play");
    // A change in one window is seen in the other.
    first.run(
        "const slider = document.getElementById('slider-friction'); slider.value = '0.25'; \
         slider.dispatchEvent(new Event('input'))",
    );
    second.wait_for("document.getElementById('slider-friction').value === '0.25'");
    second.wait_for("document.getElementById('notes').textContent.includes('2 parts')");
    first.settle();
    assert_eq!(index(first), index(second));
    first.press(super::RIGHT, None);
    second.wait_for(&format!(
        "document.getElementById('index').textContent.replace('\u{202f}', '') === '{}'",
        index(first)
    ));
    for (window, name) in windows.iter().zip(["first", "second"]) {
        assert_eq!(window.run("return document.getElementById('alert').hidden"), true);
        window.screenshot(&format!("live-{name}-window"));
        assert_eq!(window.console(), [""; 0]);
    }
    let part = live.directory.path().join("out/part-1.toml");
    let run_json = live.end_with(|| {
        let text = std::fs::read_to_string(&part).unwrap();
        assert_eq!(
            text.matches("load = ").count(),
            2,
            "both pulls are in the part before the change"
        );
    });
    assert!(run_json["files"].as_array().unwrap().contains(&Value::from("part-1.toml")));
}

#[test]
#[ignore = "a browser"]
fn hidden_window_of_a_live_run_resumes_without_a_jump() {
    let live = Live::start();
    let browser = Browser::start(1000, 700);
    live.open(&browser);
    browser.click("#play");
    browser.wait_for("Number(document.getElementById('index').textContent) > 20");
    browser.hide();
    let before = index(&browser);
    std::thread::sleep(Duration::from_secs(4));
    browser.unhide();
    browser.settle();
    let after = index(&browser);
    // Pictures owe at most 0.1 s each, and the scene has steps of 2 ms. Four seconds are 2000 steps.
    assert!(after < before + 1000, "{before} {after}");
    browser.wait_for(&format!(
        "Number(document.getElementById('index').textContent.replace('\u{202f}', '')) > {after}"
    ));
    assert_eq!(browser.run("return document.getElementById('alert').hidden"), true);
    assert_eq!(browser.console(), [""; 0]);
    live.end();
}
