//! Equation numbers of docs/formulation.md, and their citations in the guide and in the source of
//! all crates.

use std::collections::BTreeSet;
use std::fs;
use std::path::Path;

fn read(file: impl AsRef<Path>) -> String {
    fs::read_to_string(Path::new(env!("CARGO_MANIFEST_DIR")).join(file)).unwrap()
}

/// Numbers of a page's equations: `8a` of `\tag{8a}`.
fn tags(page: &str) -> BTreeSet<String> {
    let ends = page.split("\\tag{").skip(1);
    ends.filter_map(|text| Some(text.split_once('}')?.0.to_owned())).collect()
}

#[test]
fn the_equations_are_numbered_through_and_the_guide_has_the_same_numbers() {
    let formulation = tags(&read("docs/formulation.md"));
    for number in 1..=20 {
        let parts = ["", "a"].map(|part| formulation.contains(&format!("{number}{part}")));
        assert!(parts.contains(&true), "equation {number}");
    }
    let guide = tags(&read("docs/guide.md"));
    assert!(guide.len() > 10 && guide.is_subset(&formulation), "{guide:?}");
}

/// All Rust files below `folder`.
fn sources(folder: &Path, found: &mut Vec<String>) {
    for entry in fs::read_dir(folder).unwrap() {
        let path = entry.unwrap().path();
        if path.is_dir() {
            sources(&path, found);
        } else if path.extension().is_some_and(|extension| extension == "rs") {
            found.push(read(path));
        }
    }
}

#[test]
fn the_source_cites_equations_that_exist() {
    let mut known = tags(&read("docs/formulation.md"));
    known.insert("8".to_owned());
    let mut files = Vec::new();
    for folder in ["crates", "cli/src", "src"] {
        sources(&Path::new(env!("CARGO_MANIFEST_DIR")).join(folder), &mut files);
    }
    let mut cited = 0;
    for file in &files {
        for text in file.split("(eq. ").chain(file.split(" of eq. ")).skip(1) {
            let number: String = text.chars().take_while(|c| c.is_ascii_alphanumeric()).collect();
            if text.starts_with(|c: char| c.is_ascii_digit() || c == 'D') {
                assert!(known.contains(&number), "eq. {number}");
                cited += 1;
            }
        }
    }
    assert!(cited > 40, "{cited}");
}
