//! Every document is a page of the site.

use std::fs;
use std::path::Path;

#[test]
fn the_site_has_every_document() {
    let root = Path::new(env!("CARGO_MANIFEST_DIR"));
    let pages = fs::read_to_string(root.join("docs/site/pages.rs")).unwrap();
    let mut found = 0;
    for folder in
        ["docs", "docs/howto", "docs/concepts", "docs/reference", "docs/notebooks", "docs/pictures"]
    {
        for entry in fs::read_dir(root.join(folder)).unwrap() {
            let name = entry.unwrap().file_name().into_string().unwrap();
            if name.ends_with(".md") {
                assert!(pages.contains(&format!("\"{folder}/{name}\"")), "{folder}/{name}");
                found += 1;
            }
        }
    }
    assert!(found > 50, "{found}");
}
