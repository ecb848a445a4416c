//! The playground in a real browser: the bits of the command line, pulls, odd addresses, a phone.

use super::driver::Browser;
use super::pages::tumble;
use super::{HOME, LEFT, RIGHT, SPACE};
use crate::ROOT;
use serde_json::Value;
use std::path::{Path, PathBuf};
use std::process::Command;
use tempfile::TempDir;

/// The page, built once for each test program.
fn page() -> &'static Path {
    static PAGE: std::sync::OnceLock<(TempDir, PathBuf)> = std::sync::OnceLock::new();
    let (_, page) = PAGE.get_or_init(|| {
        let directory = tempfile::tempdir().unwrap();
        let page = directory.path().join("playground.html");
        let script = Path::new(ROOT).join("scripts/playground");
        let output = Command::new(script).arg(&page).output().unwrap();
        assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
        (directory, page)
    });
    page
}

impl Browser {
    fn open_playground(&self, fragment: &str) {
        // Another fragment alone does not load the page anew.
        self.open(Path::new("/dev/null"));
        self.open_at(page(), fragment);
        self.wait_for("document.getElementById('clock')?.textContent.startsWith('t =')");
    }

    fn choose_scene(&self, scene: usize) {
        self.run(&format!(
            "const list = document.getElementById('scene'); list.value = '{scene}'; \
             list.dispatchEvent(new Event('change'))"
        ));
        self.wait_for("document.getElementById('clock').textContent === 't = 0.000 s'");
        self.settle();
    }

    /// Answer of the page's program to a request in JavaScript.
    fn asked(&self, request: &str) -> Value {
        self.run(&format!(
            "globalThis.found = null; playground.ask({request}).then((answer) => {{ \
             globalThis.found = {{ ...answer, numbers: Array.from(answer.numbers ?? []) }}; }})"
        ));
        self.wait_for("globalThis.found");
        self.run("return globalThis.found")
    }

    fn text_of(&self, id: &str) -> String {
        let text = self.run(&format!("return document.getElementById('{id}').textContent"));
        text.as_str().unwrap().trim().to_owned()
    }

    fn is_alarmed(&self) -> bool {
        self.run("return !document.getElementById('alert').hidden") == true
    }

    /// True once a step after the `index`-th was taken.
    fn wait_beyond(&self, index: u32) {
        self.wait_for(&format!(
            "Number(document.getElementById('index').textContent.replace('\u{202f}', '')) > {index}"
        ));
    }
}

fn numbers(answer: &Value) -> Vec<f64> {
    answer["numbers"].as_array().unwrap().iter().map(|x| x.as_f64().unwrap_or(f64::NAN)).collect()
}

/// Position and attitude in the last row of a run of one body by the command line.
fn last_row(scene: &Path) -> Vec<f64> {
    let out = scene.with_extension("run");
    let arguments = ["run", scene.to_str().unwrap(), "--out", out.to_str().unwrap()];
    tumble(&[&arguments[..], &["--solver", "native"]].concat(), 0);
    let table = std::fs::read_to_string(out.join("trajectory.csv")).unwrap();
    let row = table.lines().last().unwrap();
    row.split(',').skip(2).take(7).map(|number| number.parse().unwrap()).collect()
}

#[test]
#[ignore = "a browser, and a build for WebAssembly"]
fn the_playground_has_the_bits_of_the_command_line() {
    let browser = Browser::start(1280, 800);
    browser.open_playground("");
    let size = std::fs::metadata(page()).unwrap().len();
    assert!(size < 2_000_000, "{size}");
    let answer = browser.asked("{ do: 'step', count: 999, contacts: false }");
    let found = numbers(&answer);
    assert_eq!(found[0], 999.0);
    let directory = tempfile::tempdir().unwrap();
    let scene = directory.path().join("drop.toml");
    std::fs::copy(Path::new(ROOT).join("scenarios/drop.toml"), &scene).unwrap();
    let expected = last_row(&scene);
    assert_eq!(found[20..27], expected, "each number has the digits of its bits");
    browser.assert_quiet();
}

