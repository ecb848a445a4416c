//! `tumble convert`: writes a robot, a scenario with robots, or a mesh as one scenario file.

use super::args::ConvertArgs;
use super::directory::OutputDirectory;
use super::file_names::directory_of;
use super::outcome::{Failure, Outcome};
use super::output::{PendingFile, StderrReporter};
use super::{converted_mesh, input, scenario};
use std::path::Path;
use tumble_model::shown;
use tumble_scene::scene::Scene;
use tumble_scene::{LARGEST_FILE, written};

pub fn run(args: &ConvertArgs) -> Result<Outcome, Failure> {
    let (scene, report) = if converted_mesh::is_mesh(&args.file) {
        let (scene, report) = converted_mesh::scene(args)?;
        (scene, Some(report))
    } else {
        args.mesh.refuse()?;
        let text = scenario::read_text(&args.file)?;
        let scene = Scene::parse_with(&text, &args.file, &[], &args.robot, &input::bytes);
        (scene.map_err(Failure::as_flag)?, None)
    };
    let written = written::HEAD.to_owned() + &written::text(&scene)?;
    if written.len() as u64 > LARGEST_FILE {
        let (file, length) = (shown::path(&args.file), written.len());
        return Err(Failure::Input(format!(
            "{file}: the scenario would have {length} bytes; allowed: {LARGEST_FILE}; use fewer or \
             coarser meshes"
        )));
    }
    let name = args.out.file_name().and_then(|name| name.to_str());
    let name = name.filter(|name| name.ends_with(".toml")).ok_or_else(|| {
        let out = shown::path(&args.out);
        Failure::Input(format!("{out}: a file name that ends in .toml is needed"))
    })?;
    let same = |a: &Path, b: &Path| Some(a.canonicalize().ok()? == b.canonicalize().ok()?);
    if same(&args.file, &args.out) == Some(true) {
        let out = shown::path(&args.out);
        return Err(Failure::Input(format!(
            "{out}: this is the input file; choose another output file"
        )));
    }
    let directory = OutputDirectory::for_pictures(directory_of(None, &args.out))?;
    let file = PendingFile::create(&directory, name)?;
    file.write(written.as_bytes())?;
    let path = file.publish()?;
    let mut reporter = StderrReporter::new(args.quiet);
    scene.notes().iter().for_each(|note| reporter.note(note));
    reporter.say(&report.unwrap_or_default());
    reporter.say(&format!("wrote {}\n", shown::path(&path)));
    reporter.end(Outcome::Done)
}
