//! The example programs, built.

use serde_json::Value;
use std::path::PathBuf;
use std::process::Command;

/// Builds an example or a measuring program (mostly it is built) and says where it is. Of the whole workspace, as all tests are: by itself
/// the library would want dependencies with other features, and all would be built once more.
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
