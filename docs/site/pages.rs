//! The documents as sources of the book.

use crate::{Done, beside, formulas};
use std::fmt::Write;
use std::fs;
use std::path::Path;

/// The chapters: headings, and under each the title and the file of every page.
const CHAPTERS: &[(&str, &[(&str, &str)])] = &[
    ("", &[("Overview", "README.md"), ("Gallery", GALLERY)]),
    (
        "Getting started",
        &[
            ("Ten minutes", "docs/start.md"),
            ("The tutorial, item by item", "docs/tutorial.md"),
            ("The playground", "docs/playground.md"),
            ("Notebooks", "docs/notebooks/README.md"),
        ],
    ),
    (
        "How-to",
        &[
            ("Tasks", "docs/howto/README.md"),
            ("Make a pile", "docs/howto/pile.md"),
            ("Put a conveyor in a scene", "docs/howto/conveyor.md"),
            ("Hold a part with a suction cup or a magnet", "docs/howto/suction-cup.md"),
            ("Drive on mecanum wheels", "docs/howto/mecanum.md"),
            ("Drive a joint with a motor", "docs/howto/motor.md"),
            ("Put a robot into a scene", "docs/howto/robot-in-scene.md"),
            ("Give joints limits and friction", "docs/howto/joints.md"),
            ("Give a mechanism play and stops", "docs/howto/play.md"),
            ("Put a CAD part on a slope", "docs/howto/cad-part.md"),
            ("Use meshes that are not convex", "docs/howto/meshes.md"),
            ("Roll over terrain", "docs/howto/terrain.md"),
            ("Move an obstacle along a path", "docs/howto/moving-obstacles.md"),
            ("Make bodies bounce", "docs/howto/restitution.md"),
            ("Choose what collides", "docs/howto/collision-groups.md"),
            ("Add drag and force fields", "docs/howto/drag.md"),
            ("Prepare a lesson", "docs/howto/lesson.md"),
            ("Sum contact forces by pair", "docs/howto/contact-forces.md"),
            ("Cast rays and measure distances", "docs/howto/queries.md"),
            ("Export tables and pictures", "docs/howto/export.md"),
            ("Save a run and resume it", "docs/howto/save-and-resume.md"),
            ("Judge whether a structure stands", "docs/howto/stands.md"),
            ("Choose the tolerance", "docs/howto/tolerance.md"),
            ("Handle a failed step", "docs/howto/failed-step.md"),
            ("Run a batch", "docs/howto/batches.md"),
            ("Sweep parameters on a cluster", "docs/howto/dask.md"),
            ("Train in a Gymnasium environment", "docs/howto/gymnasium.md"),
            ("Differentiate a run", "docs/howto/gradients.md"),
            ("Plan controls", "docs/howto/plans.md"),
            ("Fit friction to a recording", "docs/howto/fit-friction.md"),
            ("Run your MuJoCo model", "docs/howto/mujoco-model.md"),
            ("Certify a step of another engine", "docs/howto/certify-engine.md"),
            ("Audit a whole run", "docs/howto/audit-rollout.md"),
            ("Add an engine to the benchmark", "docs/howto/bench-adapter.md"),
            ("Get contact problems for your solver", "docs/howto/contact-problems.md"),
        ],
    ),
    (
        "Concepts",
        &[
            ("Overview of the concepts", "docs/concepts/README.md"),
            ("What a hard contact is", "docs/concepts/hard-contact.md"),
            ("The certificate", "docs/concepts/certificate.md"),
            ("The selection rule", "docs/concepts/selection-rule.md"),
            ("Hyperstatic forces", "docs/concepts/hyperstatic-forces.md"),
            ("Time step and order", "docs/concepts/time-step.md"),
            ("Joints as rows", "docs/concepts/joints-as-rows.md"),
            ("Unphysical steps", "docs/concepts/unphysical-steps.md"),
            ("Determinism", "docs/concepts/determinism.md"),
            ("Accuracy in time", "docs/accuracy.md"),
            ("Limits", "docs/limits.md"),
        ],
    ),
    (
        "Reference",
        &[
            ("All references", REFERENCE),
            ("Scene format", "scenarios/README.md"),
            ("Tables", "docs/tables.md"),
            ("Command line", "docs/command-line.md"),
            ("Rust", "docs/guide.md"),
            ("Python", "docs/python.md"),
            ("JavaScript", "docs/npm.md"),
            ("Robots from files", "docs/robots.md"),
            ("Constants from recorded motion", "docs/fit.md"),
            ("Learning", "docs/learning.md"),
            ("The referee", "docs/referee.md"),
            ("Format of step certificates", "docs/reference/certificate-format.md"),
        ],
    ),
    (
        "Derivations",
        &[
            ("Formulation", "docs/formulation.md"),
            ("The native solver", "docs/native-solver.md"),
            ("Joints", "docs/joints.md"),
            ("Derivatives", "docs/gradients.md"),
            ("The contact problem alone", "docs/contact-problem.md"),
            ("Plans", "docs/planning.md"),
            ("Statics", "docs/statics.md"),
            ("The Ipopt path", "docs/ipopt-path.md"),
        ],
    ),
    (
        "Measurements",
        &[
            ("Problems with closed-form solutions", "docs/validation.md"),
            ("Other engines", "docs/comparison.md"),
            ("Contact benchmark", "docs/benchmark.md"),
            ("Recorded tosses", "docs/reality.md"),
            ("Long runs", "docs/soak.md"),
            ("Pictures and their cost", "docs/pictures/README.md"),
            ("Reference data", "data/README.md"),
        ],
    ),
    (
        "Project",
        &[
            ("Architecture", "ARCHITECTURE.md"),
            ("Dependencies", "docs/dependencies.md"),
            ("Contributing", "CONTRIBUTING.md"),
            ("Security", "SECURITY.md"),
            ("Changelog", "CHANGELOG.md"),
        ],
    ),
];

