//! Unit tests of `markup.rs`.

use super::*;

#[test]
fn markup_characters_in_text_are_escaped() {
    assert_eq!(escape("a<b>&\"\n\u{ffff}"), "a&lt;b&gt;&amp;&quot;  ");
}
