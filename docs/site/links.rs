//! The links of the finished site.

use crate::{Done, beside};
use std::collections::{HashMap, HashSet};
use std::fs;
use std::path::{Path, PathBuf};

/// What a page links to, and what can be linked to in it.
#[derive(Default)]
struct Page {
    links: HashSet<String>,
    anchors: HashSet<String>,
}

/// Whether every link of every page below `site` leads to a file below it, and to an anchor of that file. Links to
/// other sites are not followed.
pub fn check(site: &Path) -> Done {
    let mut pages = HashMap::new();
    let mut files = HashSet::new();
    read(site, Path::new(""), &mut files, &mut pages)?;
    let mut wrong = Vec::new();
    let mut links = 0;
    for (from, page) in &pages {
        for link in &page.links {
            let is_elsewhere = link.contains("://")
                || link.starts_with("data:")
                || link.starts_with("javascript:")
                // rustdoc asks for the implementations in other crates also where there are none.
                || link.contains("trait.impl/");
            if is_elsewhere {
                continue;
            }
            links += 1;
            if !leads_somewhere(from, link, &files, &pages) {
                wrong.push(format!("{}: {link}", from.display()));
            }
        }
    }
    wrong.sort();
    if !wrong.is_empty() {
        return Err(format!("links that lead nowhere:\n{}", wrong.join("\n")).into());
    }
    println!("{} pages, {links} links, each leads somewhere", pages.len());
    Ok(())
}

fn leads_somewhere(
    from: &Path,
    link: &str,
    files: &HashSet<PathBuf>,
    pages: &HashMap<PathBuf, Page>,
) -> bool {
    let (file, fragment) = link.split_once('#').unwrap_or((link, ""));
    let file = file.split('?').next().unwrap_or_default();
    let found = match file {
        "" => Some(from.to_owned()),
        file => beside(from, file).map(|path| match files.contains(&path) {
            true => path,
            false => path.join("index.html"),
        }),
    };
    let Some(found) = found.filter(|path| files.contains(path)) else { return false };
    // Lines of a source file are numbers, or two of them.
    let lines = fragment.split('-').next().unwrap_or_default();
    pages.get(&found).is_none_or(|page| {
        let has = |anchor: &str| page.anchors.contains(anchor);
        fragment.is_empty() || has(fragment) || has(&plain(fragment)) || has(lines)
    })
}

fn read(
    site: &Path,
    folder: &Path,
    files: &mut HashSet<PathBuf>,
    pages: &mut HashMap<PathBuf, Page>,
) -> Done {
    for entry in fs::read_dir(site.join(folder))? {
        let entry = entry?;
        let path = folder.join(entry.file_name());
        if entry.file_type()?.is_dir() {
            read(site, &path, files, pages)?;
            continue;
        }
        if path.extension().is_some_and(|kind| kind == "html") {
            pages.insert(path.clone(), page(&fs::read_to_string(entry.path())?));
        }
        files.insert(path);
    }
    Ok(())
}

fn page(html: &str) -> Page {
    let mut page = Page::default();
    let mut rest = html;
    while let Some((_, tag)) = rest.split_once('<') {
        let tail = if let Some(comment) = tag.strip_prefix("!--") {
            comment.split_once("-->").map(|(_, tail)| tail)
        } else {
            let (length, attributes) = attributes(tag);
            for (name, value) in attributes {
                match name {
                    "href" | "src" => page.links.insert(plain(value)),
                    "id" | "name" => page.anchors.insert(plain(value)),
                    _ => false,
                };
            }
            let tail = &tag[length..];
            match ["script", "style"].into_iter().find(|name| tag.starts_with(name)) {
                Some(name) => tail.split_once(&format!("</{name}")).map(|(_, tail)| tail),
                None => Some(tail),
            }
        };
        rest = tail.unwrap_or_default();
    }
    page
}

/// The attributes of a tag that have values, quoted or not, and the tag's length.
fn attributes(tag: &str) -> (usize, Vec<(&str, &str)>) {
    let mut found = Vec::new();
    let mut at = 0;
    loop {
        let rest = &tag[at..];
        let Some(next) = rest.find(['=', '>']) else { return (tag.len(), found) };
        if rest[next..].starts_with('>') {
            return (at + next, found);
        }
        let name = rest[..next].rsplit(char::is_whitespace).next().unwrap_or_default();
        let value = &rest[next + 1..];
        let quote = value.chars().next().filter(|c| ['"', '\''].contains(c));
        let begin = usize::from(quote.is_some());
        let end = match quote {
            Some(quote) => value[1..].find(quote).map(|end| end + 1),
            None => value.find(|c: char| c.is_whitespace() || c == '>'),
        };
        let end = end.unwrap_or(value.len());
        found.push((name, &value[begin..end]));
        at += next + 1 + (end + begin).min(value.len());
    }
}

/// `text` without references to characters and without escapes of bytes.
fn plain(text: &str) -> String {
    let references =
        [("&lt;", "<"), ("&gt;", ">"), ("&quot;", "\""), ("&#x27;", "'"), ("&#39;", "'")];
    let text = references.iter().fold(text.to_owned(), |text, (from, to)| text.replace(from, to));
    let text = text.replace("&amp;", "&");
    let mut bytes = Vec::with_capacity(text.len());
    let mut rest = text.as_bytes();
    while let Some((&first, tail)) = rest.split_first() {
        let code = tail.get(..2).filter(|_| first == b'%');
        let code =
            code.and_then(|code| u8::from_str_radix(std::str::from_utf8(code).ok()?, 16).ok());
        bytes.push(code.unwrap_or(first));
        rest = if code.is_some() { &tail[2..] } else { tail };
    }
    String::from_utf8_lossy(&bytes).into_owned()
}
