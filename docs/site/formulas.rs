//! Makes Markdown that needs no script of Markdown with formulas: mathematics becomes MathML, and links lead
//! where the pages are that it is read on.

use math_core::{LatexToMathML, MathCoreConfig, MathDisplay};
use pulldown_cmark::{Event, Options, Parser, Tag, TagEnd};
use std::fmt::Write;
use std::ops::Range;

/// The Markdown `source` with `$…$` and `$$…$$` as MathML. A link to a file leads where `target` says; where
/// it says `None`, its text stays. Links within the page and to other sites stay.
///
/// # Errors
/// What is wrong, with its line: a formula that cannot be converted, a formula in the text of
/// a link, a dollar sign outside formulas and code.
pub fn converted(source: &str, target: impl Fn(&str) -> Option<String>) -> Result<String, String> {
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
                    Some(file) => match target(file) {
                        Some(target) => replace(range, &format!("{text}({target})")),
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
        // An equation with a number has an environment, though documents need not say so.
        let is_bare = latex.contains(r"\tag{") && !latex.contains(r"\begin{align}");
        let [begin, end] =
            if is_bare { [r"\begin{equation}", r"\end{equation}"] } else { ["", ""] };
        let latex = format!("{begin}{latex}{end}");
        let mathml = converter.convert_with_local_state(&latex, display).map_err(|error| {
            let dollars = (range.len() + begin.len() + end.len() - latex.len()) / 2;
            let line = line(range.start + dollars + error.0.start.saturating_sub(begin.len()));
            let text = source.lines().nth(line - 1).unwrap_or_default();
            format!("line {line}: {error} This is the line:\n{text}")
        })?;
        replace(range, &shielded(&mathml.mathml));
    }
    page.push_str(&source[written..]);
    Ok(page)
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
