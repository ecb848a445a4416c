//! Makes the crate's front page of `docs/guide.md`: its mathematics becomes MathML, which
//! browsers render without a script, and its links to source files become links to items.

use math_core::{LatexToMathML, MathCoreConfig, MathDisplay};
use pulldown_cmark::{Event, Options, Parser, Tag, TagEnd};
use std::fmt::Write;
use std::ops::Range;

/// Brackets grow only with a font that has a MATH table: the usual ones of macOS, Windows and
/// Linux. rustdoc lets words break anywhere, which cuts off text in formulas, and gives every
/// paragraph whose formulas are higher than its lines a scroll bar.
const STYLE: &str = r#"
<style>
.docblock math {
  font-family: "STIX Two Math", "Cambria Math", "Latin Modern Math", "DejaVu Math TeX Gyre", math;
  overflow-wrap: normal;
}
.docblock > p:has(math) { overflow-y: hidden; padding-bottom: 0.3em; margin-bottom: 0.45em; }
</style>
"#;

/// The page for rustdoc of the Markdown `source`.
///
/// - `$…$` and `$$…$$` become MathML; code is left alone.
/// - `[text](../src/plane.rs#Plane::new)` becomes a link to `crate::plane::Plane::new`, and so does
///   `[text](../core/src/plane.rs#Plane::new)`: the crate has the core's items under the same paths.
/// - Of other links to files of the repository, which rustdoc's pages do not have beside
///   them, the text stays.
///
/// # Errors
/// What is wrong, with its line: a formula that cannot be converted, a formula in the text of
/// a link, a dollar sign outside formulas and code.
pub fn page(source: &str) -> Result<String, String> {
    let options = Options::ENABLE_MATH | Options::ENABLE_TABLES;
    let converter = LatexToMathML::new(MathCoreConfig::default())
        .map_err(|(error, ..)| format!("the converter of formulas: {error}"))?;
    let mut page = String::with_capacity(2 * source.len());
    let mut written = 0;
    let mut replace = |range: Range<usize>, text: &str| {
        page.push_str(&source[written..range.start]);
        page.push_str(text);
        written = range.end;
    };
    let line = |at: usize| source[..at].matches('\n').count() + 1;
    let mut link = None;
    let mut in_code = false;
    for (event, range) in Parser::new_ext(source, options).into_offset_iter() {
        let (latex, display) = match &event {
            Event::InlineMath(latex) => (latex, MathDisplay::Inline),
            Event::DisplayMath(latex) => (latex, MathDisplay::Block),
            Event::Text(text) if !in_code && text.contains('$') => {
                return Err(format!("line {}: a $ that is part of no formula", line(range.start)));
            }
            Event::Start(Tag::CodeBlock(_)) => {
                in_code = true;
                continue;
            }
            Event::End(TagEnd::CodeBlock) => {
                in_code = false;
                continue;
            }
            Event::Start(Tag::Link { dest_url, .. }) => {
                link = Some(dest_url.to_string());
                continue;
            }
            Event::End(TagEnd::Link) => {
                let text = &source[range.clone()];
                let text = text.rfind("](").map_or(text, |end| &text[..=end]);
                match link.take().as_deref() {
                    Some(url) if url.contains("://") || url.starts_with('#') => {}
                    Some(file) => match item(file) {
                        Some(item) => replace(range, &format!("{text}({item})")),
                        None => replace(range, &text[1..text.len() - 1]),
                    },
                    None => {}
                }
                continue;
            }
            _ => continue,
        };
        if link.is_some() {
            return Err(format!("line {}: a formula in a link", line(range.start)));
        }
        let mathml = converter.convert_with_local_state(latex, display).map_err(|error| {
            let dollars = (range.len() - latex.len()) / 2;
            let line = line(range.start + dollars + error.0.start);
            let text = source.lines().nth(line - 1).unwrap_or_default();
            format!("line {line}: {error} This is the line:\n{text}")
        })?;
        replace(range, &shielded(&mathml.mathml));
    }
    page.push_str(&source[written..]);
    page.push_str(STYLE);
    Ok(page)
}

/// The item of a link like `../src/solver/mod.rs#StepSolver`: `crate::solver::StepSolver`. `None` of
/// links to other files than sources.
fn item(link: &str) -> Option<String> {
    let (file, name) = link.split_once('#').unwrap_or((link, ""));
    let file = file.strip_prefix("../core/src/").or_else(|| file.strip_prefix("../src/"))?;
    let module = file.trim_end_matches(".rs");
    let module = module.trim_end_matches("/mod").replace('/', "::");
    let separator = if name.is_empty() { "" } else { "::" };
    Some(format!("crate::{module}{separator}{name}"))
}

/// MathML whose text Markdown leaves as it is: punctuation outside tags as references to
/// characters, no line breaks. (`*`, `_`, `[` and `|` mean something to Markdown.)
fn shielded(mathml: &str) -> String {
    let mut shielded = String::with_capacity(mathml.len());
    let mut in_tag = false;
    for character in mathml.chars() {
        match character {
            '<' => in_tag = true,
            '>' => in_tag = false,
            _ => {}
        }
        let plain = in_tag || !character.is_ascii_punctuation() || "<>&#;".contains(character);
        match character {
            '\n' => shielded.push(' '),
            _ if plain => shielded.push(character),
            // A String takes everything.
            _ => drop(write!(shielded, "&#{};", u32::from(character))),
        }
    }
    shielded
}
