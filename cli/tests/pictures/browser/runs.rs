//! Pages of unusual runs: small, floating, distant, long, with many bodies or failed steps.

use super::driver::Browser;
use super::pages::{Pages, tumble};
use super::{END, RIGHT, SPACE};
use crate::ROOT;
use crate::pile;
use serde_json::Value;
use std::fs;

/// A body of 1 mm is shown with enough digits. A floating body has no friction and no ground.
#[test]
#[ignore = "a browser"]
fn small_and_floating_bodies_have_readable_pages() {
    let pages = Pages::new();
    let side = [
        "--set",
        "body.box=0.001",
        "--set",
        "start.position=0,0,0.001",
        "--set",
        "start.velocity=0.01,0,0",
    ];
    let time = ["--dt", "1e-5", "--steps", "50", "--solver", "native"];
    let small = pages.simulate("small", &[side.as_slice(), &time].concat(), 0);
    let free = pages.simulate("free", &["--scene", "floating", "--steps", "50"], 0);
    let browser = Browser::start(1280, 800);
    browser.open(&small);
    browser.press(RIGHT, None);
    let read = |name: &str| {
        let read = format!("return document.querySelector('#state .{name} dd').textContent");
        browser.run(&read).as_str().unwrap().to_owned()
    };
    assert!(read("position").ends_with("0.0010000 m"), "{}", read("position"));
    assert!(read("speed").starts_with("0.01000 "), "{}", read("speed"));
    assert_eq!(read("t"), "0.00001 s");
    browser.screenshot("small");
    browser.open(&free);
    let facts = browser.run("return document.getElementById('facts').textContent");
    assert!(!facts.as_str().unwrap().contains("friction"), "{facts}");
    // A page with two different grounds names the one in the common view.
    let slope = format!("{ROOT}/scenarios/slope.toml");
    pages.simulate("slope", &[&slope, "--steps", "50"], 0);
    let a = pages.path("slope").join("states.csv");
    let b = pages.path("small").join("states.csv");
    let out = pages.path("grounds");
    let [a, b, to] = [&a, &b, &out].map(|path| path.to_str().unwrap());
    tumble(&["view", a, b, "--out", to], 0);
    browser.open(&out.join("view.html"));
    browser.press("o", None);
    let said = "return document.querySelector('.stage:not([hidden]) .remark').textContent";
    assert_eq!(browser.run(said), "the ground is that of A");
    let grounds =
        "return [...document.querySelectorAll('tr.differs')].map((row) => row.textContent)
        .filter((text) => text.startsWith('ground'))[0]";
    let grounds = browser.run(grounds);
    assert!(grounds.as_str().unwrap().contains("level, z = 0 m"), "{grounds}");
    browser.assert_quiet();
}

/// Each of a hundred bodies has its plots and can be selected by a click or from the list. Playback
/// is smooth.
#[test]
#[ignore = "a browser"]
fn a_hundred_bodies_play_and_are_chosen() {
    let pages = Pages::new();
    let path = pages.path("hundred.html");
    let film = pile::film(600);
    fs::write(&path, tumble_view::view::page("0", &[&film]).unwrap()).unwrap();
    let browser = Browser::start(1280, 800);
    browser.open(&path);
    browser.screenshot("many-start");
    let chosen = || browser.run("return document.getElementById('body').selectedOptions[0].text");
    let position =
        || browser.run("return document.querySelector('#state .position dd').textContent");
    // The bricks lie still.
    assert_eq!((chosen(), position()), ("ball 60".into(), "−1.1000, −2.4395, 0.9116 m".into()));
    // Positions of two bodies in the page.
    for name in ["ball 62", "octahedron 88"] {
        let b = film.bodies.iter().position(|body| body.name == name).unwrap();
        browser.run(&format!(
            "const list = document.getElementById('body'); list.value = {b}; \
             list.dispatchEvent(new Event('change')); document.getElementById('follow').click()"
        ));
        browser.settle();
        let start = film.frames[0].states[b].position;
        let read = position().as_str().unwrap().replace('−', "-").replace(" m", "");
        let read: Vec<f64> = read.split(", ").map(|number| number.parse().unwrap()).collect();
        for (read, start) in read.iter().zip(start.iter()) {
            assert!((read - start).abs() < 1e-4, "{read} {start}");
        }
        let plots = "return document.querySelectorAll('.sheet h2')[0].textContent";
        assert_eq!(browser.run(plots), format!("Motion and contact: {name}"));
        browser.run("document.getElementById('follow').click()");
    }
    // A click selects the body drawn there. The colour at the point must be one of the six colours
    // of bodies, which repeat by index.
    browser.click("#forces");
    browser.click("#trail");
    let (mut found, mut compared) = (std::collections::BTreeSet::new(), 0);
    for (across, down) in (0..96).map(|i| (f64::from(i % 12), f64::from(i / 12))) {
        let place = browser.place(".stage canvas", 0.12 + 0.07 * across, 0.3 + 0.06 * down);
        browser.run("document.getElementById('body').value = '-1'");
        let colour = browser.colour_at(place);
        browser.drag("mouse", &[[place, place]]);
        let chosen = browser.run("return Number(document.getElementById('body').value || -1)");
        // A click beside all bodies shows the first that moves.
        let Some(b) = chosen.as_i64().filter(|b| *b >= 0 && *b != 60) else { continue };
        found.insert(b);
        let Some([red, green, blue]) = colour else { continue };
        compared += 1;
        let expected = match b % 6 {
            0 => blue > red + 30 && blue > green + 15,
            1 => red > blue + 25 && green > blue + 15,
            2 => red > green + 25 && blue > green + 25,
            3 => blue > red + 15 && green > red,
            4 => green > red + 30 && blue > red + 25,
            _ => red > green + 25 && red > blue + 30,
        };
        assert!(expected, "{b}: {red} {green} {blue}");
    }
    assert!(found.len() > 15 && compared > 10, "{found:?}, {compared} of an even colour");
    let names = |kind: &str| found.iter().any(|b| film.bodies[*b as usize].name.starts_with(kind));
    assert!(names("brick") && names("ball"));
    browser.click("#trail");
    browser.run(
        "const list = document.getElementById('body'); list.value = '62'; \
         list.dispatchEvent(new Event('change'))",
    );
    browser.set_time(0.3);
    browser.screenshot("many");
    // Bodies of one shape are drawn together, and all forces are.
    for forces in [false, true] {
        if browser.is_pressed("forces") != forces {
            browser.click("#forces");
        }
        let count = browser.draw_calls();
        assert!((5..40).contains(&count), "{count} draw calls, forces {forces}");
    }
    browser.colour_scheme("dark");
    browser.set_time(0.6);
    browser.screenshot("many-dark");
    browser.assert_quiet();
}

