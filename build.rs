//! Hands the Ipopt version that `ipopt-sys` was built against to the crate, so that
//! `--version` and every output file can name it, and makes the crate's front page; each where
//! its feature asks for it.

#[cfg(feature = "guide")]
#[path = "build/guide.rs"]
mod guide;

use std::error::Error;
use std::process::ExitCode;

fn main() -> ExitCode {
    println!("cargo:rerun-if-changed=build.rs");
    #[cfg(feature = "ipopt")]
    hand_over_ipopt_version();
    match write_front_page() {
        Ok(()) => ExitCode::SUCCESS,
        Err(error) => {
            eprintln!("{error}");
            ExitCode::FAILURE
        }
    }
}

/// `links = "ipopt"` in ipopt-sys turns its `cargo:version=` line into a variable.
#[cfg(feature = "ipopt")]
fn hand_over_ipopt_version() {
    let version = std::env::var("DEP_IPOPT_VERSION").unwrap_or_else(|_| "unknown".to_owned());
    println!("cargo:rustc-env=TUMBLE_IPOPT_VERSION={version}");
}

#[cfg(feature = "guide")]
fn write_front_page() -> Result<(), Box<dyn Error>> {
    const GUIDE: &str = "docs/guide.md";

    for file in ["build/guide.rs", "build/formulas.rs", GUIDE] {
        println!("cargo:rerun-if-changed={file}");
    }
    let source = std::fs::read_to_string(GUIDE).map_err(|error| format!("{GUIDE}: {error}"))?;
    let page = guide::page(&source).map_err(|error| format!("{GUIDE}, {error}"))?;
    let directory = std::path::PathBuf::from(std::env::var("OUT_DIR")?);
    Ok(std::fs::write(directory.join("guide.md"), page)?)
}

/// The front page is the guide as it stands.
#[cfg(not(feature = "guide"))]
fn write_front_page() -> Result<(), Box<dyn Error>> {
    Ok(())
}
