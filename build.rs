//! Passes the version of Ipopt that `ipopt-sys` was built against to the crate, which reports it.

fn main() {
    println!("cargo:rerun-if-changed=build.rs");
    if std::env::var_os("CARGO_FEATURE_IPOPT").is_some() {
        // `links = "ipopt"` in ipopt-sys turns its `cargo:version=` line into a variable.
        let version = std::env::var("DEP_IPOPT_VERSION").unwrap_or_else(|_| "unknown".to_owned());
        println!("cargo:rustc-env=TUMBLE_IPOPT_VERSION={version}");
    }
}
