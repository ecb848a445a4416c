//! The page in a real browser: play, pause, scrub, orbit, zoom and layout on a phone.
//!
//! Requires Chromium and chromedriver (`scripts/setup --browser`). `scripts/test --minutes` runs
//! these tests. Screenshots are in `target/view-screenshots`.

mod choices;
mod driver;
mod live;
mod meshes;
mod pages;
mod playground;
mod runs;

use driver::Browser;
use pages::{Pages, lab_distance};
use serde_json::Value;
use std::time::Duration;

/// Keys in the WebDriver protocol.
const SHIFT: &str = "\u{e008}";
const ESCAPE: &str = "\u{e00c}";
const SPACE: &str = " ";
const TAB: &str = "\u{e004}";
const END: &str = "\u{e010}";
const HOME: &str = "\u{e011}";
const LEFT: &str = "\u{e012}";
const RIGHT: &str = "\u{e014}";

/// Time of an impact in the first run below [s].
const IMPACT: f64 = 0.472;

#[test]
#[ignore = "a browser"]
fn page_plays_pauses_scrubs_and_obeys_keys() {
    let pages = Pages::new();
    let page = pages.retried();
    let browser = Browser::start(1280, 800);
    browser.open(&page);
    assert_eq!((browser.time(), browser.row().as_str()), (0.0, "0"));
    browser.click("#play");
    browser.wait_for("Number(document.getElementById('scrub').value) > 0.05");
    browser.click("#play");
    let stopped = browser.time();
    std::thread::sleep(Duration::from_millis(200));
    assert_eq!(browser.time(), stopped);

    // Slow motion by a factor of 20.
    browser.press("-", None);
    browser.run("document.getElementById('speed').value = '0.05'");
    browser.run("document.getElementById('speed').dispatchEvent(new Event('change'))");
    browser.set_time(0.0);
    browser.press(SPACE, None);
    std::thread::sleep(Duration::from_millis(400));
    browser.press(SPACE, None);
    let slow = browser.time();
    assert!(slow > 0.002 && slow < 0.5, "{slow}");

    browser.click("#scrub");
    assert!((browser.time() / 1.998 - 0.5).abs() < 0.02, "{}", browser.time());
    browser.press(HOME, None);
    assert_eq!(browser.row(), "0");
    for (key, held, row) in [
        (RIGHT, None, "1"),
        (RIGHT, Some(SHIFT), "21"),
        (LEFT, None, "20"),
        (END, None, "999"),
        (LEFT, Some(SHIFT), "979"),
        (HOME, None, "0"),
    ] {
        browser.press(key, held);
        assert_eq!(browser.row(), row, "{key:?} {held:?}");
    }
    let speed = || browser.run("return document.getElementById('speed').value");
    browser.press("+", None);
    assert_eq!(speed(), "0.1");
    browser.press("-", None);
    assert_eq!(speed(), "0.05");

    // The only retried step of this run, and the worst step.
    browser.press("n", None);
    let mark = browser.row();
    let status = "return document.querySelector('#state .status dd').textContent";
    assert_eq!(browser.run(status), "retried");
    browser.press("n", None);
    assert_eq!(browser.row(), mark, "there is one");
    browser.press(END, None);
    browser.press("p", None);
    assert_eq!(browser.row(), mark);
    browser.click(".worst");
    let link = browser.run("return document.querySelector('.worst').textContent");
    assert!(link.as_str().unwrap().ends_with(&format!("k = {}", browser.row())), "{link}");

    browser.press("?", None);
    browser.wait_for("document.getElementById('help').open");
    browser.screenshot("help");
    browser.press(ESCAPE, None);
    browser.wait_for("!document.getElementById('help').open");
    browser.assert_quiet();
}

