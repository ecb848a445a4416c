//! XML as a tree of elements with line numbers, limited in size.

use roxmltree::{Document, Node, ParsingOptions};
use std::borrow::Cow;
use std::collections::HashSet;
use std::rc::Rc;
use tumble_model::{nearest, shown};

/// Maximum size of a robot's file (bytes).
pub const LARGEST_FILE: u64 = 16 << 20;
/// Maximum number of elements.
const MOST_ELEMENTS: u32 = 200_000;
/// Maximum nesting depth of elements.
const DEEPEST: usize = 200;
/// Maximum number of numbers in one attribute.
const MOST_NUMBERS: usize = 1_000_000;

/// A value, or one sentence about the fault in a file and its place.
pub type Parsed<T> = Result<T, String>;

/// Message for a Xacro file.
const XACRO: &str = "this is Xacro, not URDF; run `xacro FILE > robot.urdf` first";

/// An element with its name, attributes, children and line.
#[derive(Debug, Clone)]
pub struct Element {
    /// Name without name space prefix.
    pub tag: String,
    /// Names and values of the attributes, in order.
    pub attributes: Vec<(String, String)>,
    /// Child elements.
    pub children: Vec<Element>,
    /// Text of the element without that of its children, trimmed.
    pub text: String,
    /// Line, counted from 1.
    pub line: u32,
    /// Name of the included file that contains the element.
    pub file: Option<Rc<str>>,
}

/// Largest number of attributes of an element. The parser compares each with all others.
const MOST_ATTRIBUTES: usize = 1000;

/// Line of the first element with more than [`MOST_ATTRIBUTES`] attributes, counted from 1.
fn line_of_many_attributes(text: &str) -> Option<usize> {
    let mut rest = text;
    while let Some(start) = rest.find('<') {
        let tag = &rest[start..];
        let ends = [("<!--", "-->"), ("<![CDATA[", "]]>")];
        if let Some((_, end)) = ends.iter().find(|(begin, _)| tag.starts_with(begin)) {
            rest = &tag[tag.find(end).unwrap_or(tag.len())..];
            continue;
        }
        let (mut quote, mut values, mut length) = (None, 0, tag.len());
        for (at, byte) in tag.bytes().enumerate() {
            match (quote, byte) {
                (None, b'>') => {
                    length = at;
                    break;
                }
                (None, b'"' | b'\'') => quote = Some(byte),
                (Some(open), _) if open == byte => {
                    quote = None;
                    values += 1;
                }
                _ => {}
            }
        }
        if values > MOST_ATTRIBUTES {
            return Some(1 + text[..text.len() - tag.len()].matches('\n').count());
        }
        rest = &tag[length..];
    }
    None
}

/// Largest number of prefixes of name spaces. The parser compares each name with all of them.
const MOST_PREFIXES: usize = 100;

/// Line of the first prefix beyond [`MOST_PREFIXES`], counted from 1.
fn line_of_many_prefixes(text: &str) -> Option<usize> {
    let mut prefixes = HashSet::new();
    let ends = |c: char| c.is_whitespace() || "=:<>\"'".contains(c);
    let mut declared = text.match_indices("xmlns:").map(|(at, start)| at + start.len());
    let beyond = declared.find(|&at| {
        prefixes.insert(text[at..].split(ends).next()) && prefixes.len() > MOST_PREFIXES
    })?;
    Some(1 + text[..beyond].matches('\n').count())
}

/// Rejects XML whose parsing would take too long.
///
/// # Errors
/// The line of the element.
pub fn check_attributes(text: &str) -> Parsed<()> {
    if let Some(line) = line_of_many_attributes(text) {
        return Err(format!("line {line}: an element has more than {MOST_ATTRIBUTES} attributes"));
    }
    line_of_many_prefixes(text).map_or(Ok(()), |line| {
        Err(format!("line {line}: the file has more than {MOST_PREFIXES} XML name spaces"))
    })
}

impl Element {
    /// Parses `text` and returns its root element. `file` is the name of an included file.
    pub fn parse(text: &str, file: Option<&str>) -> Parsed<Self> {
        let options = ParsingOptions { nodes_limit: MOST_ELEMENTS, ..ParsingOptions::default() };
        let text = without_late_declaration(text);
        let text = &*with_name_spaces(&text);
        check_attributes(text).map_err(|why| format!("{}{why}", within(file)))?;
        let document = Document::parse_with_options(text, options).map_err(|error| {
            let line = error.pos().row;
            let hint = if text.contains("xacro:") { XACRO } else { "it is not XML" };
            format!("{}line {line}: {hint}: {error}", within(file))
        })?;
        let file: Option<Rc<str>> = file.map(Rc::from);
        let lines = LineStarts::new(text);
        Self::from_node(&lines, document.root_element(), file.as_ref(), 0)
    }

