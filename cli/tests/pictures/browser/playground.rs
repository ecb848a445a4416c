//! The playground in a real browser: the bits of the command line, pulls, odd addresses, a phone.

use super::driver::Browser;
use super::pages::tumble;
use super::{HOME, LEFT, RIGHT, SPACE};
use crate::ROOT;
use serde_json::Value;
use std::path::{Path, PathBuf};
use std::process::Command;
use std::time::Duration;
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

    /// Fragment of the address that the page gives its first scene.
    fn shared_fragment(&self) -> String {
        self.open_playground("");
        self.click("#share");
        self.wait_for("document.getElementById('sharing').open");
        let link = self.run("return document.getElementById('link').value");
        let (_, fragment) = link.as_str().unwrap().split_once('#').unwrap();
        format!("#{fragment}")
    }

    fn text_of(&self, id: &str) -> String {
        let text = self.run(&format!("return document.getElementById('{id}').textContent"));
        text.as_str().unwrap().trim().to_owned()
    }

    /// Asserts that a finger reaches the middle of each control, and that no two overlap.
    fn assert_reachable(&self) {
        let faults = self.run(
            "document.getElementById('source').open = true; \
             const shown = [...document.querySelectorAll('button, select, input, textarea, summary')] \
               .filter((one) => !one.closest('dialog') && one.getClientRects().length > 0); \
             const faults = []; const boxes = []; \
             for (const one of shown) { \
               one.scrollIntoView({ block: 'center' }); \
               const { left, right, top, bottom, width, height } = one.getBoundingClientRect(); \
               const name = one.id || one.textContent.trim(); \
               const hit = document.elementFromPoint(left + width / 2, top + height / 2); \
               if (!(hit === one || one.contains(hit) || hit?.closest('label')?.contains(one))) \
                 faults.push(`${name} is behind ${hit?.id || hit?.tagName}`); \
               if (left < 0 || right > innerWidth + 0.5) faults.push(`${name} is cut off`); \
               if (one.tagName !== 'INPUT' && Math.min(width, height) < 24) \
                 faults.push(`${name} is small: ${width} by ${height}`); \
               const box = { name, left, right, top: top + scrollY, bottom: bottom + scrollY }; \
               const isFixed = one.closest('#transport'); \
               for (const other of isFixed ? [] : boxes) { \
                 if (box.left < other.right - 1 && other.left < box.right - 1 \
                   && box.top < other.bottom - 1 && other.top < box.bottom - 1) \
                   faults.push(`${name} overlaps ${other.name}`); \
               } \
               if (!isFixed) boxes.push(box); \
             } \
             document.getElementById('source').open = false; window.scrollTo(0, 0); \
             return faults",
        );
        assert_eq!(faults, serde_json::json!([]));
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
    tumble(&arguments, 0);
    let table = std::fs::read_to_string(out.join("states.csv")).unwrap();
    let row = table.lines().last().unwrap();
    row.split(',').skip(3).take(7).map(|number| number.parse().unwrap()).collect()
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
fn playground_survives_invalid_addresses_and_hard_throws() {
    let browser = Browser::start(1280, 800);
    // A megabyte as the browser encodes it.
    let noise = "x%zé=9".repeat(90_000);
    let whole = browser.shared_fragment();
    for (fragment, is_alarming) in [
        ("", false),
        ("#", false),
        ("#scene=", true),
        ("#t=1", true),
        ("#z=", true),
        ("#z=AAAA", true),
        ("#z=%%%", true),
        ("#z=é", true),
        (&whole[..whole.len() - 6], true),
        ("#text=%E0%A4%A", true),
        ("#text=name", true),
        (&format!("#{noise}"), true),
        (&format!("#z={noise}"), true),
        (&format!("#text={}", noise.replace('%', "")), true),
    ] {
        let shown: String = fragment.chars().take(30).collect();
        browser.open_playground(fragment);
        assert_eq!(browser.is_alarmed(), is_alarming, "{shown}");
        let message = browser.text_of("alert");
        assert!(message.chars().count() < 600, "{shown}: {message}");
        assert_eq!(browser.run("return document.getElementById('scene').value"), "0", "{shown}");
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
        let shown = numbers(&browser.asked("{ do: 'step', count: 20, contacts: true }"));
        assert!(shown.len() > 160 && shown.iter().all(|number| number.is_finite()));
        browser.settle();
    }
    browser.assert_quiet();
}

#[test]
#[ignore = "a browser, and a build for WebAssembly"]
fn hidden_playground_resumes_without_a_jump() {
    let browser = Browser::start(1000, 700);
    browser.open_playground("");
    browser.choose_scene(5);
    browser.press(SPACE, None);
    browser.wait_beyond(20);
    browser.hide();
    let index = || browser.text_of("index").replace('\u{202f}', "").parse::<u32>().unwrap();
    let before = index();
    std::thread::sleep(Duration::from_secs(4));
    browser.unhide();
    browser.settle();
    let after = index();
    // A picture owes at most 0.1 s of steps of 2 ms. Four seconds would be 2000 steps.
    assert!(after < before + 1000, "{before} {after}");
    browser.wait_beyond(after);
    assert!(!browser.is_alarmed());
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
        browser.assert_reachable();
        browser.run("document.getElementById('sliders').scrollIntoView()");
        browser.settle();
        browser.screenshot(&format!("playground-phone-sliders-{scheme}"));
        browser.run("window.scrollTo(0, 0)");
        for (dialog, button) in [("help", "#help-open"), ("sharing", "#share")] {
            browser.click(button);
            browser.wait_for(&format!("document.getElementById('{dialog}').open"));
            browser.assert_fits();
            browser.screenshot(&format!("playground-phone-{dialog}-{scheme}"));
            browser.run(&format!("document.getElementById('{dialog}').close()"));
        }
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

/// Rounds of a measurement, of which the fastest counts.
const ROUNDS: usize = 3;
/// Largest accepted time of a step in the browser over that of the command line. The compiler for
/// WebAssembly has vectors of half the length.
const MOST_TIMES: f64 = 3.0;

/// Opens a scene of `playground/measure` and returns its path.
fn open_measured(browser: &Browser, name: &str) -> PathBuf {
    let scene = Path::new(ROOT).join(format!("playground/measure/{name}.toml"));
    let text = serde_json::to_string(&std::fs::read_to_string(&scene).unwrap()).unwrap();
    browser.open_playground("");
    browser.run(&format!("document.getElementById('text').value = {text}"));
    browser.run("document.getElementById('run-text').click()");
    browser.wait_for("document.querySelectorAll('#body option').length >= 50");
    scene
}

/// Times of a step [µs] in the browser and on the command line, each the least of a few rounds.
fn step_times(browser: &Browser, name: &str, steps: u32) -> [f64; 2] {
    let directory = tempfile::tempdir().unwrap();
    let mut least = [f64::INFINITY; 2];
    for round in 0..ROUNDS {
        let scene = open_measured(browser, name);
        let out = directory.path().join(round.to_string());
        let rows = (steps + 1).to_string();
        let paths = [scene.to_str().unwrap(), out.to_str().unwrap()];
        tumble(&["run", paths[0], "--steps", &rows, "--out", paths[1]], 0);
        let run_json = std::fs::read_to_string(out.join("run.json")).unwrap();
        let run_json: Value = serde_json::from_str(&run_json).unwrap();
        let native = run_json["summary"]["solve_seconds"].as_f64().unwrap();
        browser.run(&format!(
            "globalThis.seconds = null; const start = performance.now(); \
             playground.ask({{ do: 'step', count: {steps}, contacts: false }}).then(() => \
             {{ globalThis.seconds = (performance.now() - start) / 1000; }})"
        ));
        browser.wait_for("globalThis.seconds");
        let page = browser.run("return globalThis.seconds").as_f64().unwrap();
        for (least, seconds) in least.iter_mut().zip([page, native]) {
            *least = least.min(1e6 * seconds / f64::from(steps));
        }
    }
    least
}

/// Median and longest time between two pictures over eight seconds [ms].
fn picture_times(browser: &Browser) -> [f64; 2] {
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
    let times: Vec<_> = times.as_array().unwrap().iter().map(|t| t.as_f64().unwrap()).collect();
    [times[times.len() / 2], times[times.len() - 1]]
}

/// Prints the table of docs/playground.md: `cargo test --release -p tumble-cli --test pictures --
/// --include-ignored --nocapture pictures_of_the_playground`.
#[test]
#[ignore = "a browser, and a build for WebAssembly"]
fn playground_keeps_drawing_while_many_bodies_move() {
    let browser = Browser::start(1400, 900);
    for (name, before, steps) in [("fifty", 100, 999), ("thousand", 10, 299)] {
        let [page, native] = step_times(&browser, name, steps);
        let ratio = page / native;
        println!("{name}: step {page:.0} µs in the page, {native:.0} µs native, ratio {ratio:.1}");
        // A build for development is slow.
        assert!(cfg!(debug_assertions) || ratio <= MOST_TIMES, "{name}: {ratio}");
        open_measured(&browser, name);
        browser.asked(&format!("{{ do: 'step', count: {before}, contacts: false }}"));
        for forces in ["with forces", "without forces"] {
            let [median, longest] = picture_times(&browser);
            println!("{name} {forces}: median {median:.0} ms, longest {longest:.0} ms");
            assert!(longest < 10_000.0, "{name} {forces}: {longest} ms");
            browser.press("f", None);
        }
    }
    browser.assert_quiet();
}
