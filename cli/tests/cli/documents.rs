//! Snippets of the documents: the scenes and commands of a page run in its order, in a directory of
//! their own.
//!
//! - A `toml` block that begins with `# NAME.toml` is written to that file. References also have
//!   parts of a scene, without a name.
//! - In a `sh` block every line that begins with `tumble` or `mkdir` runs. The other lines install
//!   something.
//! - In a `console` block the lines after `$` run. Every line of output that is shown must be printed,
//!   except the line of the time.

use super::support::PROGRAM;
use crate::ROOT;
use std::fs;
use std::path::{Path, PathBuf};
use std::process::Command;

/// Pages outside of the folders that are searched.
const PAGES: [&str; 2] = ["README.md", "docs/start.md"];
const REFERENCES: [&str; 3] = ["docs/command-line.md", "docs/planning.md", "scenarios/README.md"];
const FOLDERS: [&str; 2] = ["docs/howto", "docs/concepts"];

fn pages() -> Vec<PathBuf> {
    let root = Path::new(ROOT);
    let listed = PAGES.iter().chain(&REFERENCES);
    let mut pages: Vec<PathBuf> = listed.map(|page| root.join(page)).collect();
    for folder in FOLDERS {
        let entries = fs::read_dir(root.join(folder)).unwrap();
        pages.extend(entries.map(|entry| entry.unwrap().path()));
    }
    pages.retain(|page| page.extension().is_some_and(|kind| kind == "md"));
    pages.sort();
    pages
}

/// Fenced block of a page.
struct Block<'a> {
    language: &'a str,
    text: &'a str,
}

fn blocks(page: &str) -> Vec<Block<'_>> {
    let mut parts = page.split("\n```");
    parts.next();
    let mut blocks = Vec::new();
    while let (Some(block), Some(_)) = (parts.next(), parts.next()) {
        let (language, text) = block.split_once('\n').unwrap();
        blocks.push(Block { language, text });
    }
    blocks
}

/// Commands of a `sh` block. A backslash continues a line.
fn commands(text: &str) -> Vec<String> {
    let text = text.replace("\\\n", " ");
    let runs = |line: &&str| line.starts_with("tumble ") || line.starts_with("mkdir ");
    text.lines().filter(runs).map(str::to_owned).collect()
}

/// Runs a command line by the shell in `folder`, which is also the home directory. Returns its output.
fn run(command: &str, folder: &Path, page: &Path) -> String {
    let program = Path::new(PROGRAM).parent().unwrap();
    let path = format!("{}:{}", program.display(), std::env::var("PATH").unwrap());
    let mut shell = Command::new("sh");
    shell.args(["-c", command]).env("PATH", path).env("HOME", folder).current_dir(folder);
    let end = shell.output().unwrap();
    let error = String::from_utf8_lossy(&end.stderr);
    assert!(end.status.success(), "{}: {command}: {error}", page.display());
    String::from_utf8(end.stdout).unwrap()
}

/// Runs the commands of a console and compares the lines that the page shows.
fn console(text: &str, folder: &Path, page: &Path) -> usize {
    let mut printed = String::new();
    let mut commands = 0;
    for line in text.lines() {
        if let Some(command) = line.strip_prefix("$ ") {
            let command = command.replace("cargo run --release --", "tumble");
            printed = run(&command, folder, page);
            commands += 1;
        } else if !line.starts_with("  time ") {
            let is_shown = printed.lines().any(|other| other == line);
            assert!(is_shown, "{} shows {line:?}, but this is printed:\n{printed}", page.display());
        }
    }
    commands
}

#[test]
fn the_snippets_of_the_documents_run() {
    let mut ran = 0;
    for page in pages() {
        let directory = tempfile::tempdir().unwrap();
        let folder = directory.path();
        for name in ["scenarios", "data"] {
            std::os::unix::fs::symlink(Path::new(ROOT).join(name), folder.join(name)).unwrap();
        }
        let text = fs::read_to_string(&page).unwrap();
        for block in blocks(&text) {
            match block.language {
                "toml" => {
                    let name = block.text.strip_prefix("# ").and_then(|text| text.lines().next());
                    let name = name.and_then(|line| line.split([' ', ':']).next());
                    if let Some(name) = name.filter(|name| name.ends_with(".toml")) {
                        fs::write(folder.join(name), block.text).unwrap();
                    } else {
                        let is_reference = REFERENCES.iter().any(|name| page.ends_with(name));
                        assert!(is_reference, "{page:?}: a scene without a name");
                    }
                }
                "sh" => {
                    for command in commands(block.text) {
                        run(&command, folder, &page);
                        ran += 1;
                    }
                }
                "console" => ran += console(block.text, folder, &page),
                _ => {}
            }
        }
    }
    assert!(ran > 20, "{ran}");
}
