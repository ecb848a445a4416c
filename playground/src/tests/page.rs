//! Unit tests of `page.rs`.

use super::*;

#[test]
fn playground_page_is_complete_and_closes_no_element_early() {
    let page = page(b"\0asm").unwrap();
    for mark in ["  // STAGE\n", "  // OVERLAYS\n"] {
        assert_eq!(SCENE.matches(mark).count(), 1);
    }
    assert_eq!(page.matches("<script").count(), page.matches("</script>").count());
    assert_eq!(page.matches("</style").count(), 1);
    assert!(super::page(b"text").is_err());
}
