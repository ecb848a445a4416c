//! Writes the page of the playground: `playground-page PROGRAM.wasm PAGE.html`.

use std::path::PathBuf;
use std::process::ExitCode;
use std::{env, fs};

fn main() -> ExitCode {
    match run() {
        Ok(()) => ExitCode::SUCCESS,
        Err(why) => {
            eprintln!("playground-page: {why}");
            ExitCode::from(2)
        }
    }
}

fn run() -> Result<(), String> {
    let arguments: Vec<_> = env::args_os().skip(1).map(PathBuf::from).collect();
    let [program, page] = arguments.as_slice() else {
        return Err("two paths are needed: the program and the page".to_owned());
    };
    let bytes = fs::read(program).map_err(|error| format!("{}: {error}", program.display()))?;
    let text = tumble_playground::page::page(&bytes)?;
    fs::write(page, &text).map_err(|error| format!("{}: {error}", page.display()))
}
