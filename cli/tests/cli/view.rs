//! `tumble view` and `--html`: content of the page, and refusals. Tests in a browser are in
//! `cli/tests/pictures/browser/mod.rs`.

use crate::support::{
    End, FAILING_RUN, Simulated, Table, WRITTEN, everything_in, run, simulate, tumble, two_impacts,
};
use base64::Engine as _;
use base64::engine::general_purpose::STANDARD;
use serde_json::Value;
use std::fs;
use std::path::Path;

const RUN: [&str; 4] = ["--steps", "400", "--solver", "native"];

/// Page and its embedded data.
struct Page {
    text: String,
    data: Value,
}

impl Page {
    fn read(path: &Path) -> Self {
        let text = fs::read_to_string(path).unwrap();
        let opening = "<script type=\"application/json\" id=\"data\">";
        let (_, rest) = text.split_once(opening).expect("the page has its data");
        let (json, _) = rest.split_once("</script>").unwrap();
        let data = serde_json::from_str(json).unwrap();
        Self { text, data }
    }

    fn frames(&self, run: usize) -> &Value {
        &self.data["runs"][run]["frames"]
    }

    fn plot(&self, id: &str) -> &Value {
        let sheets = self.data["sheets"].as_array().unwrap().iter();
        let mut plots = sheets.flat_map(|sheet| sheet["plots"].as_array().unwrap());
        plots.find(|plot| plot["id"] == id).unwrap_or_else(|| panic!("no plot {id}"))
    }

    fn fact(&self, run: usize, name: &str) -> &str {
        let lists = ["facts", "record"].map(|of| self.data["runs"][run][of].as_array().unwrap());
        let fact = lists.into_iter().flatten().find(|fact| fact["name"] == name);
        fact.unwrap_or_else(|| panic!("no fact {name}"))["value"].as_str().unwrap()
    }
}

fn bytes(text: &Value) -> Vec<u8> {
    STANDARD.decode(text.as_str().unwrap()).unwrap()
}

/// Relative rounding error of sixteen significant bits.
const ROUNDING: f64 = 1.0 / 65_536.0;

/// Decodes packed integers. Each code is the difference from a prediction by the previous values,
/// in groups of seven bits with the lowest first. Code 0 with a count repeats the prediction, and
/// code 1 is a missing value.
fn whole(packed: &Value) -> Vec<Option<i64>> {
    let mut bytes = bytes(&packed["bytes"]).into_iter();
    let mut next = || {
        let mut code = 0u64;
        for group in 0.. {
            let byte = bytes.next().expect("a whole code");
            code |= u64::from(byte & 0x7f) << (7 * group);
            if byte < 0x80 {
                break;
            }
        }
        code
    };
    let count = packed["count"].as_u64().unwrap() as usize;
    let is_straight = packed["order"] == 2;
    let (mut values, mut last, mut before) = (Vec::new(), 0, 0);
    while values.len() < count {
        let code = next();
        for _ in 0..if code == 0 { next() + 1 } else { 1 } {
            let half = (code / 2) as i64;
            let more = if code % 2 == 1 { half } else { -half };
            if code != 1 {
                let told = if is_straight { 2 * last - before } else { last };
                (before, last) = (last, told + more);
            }
            values.push((code != 1).then_some(last));
        }
    }
    values
}

/// Values in multiples of a step, and the step.
fn measures(packed: &Value) -> (Vec<f64>, f64) {
    let step = packed["step"].as_f64().unwrap();
    let value = |whole: Option<i64>| whole.map_or(f64::NAN, |whole| whole as f64 * step);
    (whole(packed).into_iter().map(value).collect(), step)
}

/// Values of sixteen significant bits: the upper three bytes of an `f32`.
fn floats(packed: &Value) -> Vec<f32> {
    let value = |whole: Option<i64>| {
        let Some(upper) = whole else { return f32::NAN };
        let size = f32::from_bits((upper.unsigned_abs() as u32) << 8);
        if upper < 0 { -size } else { size }
    };
    whole(packed).into_iter().map(value).collect()
}

