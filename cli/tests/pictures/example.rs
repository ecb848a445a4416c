//! Paths of the built example programs.

use serde_json::Value;
use std::path::PathBuf;
use std::process::Command;

/// Builds an example or a measuring program and returns its path. It builds the whole workspace, as
/// the test run does. Building the library alone would select other dependency features and compile
/// everything again.
pub fn built(example: &str) -> PathBuf {
    let built = Command::new(env!("CARGO"))
        .args(["build", "--quiet", "--locked", "--workspace", "--message-format=json"])
        .args(["--bins", "--examples"])
        .current_dir(env!("CARGO_MANIFEST_DIR"))
        .output()
        .unwrap();
    assert!(built.status.success(), "{}", String::from_utf8_lossy(&built.stderr));
    let messages = String::from_utf8(built.stdout).unwrap();
    let messages = messages.lines().map(|line| serde_json::from_str::<Value>(line).unwrap());
    let is_of = |message: &Value| message["target"]["name"] == example;
    let mut programs =
        messages.filter(is_of).filter_map(|built| Some(built["executable"].as_str()?.into()));
    programs.next().unwrap()
}