#[test]
#[ignore = "a browser, and a build for WebAssembly"]
fn a_body_is_thrown_in_the_playground_and_the_file_repeats_it() {
    let browser = Browser::start(1280, 800);
    browser.open_playground("");
    browser.choose_scene(5);
    browser.press(RIGHT, None);
    browser.wait_for("document.getElementById('index').textContent === '0'");
    browser.press(LEFT, None);
    browser.wait_for("document.getElementById('clock').textContent === 't = 0.000 s'");
    // The middle of the tower to the right.
    let from = browser.place(".stage canvas", 0.5, 0.5);
    browser.drag("mouse", &[[from, (from.0 + 150.0, from.1 - 20.0)]]);
    browser.wait_beyond(20);
    browser.press(SPACE, None);
    browser.wait_for("!document.querySelector('.holding')");
    let thrown = browser.text_of("kinetic");
    assert!(!thrown.starts_with("0 J") && !browser.is_alarmed(), "{thrown}");
    assert_eq!(browser.text_of("failed"), "none");
    browser.screenshot("playground-thrown");

    let exported = browser.asked("{ do: 'export' }");
    let text = exported["text"].as_str().unwrap();
    assert!(text.contains("load = "), "the pull is a load");
    let found = numbers(&exported);
    let start = text.lines().find_map(|line| line.strip_prefix("start_index = "));
    let start: f64 = start.map_or(0.0, |index| index.parse().unwrap());
    let steps = found[0] - start;
    let directory = tempfile::tempdir().unwrap();
    let scene = directory.path().join("scene.toml");
    std::fs::write(&scene, text).unwrap();
    let out = directory.path().join("run");
    let rows = (steps + 1.0).to_string();
    let paths = [scene.to_str().unwrap(), out.to_str().unwrap()];
    tumble(&["run", paths[0], "--steps", &rows, "--out", paths[1]], 0);
    let table = std::fs::read_to_string(out.join("states.csv")).unwrap();
    let rows: Vec<_> = table.lines().collect();
    let last = rows[rows.len() - 10..].iter().flat_map(|row| row.split(',').skip(3).take(7));
    let last: Vec<f64> = last.map(|number| number.parse().unwrap()).collect();
    assert_eq!(found[20..], last);

    // The link has the same text.
    browser.click("#share");
    browser.wait_for("document.getElementById('sharing').open");
    let link = browser.run("return document.getElementById('link').value");
    let (_, fragment) = link.as_str().unwrap().split_once('#').unwrap();
    browser.open_playground(&format!("#{fragment}"));
    assert_eq!(browser.asked("{ do: 'export' }")["text"], text);
    browser.press(HOME, None);
    assert!(!browser.is_alarmed());
    browser.assert_quiet();
}

#[test]
#[ignore = "a browser, and a build for WebAssembly"]
fn the_playground_survives_odd_addresses_and_hard_throws() {
    let browser = Browser::start(1280, 800);
    for fragment in
        ["#z=", "#z=AAAA", "#z=%%%", "#text=%E0%A4%A", "#text=name", "#z=é", "#t=1", "#"]
    {
        browser.open_playground(fragment);
        let is_ours = fragment.starts_with("#z=") || fragment.starts_with("#text=");
        assert_eq!(browser.is_alarmed(), is_ours, "{fragment}");
        browser.press(RIGHT, None);
        browser.wait_for("document.getElementById('index').textContent === '0'");
    }
    let plain = "steps%20%3D%2010%0A%5Bground%5D%0Afriction%20%3D%200.5%0A%5B%5Bbodies%5D%5D%0Asphere%20%3D%200.1\
                 %0Amass%20%3D%201.0%0Aposition%20%3D%20%5B0.0%2C%200.0%2C%201.0%5D";
    browser.open_playground(&format!("#text={plain}"));
    assert!(!browser.is_alarmed());
    // Throws at both ends of the friction slider.
    for friction in [0.0, 2.0] {
        browser.choose_scene(3);
        browser.asked(&format!("{{ do: 'change', change: {{ friction: {friction} }} }}"));
        let from = browser.place(".stage canvas", 0.5, 0.5);
        for (x, y) in [(300.0, -200.0), (-350.0, -100.0), (0.0, 200.0)] {
            browser.drag("mouse", &[[from, (from.0 + x, from.1 + y)]]);
        }
        browser.press(SPACE, None);
        browser.press(SPACE, None);
        assert!(numbers(&browser.asked("{ do: 'step', count: 20, contacts: true }")).len() > 160);
    }
    browser.assert_quiet();
}

