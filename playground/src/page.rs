//! The page: one HTML file from its parts.

use crate::packed::packed;
use tumble_view::view::{LiveParts, live_parts};

const TEMPLATE: &str = include_str!("../page/index.html");
const STYLE: &str = include_str!("../page/style.css");
const LOADER: &str = include_str!("../page/loader.js");
const WORKER: &str = include_str!("../page/worker.js");
/// Drawing of one scene, with marks for the scripts that it needs.
const SCENE: &str = include_str!("../page/scene.js");
const OVERLAYS: &str = include_str!("../page/drawing.js");
const LIVE: &str = include_str!("../page/live.js");
/// Scripts of the program and the controls, in order of their dependencies.
const SCRIPTS: [&str; 8] = [
    include_str!("../page/program.js"),
    include_str!("../page/controls.js"),
    include_str!("../page/state.js"),
    include_str!("../page/picture.js"),
    include_str!("../page/keys.js"),
    include_str!("../page/share.js"),
    include_str!("../page/touch.js"),
    include_str!("../page/main.js"),
];

/// Page with the `program`, the WebAssembly of this crate.
///
/// # Errors
/// A file that is not WebAssembly; a mark of the template without a part.
pub fn page(program: &[u8]) -> Result<String, String> {
    if !program.starts_with(b"\0asm") {
        return Err(
            "the program is not WebAssembly; build it for wasm32-unknown-unknown".to_owned()
        );
    }
    assemble_page(Source { program: text(program)?, live: "", connections: String::new() })
}

/// Page whose program is a server on one of the `hosts` (address and port).
///
/// # Errors
/// A mark of the template without a part.
pub fn live_page(hosts: &[String]) -> Result<String, String> {
    let hosts: Vec<_> = hosts.iter().map(|host| format!("ws://{host}")).collect();
    let connections = format!("; connect-src {}", hosts.join(" "));
    assemble_page(Source { program: String::new(), live: "live", connections })
}

/// Program of a page.
struct Source {
    /// Packed WebAssembly, or nothing.
    program: String,
    /// Path of the server's socket beside the page, or nothing.
    live: &'static str,
    /// Directive of the page's policy for connections, or nothing.
    connections: String,
}

fn text(bytes: &[u8]) -> Result<String, String> {
    packed(bytes).map_err(|error| error.to_string())
}

fn assemble_page(source: Source) -> Result<String, String> {
    let LiveParts { style, base, stage, drawer, drawer_licence } = live_parts();
    let scene = SCENE.replace("  // STAGE\n", &stage).replace("  // OVERLAYS\n", OVERLAYS);
    let scripts = [&base, LIVE, &scene].into_iter().chain(SCRIPTS);
    let script = scripts.collect::<Vec<_>>().join("\n");
    let script = format!("(() => {{\n\"use strict\";\n{script}}})();\n");
    let parts = [
        ("style", style + STYLE),
        ("connections", source.connections),
        ("live", source.live.to_owned()),
        ("program", source.program),
        ("worker", WORKER.to_owned()),
        ("drawer-licence", drawer_licence.to_owned()),
        ("drawer", text(drawer.as_bytes())?),
        ("script", text(script.as_bytes())?),
        ("loader", LOADER.to_owned()),
    ];
    filled(&parts)
}

/// Template with its parts. Only the template is searched, since parts may contain braces.
fn filled(parts: &[(&str, String)]) -> Result<String, String> {
    let (mut page, mut rest) = (String::new(), TEMPLATE);
    while let Some((before, after)) = rest.split_once("{{") {
        let (name, after) = after.split_once("}}").unwrap_or((after, ""));
        let part = parts.iter().find(|(other, _)| *other == name);
        let (_, part) = part.ok_or_else(|| format!("the page has no part {name:?}"))?;
        page.push_str(before);
        page.push_str(part);
        rest = after;
    }
    page.push_str(rest);
    Ok(page)
}

#[cfg(test)]
#[path = "tests/page.rs"]
mod tests;
