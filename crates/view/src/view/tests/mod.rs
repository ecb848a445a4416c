//! Unit tests of `view/mod.rs`.

use super::*;

#[test]
fn scripts_and_styles_do_not_close_their_element() {
    for script in scripts::page_scripts().into_iter().chain([PLOTTER, DRAWER]) {
        assert!(!script.contains("</script") && !script.contains("<!--"));
    }
    for style in STYLES {
        assert!(!style.contains("</style"));
    }
}

#[test]
fn json_in_html_is_escaped() {
    let text = "</script><!-- & \u{2028}";
    let json = escape_json(&serde_json::to_string(text).unwrap());
    assert!(!json.contains(['<', '>', '&', '\u{2028}']));
    assert_eq!(serde_json::from_str::<String>(&json).unwrap(), text);
}
