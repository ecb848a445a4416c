//! Makes the crate's front page of `docs/guide.md`: its mathematics becomes MathML, which
//! browsers render without a script, and its links to source files become links to items.

mod formulas;

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
/// As [`formulas::converted`].
pub fn page(source: &str) -> Result<String, String> {
    Ok(formulas::converted(source, item)? + STYLE)
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