fn integers(packed: &Value) -> Vec<usize> {
    whole(packed).into_iter().map(|value| value.unwrap() as usize).collect()
}

/// Nonzero forces of a contact with their frames.
type OfContact = Vec<(usize, [f64; 3])>;

/// Forces of a run of one body on the ground and their rounding step.
fn forces(frames: &Value) -> (Vec<OfContact>, f64) {
    let in_frames = integers(&frames["force_frames"]);
    let (values, step) = measures(&frames["forces"]);
    let mut first = 0;
    let of_site = |site: &Value| {
        let [body, partner, count] = [0, 1, 2].map(|k| site[k].as_i64().unwrap());
        assert_eq!((body, partner), (0, -1), "of the only body, by the ground");
        let count = count as usize;
        let force = |i: usize| [0, 1, 2].map(|k| values[3 * first + k * count + i]);
        let all = (0..count).map(|i| (in_frames[first + i], force(i))).collect();
        first += count;
        all
    };
    let sites = frames["sites"].as_array().unwrap().iter().map(of_site).collect();
    assert_eq!((first, 3 * first), (in_frames.len(), values.len()));
    (sites, step)
}

/// Rows and values of a curve.
fn curve(series: &Value) -> Vec<(usize, f32)> {
    integers(&series["rows"]).into_iter().zip(floats(&series["values"])).collect()
}

fn view(files: &[&Path], args: &[&str]) -> End {
    tumble().arg("view").args(files).args(args).output().unwrap().into()
}

fn simulate_with_page(args: &[&str]) -> (Simulated, Page) {
    let simulated = simulate(&[args, &["--html"]].concat());
    let page = Page::read(&simulated.path("view.html"));
    (simulated, page)
}

#[test]
fn the_page_is_one_file_that_loads_nothing() {
    let (simulated, page) = simulate_with_page(&RUN);
    assert_eq!((simulated.end.code, simulated.end.stderr.as_str()), (Some(0), ""));
    assert!(simulated.end.stdout.contains("view.html"), "{}", simulated.end.stdout);
    assert_eq!(everything_in(&simulated.path("")).len(), WRITTEN.len() + 1);
    assert!(page.text.contains("default-src 'none'"));
    // uPlot's licence comment and the XML namespaces are not loaded.
    let known = [
        "https://github.com/leeoniya/uPlot",
        "http://www.w3.org/2000/svg",
        "http://www.w3.org/1999/xhtml",
    ];
    for scheme in ["http://", "https://"] {
        for (place, _) in page.text.match_indices(scheme) {
            let rest = &page.text[place..];
            assert!(known.iter().any(|known| rest.starts_with(known)), "{:.80}", rest);
        }
    }
    // The still picture is embedded in the page.
    for (place, _) in page.text.match_indices(" src=") {
        let rest = &page.text[place..];
        assert!(rest.starts_with(" src=\"data:image/png;base64,"), "{rest:.60}");
    }
    for word in ["@import", "url(", "fetch(", "XMLHttpRequest", "import(", "WebSocket"] {
        assert!(!page.text.contains(word), "{word}");
    }
    let links: Vec<_> = page.text.match_indices(" href=").map(|(i, _)| &page.text[i..]).collect();
    assert!(links.iter().all(|link| link.starts_with(" href=\"data:,\"")), "{links:.60?}");
}