#[test]
#[ignore = "a browser"]
fn page_orbits_zooms_and_shows_selected_layers() {
    let pages = Pages::new();
    let page = pages.drop();
    let browser = Browser::start(1280, 800);
    browser.open(&page);
    browser.set_time(IMPACT);
    browser.screenshot("one-light");
    let first = browser.pixels(0);
    let middle = browser.place(".stage canvas", 0.5, 0.5);
    browser.drag("mouse", &[[middle, (middle.0 + 120.0, middle.1 + 30.0)]]);
    let orbited = browser.pixels(0);
    assert_ne!(orbited, first);
    browser.wheel(middle, -3);
    assert_ne!(browser.pixels(0), orbited);
    browser.press("r", None);
    assert_eq!(browser.pixels(0), first, "r brings the first view back");
    for key in ["a", "w", "z"] {
        browser.press(key, None);
        assert_ne!(browser.pixels(0), first, "{key}");
        browser.click("#reset");
        assert_eq!(browser.pixels(0), first);
    }
    for (id, key) in [("forces", "f"), ("trail", "t")] {
        assert!(browser.is_pressed(id));
        browser.press(key, None);
        assert!(!browser.is_pressed(id));
        assert_ne!(browser.pixels(0), first, "{id}");
        browser.click(&format!("#{id}"));
        assert_eq!(browser.pixels(0), first, "{id}");
    }
    // A followed body stays in the centre of the view.
    browser.click("#follow");
    for time in [0.0, IMPACT, 1.0, 1.9] {
        browser.set_time(time);
        let (x, y) = browser.middle_of_body();
        assert!((x - 0.5).abs() < 0.06 && (y - 0.5).abs() < 0.06, "{time}: {x} {y}");
    }
    browser.screenshot("followed");
    let followed = browser.pixels(0);
    browser.press("c", None);
    assert_ne!(browser.pixels(0), followed);
    // No step follows the last row, which shows the forces of the last step.
    browser.press(END, None);
    let said = browser.run("return document.querySelector('.stage .remark').textContent");
    assert!(said.as_str().unwrap().contains("forces of the last step"), "{said}");
    let residual = "return document.querySelector('#state .residual dd').textContent";
    assert_eq!(browser.run(residual), "no step follows");

    browser.colour_scheme("dark");
    browser.set_time(IMPACT);
    assert_ne!(browser.pixels(0), first);
    browser.screenshot("one-dark");
    browser.assert_quiet();
}

/// The screenshots in docs/pictures, which `scripts/pictures` copies.
#[test]
#[ignore = "a browser"]
fn pictures_in_the_documents_match_the_pages() {
    let pages = Pages::new();
    let arch = format!("{}/scenarios/arch.toml", crate::ROOT);
    let arch = pages.simulate("arch", &[&arch, "--solver", "native"], 0);
    for (name, page, time) in [("view", pages.drop(), IMPACT), ("arch", arch, 1.0)] {
        let browser = Browser::start(1280, 800);
        browser.open(&page);
        browser.set_time(time);
        browser.settle();
        browser.screenshot(&format!("document-{name}"));
        browser.assert_quiet();
    }
}

