//! Runs with pages, and queries of an open page.

use super::driver::Browser;
use assert_cmd::Command;
use std::path::PathBuf;
use std::time::Duration;
use tempfile::TempDir;

/// Runs the program quietly and asserts its exit code.
pub fn tumble(args: &[&str], code: i32) {
    let mut command = Command::new(env!("CARGO_BIN_EXE_tumble"));
    command.timeout(Duration::from_secs(600));
    command.args(args).arg("--quiet").assert().code(code);
}

/// Temporary directory of runs and pages.
pub struct Pages {
    directory: TempDir,
}

impl Pages {
    pub fn new() -> Self {
        Self { directory: tempfile::tempdir().unwrap() }
    }

    pub fn path(&self, name: &str) -> PathBuf {
        self.directory.path().join(name)
    }

    /// Page of a simulation.
    pub fn simulate(&self, name: &str, args: &[&str], code: i32) -> PathBuf {
        let out = self.path(name);
        tumble(&[args, &["--html", "--out", out.to_str().unwrap()]].concat(), code);
        out.join("view.html")
    }

    /// Page of the drop scene with seed 42 and the native solver.
    pub fn drop(&self) -> PathBuf {
        self.simulate("drop", &["--steps", "1000", "--solver", "native"], 0)
    }

    /// Page of the drop scene with seed 0, in which one step is retried.
    pub fn retried(&self) -> PathBuf {
        let args = ["--steps", "1000", "--seed", "0", "--solver", "native"];
        self.simulate("retried", &args, 0)
    }

    /// Page of the drop scene and a shorter, coarser run of another body.
    pub fn pair(&self) -> PathBuf {
        self.drop();
        let other =
            ["--steps", "300", "--solver", "native", "--dt", "0.005", "--set", "body.box=1,2,0.5"];
        self.simulate("other", &other, 0);
        let [a, b] = ["drop", "other"].map(|name| self.path(name).join("states.csv"));
        let out = self.path("pair");
        tumble(
            &["view", a.to_str().unwrap(), b.to_str().unwrap(), "--out", out.to_str().unwrap()],
            0,
        );
        out.join("view.html")
    }
}

/// Queries of the page.
impl Browser {
    pub fn time(&self) -> f64 {
        self.run("return Number(document.getElementById('scrub').value)").as_f64().unwrap()
    }

    pub fn set_time(&self, time: f64) {
        self.run(&format!(
            "const scrub = document.getElementById('scrub'); scrub.value = {time}; \
             scrub.dispatchEvent(new Event('input'))"
        ));
        self.settle();
    }

    /// Row index k at the cursor.
    pub fn row(&self) -> String {
        let row = "return document.querySelectorAll('#state .k dd')[0].textContent";
        self.run(row).as_str().unwrap().to_owned()
    }

    /// Pixels of a view as a data URL.
    pub fn pixels(&self, stage: usize) -> String {
        let canvas = format!("document.querySelectorAll('.stage canvas')[{stage}]");
        self.run(&format!("return {canvas}.toDataURL()")).as_str().unwrap().to_owned()
    }

    /// Point in an element, given by shares of its width and height [pixels].
    pub fn place(&self, selector: &str, across: f64, down: f64) -> (f64, f64) {
        let corner = self.run(&format!(
            "const r = document.querySelector('{selector}').getBoundingClientRect(); \
             return [r.left + {across} * r.width, r.top + {down} * r.height]"
        ));
        (corner[0].as_f64().unwrap(), corner[1].as_f64().unwrap())
    }

    /// Centroid of the blue pixels of the body in the first view, in shares of its size.
    pub fn middle_of_body(&self) -> (f64, f64) {
        let middle = self.run(
            "const canvas = document.querySelector('.stage canvas'); \
             const { width, height } = canvas; \
             const copy = Object.assign(document.createElement('canvas'), { width, height }); \
             const context = copy.getContext('2d', { willReadFrequently: true }); \
             context.drawImage(canvas, 0, 0); \
             const { data } = context.getImageData(0, 0, width, height); \
             let [x, y, n] = [0, 0, 0]; \
             for (let i = 0; i < width * height; i += 1) { \
               if (data[4 * i + 2] - data[4 * i] < 30) continue; \
               x += i % width; y += Math.floor(i / width); n += 1; \
             } \
             return [x / n / width, y / n / height]",
        );
        (middle[0].as_f64().unwrap(), middle[1].as_f64().unwrap())
    }