/// The page contains the tilted plane, and the height of the lowest point is measured from it.
#[test]
fn a_slope_is_a_slope_in_the_page() {
    let body = [
        "--set",
        "body.box=0.4,0.3,0.2",
        "--set",
        "body.mass=2",
        "--set",
        "body.inertia=solid",
        "--solver",
        "native",
    ];
    let ground = [
        "--set",
        "ground.slope=25",
        "--mu",
        "0.4",
        "--set",
        "start.frame=ground",
        "--steps",
        "200",
    ];
    let place = ["--set", "start.position=0,0,0.1", "--set", "start.attitude=1,0,0,0"];
    let motion = ["--set", "start.velocity=0,0,0", "--set", "start.spin=0,0,0"];
    let (_, page) = simulate_with_page(&[&body[..], &ground, &place, &motion].concat());
    let ground = &page.data["runs"][0]["ground"];
    let normal = [25f64.to_radians().sin(), 0.0, 25f64.to_radians().cos()];
    for (axis, expected) in normal.into_iter().enumerate() {
        assert!((ground["normal"][axis].as_f64().unwrap() - expected).abs() < 1e-15);
    }
    assert_eq!(ground["offset"], 0.0);
    assert!(page.fact(0, "ground").starts_with("slope 25°"), "{}", page.fact(0, "ground"));
    let height = curve(&page.plot("height")["series"][0]);
    assert!(height.iter().all(|(_, z)| z.abs() < 1e-9), "{height:?}");
    // The plane takes m g cos θ by its normal and μ times that by friction, with m = 2 kg: the box
    // slides.
    let force = f64::from(curve(&page.plot("force")["series"][0])[1].1);
    let expected = 2.0 * 9.81 * normal[2] * 0.4_f64.hypot(1.0);
    assert!((force - expected).abs() < ROUNDING * expected, "{force}");
}

/// The page shows a ground exactly if the run has one in reach, also if nothing touches it.
#[test]
fn the_page_has_a_ground_where_the_run_has_one() {
    let ground = |args: &[&str]| {
        let (_simulated, page) = simulate_with_page(args);
        page.data["runs"][0]["ground"].clone()
    };
    let falling = ["--scene", "floating", "--gravity", "9.81", "--steps", "100"];
    assert!(ground(&falling).is_null());
    let hovering = [
        "--solver",
        "native",
        "--gravity",
        "0",
        "--set",
        "start.position=0,0,1.8",
        "--steps",
        "20",
    ];
    assert_eq!(ground(&hovering)["normal"], serde_json::json!([0.0, 0.0, 1.0]));
}

