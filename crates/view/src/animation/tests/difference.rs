//! Unit tests of `difference.rs`.

use super::*;

#[test]
fn frames_contain_only_the_changed_rectangle() {
    let before = vec![5; 16];
    let mut now = before.clone();
    (now[4 + 1], now[8 + 3]) = (7, 8);
    let changed = Changed::between(&before, &now, 4);
    assert_eq!((&changed.columns, &changed.rows), (&(1..4), &(1..3)));
    let pixels: Vec<_> = changed.pixels(&before, &now).collect();
    assert_eq!(pixels, [Some(7), None, None, None, None, Some(8)]);
    let same = Changed::between(&now, &now, 4);
    assert_eq!((same.columns, same.rows), (0..1, 0..1));
    let first = Changed::between(&[], &now, 4);
    assert!(first.pixels(&[], &now).eq(now.iter().copied().map(Some)));
}
