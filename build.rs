//! Hands the Ipopt version that `ipopt-sys` was built against to the crate, so that
//! `--version` and every output file can name it, and makes the crate's front page.

#[path = "build/guide.rs"]
mod guide;

use std::env;
use std::error::Error;
use std::fs;
use std::path::PathBuf;
use std::process::ExitCode;

const GUIDE: &str = "docs/guide.md";

fn main() -> ExitCode {
    match hand_over() {
        Ok(()) => ExitCode::SUCCESS,
        Err(error) => {
            eprintln!("{error}");
            ExitCode::FAILURE
        }
    }
}

fn hand_over() -> Result<(), Box<dyn Error>> {
    // `links = "ipopt"` in ipopt-sys turns its `cargo:version=` line into this variable.
    let version = env::var("DEP_IPOPT_VERSION").unwrap_or_else(|_| "unknown".to_owned());
    println!("cargo:rustc-env=TUMBLE_IPOPT_VERSION={version}");

    let source = fs::read_to_string(GUIDE).map_err(|error| format!("{GUIDE}: {error}"))?;
    let page = guide::page(&source).map_err(|error| format!("{GUIDE}, {error}"))?;
    fs::write(PathBuf::from(env::var("OUT_DIR")?).join("guide.md"), page)?;

    for file in ["build.rs", "build/guide.rs", GUIDE] {
        println!("cargo:rerun-if-changed={file}");
    }
    Ok(())
}