/// Positions, attitudes, residuals, statuses, forces and curves of the page equal the trajectory to
/// their rounding.
#[test]
fn the_data_are_the_trajectory_s_own_numbers() {
    let (simulated, page) = simulate_with_page(&RUN);
    let table = simulated.table();
    let frames = page.frames(0);
    assert_eq!((&frames["every"], &frames["count"]), (&1.into(), &400.into()));
    // Positions are rounded to 1e-4 m and attitudes to less than 1e-4, with each component stored
    // over all rows.
    let (positions, length) = measures(&frames["positions"]);
    assert_eq!((positions.len(), length), (3 * 400, 1e-4));
    for (part, name) in ["x_m", "y_m", "z_m"].into_iter().enumerate() {
        let origin = frames["origin"][part].as_f64().unwrap();
        for (row, value) in table.numbers(name).into_iter().enumerate() {
            let shown = origin + positions[400 * part + row];
            assert!((shown - value).abs() < 0.501 * length, "{name} {row}: {shown} {value}");
        }
    }
    let (attitudes, turn) = measures(&frames["attitudes"]);
    assert_eq!(attitudes.len(), 4 * 400);
    assert!(turn < 1e-4);
    let parts = ["qw", "qx", "qy", "qz"].map(|name| table.numbers(name));
    for row in 0..400 {
        let shown = [0, 1, 2, 3].map(|part| attitudes[400 * part + row]);
        // A quaternion and its negative are the same attitude.
        let along: f64 = (0..4).map(|part| shown[part] * parts[part][row]).sum();
        for (shown, of) in shown.iter().zip(&parts) {
            assert!((shown * along.signum() - of[row]).abs() < 0.501 * turn, "{row}");
        }
    }
    let certificates = table.numbers("certificate_m_s");
    let shown = floats(&frames["residuals"]);
    assert_eq!(shown.len(), 400);
    for (shown, value) in shown.iter().zip(&certificates) {
        assert!((f64::from(*shown) - value).abs() <= ROUNDING * value, "{shown} {value}");
    }
    let names = page.data["statuses"].as_array().unwrap();
    let statuses = bytes(&frames["statuses"]);
    for (status, text) in statuses.into_iter().zip(table.texts("status")) {
        assert_eq!(names[usize::from(status)], text);
    }

    // All forces above 1e-6 of the weight are in the page.
    let (sites, step) = forces(frames);
    assert!((step / 98.1e-4 - 1.0).abs() < 1e-12, "1e-4 of the weight");
    let mut count = 0;
    let mut shown: Vec<_> = sites.into_iter().flatten().collect();
    let parts =
        |corner: usize| ["fx", "fy", "fz"].map(|part| table.numbers(&format!("{part}{corner}_N")));
    for parts in (0..8).map(parts) {
        let force = |row: usize| [0, 1, 2].map(|k: usize| parts[k][row]);
        let presses = |row: &usize| force(*row).iter().map(|f| f * f).sum::<f64>().sqrt() > 98.1e-6;
        for row in (0..400).filter(presses) {
            let is_it = |(of, shown): &(usize, [f64; 3])| {
                let mut pairs = shown.iter().zip(force(row));
                *of == row && pairs.all(|(shown, value)| (shown - value).abs() < 0.501 * step)
            };
            let found = shown.iter().position(is_it).unwrap_or_else(|| panic!("row {row}"));
            shown.swap_remove(found);
            count += 1;
        }
    }
    assert!(shown.is_empty() && count > 100, "{count}, and {shown:?}");

    // Curve with constant stretches restored.
    let z = curve(&page.plot("z")["series"][0]);
    let values = table.numbers("z_m");
    assert_eq!((z[0].0, z[z.len() - 1].0), (0, 399));
    for pair in z.windows(2) {
        let is_shown =
            |row: usize| (f64::from(pair[0].1) - values[row]).abs() <= ROUNDING * values[row].abs();
        assert!((pair[0].0..pair[1].0).all(is_shown), "{pair:?}");
    }
    let worst = &page.data["runs"][0]["worst"];
    let largest = certificates.iter().copied().fold(0.0, f64::max);
    assert_eq!(worst["residual"].as_f64().unwrap(), largest);
    assert_eq!(certificates[worst["row"].as_u64().unwrap() as usize], largest);
}

/// The page is given to the program that opens files.
#[cfg(target_os = "linux")]
#[test]
fn a_page_is_opened_on_request() {
    use std::os::unix::fs::PermissionsExt as _;
    let (simulated, _) = simulate_with_page(&RUN);
    let opener = simulated.path("xdg-open");
    fs::write(&opener, "#!/bin/sh\nprintf %s \"$1\" > \"$0.seen\"\n").unwrap();
    fs::set_permissions(&opener, fs::Permissions::from_mode(0o755)).unwrap();
    let mut command = tumble();
    command.args(["view", "--open"]).arg(simulated.path("")).env("PATH", simulated.path(""));
    assert!(command.output().unwrap().status.success());
    let seen = simulated.path("xdg-open.seen");
    while fs::read(&seen).map_or(true, |seen| seen.is_empty()) {
        std::thread::sleep(std::time::Duration::from_millis(10));
    }
    assert_eq!(Path::new(&fs::read_to_string(seen).unwrap()), simulated.path("view.html"));
    let end = command.env("PATH", "").output().unwrap();
    assert!(String::from_utf8_lossy(&end.stderr).contains("--open: xdg-open does not start"));
}