/// Folders whose files with these endings become a part of the site as they are.
const FILES: &[(&str, &[&str])] = &[
    ("docs/pictures", &["gif", "png", "svg"]),
    ("docs/figures", &["svg"]),
    ("docs/notebooks", &["ipynb"]),
];

/// The pages that are no documents of the repository.
const GALLERY: &str = "gallery/README.md";
const REFERENCE: &str = "reference.md";

const REFERENCE_TEXT: &str = "# Reference

- [Rust](rust/tumble/index.html): the library and the crates around it, made by rustdoc
- [Python](python/tumble.html): the package, made of its docstrings by pdoc
- [Scene format](scenarios/index.html): every field
- [Tables](docs/tables.html): every column
- [Command line](docs/command-line.html): commands, options, exit codes
";

/// Crates, by the folders of their sources.
const CRATES: &[(&str, &str)] = &[
    ("src/", "tumble"),
    ("crates/core/src/", "tumble_core"),
    ("crates/decompose/src/", "tumble_decompose"),
    ("crates/model/src/", "tumble_model"),
    ("crates/plan/src/", "tumble_plan"),
    ("crates/robot/src/", "tumble_robot"),
    ("crates/scene/src/", "tumble_scene"),
    ("crates/view/src/", "tumble_view"),
    ("ipopt-sys/src/", "ipopt_sys"),
];

pub fn write(out: &Path, rust: &Path, runs: &Path) -> Done {
    let mut contents = "# Summary\n".to_owned();
    for (heading, pages) in CHAPTERS {
        if !heading.is_empty() {
            writeln!(contents, "\n# {heading}\n")?;
        }
        for (title, file) in *pages {
            writeln!(contents, "- [{title}]({file})")?;
            let text = match *file {
                GALLERY => gallery(out, runs)?,
                REFERENCE => REFERENCE_TEXT.to_owned(),
                file => fs::read_to_string(file).map_err(|error| format!("{file}: {error}"))?,
            };
            let page = formulas::converted(&text, |link| target(Path::new(file), link, rust))
                .map_err(|error| format!("{file}, {error}"))?;
            let path = out.join(file);
            fs::create_dir_all(path.parent().ok_or("no folder")?)?;
            fs::write(path, page)?;
        }
    }
    fs::write(out.join("SUMMARY.md"), contents)?;
    for (folder, _) in FILES {
        fs::create_dir_all(out.join(folder))?;
        for entry in fs::read_dir(folder)? {
            let file = entry?.path();
            if is_file_of_site(&file) {
                fs::copy(&file, out.join(&file))?;
            }
        }
    }
    Ok(())
}

