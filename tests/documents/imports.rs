//! Order of imports: the layers of the core, and folders whose modules form no circle.

use std::collections::{BTreeMap, BTreeSet};
use std::fs;
use std::path::{Path, PathBuf};

/// Modules of the core in the order of ARCHITECTURE.md. A module imports earlier ones only.
const LAYERS: [&str; 16] = [
    "partner",
    "error",
    "sets",
    "sparse",
    "kinematics",
    "geometry",
    "mechanics",
    "joint",
    "world",
    "contact",
    "query",
    "derivative",
    "problem",
    "step",
    "solver",
    "simulation",
];

/// Folders without circles, each with the path of its module.
const TREES: [(&str, &str); 4] = [
    ("cli/src", "crate::"),
    ("crates/core/src/geometry", "crate::geometry::"),
    ("crates/scene/src", "crate::"),
    ("crates/scene/src/bodies", "crate::bodies::"),
];

type Imports = BTreeMap<String, BTreeSet<String>>;

fn root() -> &'static Path {
    Path::new(env!("CARGO_MANIFEST_DIR"))
}

/// Rust files below `folder`.
fn sources(folder: &Path) -> Vec<PathBuf> {
    let mut found = Vec::new();
    for entry in fs::read_dir(folder).unwrap() {
        let path = entry.unwrap().path();
        if path.is_dir() {
            found.extend(sources(&path));
        } else if path.extension().is_some_and(|extension| extension == "rs") {
            found.push(path);
        }
    }
    found
}

/// First names behind `prefix` in the use statements of a file, without its unit tests.
fn imported(text: &str, prefix: &str) -> BTreeSet<String> {
    let program = text.split("#[cfg(test)]\nmod ").next().unwrap();
    let mut names = BTreeSet::new();
    for statement in program.split("use ").skip(1) {
        let statement = statement.split(';').next().unwrap();
        let Some(rest) = statement.strip_prefix(prefix) else { continue };
        let (mut depth, mut begins) = (0, true);
        for (place, letter) in rest.char_indices() {
            match letter {
                '{' => depth += 1,
                '}' => depth -= 1,
                ',' if depth == 1 => begins = true,
                _ if begins && !letter.is_whitespace() => {
                    let is_part = |c: char| c.is_alphanumeric() || c == '_';
                    names.insert(rest[place..].split(|c| !is_part(c)).next().unwrap().to_owned());
                    begins = false;
                }
                _ => {}
            }
        }
    }
    names
}

/// Imports between the modules of `folder`, which others name by `path`.
fn imports(folder: &Path, path: &str) -> Imports {
    let mut imports = Imports::new();
    for file in sources(folder) {
        let text = fs::read_to_string(&file).unwrap();
        let below = file.strip_prefix(folder).unwrap();
        let first = below.components().next().unwrap().as_os_str().to_str().unwrap();
        let names = imports.entry(first.trim_end_matches(".rs").to_owned()).or_default();
        names.extend(imported(&text, path));
        match below.components().count() {
            1 => names.extend(imported(&text, "super::")),
            2 if below.ends_with("mod.rs") => names.extend(imported(&text, "super::")),
            _ => {}
        }
    }
    imports.retain(|name, _| !["mod", "lib", "main"].contains(&name.as_str()));
    imports
}

/// Modules that import each other in a circle, and modules that use one.
fn circle(mut imports: Imports) -> Vec<String> {
    loop {
        let left: BTreeSet<_> = imports.keys().cloned().collect();
        imports.retain(|module, names| names.iter().any(|to| to != module && left.contains(to)));
        if imports.len() == left.len() {
            return left.into_iter().collect();
        }
    }
}

#[test]
fn modules_of_the_core_import_earlier_layers_only() {
    let imports = imports(&root().join("crates/core/src"), "crate::");
    let place = |name: &str| LAYERS.iter().position(|layer| *layer == name);
    for (module, names) in &imports {
        let own = place(module).unwrap_or_else(|| panic!("{module} has no layer"));
        for name in names.iter().filter(|name| *name != module) {
            let other = place(name).unwrap_or_else(|| panic!("{module} imports {name}"));
            assert!(other < own, "{module} imports {name}, a later layer");
        }
    }
    assert_eq!(imports.len(), LAYERS.len());
}

#[test]
fn architecture_names_the_layers_in_their_order() {
    let text = fs::read_to_string(root().join("ARCHITECTURE.md")).unwrap();
    let line = text.lines().find(|line| line.contains("kinematics ─►")).unwrap();
    let named: Vec<_> = line.split("─►").map(str::trim).collect();
    let is_named = |layer: &&str| named.iter().any(|name| name.split('/').next() == Some(*layer));
    let layers: Vec<_> = LAYERS.into_iter().filter(|layer| is_named(&layer)).collect();
    let named: Vec<_> = named.iter().map(|name| name.split('/').next().unwrap()).collect();
    assert_eq!(named, layers);
}

#[test]
fn modules_of_these_folders_form_no_circle() {
    for (folder, path) in TREES {
        let imports = imports(&root().join(folder), path);
        assert!(imports.len() > 5, "{folder}");
        let circle = circle(imports);
        assert!(circle.is_empty(), "{folder}: {circle:?}");
    }
}

#[test]
fn a_circle_and_a_group_of_imports_are_found() {
    let names = imported("use super::{a, b::{C, d}};\nuse super::e::F;\nuse super::g;", "super::");
    assert_eq!(names.into_iter().collect::<Vec<_>>(), ["a", "b", "e", "g"]);
    let tree = |pairs: [(&str, &str); 3]| {
        let to = |to: &str| BTreeSet::from([to.to_owned()]);
        pairs.map(|(from, name)| (from.to_owned(), to(name))).into_iter().collect()
    };
    assert!(circle(tree([("a", "b"), ("b", "c"), ("c", "d")])).is_empty());
    assert_eq!(circle(tree([("a", "b"), ("b", "c"), ("c", "b")])), ["a", "b", "c"]);
}
