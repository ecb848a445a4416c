//! Unit tests of `poses.rs`.

use super::*;

#[test]
fn sampled_poses_are_evenly_spaced_and_include_the_last_frame() {
    for rows in [1, 2, 5, 6000, 6001, 100_000, 1_000_000] {
        let every = spacing(rows, MOST_FRAMES);
        let shown: Vec<_> = shown(rows, every).collect();
        assert!(shown.len() <= MOST_FRAMES, "{rows}");
        assert!(shown.len() > MOST_FRAMES / 3 || every == 1, "{rows}: {}", shown.len());
        assert_eq!((shown[0], shown[shown.len() - 1]), (0, rows - 1));
        assert!(shown.windows(2).rev().skip(1).all(|pair| pair[1] - pair[0] == every));
    }
    assert_eq!(spacing(6000, MOST_FRAMES), 1);
    assert_eq!(shown(0, 1).count(), 0);
}
