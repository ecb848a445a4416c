//! Unit tests of `groups.rs`.

use super::*;

#[test]
fn edit_distance_counts_letters() {
    for (from, to, count) in
        [("", "abc", 3), ("kitten", "sitting", 3), ("debri", "debris", 1), ("a", "a", 0)]
    {
        assert_eq!((edits(from, to), edits(to, from)), (count, count), "{from} {to}");
    }
    let known = ["default", "ground", "debris"];
    assert_eq!(nearest("debri", known.into_iter()), Some("debris"));
    assert_eq!(nearest("Ground", known.into_iter()), Some("ground"));
    assert_eq!(nearest("hand", known.into_iter()), None);
}
