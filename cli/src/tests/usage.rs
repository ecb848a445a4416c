//! Unit tests of `usage.rs`.

use super::*;

fn words(text: &str) -> Vec<OsString> {
    text.split(' ').map(OsString::from).collect()
}

#[test]
fn a_vector_with_spaces_is_shown_with_commas() {
    let run = Cli::command();
    let found = separate_numbers(&run, &words("--gravity 0 0 -1.5 --gif")).unwrap();
    assert!(found.ends_with("write --gravity 0,0,-1.5"), "{found}");
    assert_eq!(separate_numbers(&run, &words("--gravity 0,0,1 --steps 3")), None);
    assert_eq!(separate_numbers(&run, &words("--steps 3 4")), None);
}

#[test]
fn a_misspelt_command_is_suggested_and_a_path_is_not_a_command() {
    let program = Cli::command();
    let found = |word: &str| unknown_command(&program, OsStr::new(word));
    assert!(found("verfy").unwrap().contains("did you mean `verify`?"));
    assert!(!found("xyzzy").unwrap().contains("did you mean"));
    for allowed in ["stack.toml", "a/b", "--steps", "run", "help"] {
        assert_eq!(found(allowed), None, "{allowed}");
    }
}

#[test]
fn the_command_of_a_failure_is_in_its_remedy() {
    let mut program = Cli::command();
    let arguments = words("verify states.csv --worts 3");
    let all: Vec<_> = std::iter::once(OsString::from("tumble")).chain(arguments.clone()).collect();
    let error = program.try_get_matches_from_mut(all).unwrap_err();
    let found = sentence(&error, &program, &arguments);
    assert!(found.contains("did you mean `--worst`?"), "{found}");
    assert!(found.ends_with("(see tumble verify --help)"), "{found}");
}