/// Joint forces of the page hold up a hanging bar: their sum is its weight, upwards.
#[test]
fn joint_forces_are_in_the_world_frame() {
    let out = tempfile::tempdir().unwrap();
    let scene = out.path().join("hanging.toml");
    let text = r#"
        name = "hanging"
        steps = 5
        [ground]
        none = true
        friction = 0.5
        [[bodies]]
        name = "bar"
        box = [0.2, 0.2, 1.0]
        mass = 2.0
        position = [0.0, 0.0, -0.5]
        [[joints]]
        name = "pin"
        type = "revolute"
        bodies = ["bar"]
        axis = [0, 1, 0]
        anchor = [0.0, 0.0, 0.0]
    "#;
    fs::write(&scene, text).unwrap();
    let (_, page) = simulate_with_page(&[scene.to_str().unwrap()]);
    let frames = &page.data["runs"][0]["frames"];
    let forces = whole(&frames["joint_forces"]);
    let count = frames["count"].as_u64().unwrap() as usize;
    let step = frames["joint_forces"]["step"].as_f64().unwrap();
    let force = [0, 1, 2].map(|axis| forces[axis * count].unwrap() as f64 * step);
    assert!(force[0].abs() < 0.01 && force[1].abs() < 0.01, "{force:?}");
    assert!((force[2] - 2.0 * 9.81).abs() < 0.01, "{force:?}");
}

#[test]
fn the_parameters_and_counts_are_those_of_run_json() {
    let args =
        ["--set", "body.inertia=1,2,3", "--set", "body.box=1,2,0.5", "--mu", "0.5", "--seed", "7"];
    let (simulated, page) = simulate_with_page(&[RUN.as_slice(), &args].concat());
    for (name, value) in [
        ("scene", "drop"),
        ("seed", "7"),
        ("solver", "native"),
        ("rows", "400"),
        ("time step h", "0.002 s"),
        ("mass m", "10 kg"),
        ("friction μ", "0.5"),
        ("gravity g", "(0, 0, -9.81) m/s²"),
        ("inertia I", "diag(1, 2, 3) kg m²"),
        ("body", "box 1 × 2 × 0.5 m"),
        ("start velocity", "(0, 4, 0) m/s"),
    ] {
        let run = &page.data["runs"][0];
        let lists = [&run["facts"], &run["record"], &run["bodies"][0]["facts"]];
        let mut all = lists.into_iter().flat_map(|list| list.as_array().unwrap());
        let found = all.find(|fact| fact["name"] == name);
        assert_eq!(found.unwrap_or_else(|| panic!("no fact {name}"))["value"], value);
    }
    let summary = &simulated.run_json()["summary"];
    for count in page.data["runs"][0]["counts"].as_array().unwrap() {
        let name = count[0].as_str().unwrap();
        let field = if name == "free" { "free_steps" } else { name };
        assert_eq!(count[1], summary[field], "{name}");
    }
    // The plots are the same as in `tumble plot`.
    for id in ["x", "speed", "force", "contacts", "energy", "height", "residual", "iterations"] {
        assert!(page.plot(id)["axis"]["ticks"].is_array(), "{id}");
    }
}

#[test]
fn two_impacts_in_200_000_rows_are_kept_in_the_page() {
    let directory = two_impacts(200_000, "converged");
    let end = view(&[&directory.path().join("states.csv")], &[]);
    // One of the steps failed.
    assert_eq!((end.code, end.stderr.as_str()), (Some(3), ""));
    let page = Page::read(&directory.path().join("view.html"));
    assert!(page.text.len() < 1_500_000, "{}", page.text.len());

    let z = curve(&page.plot("z")["series"][0]);
    assert!(z.contains(&(77_777, 9.0)) && z.contains(&(123_456, -3.0)), "{z:?}");
    let force = curve(&page.plot("force")["series"][0]);
    assert!(force.contains(&(77_777, 20_025.0)), "{force:?}");
    let marks = &page.plot("residual")["marks"][0];
    assert_eq!((&marks["status"], &marks["count"]), (&"failed".into(), &1.into()));
    assert_eq!(integers(&marks["rows"]), [77_777]);

    // The frame with the impact has the mean force and the worst status of its steps.
    let frames = page.frames(0);
    let every = frames["every"].as_u64().unwrap() as usize;
    assert_eq!(every, 34);
    let frame = 77_777 / every;
    let names = page.data["statuses"].as_array().unwrap();
    assert_eq!(names[usize::from(bytes(&frames["statuses"])[frame])], "failed");
    let mean = (20_000.0 + 25.0 * (every - 1) as f64) / every as f64;
    let (sites, step) = forces(frames);
    let largest = sites.iter().flatten().filter(|(of, _)| *of == frame);
    let largest = largest.map(|(_, force)| force[2]).fold(0.0, f64::max);
    assert!((largest - mean).abs() < 0.501 * step, "{largest} {mean}");
}