    fn from_node(
        lines: &LineStarts,
        node: Node<'_, '_>,
        file: Option<&Rc<str>>,
        depth: usize,
    ) -> Parsed<Self> {
        let line = lines.line(node.range().start);
        let name = node.tag_name();
        if name.namespace().is_some_and(|space| space.contains("xacro")) {
            let file = within(file.map(|file| &**file));
            return Err(format!("{file}line {line}, <{}>: {XACRO}", name.name()));
        }
        if depth > DEEPEST {
            return Err(format!(
                "{}line {line}: elements are nested more than {DEEPEST} deep",
                within(file.map(|file| &**file))
            ));
        }
        let attributes = node.attributes();
        let attributes = attributes.map(|one| (one.name().to_owned(), one.value().to_owned()));
        let children = node.children().filter(Node::is_element);
        let texts = node.children().filter(Node::is_text).filter_map(|part| part.text());
        Ok(Self {
            tag: name.name().to_owned(),
            attributes: attributes.collect(),
            children: children
                .map(|child| Self::from_node(lines, child, file, depth + 1))
                .collect::<Result<_, _>>()?,
            text: texts.collect::<String>().trim().to_owned(),
            line,
            file: file.cloned(),
        })
    }

    /// Error message about the element: position, name and `why`.
    pub fn wrong(&self, why: impl std::fmt::Display) -> String {
        format!("{}: {why}", self.at())
    }

    /// Position and name of the element, for messages.
    pub fn at(&self) -> String {
        let name = self.own("name").or_else(|| self.own("class"));
        let name = name.map_or(String::new(), |name| format!(" {:?}", shown::line(name)));
        format!("{}line {}, <{}>{name}", within(self.file.as_deref()), self.line, self.tag)
    }

    /// Value of an attribute of this element.
    pub fn own(&self, name: &str) -> Option<&str> {
        self.attributes.iter().find(|(known, _)| known == name).map(|(_, value)| value.as_str())
    }

    /// Children with this tag.
    pub fn all<'a>(&'a self, tag: &'a str) -> impl Iterator<Item = &'a Element> {
        self.children.iter().filter(move |child| child.tag == tag)
    }

    /// The only child with this tag. More than one is an error.
    pub fn one(&self, tag: &str) -> Parsed<Option<&Self>> {
        let mut all = self.children.iter().filter(|child| child.tag == tag);
        let first = all.next();
        match all.next() {
            Some(second) => Err(second.wrong(format!("<{}> already has one", self.tag))),
            None => Ok(first),
        }
    }

    /// Number of elements in this tree, including the root.
    pub fn count(&self) -> usize {
        1 + self.children.iter().map(Self::count).sum::<usize>()
    }

    /// Parses the numbers in the value of an attribute.
    pub fn numbers_of(&self, name: &str, value: &str) -> Parsed<Vec<f64>> {
        let number = |word: &str| match word.parse::<f64>() {
            Ok(number) if number.is_finite() => Ok(number),
            _ if word.contains("${") => Err(self.wrong(format!("{name}: {XACRO}"))),
            _ => Err(self.wrong(format!("{name}: {:?} is not a number", shown::line(word)))),
        };
        let words = value.split(|c: char| c.is_ascii_whitespace() || c == ',');
        let words: Vec<_> = words.filter(|word| !word.is_empty()).collect();
        if words.len() > MOST_NUMBERS {
            return Err(self.wrong(format!("{name}: there are more than {MOST_NUMBERS} numbers")));
        }
        words.into_iter().map(number).collect()
    }
}

/// Byte offsets of the lines of a text. `Document::text_pos_at` would scan the text at each call.
struct LineStarts(Vec<usize>);

impl LineStarts {
    fn new(text: &str) -> Self {
        let ends = text.bytes().enumerate().filter(|(_, byte)| *byte == b'\n');
        Self(std::iter::once(0).chain(ends.map(|(end, _)| end + 1)).collect())
    }

    /// Line that contains a byte, counted from 1.
    fn line(&self, byte: usize) -> u32 {
        self.0.partition_point(|start| *start <= byte) as u32
    }
}

/// `text` with an XML declaration after its beginning replaced by blanks. Many parsers accept such
/// files.
fn without_late_declaration(text: &str) -> Cow<'_, str> {
    let begun = text.trim_start();
    let end = begun.find("?>").filter(|_| begun.starts_with("<?xml") && begun.len() < text.len());
    let Some(end) = end else { return Cow::Borrowed(text) };
    let blank = |c: char| if c == '\n' { c } else { ' ' };
    let (head, rest) = text.split_at(text.len() - begun.len() + end + "?>".len());
    Cow::Owned(head.chars().map(blank).chain(rest.chars()).collect())
}

/// `text` of an SDF with the prefixes declared that SDF files use without declaration.
fn with_name_spaces(text: &str) -> Cow<'_, str> {
    let is_missing = |prefix: &&&str| {
        text.contains(&format!("{prefix}:")) && !text.contains(&format!("xmlns:{prefix}"))
    };
    let missing = ["drake", "gz", "ignition"];
    let missing: String = missing
        .iter()
        .filter(is_missing)
        .map(|prefix| format!(" xmlns:{prefix}=\"{prefix}\""))
        .collect();
    if missing.is_empty() {
        return Cow::Borrowed(text);
    }
    Cow::Owned(text.replacen("<sdf", &format!("<sdf{missing}"), 1))
}

