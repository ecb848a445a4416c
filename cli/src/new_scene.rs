//! `tumble new`: writes a commented scenario file that runs.

use super::args::NewArgs;
use super::outcome::{Failure, Outcome};
use super::{file_names, output};
use std::io::Write as _;
use std::path::{Path, PathBuf};
use tumble_model::shown;

/// The scenario file. `NAME` is replaced.
const TEMPLATE: &str = include_str!("new_scene.toml");

/// Writes the file and prints the next commands.
pub fn run(args: &NewArgs) -> Result<Outcome, Failure> {
    let path = file_of(&args.name)?;
    let shown = shown::path(&path);
    if path.exists() {
        return Err(Failure::Input(format!("{shown} exists; choose another name")));
    }
    let directory = file_names::directory_of(None, &path);
    if !directory.is_dir() {
        let directory = shown::path(directory);
        return Err(Failure::Input(format!(
            "{shown} cannot be written: there is no directory {directory}; create it first"
        )));
    }
    let name = path.file_stem().unwrap_or_default().to_string_lossy();
    write(&path, &TEMPLATE.replace("NAME", &name))
        .map_err(|error| Failure::Other(format!("{shown} cannot be written: {error}")))?;
    // A name with blanks is quoted, so that the commands can be copied.
    let word = if shown.contains(' ') { format!("'{shown}'") } else { shown.clone() };
    output::say(&format!(
        "wrote {shown}\n  tumble check {word}        checks it\n  tumble run {word} --html   \
         simulates it and writes out/view.html\n"
    ))?;
    Ok(Outcome::Done)
}

/// File of the scene `name`, which may end in `.toml`.
fn file_of(name: &Path) -> Result<PathBuf, Failure> {
    let stem = name.file_stem().and_then(|stem| stem.to_str());
    let is_toml = name.extension().is_none_or(|end| end == "toml");
    match stem {
        Some(stem) if is_toml && shown::is_name(stem) && !stem.contains(['"', '\\']) => {
            Ok(name.with_extension("toml"))
        }
        _ => Err(Failure::Input(format!(
            "{}: is not a name of a scenario file; write a name of at most 80 characters, with .toml \
             or no ending",
            shown::path(name)
        ))),
    }
}

/// Writes the whole file under a temporary name and renames it, unless `path` has appeared.
fn write(path: &Path, text: &str) -> std::io::Result<()> {
    let mut file = output::temporary().tempfile_in(file_names::directory_of(None, path))?;
    file.write_all(text.as_bytes())?;
    file.as_file().sync_all()?;
    file.persist_noclobber(path).map(drop).map_err(|error| error.error)
}