/// A slow machine paints motion with fewer pixels and still pictures with all pixels.
#[test]
#[ignore = "a browser"]
fn a_slow_machine_keeps_pace() {
    let pages = Pages::new();
    let browser = Browser::start(800, 600);
    browser.open(&pages.drop());
    // Frames by a simulated clock with a fixed interval [ms].
    browser.run(
        "window.queue = []; window.requestAnimationFrame = (call) => queue.push(call); \
         let now = performance.now(); \
         window.pass = (count, apart) => { for (let k = 0; k < count; k += 1) { \
           now += apart; queue.splice(0).forEach((call) => call(now)); } \
           return document.querySelector('.stage canvas').width; }",
    );
    let pass = |count, apart| browser.run(&format!("return pass({count}, {apart})"));
    // The page requests only these frames.
    let play = || browser.run("document.getElementById('play').click()");
    let all = pass(1, 10);
    play();
    assert_eq!(pass(30, 10), all);
    let few = pass(9, 50);
    assert!(few.as_u64() < all.as_u64(), "{few} of {all} pixels across");
    assert_eq!(pass(30, 10), few, "it changes to and fro");
    play();
    assert_eq!(pass(2, 10), all);
    browser.assert_quiet();
}

#[test]
#[ignore = "a browser"]
fn unusual_runs_have_working_pages() {
    let pages = Pages::new();
    let failing = ["--steps", "300", "--max-iter", "1", "--on-failure", "record"];
    let unusual = [
        ("failing", pages.simulate("failing", &failing, 3)),
        ("floating", pages.simulate("floating", &["--scene", "floating"], 0)),
        ("row", pages.simulate("row", &["--steps", "1"], 0)),
        ("far", pages.simulate("far", &["--steps", "9", "--solver", "native"], 0)),
        ("points", pages.simulate("points", &["--steps", "300", "--solver", "native"], 0)),
        ("long", pages.simulate("long", &["--steps", "20000", "--solver", "native"], 0)),
    ];
    // A position too large for a picture, and a body of points with a malicious name.
    let far = pages.path("far").join("states.csv");
    let text = fs::read_to_string(&far).unwrap();
    let mut lines: Vec<_> = text.lines().map(str::to_owned).collect();
    let mut fields: Vec<_> = lines[5].split(',').collect();
    (fields[3], fields[10]) = ("1e300", "-1e300");
    lines[5] = fields.join(",");
    fs::write(&far, lines.join("\n")).unwrap();
    tumble(&["view", far.to_str().unwrap()], 0);
    let points = pages.path("points");
    let run = fs::read_to_string(points.join("run.json")).unwrap();
    let mut run: Value = serde_json::from_str(&run).unwrap();
    let corners: Vec<_> = (0..8).map(|i| [f64::from(i) - 2.0, 1.0, 1.0]).collect();
    let body = run["model"]["bodies"][0].as_object_mut().unwrap();
    body.remove("pieces");
    body.insert("points".to_owned(), serde_json::json!(corners));
    run["scene"] = "</script><script>document.title = 'broken'</script>".into();
    fs::write(points.join("run.json"), run.to_string()).unwrap();
    tumble(&["view", points.join("states.csv").to_str().unwrap()], 0);

    let browser = Browser::start(1000, 700);
    for (name, page) in unusual {
        browser.open(&page);
        browser.run("document.querySelectorAll('details').forEach((plot) => { plot.open = true })");
        browser.press(RIGHT, None);
        browser.press(END, None);
        browser.press("n", None);
        browser.press("p", None);
        browser.press(SPACE, None);
        browser.settle();
        browser.press(SPACE, None);
        browser.screenshot(&format!("odd-{name}"));
        let clock = browser.run("return document.getElementById('clock').textContent");
        assert!(clock.as_str().unwrap().ends_with(" s"), "{name}: {clock}");
        let title = browser.run("return document.title");
        assert!(title != "" && title != "broken", "{name}: {title}");
        browser.assert_quiet();
        if name == "long" {
            let note = browser.run("return document.querySelector('.note').textContent");
            let expected = "every 4th of 20\u{202f}000 rows is shown";
            assert!(note.as_str().unwrap().starts_with(expected), "{note}");
        }
    }
}
