//! Options of the page: selection of bodies, camera, links to a time, saved pictures, and the page
//! without WebGL.

use super::driver::Browser;
use super::pages::Pages;
use super::{END, ESCAPE, HOME, IMPACT, SHIFT};
use crate::pile;
use std::fs;
use std::path::PathBuf;
use std::time::{Duration, Instant};

/// Page of a hundred bodies.
fn hundred(pages: &Pages, steps: u64) -> PathBuf {
    let path = pages.path("hundred.html");
    fs::write(&path, tumble_view::view::page("0", &[&pile::film(steps)]).unwrap()).unwrap();
    path
}

#[test]
#[ignore = "a browser"]
fn several_bodies_are_chosen_and_compared() {
    let pages = Pages::new();
    let browser = Browser::start(1280, 800);
    browser.open(&hundred(&pages, 300));
    let choose = |b: usize| {
        browser.run(&format!(
            "const list = document.getElementById('body'); list.value = {b}; \
             list.dispatchEvent(new Event('change'))"
        ));
        browser.settle();
    };
    let heading = || browser.run("return document.querySelector('.sheet h2').textContent");
    let labels = || {
        browser
            .run("return [...document.querySelectorAll('.names span')].map((e) => e.textContent)")
    };
    // Positions of two balls in the picture, found by following them.
    let places = [64, 69].map(|b| {
        choose(b);
        let place = browser.run(
            "const r = document.querySelector('.names span').getBoundingClientRect(); \
             return [r.left + r.width / 2, r.bottom]",
        );
        // The name is a few pixels above the ball.
        (place[0].as_f64().unwrap(), place[1].as_f64().unwrap() + 16.0)
    });
    browser.drag("mouse", &[[places[0], places[0]]]);
    assert_eq!(heading(), "Motion and contact: ball 64");
    browser.click_at(places[1], SHIFT);
    assert_eq!(heading(), "Motion and contact: ball 64, ball 69");
    assert_eq!(labels(), serde_json::json!(["ball 64", "ball 69"]));
    let legend =
        "return [...document.querySelectorAll('#plot-z .legend > span')].map((e) => e.textContent)";
    let legend = browser.run(legend).to_string();
    assert!(legend.contains("ball 64") && legend.contains("ball 69"), "{legend}");
    // A second click deselects a body, and the last one stays selected.
    browser.click_at(places[1], SHIFT);
    assert_eq!(heading(), "Motion and contact: ball 64");
    browser.click_at(places[0], SHIFT);
    assert_eq!(heading(), "Motion and contact: ball 64");
    // Multiple selection without shift for touch screens.
    browser.click("#more summary");
    browser.click("#several");
    choose(85);
    assert_eq!(heading(), "Motion and contact: ball 64, octahedron 85");
    for (what, key) in [("contacts", Some("m")), ("frames", Some("b")), ("names", None)] {
        let before = (browser.pixels(0), labels());
        match key {
            Some(key) => browser.press(key, None),
            None => browser.click(&format!("#{what}")),
        }
        assert!(browser.is_pressed(what));
        assert_ne!((browser.pixels(0), labels()), before, "{what}");
        browser.click(&format!("#{what}"));
        assert_eq!((browser.pixels(0), labels()), before, "{what}");
    }
    // Minimum force, forces of the selected bodies only, and the fixed ramp faded and hidden.
    let set = |id: &str, value: &str| {
        browser.run(&format!(
            "const list = document.querySelector('{id}'); list.value = '{value}'; \
             list.dispatchEvent(new Event('change'))"
        ));
        browser.settle();
    };
    let mut seen = vec![browser.pixels(0)];
    set("#least", "1");
    seen.push(browser.pixels(0));
    browser.click("#only");
    seen.push(browser.pixels(0));
    set("#fixed select", "faded");
    seen.push(browser.pixels(0));
    browser.click("#more summary");
    browser.screenshot("chosen");
    set("#fixed select", "hidden");
    seen.push(browser.pixels(0));
    for (i, one) in seen.iter().enumerate() {
        assert!(!seen[..i].contains(one), "{i}");
    }
    browser.assert_quiet();
}

