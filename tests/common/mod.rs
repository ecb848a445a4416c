//! Numbers of other programs from `data`, beside the helpers of the core's tests.

// Every test program compiles this file separately and uses only a part of it.
#![allow(dead_code)]

#[path = "../../crates/core/tests/common/mod.rs"]
mod helpers;

pub use helpers::*;

use flate2::read::GzDecoder;
use nalgebra::Vector3;
use serde::Deserialize;
use std::fs::File;
use std::io::Read;
use std::path::Path;
use tumble::step_nlp::ProgramPoint;
use tumble_core::mechanics::State;

/// Seeds of the runs in `data/tutorial`.
pub const SEEDS: [u32; 4] = [42, 0, 1, 2];

/// Reads a file of the reference data and decompresses it if its name ends in `.gz`.
pub fn reference(name: &str) -> String {
    let package = Path::new(env!("CARGO_MANIFEST_DIR"));
    let root = package.ancestors().find(|folder| folder.join("data").is_dir());
    let path = root.expect("a folder with data").join("data").join(name);
    let mut file = File::open(&path).unwrap_or_else(|e| panic!("{}: {e}", path.display()));
    let mut text = String::new();
    let read = if name.ends_with(".gz") {
        GzDecoder::new(file).read_to_string(&mut text)
    } else {
        file.read_to_string(&mut text)
    };
    read.unwrap_or_else(|e| panic!("{}: {e}", path.display()));
    text
}

/// One row of `data/tutorial`: a step as CasADi and Ipopt solved it.
pub struct Row {
    pub k: i64,
    /// True if Ipopt returned `Solve_Succeeded`.
    pub solved: bool,
    pub iterations: u32,
    pub active: [bool; 8],
    pub point: ProgramPoint,
}

#[derive(Deserialize)]
struct RawRow(i64, String, u32, String, Vec<f64>);

/// Rows of one seed. The initial state (k = −1) comes first.
pub fn tutorial_rows(seed: u32) -> Vec<Row> {
    let text = reference(&format!("tutorial/seed-{seed}.csv.gz"));
    let mut reader = csv::Reader::from_reader(text.as_bytes());
    let rows = reader.deserialize().map(|row| {
        let RawRow(k, status, iterations, flags, x) = row.unwrap();
        let mut point = ProgramPoint::zeros(8);
        point.as_mut_slice().copy_from_slice(&x);
        Row {
            k,
            solved: status == "Solve_Succeeded",
            iterations,
            active: std::array::from_fn(|i| flags.as_bytes()[i] == b'1'),
            point,
        }
    });
    rows.collect()
}

impl Row {
    /// Number of flagged corners.
    pub fn flagged(&self) -> usize {
        self.active.iter().filter(|active| **active).count()
    }

    pub fn state(&self) -> State {
        self.point.state()
    }

    pub fn forces(&self) -> Vec<Vector3<f64>> {
        (0..8).map(|i| self.point.force(i)).collect()
    }
}
