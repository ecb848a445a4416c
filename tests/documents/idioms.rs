//! Upper bounds on idioms that the code avoids. A change may lower a bound, never raise it.

use super::imports::{root, sources};
use std::fs;
use std::path::PathBuf;

/// True for a line with the idiom.
type IsIdiom = fn(&str) -> bool;

/// Name of an idiom, whether a line without indentation has it, and the largest allowed count.
const IDIOMS: [(&str, IsIdiom, usize); 4] = [
    ("function `of`, instead of `new`, `from_x` or a noun", is_named_of, 0),
    ("tuple of values in a `let`", is_tuple_let, 623),
    ("arm of a `match` on a bool", is_bool_arm, 10),
    ("visibility `pub(in super…)`", |line| line.contains("pub(in super"), 0),
];

fn is_named_of(line: &str) -> bool {
    ["fn of(", "fn of<", "fn of_"].iter().any(|start| line.contains(start))
}

fn is_tuple_let(line: &str) -> bool {
    line.starts_with("let (") && line.contains(") = (") && line.ends_with(");")
}

fn is_bool_arm(line: &str) -> bool {
    ["true =>", "false =>", "true if ", "false if "].iter().any(|start| line.starts_with(start))
}

/// Lines of a file before its unit tests.
fn lines(text: &str) -> impl Iterator<Item = &str> {
    text.split("#[cfg(test)]\nmod ").take(1).flat_map(str::lines).map(str::trim_start)
}

#[test]
fn avoided_idioms_do_not_increase() {
    let folders = ["src", "crates", "cli/src", "playground/src", "python/src"];
    let files = folders.iter().flat_map(|folder| sources(&root().join(folder)));
    let is_test = |path: &PathBuf| path.iter().any(|part| part == "tests" || part == "tests.rs");
    let texts: Vec<_> =
        files.filter(|path| !is_test(path)).map(|path| fs::read_to_string(path).unwrap()).collect();
    assert!(texts.len() > 300, "{} files", texts.len());
    for (name, has, most) in IDIOMS {
        let count = texts.iter().flat_map(|text| lines(text)).filter(|line| has(line)).count();
        assert!(count <= most, "{name}: {count} times; allowed: {most}");
    }
}