/// Nothing is selected at first. A selection is an outline, which leaves the surface as it is.
#[test]
#[ignore = "a browser"]
fn a_choice_is_outlined_and_can_be_ended() {
    let pages = Pages::new();
    let browser = Browser::start(1280, 800);
    browser.open(&hundred(&pages, 300));
    let names = || browser.run("return document.querySelectorAll('.names span').length");
    browser.click("#forces");
    browser.click("#trail");
    let first = browser.pixels(0);
    assert_eq!(names(), 0);
    browser.run(
        "const list = document.getElementById('body'); list.value = 62; \
         list.dispatchEvent(new Event('change'))",
    );
    browser.settle();
    browser.screenshot("outlined");
    assert_eq!(names(), 1);
    let place = browser.run(
        "const r = document.querySelector('.names span').getBoundingClientRect(); \
         return [r.left + r.width / 2, r.bottom + 22]",
    );
    let place = (place[0].as_f64().unwrap(), place[1].as_f64().unwrap());
    let (chosen, inside) = (browser.pixels(0), browser.colour_at(place));
    assert_ne!(chosen, first);
    browser.press(ESCAPE, None);
    assert_eq!((browser.pixels(0), names()), (first.clone(), 0.into()));
    assert!(inside.is_some() && inside == browser.colour_at(place), "{inside:?}");
    // A click on the body selects it, and a click beside all bodies ends the selection.
    browser.drag("mouse", &[[place, place]]);
    assert_eq!(browser.pixels(0), chosen);
    let corner = browser.place(".stage canvas", 0.97, 0.05);
    browser.drag("mouse", &[[corner, corner]]);
    assert_eq!((browser.pixels(0), names()), (first, 0.into()));
    browser.assert_quiet();
}

#[test]
#[ignore = "a browser"]
fn the_certificate_and_the_contacts_are_shown() {
    let pages = Pages::new();
    let browser = Browser::start(1280, 800);
    let failing = ["--steps", "300", "--max-iter", "1", "--on-failure", "record"];
    // Number of red pixels of the strip, and of all that are painted.
    let strip = || {
        let counts = browser.run(
            "const canvas = document.getElementById('strip'); \
             const { width, height } = canvas; \
             const { data } = canvas.getContext('2d').getImageData(0, 0, width, height); \
             let [red, all] = [0, 0]; \
             for (let i = 0; i < data.length; i += 4) { \
               if (data[i + 3] > 100) all += 1; \
               if (data[i + 3] > 200 && data[i] > 180 && data[i + 1] < 80) red += 1; \
             } \
             return [red, all]",
        );
        [0, 1].map(|k| counts[k].as_u64().unwrap())
    };
    browser.open(&pages.drop());
    let [red, all] = strip();
    assert!(red == 0 && all > 1000, "{red} of {all}");
    let label = "return document.getElementById('strip').ariaLabel";
    let label = browser.run(label);
    assert!(label.as_str().unwrap().contains("residual of each step"), "{label}");
    let title = "return document.querySelector('h1').textContent";
    assert_eq!(browser.run(title), "drop scene");
    browser.set_time(IMPACT);
    assert_eq!(browser.run("return document.querySelector('.time').textContent"), "t = 0.472 s");
    let first = browser.pixels(0);
    // The drop lands on an edge or a face: single forces are others than resultants.
    let scale = "return [...document.querySelectorAll('.force-scale text:not(.law)')].map((e) => e.textContent)";
    assert_eq!(browser.run(scale), serde_json::json!(["1 kN", "100 N", "10 N"]));
    for (id, key) in [("contacts", "m"), ("points", "e"), ("cones", "k")] {
        assert!(!browser.is_pressed(id));
        browser.press(key, None);
        assert!(browser.is_pressed(id));
        assert_ne!(browser.pixels(0), first, "{id}");
        browser.screenshot(id);
        browser.press(key, None);
        assert_eq!(browser.pixels(0), first, "{id}");
    }
    browser.open(&pages.simulate("failing", &failing, 3));
    let [red, all] = strip();
    browser.screenshot("strip-failed");
    assert!(red > 100, "{red} of {all}");
    browser.assert_quiet();
}

#[test]
#[ignore = "a browser"]
fn a_slide_plays_in_a_loop() {
    let pages = Pages::new();
    let browser = Browser::start(1280, 800);
    browser.open_at(&pages.drop(), "#slide");
    browser.wait_for("document.getElementById('play').classList.contains('playing')");
    browser.press("+", None);
    browser.press("+", None);
    browser.wait_for("Number(document.getElementById('scrub').value) > 1.5");
    browser.wait_for("Number(document.getElementById('scrub').value) < 1.0");
    browser.screenshot("slide");
    browser.press("v", None);
    let playing = "return document.getElementById('play').classList.contains('playing')";
    assert_eq!(browser.run(playing), false);
    browser.assert_quiet();
}