fn within(file: Option<&str>) -> String {
    file.map_or(String::new(), |file| format!("{}, ", shown::line(file)))
}

/// True if a list of names, separated by spaces, has this one.
pub fn is_listed(name: &str, list: &str) -> bool {
    list.split_ascii_whitespace().any(|known| known == name)
}

/// Attributes of an element, including defaults.
pub trait Attributes {
    /// The element, for messages.
    fn element(&self) -> &Element;

    /// Value of an attribute.
    fn get(&self, name: &str) -> Option<&str>;

    /// All numbers of an attribute.
    fn numbers(&self, name: &str) -> Parsed<Option<Vec<f64>>> {
        self.get(name).map(|value| self.element().numbers_of(name, value)).transpose()
    }

    /// Exactly `N` numbers of an attribute.
    fn exactly<const N: usize>(&self, name: &str) -> Parsed<Option<[f64; N]>> {
        let Some(numbers) = self.numbers(name)? else { return Ok(None) };
        <[f64; N]>::try_from(numbers).map(Some).map_err(|given| {
            let count = given.len();
            self.element().wrong(format!("{name}: {count} numbers are given; {N} are needed"))
        })
    }

    /// Number of an attribute.
    fn number(&self, name: &str) -> Parsed<Option<f64>> {
        Ok(self.exactly::<1>(name)?.map(|[number]| number))
    }

    /// Number of an attribute within bounds. `usual` is the default.
    fn bounded(&self, name: &str, usual: f64, [low, high]: [f64; 2]) -> Parsed<f64> {
        self.number(name)?;
        self.first_bounded(name, usual, [low, high])
    }

    /// The first number of an attribute, within bounds.
    fn first_bounded(&self, name: &str, usual: f64, [low, high]: [f64; 2]) -> Parsed<f64> {
        let number = self.numbers(name)?.and_then(|all| all.first().copied()).unwrap_or(usual);
        if (low..=high).contains(&number) {
            Ok(number)
        } else {
            Err(self.element().wrong(format!("{name} is {number:?}; allowed: {low:?} to {high:?}")))
        }
    }

    /// Integer of an attribute.
    fn whole(&self, name: &str) -> Parsed<Option<i64>> {
        let Some(number) = self.number(name)? else { return Ok(None) };
        if number.fract() != 0.0 || number.abs() > 2_147_483_648.0 {
            return Err(self.element().wrong(format!("{name}: a whole number is needed")));
        }
        Ok(Some(number as i64))
    }

    /// Attribute whose value is one of several words.
    fn word<T: Copy>(&self, name: &str, words: &[(&str, T)]) -> Parsed<Option<T>> {
        let Some(value) = self.get(name) else { return Ok(None) };
        let found = words.iter().find(|(word, _)| *word == value.trim());
        found.map(|(_, meaning)| Some(*meaning)).ok_or_else(|| {
            let allowed: Vec<_> = words.iter().map(|(word, _)| format!("{word:?}")).collect();
            let value = shown::line(value);
            self.element().wrong(format!("{name} is {value:?}; allowed: {}", allowed.join(", ")))
        })
    }

    /// Value of a required attribute.
    fn needed(&self, name: &str) -> Parsed<&str> {
        self.get(name).ok_or_else(|| self.element().wrong(format!("{name} is needed")))
    }

    /// Rejects attributes with numbers other than 0 from the number `from` on: each is given by its name and
    /// the reason.
    fn refuse_unless_zero(&self, from: usize, unsupported: &[(&str, &str)]) -> Parsed<()> {
        for (name, why) in unsupported {
            let numbers = self.numbers(name)?.unwrap_or_default();
            if numbers.iter().skip(from).any(|number| *number != 0.0) {
                return Err(self.element().wrong(format!("{name}: {why}")));
            }
        }
        Ok(())
    }

    /// Rejects attributes that are listed neither in `read` nor in `idle`, separated by spaces.
    fn refuse_others(&self, read: &str, idle: &str) -> Parsed<()> {
        let known = |name: &str| is_listed(name, read) || is_listed(name, idle);
        match self.element().attributes.iter().find(|(name, _)| !known(name)) {
            None => Ok(()),
            Some((name, _)) => {
                let names = read.split_ascii_whitespace().chain(idle.split_ascii_whitespace());
                let hint = nearest::hint(name, names);
                let name = shown::line(name);
                Err(self.element().wrong(format!("{name}: this attribute is unknown{hint}")))
            }
        }
    }
}

impl Attributes for Element {
    fn element(&self) -> &Element {
        self
    }

    fn get(&self, name: &str) -> Option<&str> {
        self.own(name)
    }
}