#[test]
fn more_marks_than_a_page_takes_are_thinned_and_counted() {
    let directory = two_impacts(20_000, "failed");
    assert_eq!(view(&[&directory.path().join("states.csv")], &[]).code, Some(3));
    let page = Page::read(&directory.path().join("view.html"));
    let marks = &page.plot("residual")["marks"][0];
    assert_eq!(marks["count"], 19_999);
    let rows = integers(&marks["rows"]);
    assert!((4000..=5000).contains(&rows.len()), "{}", rows.len());
    assert!(rows.windows(2).all(|pair| pair[1] - pair[0] == rows[1]));
}

/// Two runs share one time axis, and the page plots their distance.
#[test]
fn two_runs_share_the_time_and_have_a_distance() {
    let fine = simulate(&["--steps", "300", "--solver", "native"]);
    let coarse =
        simulate(&["--steps", "100", "--solver", "native", "--dt", "0.004", "--mu", "0.4"]);
    let files = [coarse.path("states.csv"), fine.path("states.csv")];
    let out = fine.directory.path().join("pair");
    let end = view(&[&files[0], &files[1]], &["--out", out.to_str().unwrap()]);
    assert_eq!((end.code, end.stderr.as_str()), (Some(0), ""));
    let page = Page::read(&out.join("view.html"));
    assert_eq!(page.data["runs"].as_array().unwrap().len(), 2);
    assert_eq!((page.fact(0, "friction μ"), page.fact(1, "friction μ")), ("0.4", "0.3"));
    assert_eq!(page.fact(1, "file"), files[1].to_str().unwrap());
    assert_eq!(page.plot("z")["series"].as_array().unwrap().len(), 2);
    assert_eq!(page.plot("force")["series"].as_array().unwrap().len(), 2);

    // Distances are given at the rows of the finer run while both last. 99 coarse steps equal 198
    // fine steps.
    let distance = &page.plot("distance")["series"][0];
    assert_eq!(distance["run"], 1);
    let points = curve(distance);
    assert_eq!(points[points.len() - 1].0, 198);
    let position =
        |table: &Table, row: usize| ["x_m", "y_m", "z_m"].map(|name| table.numbers(name)[row]);
    let (fine, coarse) = (fine.table(), coarse.table());
    for (row, value) in points.into_iter().filter(|(row, _)| row % 33 == 0) {
        let a = position(&fine, row);
        let (before, after) = (position(&coarse, row / 2), position(&coarse, row.div_ceil(2)));
        let squares = (0..3).map(|k| (a[k] - 0.5 * (before[k] + after[k])).powi(2));
        let expected = squares.sum::<f64>().sqrt();
        assert!((f64::from(value) - expected).abs() <= ROUNDING * expected + 1e-15, "{row}");
    }
}

#[test]
fn a_single_row_and_a_body_that_is_no_box_have_pages() {
    let (simulated, page) = simulate_with_page(&["--steps", "1", "--quiet"]);
    assert_eq!((simulated.end.code, simulated.end.stdout.as_str()), (Some(0), ""));
    assert_eq!(page.frames(0)["count"], 1);
    assert_eq!(page.plot("force")["nothing"], "no step in this run");
    assert!(page.data["runs"][0]["worst"].is_null());

    let mut run_json = simulated.run_json();
    let corners: Vec<_> = (0..8).map(|i| [1.0 + f64::from(i), 1.0, 1.0]).collect();
    let body = run_json["model"]["bodies"][0].as_object_mut().unwrap();
    body.remove("pieces");
    body.insert("points".to_owned(), serde_json::json!(corners));
    fs::write(simulated.path("run.json"), run_json.to_string()).unwrap();
    assert_eq!(view(&[&simulated.path("states.csv")], &[]).code, Some(0));
    let page = Page::read(&simulated.path("view.html"));
    let body = &page.data["runs"][0]["bodies"][0];
    assert_eq!(body["pieces"], serde_json::json!([]));
    assert_eq!(body["points"].as_array().map(Vec::len), Some(8));
    let facts = body["facts"].as_array().unwrap();
    assert!(facts.contains(&serde_json::json!({"name": "body", "value": "8 contact points"})));
}

