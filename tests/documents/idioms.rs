//! Upper bounds on idioms that the code avoids. A change may lower a bound, never raise it.

use super::imports::root;
use super::statements::files;
use std::fs;

/// True for a line with the idiom, without its indentation.
type IsIdiom = fn(&str) -> bool;

/// Files of the repository, by their paths.
type IsChecked = fn(&str) -> bool;

struct Idiom {
    name: &'static str,
    is_checked: IsChecked,
    is_idiom: IsIdiom,
    /// Largest allowed count.
    most: usize,
}

const IDIOMS: [Idiom; 7] = [
    Idiom {
        name: "function `of`, instead of `new`, `from_x` or a noun",
        is_checked: is_program,
        is_idiom: |line| ["fn of(", "fn of<", "fn of_"].iter().any(|start| line.contains(start)),
        most: 0,
    },
    Idiom {
        name: "value `of`, instead of a noun",
        is_checked: is_program,
        is_idiom: is_value_of,
        most: 387,
    },
    Idiom {
        name: "tuple of values in a `let`",
        is_checked: is_program,
        is_idiom: |line| {
            line.starts_with("let (") && line.contains(") = (") && line.ends_with(");")
        },
        most: 623,
    },
    Idiom {
        name: "arm of a `match` on a bool",
        is_checked: is_program,
        is_idiom: |line| {
            ["true =>", "false =>", "true if ", "false if "]
                .iter()
                .any(|start| line.starts_with(start))
        },
        most: 10,
    },
    Idiom {
        name: "visibility `pub(in super…)`",
        is_checked: is_program,
        is_idiom: |line| line.contains("pub(in super"),
        most: 0,
    },
    Idiom {
        name: "function of the platform, instead of one of `libm`",
        is_checked: |path| is_program(path) && !path.starts_with("crates/view/"),
        is_idiom: is_platform_function,
        most: 5,
    },
    Idiom {
        name: "comment that begins with a relative clause or a genitive",
        is_checked: |_| true,
        is_idiom: is_fronted_comment,
        most: 21,
    },
];

/// True for sources of programs and libraries in Rust, without tests.
fn is_program(path: &str) -> bool {
    let folders = ["src/", "crates/", "cli/src/", "playground/src/", "python/src/"];
    path.ends_with(".rs")
        && folders.iter().any(|folder| path.starts_with(folder))
        && !path.split('/').any(|part| part == "tests" || part == "tests.rs")
}

fn is_value_of(line: &str) -> bool {
    let signs =
        ["let of ", "let mut of ", "|of|", "|of,", "(of,", ", of)", ", of|", "of: ", "for of "];
    !line.starts_with("//")
        && signs.iter().any(|sign| {
            line.match_indices(sign).any(|(place, _)| {
                !sign.starts_with("of") || !line[..place].ends_with(|c: char| c.is_alphanumeric())
            })
        })
}

/// Functions that `clippy.toml` of the core refuses too.
fn is_platform_function(line: &str) -> bool {
    const NAMES: [&str; 25] = [
        "sin", "cos", "tan", "sin_cos", "asin", "acos", "atan", "atan2", "sinh", "cosh", "tanh",
        "asinh", "acosh", "atanh", "exp", "exp2", "exp_m1", "ln", "ln_1p", "log", "log2", "log10",
        "powf", "cbrt", "hypot",
    ];
    let calls = line.split('.').skip(1).filter_map(|call| Some(call.split_once('(')?.0));
    !line.starts_with("//") && calls.into_iter().any(|name| NAMES.contains(&name))
}

fn is_fronted_comment(line: &str) -> bool {
    const OPENERS: [&str; 13] = [
        "What",
        "Which",
        "How",
        "Of",
        "That of",
        "Those of",
        "The same of",
        "Where",
        "As",
        "By",
        "From",
        "Whose",
        "Whom",
    ];
    let signs = ["///", "//!", "//", "#"];
    let text = signs.iter().find_map(|sign| line.strip_prefix(sign)).map(str::trim_start);
    let begins = |text: &str| {
        OPENERS
            .iter()
            .any(|opener| text.strip_prefix(opener).is_some_and(|rest| rest.starts_with(' ')))
    };
    text.is_some_and(begins)
}

#[test]
fn avoided_idioms_do_not_increase() {
    let paths = files(&[".rs", ".py", ".pyi", ".js", ".cpp", ".h"]);
    let texts: Vec<_> = paths
        .into_iter()
        .map(|path| {
            let text = fs::read_to_string(root().join(&path)).unwrap();
            (path, text)
        })
        .collect();
    let mut wrong = String::new();
    for idiom in &IDIOMS {
        let checked = texts.iter().filter(|(path, _)| (idiom.is_checked)(path));
        let places: Vec<_> = checked.flat_map(|(path, text)| places(idiom, path, text)).collect();
        if places.len() > idiom.most {
            let (count, most) = (places.len(), idiom.most);
            wrong +=
                &format!("{}: {count} times; allowed: {most}\n{}\n", idiom.name, places.join("\n"));
        }
    }
    assert!(wrong.is_empty(), "{wrong}");
    assert!(texts.iter().filter(|(path, _)| is_program(path)).count() > 300);
}

/// Lines of a file with the idiom, before its unit tests: path, number and text. A comment counts
/// where it begins.
fn places(idiom: &Idiom, path: &str, text: &str) -> Vec<String> {
    let program = text.split("#[cfg(test)]\nmod ").next().unwrap();
    let signs = ["//", "#"];
    let is_comment = |line: &str| signs.iter().any(|sign| line.trim_start().starts_with(sign));
    let mut was_comment = false;
    let mut places = Vec::new();
    for (number, line) in program.lines().enumerate() {
        let goes_on = was_comment && is_comment(line);
        was_comment = is_comment(line);
        if !goes_on && (idiom.is_idiom)(line.trim_start()) {
            places.push(format!("{path}:{}: {}", number + 1, line.trim_start()));
        }
    }
    places
}