#[test]
#[ignore = "a browser"]
fn the_plots_and_the_time_are_linked() {
    let pages = Pages::new();
    let page = pages.drop();
    let browser = Browser::start(1280, 800);
    browser.open(&page);
    browser.run("document.querySelectorAll('details').forEach((plot) => { plot.open = true })");
    let count = |of: &str| format!("document.querySelectorAll('{of}').length");
    browser.wait_for(&format!("{} === {}", count(".u-over"), count("details.plot")));
    let at = |share| browser.place("#plot-z .u-over", share, 0.5);
    browser.drag("mouse", &[[at(0.25), at(0.25)]]);
    assert!((browser.time() / 1.998 - 0.25).abs() < 0.01, "{}", browser.time());
    browser.drag("mouse", &[[at(0.3), at(0.75)]]);
    assert!((browser.time() / 1.998 - 0.75).abs() < 0.01, "{}", browser.time());
    // Every plot has its cursor at the current time.
    let places = browser.run(
        "return [...document.querySelectorAll('.u-over')].map((over) => { \
           const [o, c] = [over, over.querySelector('.cursor')].map((e) => e.getBoundingClientRect()); \
           return (c.left - o.left) / o.width; })",
    );
    for place in places.as_array().unwrap() {
        assert!((place.as_f64().unwrap() - 0.75).abs() < 0.01, "{places}");
    }
    // The colours of the curves are distinguishable in the light and dark schemes. Their distance in
    // CIELAB exceeds twice a just noticeable difference.
    for scheme in ["light", "dark"] {
        browser.colour_scheme(scheme);
        browser.settle();
        let strokes = browser.legend_strokes("energy");
        assert_eq!(strokes.len(), 3);
        for (i, a) in strokes.iter().enumerate() {
            for b in &strokes[..i] {
                assert!(lab_distance(&a.0, &b.0) > 15.0, "{scheme}: {a:?} {b:?}");
            }
        }
    }
    browser.colour_scheme("light");
    browser.settle();
    // Every plot has pixels that are not grey like the grid.
    let painted = browser.run(
        "return [...document.querySelectorAll('.uplot canvas')].map((canvas) => { \
           const { data } = canvas.getContext('2d').getImageData(0, 0, canvas.width, canvas.height); \
           let count = 0; \
           for (let i = 0; i < data.length; i += 4) { \
             const [low, high] = [Math.min(...data.slice(i, i + 3)), Math.max(...data.slice(i, i + 3))]; \
             if (data[i + 3] > 128 && (high - low > 60 || high < 100)) count += 1; \
           } \
           return count; })",
    );
    for count in painted.as_array().unwrap() {
        assert!(count.as_u64().unwrap() > 100, "{painted}");
    }
    // The value next to the plot's name belongs to the current row.
    browser.press(HOME, None);
    let z = "return document.querySelector('#plot-z .single').textContent";
    assert_eq!(browser.run(z), "2.500");
    browser.screenshot("plots");
    browser.assert_quiet();
}

#[test]
#[ignore = "a browser"]
fn two_runs_are_seen_side_by_side_and_in_one_view() {
    let pages = Pages::new();
    let page = pages.pair();
    let browser = Browser::start(1280, 800);
    browser.open(&page);
    browser.set_time(1.2);
    browser.screenshot("two-light");
    let shown = || browser.run("return document.querySelectorAll('.stage:not([hidden])').length");
    assert_eq!(shown(), 2);
    assert_ne!(browser.pixels(0), browser.pixels(1));
    // Each curve of each run has its own combination of colour and dash.
    browser.run("document.querySelectorAll('details').forEach((plot) => { plot.open = true })");
    let strokes = browser.legend_strokes("energy");
    assert_eq!(strokes.len(), 6);
    for (i, a) in strokes.iter().enumerate() {
        for b in &strokes[..i] {
            assert!(lab_distance(&a.0, &b.0) > 15.0 || a.1 != b.1, "{a:?} {b:?}");
        }
    }
    // Both views share one camera.
    let before = [browser.pixels(0), browser.pixels(1)];
    let middle = browser.place(".stage canvas", 0.5, 0.5);
    browser.drag("mouse", &[[middle, (middle.0 + 80.0, middle.1)]]);
    assert!(browser.pixels(0) != before[0] && browser.pixels(1) != before[1]);
    browser.press("o", None);
    assert_eq!(shown(), 1);
    browser.screenshot("overlay");
    // The second run is shorter and stays at its end.
    browser.press(END, None);
    let ends = browser
        .run("return [...document.querySelectorAll('#state .k dd')].map((k) => k.textContent)");
    assert_eq!(ends, serde_json::json!(["999", "299"]));
    let differing = browser
        .run("return [...document.querySelectorAll('tr.differs th')].map((th) => th.textContent)");
    for name in ["time step h", "rows", "changed"] {
        assert!(differing.as_array().unwrap().contains(&Value::from(name)), "{differing}");
    }
    browser.wait_for("document.querySelector('#plot-distance .u-over')");
    // A step goes to the next row of either run, with time steps of 2 ms and 5 ms.
    browser.press(HOME, None);
    let mut times = Vec::new();
    for _ in 0..4 {
        browser.press(RIGHT, None);
        times.push((browser.time() * 1e3).round());
    }
    assert_eq!(times, [2.0, 4.0, 5.0, 6.0]);
    browser.colour_scheme("dark");
    browser.set_time(IMPACT);
    browser.press("o", None);
    browser.screenshot("two-dark");
    browser.assert_quiet();
}

