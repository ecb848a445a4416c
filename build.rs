//! Hands the Ipopt version that `ipopt-sys` was built against to the crate, so that
//! `--version` and every output file can name it.

use std::env;

fn main() {
    // `links = "ipopt"` in ipopt-sys turns its `cargo:version=` line into this variable.
    let version = env::var("DEP_IPOPT_VERSION").unwrap_or_else(|_| "unknown".to_owned());
    println!("cargo:rustc-env=TUMBLE_IPOPT_VERSION={version}");
    println!("cargo:rerun-if-changed=build.rs");
}