#[test]
#[ignore = "a browser"]
fn the_camera_follows_where_the_motion_is_long() {
    let pages = Pages::new();
    // A cube that slides 60 m.
    let far =
        ["--steps", "1000", "--solver", "native", "--set", "start.velocity=0,40,0", "--mu", "0.05"];
    let far = pages.simulate("far", &far, 0);
    let browser = Browser::start(1280, 800);
    browser.open(&far);
    assert!(browser.is_pressed("follow"));
    for time in [0.0, 0.7, 1.9] {
        browser.set_time(time);
        let (x, y) = browser.middle_of_body();
        assert!((x - 0.5).abs() < 0.1 && (y - 0.5).abs() < 0.2, "{time}: {x} {y}");
    }
    browser.screenshot("long");
    // Without following the whole motion is visible and the body is small.
    let followed = browser.pixels(0);
    browser.press("c", None);
    assert!(!browser.is_pressed("follow"));
    assert_ne!(browser.pixels(0), followed);
    browser.screenshot("long-all");
    browser.press("c", None);
    assert_eq!(browser.pixels(0), followed);
    browser.assert_quiet();
}

#[test]
#[ignore = "a browser"]
fn a_link_leads_to_a_time_and_a_picture_is_saved() {
    let pages = Pages::new();
    let page = pages.pair();
    let browser = Browser::start(1280, 800);
    browser.open_at(&page, "#t=1.25");
    assert_eq!((browser.time(), browser.row().as_str()), (1.25, "625"));
    browser.set_time(IMPACT);
    browser.wait_for(&format!("location.hash === '#t={IMPACT}'"));
    browser.run("location.hash = '#t=0.5'");
    browser.wait_for("document.getElementById('clock').textContent.startsWith('0.500')");
    // An invalid fragment leaves the time unchanged.
    browser.run("location.hash = '#elsewhere'");
    browser.settle();
    assert_eq!(browser.time(), 0.5);

    let saved = pages.path("saved");
    fs::create_dir(&saved).unwrap();
    browser.save_to(&saved);
    browser.press("i", None);
    let picture = saved.join("tumble-0.500s.png");
    let start = Instant::now();
    while !picture.exists() {
        assert!(start.elapsed() < Duration::from_secs(120), "no picture was saved");
        std::thread::sleep(Duration::from_millis(50));
    }
    let bytes = fs::read(&picture).unwrap();
    assert!(bytes.starts_with(b"\x89PNG\r\n\x1a\n"));
    // The picture is as wide as both views.
    let wide = u32::from_be_bytes(bytes[16..20].try_into().unwrap());
    let views = "return [...document.querySelectorAll('.stage:not([hidden]) canvas')] \
                 .reduce((sum, canvas) => sum + canvas.width, 0)";
    assert_eq!(browser.run(views), wide);
    assert!(bytes.len() > 10_000, "{} bytes", bytes.len());
    let target = PathBuf::from(env!("CARGO_TARGET_TMPDIR"));
    let shots = target.parent().unwrap().join("view-screenshots");
    fs::create_dir_all(&shots).unwrap();
    fs::copy(&picture, shots.join("saved.png")).unwrap();
    browser.assert_quiet();
}

/// Without WebGL the page shows a still picture of the start with a note. Numbers and plots still
/// work.
#[test]
#[ignore = "a browser"]
fn without_webgl_there_is_a_picture() {
    let pages = Pages::new();
    let browser = Browser::without_graphics(1280, 800);
    for (name, page, count) in [("one", pages.drop(), 1), ("two", pages.pair(), 2)] {
        browser.open(&page);
        let said = "return [...document.querySelectorAll('.stage:not([hidden]) .remark')] \
                    .map((e) => e.textContent)";
        let sentence = "this browser has no WebGL: the picture stands still at the start";
        assert_eq!(browser.run(said), serde_json::json!(vec![sentence; count]));
        let stills = "return [...document.querySelectorAll('.still')].filter((e) => \
                      e.checkVisibility() && e.naturalWidth > 300).length";
        assert_eq!(browser.run(stills), count);
        assert_eq!(browser.run("return document.querySelectorAll('.stage canvas').length"), 0);
        browser.press(END, None);
        assert_eq!(browser.row(), "999");
        browser.press("f", None);
        browser.press("i", None);
        browser.press(HOME, None);
        browser.click("#play");
        browser.wait_for("Number(document.getElementById('scrub').value) > 0.05");
        browser.click("#play");
        assert_eq!(browser.run("return document.getElementById('reset').disabled"), true);
        browser.wait_for("document.querySelector('#plot-z .u-over')");
        browser.screenshot(&format!("no-webgl-{name}"));
        browser.assert_quiet();
    }
}