#[test]
#[ignore = "a browser"]
fn page_has_one_column_and_touch_on_a_phone() {
    let pages = Pages::new();
    let (pair, single) = (pages.pair(), pages.path("drop").join("view.html"));
    let browser = Browser::start(360, 740);
    browser.resize(360, 740, true);
    for (name, page) in [("phone-two", &pair), ("phone-one", &single)] {
        browser.open(page);
        browser.run("document.querySelectorAll('details').forEach((plot) => { plot.open = true })");
        browser.set_time(IMPACT);
        browser.assert_fits();
        browser.screenshot(name);
        browser.colour_scheme("dark");
        browser.screenshot(&format!("{name}-dark"));
        browser.colour_scheme("light");
    }
    // A vertical swipe scrolls the page with two views and orbits with one view.
    let touch = "return getComputedStyle(document.querySelector('.stage canvas')).touchAction";
    assert_eq!(browser.run(touch), "none");
    browser.open(&pair);
    assert_eq!(browser.run(touch), "pan-y");
    browser.open(&single);
    browser.run("document.querySelectorAll('details').forEach((plot) => { plot.open = true })");
    browser.set_time(IMPACT);
    let first = browser.pixels(0);
    let (x, y) = browser.place(".stage canvas", 0.5, 0.5);
    browser.drag("touch", &[[(x, y), (x + 60.0, y)]]);
    let orbited = browser.pixels(0);
    assert_ne!(orbited, first);
    let apart = |from: f64, to: f64| [(x + from, y), (x + to, y)];
    browser.drag("touch", &[apart(-20.0, -80.0), apart(20.0, 80.0)]);
    assert_ne!(browser.pixels(0), orbited);
    // The playback controls stay visible at the end of the page.
    browser.run("window.scrollTo(0, document.body.scrollHeight)");
    let (_, bottom) = browser.place("#play", 0.5, 1.0);
    assert!((600.0..740.0).contains(&bottom), "{bottom}");
    browser.screenshot("phone-plots");
    browser.assert_quiet();
}

#[test]
#[ignore = "a browser"]
fn every_control_is_reached_by_tab_with_a_visible_focus() {
    let pages = Pages::new();
    let page = pages.retried();
    let browser = Browser::start(1280, 800);
    browser.open(&page);
    let mut reached = Vec::new();
    for _ in 0..40 {
        browser.press(TAB, None);
        let focus = browser.run(
            "const e = document.activeElement; const style = getComputedStyle(e); \
             return [e.id || `${e.closest('[id]')?.id} ${e.tagName}`, style.outlineStyle, \
                     (e.ariaLabel || e.textContent).trim()]",
        );
        if focus[0].as_str().unwrap().ends_with(" BODY") {
            break;
        }
        assert_ne!(focus[1], "none", "{focus}");
        assert_ne!(focus[2], "", "{focus}");
        reached.push(focus[0].as_str().unwrap().to_owned());
    }
    let ids = [
        "help-open",
        "stages CANVAS",
        "play",
        "scrub",
        "speed",
        "forces",
        "trail",
        "follow",
        "more SUMMARY",
        "reset",
        "previous",
        "next",
        "facts BUTTON",
        "plot-z SUMMARY",
        "plot-residual SUMMARY",
    ];
    for id in ids {
        assert!(reached.iter().any(|other| other == id), "{id}: {reached:?}");
    }
}
