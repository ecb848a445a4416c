//! Scripts of the pages, in order of their dependencies.

/// Scripts without a run: vectors, formatting, the class `Run`, colours, camera, speed and toggles.
pub const BASE: [&str; 8] = [
    include_str!("page/vectors.js"),
    include_str!("page/numbers.js"),
    include_str!("page/run.js"),
    include_str!("page/graphics.js"),
    include_str!("page/colours.js"),
    include_str!("page/camera.js"),
    include_str!("page/pace.js"),
    include_str!("page/choices.js"),
];

/// Runs of a recorded page, the global `runs`.
pub const RUNS: &str = include_str!("page/runs.js");

/// Scripts that draw the global `runs`; the class `Stage` among them.
pub const STAGE: [&str; 14] = [
    include_str!("page/ground.js"),
    include_str!("page/trails.js"),
    include_str!("page/shapes.js"),
    include_str!("page/overlays.js"),
    include_str!("page/ambience.js"),
    include_str!("page/outline.js"),
    include_str!("page/solids.js"),
    include_str!("page/occlusion.js"),
    include_str!("page/light.js"),
    include_str!("page/floor.js"),
    include_str!("page/labels.js"),
    include_str!("page/forces.js"),
    include_str!("page/scenery.js"),
    include_str!("page/stage.js"),
];

/// Plots, tables and controls of a recorded page.
pub const RECORDED: [&str; 6] = [
    include_str!("page/plots.js"),
    include_str!("page/sidebar.js"),
    include_str!("page/strip.js"),
    include_str!("page/sharing.js"),
    include_str!("page/keys.js"),
    include_str!("page/main.js"),
];

/// All scripts of a recorded page.
pub fn page_scripts() -> Vec<&'static str> {
    [&BASE[..], &[RUNS], &STAGE, &RECORDED].concat()
}

/// Scripts one after another, without the lines that are comments.
pub fn joined(scripts: &[&str]) -> String {
    let lines = scripts.iter().flat_map(|script| script.lines());
    let code = lines.filter(|line| !line.trim_start().starts_with("//"));
    code.flat_map(|line| [line, "\n"]).collect()
}