#[test]
fn failed_steps_are_marked_and_keep_the_exit_code() {
    let (simulated, page) = simulate_with_page(&FAILING_RUN);
    assert_eq!(simulated.end.code, Some(3));
    let failed = &simulated.run_json()["summary"]["failed"];
    let marks = page.plot("residual")["marks"].as_array().unwrap();
    let of_failed = marks.iter().find(|marks| marks["status"] == "failed").unwrap();
    assert_eq!(&of_failed["count"], failed);
    assert_eq!(integers(&of_failed["rows"]).len() as u64, failed.as_u64().unwrap());
    assert_eq!(view(&[&simulated.path("states.csv")], &[]).code, Some(3));
}

#[test]
fn a_title_from_a_file_cannot_break_the_page() {
    let simulated = simulate(&["--steps", "3"]);
    let text = fs::read_to_string(simulated.path("run.json")).unwrap();
    let evil = "</script></title><script>{{data}}<!-- & \u{2028}";
    let text = text.replace("\"drop\"", &serde_json::to_string(evil).unwrap());
    fs::write(simulated.path("run.json"), text).unwrap();
    let end = view(&[&simulated.path("states.csv")], &[]);
    assert_eq!((end.code, end.stderr.as_str()), (Some(0), ""));
    let page = Page::read(&simulated.path("view.html"));
    assert_eq!(page.fact(0, "scene"), evil);
    assert!(page.text.contains("&lt;/script&gt;&lt;/title&gt;&lt;script&gt;{{data}}&lt;!-- &amp;"));
    assert_eq!(page.text.matches("</script>").count(), 4);
    // The second line of the page says whose it is.
    assert_eq!(page.text.matches("<!--").count(), 1);
}

#[test]
fn what_cannot_be_read_or_written_is_one_sentence() {
    let simulated = simulate(&["--steps", "3"]);
    let file = simulated.path("states.csv");
    run(&["view"]).assert_refused(2, &["FILE.csv"]);
    view(&[&file, &file, &file], &[]).assert_refused(2, &["FILE.csv"]);
    let nowhere = Path::new("/nowhere/x.csv");
    view(&[nowhere], &[]).assert_refused(2, &["/nowhere/x.csv", "does not exist"]);
    view(&[&file, nowhere], &[]).assert_refused(2, &["/nowhere/x.csv", "does not exist"]);
    view(&[&file], &["--steps", "3"]).assert_refused(2, &["--steps"]);
    view(&[&simulated.path("run.json")], &[])
        .assert_refused(2, &["run.json", "is not a table of the run"]);

    let occupied = simulated.path("occupied");
    fs::write(&occupied, "").unwrap();
    view(&[&file], &["--out", occupied.to_str().unwrap()]).assert_refused(2, &["occupied"]);
    fs::create_dir(simulated.path("view.html")).unwrap();
    view(&[&file], &[]).assert_refused(1, &["view.html", "is a directory"]);
    assert_eq!(everything_in(&simulated.path("")).len(), WRITTEN.len() + 2, "nothing is left");

    // A simulation refuses at the start.
    let other = simulated.path("other");
    let out = other.to_str().unwrap();
    run(&["--html", "--steps", "1000001", "--out", out]).assert_refused(2, &["--html", "rows"]);
    assert!(!other.exists());
}
