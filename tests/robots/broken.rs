//! Randomly broken robot files. Nothing panics, and the error names the place.

use rand_mt::Mt64;
use std::io;
use std::path::Path;
use std::sync::Arc;
use std::sync::atomic::AtomicBool;
use tumble_core::simulation::StepRecord;
use tumble_scene::scene::Scene;

const FILES: [&str; 6] = [
    "data/robots/arm.urdf",
    "data/robots/classes.xml",
    "data/robots/hopper.xml",
    "data/robots/quadruped.urdf",
    "scenarios/robots/crawler.xml",
    "scenarios/robots/pusher.urdf",
];

/// Replacement values for an attribute.
const VALUES: [&str; 14] = [
    "",
    "word",
    "nan",
    "inf",
    "-1",
    "0",
    "1e400",
    "1e-320",
    "-0",
    "1 2",
    "1,5",
    "1e308 1e308 1e308",
    "99999999999999999999",
    "trunk",
];

fn read(path: &Path, _: u64) -> io::Result<Vec<u8>> {
    std::fs::read(path)
}

fn below(random: &mut Mt64, count: usize) -> usize {
    (random.next_u64() % count.max(1) as u64) as usize
}

/// Attributes of a text: start of the name, start of the value, end of the value.
fn attributes(text: &str) -> Vec<[usize; 3]> {
    let mut found = Vec::new();
    for (at, _) in text.match_indices("=\"") {
        let name = text[..at].rfind([' ', '\n']).map_or(0, |place| place + 1);
        let end = text[at + 2..].find('"').map_or(text.len(), |length| at + 2 + length);
        found.push([name, at + 2, end]);
    }
    found
}

/// Text with one random change:
///
/// - an attribute removed, or its value replaced,
/// - a number replaced, two values exchanged, or all signs changed,
/// - a line removed, duplicated or moved,
/// - the end cut off.
fn broken(text: &str, random: &mut Mt64) -> String {
    let all = attributes(text);
    let [name, from, to] = all[below(random, all.len())];
    let [_, other, other_end] = all[below(random, all.len())];
    let with = |value: &str| format!("{}{value}{}", &text[..from], &text[to..]);
    let value = VALUES[below(random, VALUES.len())];
    let mut lines: Vec<_> = text.lines().collect();
    let (line, place) = (below(random, lines.len()), below(random, lines.len()));
    match below(random, 9) {
        0 => format!("{}{}", &text[..name], &text[(to + 1).min(text.len())..]),
        1 => with(value),
        2 => {
            let mut parts: Vec<_> = text[from..to].split(' ').collect();
            let part = below(random, parts.len());
            parts[part] = value;
            with(&parts.join(" "))
        }
        3 => with(&text[other..other_end]),
        4 => {
            with(&text[from..to].split(' ').map(|x| format!("-{x}")).collect::<Vec<_>>().join(" "))
        }
        5 => {
            lines.remove(line);
            lines.join("\n")
        }
        6 => {
            lines.insert(place, lines[line]);
            lines.join("\n")
        }
        7 => {
            let moved = lines.remove(line);
            lines.insert(place.min(lines.len()), moved);
            lines.join("\n")
        }
        _ => text.chars().take(below(random, text.len())).collect(),
    }
}

#[test]
fn broken_files_are_rejected_with_their_line() {
    let root = Path::new(env!("CARGO_MANIFEST_DIR"));
    let texts = FILES.map(|file| std::fs::read_to_string(root.join(file)).unwrap());
    let mut random = Mt64::new(24);
    let (mut refused, mut moved) = (0, 0);
    for _ in 0..1000 {
        let file = below(&mut random, FILES.len());
        let mut text = texts[file].clone();
        for _ in 0..=below(&mut random, 3) {
            if !attributes(&text).is_empty() {
                text = broken(&text, &mut random);
            }
        }
        let path = root.join(FILES[file]);
        let scene = match Scene::from_text(&text, &path, &[], &read) {
            Ok(scene) => scene,
            Err(failure) => {
                let why = failure.to_string();
                // An error of the whole file names its element. An invalid start names the bodies.
                // A value out of bounds names its joint or body.
                let is_named = ["line ", ">: ", "position: ", "joints[", "gears[", "bodies["];
                assert!(is_named.iter().any(|name| why.contains(name)), "{why}\n{text}");
                assert_eq!(why.lines().count(), 1, "{why}");
                refused += 1;
                continue;
            }
        };
        let mut simulation = scene.simulation(&Arc::new(AtomicBool::new(false))).unwrap();
        let mut record = StepRecord::new();
        for _ in 0..3 {
            // A joint may be so far apart that a step has no valid problem. That is an error, not a
            // panic.
            if simulation.step(&mut record).is_err() {
                break;
            }
        }
        moved += 1;
    }
    assert!(refused > 300 && moved > 50, "{refused} {moved}");
}
