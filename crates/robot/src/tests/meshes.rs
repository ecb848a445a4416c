//! Unit tests of `meshes.rs`.

use super::*;

#[test]
fn triangles_are_shared_in_proportion_and_small_meshes_keep_theirs() {
    assert_eq!(shares(&[20_000; 10], 20_000), [2000; 10]);
    assert_eq!(shares(&[12, 100_000], 20_000), [12, 19_988]);
    let three = shares(&[20_000, 40_000, 100], 10_000);
    assert!(three[1] > 3 * three[0] / 2 && three[0] > 1666, "{three:?}");
    assert_eq!(three[2], 100);
    assert!(three.iter().sum::<usize>() <= 10_000, "{three:?}");
    assert_eq!(shares(&[5; 4], 3), [1; 4]);
}
