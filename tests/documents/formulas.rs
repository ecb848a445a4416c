//! Formulas of documents as MathML.

#[path = "../../docs/site/formulas.rs"]
mod converter;

use converter::converted;

use std::fs;
use std::path::Path;

fn page(source: &str) -> Result<String, String> {
    converted(source, |_| None)
}

fn read(file: impl AsRef<Path>) -> String {
    fs::read_to_string(Path::new(env!("CARGO_MANIFEST_DIR")).join(file)).unwrap()
}

#[test]
fn formulas_become_mathml_and_code_stays() {
    let code = "```rust\nlet a = \"$x$\"; // $$y$$\n```\n\nand `$z$` and `a_b`\n";
    let page = page(&format!("A $\\mu$ and\n\n{code}\n\n$$\n\\frac1h\n$$\n")).unwrap();
    assert!(page.starts_with("A <math><mi>μ</mi></math> and\n"), "{page}");
    assert!(page.contains(code), "{page}");
    assert!(page.contains("<math display=\"block\"><mfrac><mn>1</mn><mi>h</mi></mfrac></math>"));
}

/// Checks the number of an equation. Documents write it without the environment that LaTeX
/// requires.
#[test]
fn an_equation_has_its_number() {
    let found = page("$$\na=b \\tag{7c}\n$$\n").unwrap();
    assert!(found.contains("7c") && !found.contains("tag"), "{found}");
    let error = page("$$\na=\n\\nonsense b \\tag{7c}\n$$\n").unwrap_err();
    assert!(error.starts_with("line 3: "), "{error}");
}

/// Checks punctuation that Markdown would read as a link, emphasis or the end of a cell.
#[test]
fn the_punctuation_of_formulas_means_nothing_to_markdown() {
    let page = page("$[a]_*|b| < c$").unwrap();
    let text: String = page.split('>').filter_map(|piece| piece.split('<').next()).collect();
    assert!(!text.contains(['[', ']', '*', '_', '|', '`', '\\']), "{text}");
    assert!(page.contains("&#91;") && page.contains("&#124;") && page.contains("&lt;"), "{page}");
}

#[test]
fn links_lead_where_the_page_is_read() {
    let target = |link: &str| (link == "../a.rs#b").then(|| "a.html#b".to_owned());
    let is =
        |source, expected: &str| assert_eq!(converted(source, target).as_deref(), Ok(expected));
    is("[`b`](../a.rs#b)", "[`b`](a.html#b)");
    is("see [`docs/a.md`](a.md)!", "see `docs/a.md`!");
    is("[Ipopt](https://coin-or.github.io/Ipopt/)", "[Ipopt](https://coin-or.github.io/Ipopt/)");
}

#[test]
fn a_formula_that_cannot_be_converted_is_named_by_its_line() {
    let error = page("text\n\n$$\na=\n\\nonsense b\n$$\n").unwrap_err();
    assert!(error.starts_with("line 5: ") && error.contains("\\nonsense b"), "{error}");
    let error = page("$a$ and\n$\\frac{a$").unwrap_err();
    assert_eq!(error, "line 2: a $ that is part of no formula");
    let error = page("$a$ and\n[$b$](b.md)").unwrap_err();
    assert_eq!(error, "line 2: a formula in a link");
}

#[test]
fn every_formula_of_the_guide_is_converted() {
    let source = read("docs/guide.md");
    let page = page(&source).unwrap();
    assert!(page.matches("<math").count() > 40);
    assert_eq!(page.matches("```").count(), source.matches("```").count());
    assert!(!page.contains('$') && !page.contains("../crates"), "{page}");
}
