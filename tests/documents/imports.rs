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

/// True for the module paths of a tree.
type IsIn = fn(&str) -> bool;

/// Crates, and their modules that import each other in no circle.
const TREES: [(&str, IsIn); 3] = [
    ("cli/src", |module| !module.starts_with("verify::judge")),
    ("crates/core/src", |module| module.starts_with("geometry")),
    ("crates/scene/src", |module| {
        ["file", "scene", "settings", "bodies", "bodies::build", "bodies::robots"].contains(&module)
    }),
];

type Imports = BTreeMap<String, BTreeSet<String>>;

pub(super) fn root() -> &'static Path {
    Path::new(env!("CARGO_MANIFEST_DIR"))
}

/// Rust files below `folder`.
pub(super) fn sources(folder: &Path) -> Vec<PathBuf> {
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

/// Paths in the use statements of a file, without re-exports and unit tests.
fn used(text: &str) -> Vec<String> {
    let program = text.split("#[cfg(test)]\nmod ").next().unwrap();
    let statements = program.split('\n').enumerate().filter(|(_, line)| line.starts_with("use "));
    let from = |line: usize| program.split('\n').skip(line).collect::<Vec<_>>().join(" ");
    let mut paths = Vec::new();
    for (line, _) in statements {
        expand("", from(line)["use ".len()..].split(';').next().unwrap(), &mut paths);
    }
    paths
}

/// Adds the paths of a tree such as `a::{b, c::D}` behind `before`.
fn expand(before: &str, tree: &str, paths: &mut Vec<String>) {
    let Some((head, rest)) = tree.split_once('{') else {
        let path = tree.trim().split(' ').next().unwrap();
        if !path.is_empty() {
            paths.push(format!("{before}{path}"));
        }
        return;
    };
    let before = format!("{before}{}", head.trim());
    let (mut depth, mut begin) = (1, 0);
    for (place, letter) in rest.char_indices() {
        depth += match letter {
            '{' => 1,
            '}' => -1,
            _ => 0,
        };
        if depth == 0 || depth == 1 && letter == ',' {
            expand(&before, &rest[begin..place], paths);
            begin = place + 1;
        }
    }
}

/// Imports between the modules of a crate, by their paths. The root of the crate is "".
fn imports(folder: &Path) -> Imports {
    let module = |file: &Path| {
        let below = file.strip_prefix(folder).unwrap().with_extension("");
        let names = below.iter().map(|name| name.to_str().unwrap());
        let names = names.filter(|name| !["mod", "lib", "main"].contains(name));
        names.collect::<Vec<_>>().join("::")
    };
    let files: BTreeMap<String, PathBuf> =
        sources(folder).into_iter().map(|file| (module(&file), file)).collect();
    let import = |own: &String, path: String| {
        let mut at: Vec<&str> = own.split("::").filter(|name| !name.is_empty()).collect();
        let mut names = path.split("::").peekable();
        match *names.peek().unwrap() {
            "crate" => at.clear(),
            "super" => drop(at.pop()),
            "self" => {}
            child => {
                let child = at.iter().copied().chain([child]).collect::<Vec<_>>().join("::");
                return files.contains_key(&child).then_some(child);
            }
        }
        for name in names.skip(1) {
            at.push(name);
            if !files.contains_key(&at.join("::")) {
                at.pop();
                break;
            }
        }
        Some(at.join("::"))
    };
    let of = |(own, file): (&String, &PathBuf)| {
        let paths = used(&fs::read_to_string(file).unwrap());
        let names = paths.into_iter().filter_map(|path| import(own, path));
        (own.clone(), names.filter(|name| name != own).collect())
    };
    files.iter().map(of).collect()
}

/// Modules in circles of imports, and between two of them, each with its imports of others.
fn circle(mut imports: Imports) -> Vec<String> {
    loop {
        let left = imports.len();
        let known: BTreeSet<_> = imports.keys().cloned().collect();
        let used: BTreeSet<_> = imports.values().flatten().cloned().collect();
        imports.values_mut().for_each(|names| names.retain(|name| known.contains(name)));
        imports.retain(|module, names| !names.is_empty() && used.contains(module));
        if imports.len() == left {
            return imports.into_iter().map(|(from, to)| format!("{from} -> {to:?}")).collect();
        }
    }
}

#[test]
fn modules_of_the_core_import_earlier_layers_only() {
    let layer = |module: &str| {
        let first = module.split("::").next().unwrap();
        let place = LAYERS.iter().position(|layer| *layer == first);
        place.unwrap_or_else(|| panic!("{module} has no layer"))
    };
    let mut imports = imports(&root().join("crates/core/src"));
    imports.remove("");
    assert!(imports.len() > 100);
    for (module, names) in imports {
        for name in names.iter().filter(|name| !name.is_empty()) {
            assert!(layer(name) <= layer(&module), "{module} imports {name}, a later layer");
        }
    }
}

#[test]
fn architecture_names_the_layers_in_their_order() {
    let text = fs::read_to_string(root().join("ARCHITECTURE.md")).unwrap();
    let line = text.lines().find(|line| line.contains("kinematics ─►")).unwrap();
    let named: Vec<_> = line.split("─►").map(str::trim).collect();
    let is_named = |layer: &&str| named.iter().any(|name| name.split('/').next() == Some(*layer));
    let layers: Vec<_> = LAYERS.into_iter().filter(|layer| is_named(layer)).collect();
    let named: Vec<_> = named.iter().map(|name| name.split('/').next().unwrap()).collect();
    assert_eq!(named, layers);
}

#[test]
fn folders_have_no_import_cycles() {
    for (folder, is_checked) in TREES {
        let mut imports = imports(&root().join(folder));
        imports.retain(|module, _| is_checked(module));
        assert!(imports.len() > 5, "{folder}");
        let circle = circle(imports);
        assert!(circle.is_empty(), "{folder}: {circle:?}");
    }
}

#[test]
fn import_paths_and_cycles_are_detected() {
    let text = "use super::{a, b::{C, d}};\npub use x::Y;\nuse e::F as G;\n#[cfg(test)]\nmod t {}";
    assert_eq!(used(text), ["super::a", "super::b::C", "super::b::d", "e::F"]);
    let tree = |pairs: [(&str, &str); 3]| {
        let to = |to: &str| BTreeSet::from([to.to_owned()]);
        pairs.map(|(from, name)| (from.to_owned(), to(name))).into_iter().collect()
    };
    assert!(circle(tree([("a", "b"), ("b", "c"), ("c", "d")])).is_empty());
    let found = circle(tree([("a", "b"), ("b", "c"), ("c", "b")]));
    assert_eq!(found, [r#"b -> {"c"}"#, r#"c -> {"b"}"#]);
}
