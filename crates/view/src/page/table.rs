//! Tables of a page.

use super::number::html;

/// Table in a scrollable box. Each column has a name and a flag for numeric content.
pub fn table(columns: &[(&str, bool)], rows: &str) -> String {
    let class = |numbers: bool| if numbers { " class=\"n\"" } else { "" };
    let heads = columns
        .iter()
        .map(|(name, numbers)| format!("<th scope=\"col\"{}>{name}</th>", class(*numbers)));
    format!(
        "<div class=\"box\" tabindex=\"0\">\n<table>\n<thead><tr>{}</tr></thead>\n\
         <tbody>\n{rows}</tbody>\n</table>\n</div>\n",
        heads.collect::<String>()
    )
}

/// Numeric cell. Narrow pages, which have no columns, show `name` before the number.
pub fn number(name: &str, text: &str) -> String {
    format!("<td class=\"n\" data-name=\"{name}\">{}</td>", html(text))
}