/// True for a file that the site has as it is.
fn is_file_of_site(file: &Path) -> bool {
    let (folder, ending) = (file.parent(), file.extension());
    FILES.iter().any(|(of, endings)| {
        folder == Some(Path::new(of)) && endings.iter().any(|end| ending == Some(end.as_ref()))
    })
}

/// Address on the site of a link in the page `from`, relative to this page. `None` if the site lacks
/// the target.
fn target(from: &Path, link: &str, rust: &Path) -> Option<String> {
    let (file, fragment) = link.split_once('#').unwrap_or((link, ""));
    let path = beside(from, file)?;
    let up = "../".repeat(from.components().count() - 1);
    let mut chapters = CHAPTERS.iter().flat_map(|(_, pages)| *pages);
    let source = path.to_str()?;
    if from == Path::new(REFERENCE) {
        return Some(link.to_owned());
    }
    if chapters.any(|(_, page)| *page == source) {
        let page = source.replace("README.md", "index.md").replace(".md", ".html");
        let hash = if fragment.is_empty() { "" } else { "#" };
        return Some(format!("{up}{page}{hash}{fragment}"));
    }
    if is_file_of_site(&path) {
        return Some(link.to_owned());
    }
    let (folder, name) = CRATES.iter().find(|(folder, _)| source.starts_with(folder))?;
    let module = source[folder.len()..].trim_end_matches(".rs").trim_end_matches("/mod");
    let found = item(rust, &format!("{name}/{module}"), fragment)?;
    Some(format!("{up}rust/{found}"))
}

/// rustdoc's page of an item like `Plane::new` of a module like `tumble/world/plane`.
fn item(rust: &Path, module: &str, name: &str) -> Option<String> {
    let module = module.strip_suffix("/lib").unwrap_or(module);
    if name.is_empty() {
        let page = format!("{module}/index.html");
        return rust.join(&page).exists().then_some(page);
    }
    let (name, member) = name.split_once("::").unwrap_or((name, ""));
    let kinds = ["struct", "enum", "trait", "fn", "constant", "type"];
    let mut pages = kinds.map(|kind| format!("{module}/{kind}.{name}.html")).into_iter();
    let page = pages.find(|page| rust.join(page).exists())?;
    let text = fs::read_to_string(rust.join(&page)).ok()?;
    let members = ["method", "tymethod", "variant", "structfield", "associatedconstant"];
    let anchor = members.map(|kind| format!("{kind}.{member}")).into_iter();
    let anchor = anchor.into_iter().find(|anchor| text.contains(&format!("id=\"{anchor}\"")));
    Some(anchor.map_or_else(|| page.clone(), |anchor| format!("{page}#{anchor}")))
}

/// The scenarios of the tables in their description; their pictures, from the folder `runs`, come beside it.
fn gallery(out: &Path, runs: &Path) -> Done<String> {
    let mut page = "# Gallery\n\nThe scenarios that come with tumble, as `tumble run FILE --gif --html` \
                    shows them. A click on an animation opens the run in the browser, with its numbers.\n"
        .to_owned();
    for row in fs::read_to_string("scenarios/README.md")?.lines() {
        let Some((name, what)) =
            row.strip_prefix("| `").and_then(|row| row.split_once(".toml` | "))
        else {
            continue;
        };
        let what = what.trim_end_matches(" |");
        let (first, others) = what.split_at(what.chars().next().map_or(0, char::len_utf8));
        let folder = out.join("gallery").join(name);
        fs::create_dir_all(&folder)?;
        for file in ["animation.gif", "view.html"] {
            fs::copy(runs.join(name).join(file), folder.join(file))
                .map_err(|error| format!("{file} of {name}: {error}"))?;
        }
        let text = fs::read_to_string(format!("scenarios/{name}.toml"))?;
        writeln!(
            page,
            "\n## {name}\n\n{}{others}.\n\n\
             <a href=\"{name}/view.html\"><img src=\"{name}/animation.gif\" alt=\"{name}, animated\" \
             loading=\"lazy\"></a>\n\n<details><summary><code>scenarios/{name}.toml</code></summary>\n\n\
             ```toml\n{text}```\n\n</details>",
            first.to_uppercase()
        )?;
    }
    Ok(page)
}
