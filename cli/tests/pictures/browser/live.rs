//! A live run in a real browser: a pull, a reload, and the record.

use super::driver::Browser;
use super::pages::{Pages, tumble};
use crate::ROOT;
use std::io::{BufRead as _, BufReader};
use std::process::{Command, Stdio};

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

#[test]
#[ignore = "a browser"]
fn a_body_is_thrown_in_a_live_run_and_the_record_is_verified() {
    let directory = tempfile::tempdir().unwrap();
    let out = directory.path().join("out");
    let mut child = Command::new(env!("CARGO_BIN_EXE_tumble"))
        .args(["run", &format!("{ROOT}/scenarios/stack.toml"), "--live", "--out"])
        .arg(&out)
        .stdout(Stdio::piped())
        .spawn()
        .unwrap();
    let mut url = String::new();
    BufReader::new(child.stdout.as_mut().unwrap()).read_line(&mut url).unwrap();

    let browser = Browser::start(1280, 800);
    let is_ready = "document.getElementById('clock')?.textContent.startsWith('t =')";
    browser.open_url(url.trim());
    browser.wait_for(is_ready);
    let from = browser.place(".stage canvas", 0.5, 0.5);
    browser.drag("mouse", &[[from, (from.0 + 150.0, from.1 - 20.0)]]);
    browser.wait_for("Number(document.getElementById('index').textContent) > 20");
    browser.click("#play");
    browser.wait_for("!document.querySelector('.holding')");
    browser.screenshot("live-thrown");
    let clock = "return document.getElementById('clock').textContent";
    let before = browser.run(clock);
    browser.open_url(url.trim());
    browser.wait_for(is_ready);
    assert_eq!(browser.run(clock), before, "a reloaded page continues");
    assert_eq!(browser.run("return document.getElementById('alert').hidden"), true);
    assert_eq!(browser.console(), [""; 0]);

    let id = child.id().to_string();
    assert!(Command::new("kill").args(["-INT", &id]).status().unwrap().success());
    assert!(child.wait().unwrap().success());
    let run_json = std::fs::read_to_string(out.join("run.json")).unwrap();
    let run_json: serde_json::Value = serde_json::from_str(&run_json).unwrap();
    let bodies = run_json["model"]["bodies"].as_array().unwrap();
    assert!(bodies.iter().any(|body| !body["load"].is_null()), "the pull is a load");
    tumble(&["verify", out.join("states.csv").to_str().unwrap()], 0);
}
