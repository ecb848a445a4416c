//! Runs with their pages, and what an open page says.

use super::driver::Browser;
use assert_cmd::Command;
use std::path::PathBuf;
use std::time::Duration;
use tempfile::TempDir;

/// Runs the program, quietly; it must end with `code`.
pub fn tumble(args: &[&str], code: i32) {
    let mut command = Command::new(env!("CARGO_BIN_EXE_tumble"));
    command.timeout(Duration::from_secs(60));
    command.args(args).arg("--quiet").assert().code(code);
}

/// A directory of runs and pages.
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

    /// The page of a simulation.
    pub fn simulate(&self, name: &str, args: &[&str], code: i32) -> PathBuf {
        let out = self.path(name);
        tumble(&[args, &["--html", "--out", out.to_str().unwrap()]].concat(), code);
        out.join("view.html")
    }

    /// The drop scene, seed 42, by the native solver.
    pub fn drop(&self) -> PathBuf {
        self.simulate("drop", &["--steps", "1000", "--solver", "native"], 0)
    }

    /// The page of that and a shorter, coarser run of another body.
    pub fn pair(&self) -> PathBuf {
        self.drop();
        let other = ["--steps", "300", "--solver", "native", "--dt", "0.005", "--box", "1,2,0.5"];
        self.simulate("other", &other, 0);
        let [a, b] = ["drop", "other"].map(|name| self.path(name).join("trajectory.csv"));
        let out = self.path("pair");
        tumble(
            &["view", a.to_str().unwrap(), b.to_str().unwrap(), "--out", out.to_str().unwrap()],
            0,
        );
        out.join("view.html")
    }
}

/// What the page says, in numbers.
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

    /// k at the cursor.
    pub fn row(&self) -> String {
        let row = "return document.querySelectorAll('#state .k dd')[0].textContent";
        self.run(row).as_str().unwrap().to_owned()
    }

    /// The pixels of a view.
    pub fn pixels(&self, stage: usize) -> String {
        let canvas = format!("document.querySelectorAll('.stage canvas')[{stage}]");
        self.run(&format!("return {canvas}.toDataURL()")).as_str().unwrap().to_owned()
    }

    /// A place in an element, by shares of its width and height.
    pub fn place(&self, selector: &str, across: f64, down: f64) -> (f64, f64) {
        let corner = self.run(&format!(
            "const r = document.querySelector('{selector}').getBoundingClientRect(); \
             return [r.left + {across} * r.width, r.top + {down} * r.height]"
        ));
        (corner[0].as_f64().unwrap(), corner[1].as_f64().unwrap())
    }

    pub fn is_pressed(&self, id: &str) -> bool {
        self.run(&format!("return document.getElementById('{id}').ariaPressed")) == "true"
    }

    pub fn assert_fits(&self) {
        let widths = self.run("return [document.documentElement.scrollWidth, innerWidth]");
        assert_eq!(widths[0], widths[1], "the page scrolls sideways");
    }

    /// Nothing was said on the console and nothing was loaded.
    pub fn assert_quiet(&self) {
        assert_eq!(self.console(), [""; 0]);
        let loaded = self.run("return performance.getEntriesByType('resource').length");
        assert_eq!(loaded, 0, "nothing is loaded");
    }
}
