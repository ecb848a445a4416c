//! What changed from one frame to the next.

use gif::{DisposalMethod, Frame};
use std::borrow::Cow;

/// The smallest rectangle with all that differs between two pictures of `size` by `size`
/// palette indices; pixels in it that do not differ are `transparent`. One pixel where
/// nothing does: a frame has to have some.
pub fn difference(before: &[u8], now: &[u8], size: usize, transparent: u8) -> Frame<'static> {
    let differs = |y: usize| {
        let row = y * size..(y + 1) * size;
        before[row.clone()].iter().zip(&now[row]).map(|(a, b)| a != b)
    };
    let (mut left, mut right, mut top, mut bottom) = (size, 0, size, 0);
    for y in 0..size {
        let Some(first) = differs(y).position(|differs| differs) else { continue };
        let last = differs(y).rposition(|differs| differs).unwrap_or(first);
        (left, right) = (left.min(first), right.max(last + 1));
        (top, bottom) = (top.min(y), y + 1);
    }
    if right == 0 {
        (left, right, top, bottom) = (0, 1, 0, 1);
    }
    let mut buffer = Vec::with_capacity((right - left) * (bottom - top));
    for y in top..bottom {
        let row = y * size + left..y * size + right;
        let pixels = before[row.clone()].iter().zip(&now[row]);
        buffer.extend(pixels.map(|(a, b)| if a == b { transparent } else { *b }));
    }
    Frame {
        left: left as u16,
        top: top as u16,
        width: (right - left) as u16,
        height: (bottom - top) as u16,
        dispose: DisposalMethod::Keep,
        transparent: Some(transparent),
        buffer: Cow::Owned(buffer),
        ..Frame::default()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn only_the_rectangle_that_changed_is_kept() {
        let before = vec![5; 16];
        let mut now = before.clone();
        (now[4 + 1], now[8 + 3]) = (7, 8);
        let frame = difference(&before, &now, 4, 63);
        assert_eq!((frame.left, frame.top, frame.width, frame.height), (1, 1, 3, 2));
        let t = 63;
        assert_eq!(*frame.buffer, [7, t, t, t, t, 8]);
        let same = difference(&now, &now, 4, 63);
        assert_eq!((same.width, same.height, &*same.buffer), (1, 1, &[t][..]));
    }
}
