//! Every link of every document leads to an existing file and an existing heading.

use pulldown_cmark::{Event, Options, Parser, Tag, TagEnd};
use std::collections::HashMap;
use std::fs;
use std::path::{Component, Path, PathBuf};

/// Documents of the repository, relative to its root, without build results and foreign files.
fn documents() -> Vec<PathBuf> {
    let mut found = Vec::new();
    let mut folders = vec![PathBuf::new()];
    while let Some(folder) = folders.pop() {
        for entry in fs::read_dir(root().join(&folder)).unwrap() {
            let entry = entry.unwrap();
            let (name, path) = (entry.file_name(), folder.join(entry.file_name()));
            let name = name.to_string_lossy();
            if entry.file_type().unwrap().is_dir() {
                let is_ours = !name.starts_with('.') && name != "target" && name != "out";
                folders.extend(is_ours.then_some(path));
            } else if name.ends_with(".md") {
                found.push(path);
            }
        }
    }
    found.sort();
    found
}

fn root() -> &'static Path {
    Path::new(env!("CARGO_MANIFEST_DIR"))
}

/// Links of a document with their lines, and the anchors of its headings.
struct Document {
    links: Vec<(usize, String)>,
    anchors: Vec<String>,
}

fn read(path: &Path) -> Document {
    let text = fs::read_to_string(root().join(path)).unwrap();
    let mut document = Document { links: Vec::new(), anchors: Vec::new() };
    let mut heading: Option<String> = None;
    let mut times: HashMap<String, usize> = HashMap::new();
    let options = Options::ENABLE_TABLES | Options::ENABLE_MATH;
    for (event, range) in Parser::new_ext(&text, options).into_offset_iter() {
        let line = text[..range.start].matches('\n').count() + 1;
        match event {
            Event::Start(Tag::Link { dest_url, .. } | Tag::Image { dest_url, .. }) => {
                document.links.push((line, dest_url.to_string()));
            }
            Event::Html(html) | Event::InlineHtml(html) => {
                let sources =
                    html.split("src=\"").skip(1).filter_map(|rest| rest.split('"').next());
                document.links.extend(sources.map(|source| (line, source.to_owned())));
            }
            Event::Start(Tag::Heading { .. }) => heading = Some(String::new()),
            Event::Text(part) | Event::Code(part) => {
                if let Some(heading) = &mut heading {
                    heading.push_str(&part);
                }
            }
            Event::End(TagEnd::Heading(_)) => {
                let anchor = anchor(&heading.take().unwrap_or_default());
                let before = times.entry(anchor.clone()).or_default();
                let again = *before;
                *before += 1;
                document.anchors.push(if again == 0 {
                    anchor
                } else {
                    format!("{anchor}-{again}")
                });
            }
            _ => {}
        }
    }
    document
}

/// Anchor of a heading on the site where the documents are shown.
fn anchor(heading: &str) -> String {
    let heading = heading.to_lowercase();
    let kept = heading.chars().filter_map(|c| match c {
        ' ' => Some('-'),
        _ if c.is_alphanumeric() || c == '-' || c == '_' => Some(c),
        _ => None,
    });
    kept.collect()
}

/// `path` without `..`.
fn plain(path: &Path) -> PathBuf {
    let mut plain = PathBuf::new();
    for part in path.components() {
        match part {
            Component::ParentDir => {
                assert!(plain.pop(), "{} leaves the repository", path.display())
            }
            part => plain.push(part),
        }
    }
    plain
}

#[test]
fn all_document_links_resolve() {
    let paths = documents();
    let documents: HashMap<_, _> = paths.iter().map(|path| (path.clone(), read(path))).collect();
    assert!(paths.len() > 15, "{paths:?}");
    let (mut wrong, mut links) = (Vec::new(), 0);
    for path in &paths {
        for (line, link) in &documents[path].links {
            links += 1;
            if link.contains("://") {
                if !link.starts_with("https://") {
                    wrong.push(format!("{}:{line}: {link}: https is needed", path.display()));
                }
                continue;
            }
            let (file, fragment) = link.split_once('#').unwrap_or((link, ""));
            let target = match file {
                "" => path.clone(),
                file => plain(&path.parent().unwrap().join(file)),
            };
            // A link to a source file may name an item of it, which rustdoc checks.
            let is_there = match documents.get(&target) {
                Some(document) => {
                    fragment.is_empty() || document.anchors.iter().any(|a| a == fragment)
                }
                None => root().join(&target).exists(),
            };
            if !is_there {
                wrong.push(format!("{}:{line}: {link}", path.display()));
            }
        }
    }
    assert!(wrong.is_empty(), "{}", wrong.join("\n"));
    assert!(links > 100, "{links} links");
}