#[test]
#[ignore = "a browser, and a build for WebAssembly"]
fn the_playground_fits_a_phone_and_both_modes() {
    let browser = Browser::start(1400, 900);
    for scheme in ["light", "dark"] {
        browser.colour_scheme(scheme);
        browser.resize(1400, 900, false);
        browser.open_playground("");
        browser.choose_scene(1);
        browser.press(SPACE, None);
        browser.wait_beyond(20);
        browser.press(SPACE, None);
        browser.assert_fits();
        browser.screenshot(&format!("playground-desk-{scheme}"));
        browser.resize(390, 844, true);
        browser.settle();
        browser.assert_fits();
        let at = browser.place(".stage canvas", 0.5, 0.2);
        browser.drag("touch", &[[at, (at.0 + 60.0, at.1 - 40.0)]]);
        browser.settle();
        browser.screenshot(&format!("playground-phone-{scheme}"));
    }
    // Every control has a name.
    let nameless = browser.run(
        "return [...document.querySelectorAll('button, select, input, textarea')].filter((one) => \
         !one.ariaLabel && !one.textContent.trim() && !one.labels?.length).map((one) => one.id)",
    );
    assert_eq!(nameless, serde_json::json!([]));
    browser.assert_quiet();
}

#[test]
#[ignore = "a browser, and a build for WebAssembly"]
fn the_playground_computes_without_webgl() {
    let browser = Browser::without_graphics(800, 600);
    browser.open_playground("");
    browser.press(RIGHT, None);
    browser.wait_for("document.getElementById('index').textContent === '0'");
    assert!(browser.text_of("stages").contains("no WebGL"));
    browser.press(SPACE, None);
    browser.wait_beyond(50);
    browser.assert_quiet();
}

/// Prints the times of pictures (`-- --include-ignored --nocapture pictures_of_the_playground`).
#[test]
#[ignore = "a browser, and a build for WebAssembly"]
fn pictures_of_the_playground_go_on_while_many_bodies_move() {
    let browser = Browser::start(1400, 900);
    for (name, steps) in [("fifty", 100), ("thousand", 10)] {
        let scene = Path::new(ROOT).join(format!("playground/measure/{name}.toml"));
        let text = serde_json::to_string(&std::fs::read_to_string(scene).unwrap()).unwrap();
        browser.open_playground("");
        browser.run(&format!("document.getElementById('text').value = {text}"));
        browser.run("document.getElementById('run-text').click()");
        browser.wait_for("document.querySelectorAll('#body option').length >= 50");
        browser.asked(&format!("{{ do: 'step', count: {steps}, contacts: false }}"));
        for forces in ["with forces", "without forces"] {
            browser.press(SPACE, None);
            browser.run(
                "globalThis.times = []; let last = performance.now(); const end = last + 8000; \
                 const next = (now) => { times.push(now - last); last = now; \
                 if (now < end) requestAnimationFrame(next); else globalThis.isTimed = true; }; \
                 globalThis.isTimed = false; requestAnimationFrame(next)",
            );
            browser.wait_for("isTimed");
            browser.press(SPACE, None);
            let times = browser.run("return times.slice(1).sort((a, b) => a - b)");
            let times: Vec<_> =
                times.as_array().unwrap().iter().map(|time| time.as_f64().unwrap()).collect();
            let (median, longest) = (times[times.len() / 2], times[times.len() - 1]);
            println!("{name} {forces}: median {median:.0} ms, longest {longest:.0} ms");
            assert!(longest < 10_000.0, "{name} {forces}: {longest} ms");
            browser.press("f", None);
        }
    }
    browser.assert_quiet();
}
