//! Text in markup.

/// Text as XML and HTML have it.
pub fn escape(text: &str) -> String {
    text.chars().fold(String::new(), |mut out, c| {
        match c {
            '&' => out.push_str("&amp;"),
            '<' => out.push_str("&lt;"),
            '>' => out.push_str("&gt;"),
            '"' => out.push_str("&quot;"),
            // Neither control characters nor what else XML has no place for.
            c if c.is_control() || matches!(c, '\u{fffe}' | '\u{ffff}') => out.push(' '),
            c => out.push(c),
        }
        out
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn text_is_harmless_in_markup() {
        assert_eq!(escape("a<b>&\"\n\u{ffff}"), "a&lt;b&gt;&amp;&quot;  ");
    }
}
