//! Statements of the documents that the tree contradicts or confirms: source files, equation numbers
//! and versions.

use crate::imports::root;
use std::collections::BTreeSet;
use std::fs;
use std::path::Path;

fn read(file: impl AsRef<Path>) -> String {
    fs::read_to_string(root().join(file)).unwrap()
}

/// Files of the repository with one of the `endings`, relative to its root.
pub(super) fn files(endings: &[&str]) -> Vec<String> {
    let mut found = Vec::new();
    let mut folders = vec![root().to_owned()];
    while let Some(folder) = folders.pop() {
        for entry in fs::read_dir(folder).unwrap() {
            let path = entry.unwrap().path();
            let name = path.file_name().unwrap().to_str().unwrap();
            if path.is_dir() {
                let foreign = ["target", "out", "node_modules", "vendor"];
                folders
                    .extend((!name.starts_with('.') && !foreign.contains(&name)).then_some(path));
            } else if endings.iter().any(|ending| name.ends_with(ending)) {
                found.push(path.strip_prefix(root()).unwrap().to_str().unwrap().to_owned());
            }
        }
    }
    found
}

/// Paths of source files in the inline code of a document, each with its line.
fn named_sources(text: &str) -> impl Iterator<Item = (usize, &str)> {
    text.lines().enumerate().flat_map(|(line, text)| {
        let code = text.split('`').skip(1).step_by(2);
        let is_source = |code: &&str| {
            let ends = [".rs", ".py", ".js"].iter().any(|ending| code.ends_with(ending));
            let letters = |c: char| c.is_ascii_alphanumeric() || "_-./".contains(c);
            ends && code.contains('/') && code.chars().all(letters) && !code.contains("..")
        };
        code.filter(is_source).map(move |code| (line + 1, code))
    })
}

/// A path may be that of the repository, or its last part: `contact/law.rs`.
#[test]
fn source_files_that_documents_name_exist() {
    let known = files(&[".rs", ".py", ".js"]);
    let is_known =
        |name: &str| known.iter().any(|path| path == name || path.ends_with(&format!("/{name}")));
    let (mut wrong, mut named) = (Vec::new(), 0);
    for document in files(&[".md"]) {
        for (line, name) in named_sources(&read(&document)) {
            named += 1;
            // `tests/x.rs` stands for the unit tests of any file.
            if name != "tests/x.rs" && !is_known(name) {
                wrong.push(format!("{document}:{line}: there is no {name}"));
            }
        }
    }
    assert!(wrong.is_empty(), "{}", wrong.join("\n"));
    assert!(named > 100, "{named}");
}

/// Numbers of a list such as `1…3, D1 and D2`: 1, 2, 3, D1, D2.
fn numbers(list: &str) -> BTreeSet<String> {
    let mut found = BTreeSet::new();
    for part in list.split(", ").flat_map(|part| part.split(" and ")) {
        let (first, last) = part.split_once('…').unwrap_or((part, part));
        let letters = first.trim_end_matches(|c: char| c.is_ascii_digit());
        let number = |text: &str| text[letters.len()..].parse::<u32>().unwrap();
        found.extend((number(first)..=number(last)).map(|number| format!("{letters}{number}")));
    }
    found
}

#[test]
fn architecture_names_the_equations_of_the_formulation() {
    let text = read("ARCHITECTURE.md").replace("\n  ", " ");
    let list = text.split("cited** by number: ").nth(1).unwrap().split(" in `docs").next().unwrap();
    let page = read("docs/formulation.md");
    let tags = page.split("\\tag{").skip(1).map(|tag| tag.split('}').next().unwrap());
    let plain = |tag: &str| tag.trim_end_matches(|c: char| c.is_ascii_lowercase()).to_owned();
    assert_eq!(numbers(list), tags.map(plain).collect());
}

#[test]
fn versions_in_documents_are_those_of_the_packages() {
    let version = env!("CARGO_PKG_VERSION");
    assert!(read("CITATION.cff").contains(&format!("\nversion: {version}\n")), "CITATION.cff");
    let workspace = read("Cargo.toml");
    assert_eq!(workspace.matches(&format!("version = \"={version}\"")).count(), 10);
    let package = read("python/Cargo.toml");
    let abi = package.split("abi3-py3").nth(1).unwrap().split('"').next().unwrap();
    let page = read("docs/dependencies.md");
    assert!(page.contains(&format!("versions from 3.{abi} (abi3)")), "python 3.{abi}");
}
