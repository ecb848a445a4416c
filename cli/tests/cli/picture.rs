//! Reader of the pictures that the program draws.

use std::fs;
use std::path::Path;

/// Panels of a figure: name, start of the label, number of curves.
pub type Panels<const N: usize> = [(&'static str, &'static str, usize); N];

pub const MOTION: Panels<6> = [
    ("x", "x (m)", 1),
    ("y", "y (m)", 1),
    ("z", "z (m)", 1),
    ("speed", "|v| (m/s)", 1),
    ("force", "|F| (N)", 1),
    ("contacts", "contacts", 1),
];

pub const ENERGY: Panels<4> = [
    ("energy", "E (J)", 3),
    ("height", "zmin (m)", 1),
    ("residual", "residual (m/s)", 1),
    ("iterations", "iterations", 1),
];

/// SVG in the program's own form with one element a line.
pub struct Svg {
    pub text: String,
    pub width: f64,
    pub height: f64,
}

/// Content of a panel.
pub struct Panel {
    pub label: String,
    pub legend: Vec<String>,
    pub curves: Vec<Vec<(f64, f64)>>,
    pub dots: usize,
    /// Statuses with marks.
    pub marks: Vec<String>,
}

impl Svg {
    pub fn read(path: &Path) -> Self {
        let text = fs::read_to_string(path).unwrap();
        assert!(text.starts_with("<svg xmlns=") && text.ends_with("</svg>\n"));
        assert!(!text.contains("NaN") && !text.contains("inf"), "{}", path.display());
        let size = |name| attribute(&text, name).unwrap().parse().unwrap();
        Self { width: size("width"), height: size("height"), text }
    }

    /// Names of the panels from top to bottom.
    pub fn panels(&self) -> Vec<&str> {
        let starts = self.text.lines().filter(|line| line.starts_with("<g class=\"panel\""));
        starts.map(|line| attribute(line, "id").unwrap()).collect()
    }

    pub fn panel(&self, id: &str) -> Panel {
        let start = self.text.find(&format!("<g class=\"panel\" id=\"{id}\">")).unwrap();
        let end = start + self.text[start..].find("</g>").unwrap();
        let lines: Vec<&str> = self.text[start..end].lines().collect();
        let of = |class: &str| {
            let class = format!("class=\"{class}");
            lines.iter().copied().filter(move |line| line.contains(&class))
        };
        let texts = |class: &str| of(class).map(characters).collect::<Vec<_>>();
        Panel {
            label: texts("axis").concat(),
            legend: texts("legend"),
            curves: of("series").map(|line| points(attribute(line, "d").unwrap())).collect(),
            dots: of("dots").count(),
            marks: of("marks ")
                .map(|line| attribute(line, "class").unwrap().replace("marks ", ""))
                .collect(),
        }
    }
}

fn attribute<'a>(text: &'a str, name: &str) -> Option<&'a str> {
    text.split_once(&format!(" {name}=\"")).and_then(|(_, rest)| rest.split('"').next())
}

/// Text of an element without its markup.
fn characters(line: &str) -> String {
    let parts = line.split('<').filter_map(|part| part.split_once('>'));
    parts.map(|(_, text)| text).collect::<String>().replace('\u{200b}', "")
}

fn points(path: &str) -> Vec<(f64, f64)> {
    let pairs = path.split(['M', 'L']).filter(|pair| !pair.is_empty());
    pairs
        .map(|pair| {
            let (x, y) = pair.split_once(' ').unwrap();
            (x.parse().unwrap(), y.parse().unwrap())
        })
        .collect()
}

/// Width and height of a PNG [pixels] from its header.
pub fn png_size(path: &Path) -> (u32, u32) {
    let bytes = fs::read(path).unwrap();
    assert_eq!(&bytes[..8], b"\x89PNG\r\n\x1a\n");
    let number = |at: usize| u32::from_be_bytes(bytes[at..at + 4].try_into().unwrap());
    (number(16), number(20))
}