    /// Number of draw calls of a frame.
    pub fn draw_calls(&self) -> u64 {
        let count = self.run(
            "const queue = []; const real = window.requestAnimationFrame; \
             window.requestAnimationFrame = (call) => queue.push(call); \
             const context = WebGL2RenderingContext.prototype; \
             const names = ['drawArrays', 'drawElements', 'drawArraysInstanced', 'drawElementsInstanced']; \
             const own = names.map((name) => context[name]); \
             let count = 0; \
             names.forEach((name, k) => { context[name] = function (...given) { \
               count += 1; return own[k].apply(this, given); }; }); \
             const scrub = document.getElementById('scrub'); \
             scrub.value = Number(scrub.value) + 1; \
             scrub.dispatchEvent(new Event('input')); \
             queue.splice(0).forEach((call) => call(performance.now())); \
             names.forEach((name, k) => { context[name] = own[k]; }); \
             window.requestAnimationFrame = real; \
             return count",
        );
        count.as_u64().unwrap()
    }

    /// Colour (red, green, blue) at a point of the first view. Returns `None` at edges, where
    /// neighbouring pixels differ.
    pub fn colour_at(&self, (x, y): (f64, f64)) -> Option<[u64; 3]> {
        let colours = self.run(&format!(
            "const canvas = document.querySelector('.stage canvas'); \
             const {{ left, top }} = canvas.getBoundingClientRect(); \
             const copy = Object.assign(document.createElement('canvas'), {{ width: 3, height: 3 }}); \
             const context = copy.getContext('2d', {{ willReadFrequently: true }}); \
             context.drawImage(canvas, 1 + left - Math.round({x}), 1 + top - Math.round({y})); \
             return Array.from(context.getImageData(0, 0, 3, 3).data)"
        ));
        let channel = |pixel: usize, k: usize| colours[4 * pixel + k].as_u64().unwrap();
        let middle = [0, 1, 2].map(|k| channel(4, k));
        let is_even = (0..9).all(|i| (0..3).all(|k| channel(i, k).abs_diff(middle[k]) < 25));
        is_even.then_some(middle)
    }

    /// Colour (as `#rrggbb`) and dash of each curve in the legend of a plot.
    pub fn legend_strokes(&self, plot: &str) -> Vec<(String, String)> {
        let strokes = self.run(&format!(
            "return [...document.querySelectorAll('#plot-{plot} .legend path')] \
             .map((path) => ['stroke', 'stroke-dasharray'].map((name) => path.getAttribute(name)))"
        ));
        let text = |value: &serde_json::Value| value.as_str().unwrap().to_owned();
        strokes.as_array().unwrap().iter().map(|pair| (text(&pair[0]), text(&pair[1]))).collect()
    }

    pub fn is_pressed(&self, id: &str) -> bool {
        self.run(&format!("return document.getElementById('{id}').ariaPressed")) == "true"
    }

    pub fn assert_fits(&self) {
        let widths = self.run("return [document.documentElement.scrollWidth, innerWidth]");
        assert_eq!(widths[0], widths[1], "the page scrolls sideways");
    }

    /// Asserts that the console is empty and no resource was loaded.
    pub fn assert_quiet(&self) {
        assert_eq!(self.console(), [""; 0]);
        assert_eq!(self.run("return globalThis.raised.splice(0)"), serde_json::json!([]));
        let loaded = self.run("return performance.getEntriesByType('resource').length");
        assert_eq!(loaded, 0, "nothing is loaded");
    }
}

/// Distance of two colours `#rrggbb` in CIELAB (ΔE of 1976), from sRGB under D65.
pub fn lab_distance(a: &str, b: &str) -> f64 {
    let lab = |colour: &str| -> [f64; 3] {
        let channel = |k: usize| {
            let byte = u8::from_str_radix(&colour[2 * k + 1..2 * k + 3], 16).unwrap();
            let s = f64::from(byte) / 255.0;
            if s <= 0.04045 { s / 12.92 } else { ((s + 0.055) / 1.055).powf(2.4) }
        };
        let [r, g, b] = [0, 1, 2].map(channel);
        let f = |t: f64| {
            if t > 216.0 / 24389.0 { t.cbrt() } else { (24389.0 / 27.0 * t + 16.0) / 116.0 }
        };
        let x = f((0.4124 * r + 0.3576 * g + 0.1805 * b) / 0.95047);
        let y = f(0.2126 * r + 0.7152 * g + 0.0722 * b);
        let z = f((0.0193 * r + 0.1192 * g + 0.9505 * b) / 1.08883);
        [116.0 * y - 16.0, 500.0 * (x - y), 200.0 * (y - z)]
    };
    let (a, b) = (lab(a), lab(b));
    (0..3).map(|k| (a[k] - b[k]).powi(2)).sum::<f64>().sqrt()
}
