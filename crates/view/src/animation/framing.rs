//! Which part of the view each frame shows: all of it, or what moves, from one place or followed.
//!
//! The camera stands where it has everything in view. What is small there is shown through a
//! smaller window, of one size for all frames, so that sizes can be compared.

/// Half the width of the picture over its distance: an angle of view of 28°.
pub const HALF_VIEW: f64 = 0.249;

/// What of the half picture the motion may fill: at the sides and below, and above, where
/// the clock stands.
pub const FILL: f64 = 0.94;
pub const FILL_ABOVE: f64 = 0.84;

/// A square part of the view, in slopes: lengths across the view over those along it.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Window {
    /// To the right and up.
    pub middle: [f64; 2],
    pub half: f64,
}

/// The rectangle of the view that something takes, in slopes.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ViewExtent {
    low: [f64; 2],
    high: [f64; 2],
}

/// A nearer window has to show things larger by this.
const NEARER: f64 = 1.6;

/// Half a window over the reach of the largest body in it: what is about it is seen as well.
const CONTEXT: f64 = 5.0;

/// A window that follows has the mean place of so many frames before and after, the nearest with
/// the largest weights: half a second.
const SMOOTH: usize = 15;

impl Window {
    /// The whole view.
    pub const WHOLE: Self = Self { middle: [0.0; 2], half: HALF_VIEW };

    /// That about `extent`, with half a side of at least `least`.
    fn about(extent: &ViewExtent, least: f64) -> Self {
        let size = |k: usize| extent.high[k] - extent.low[k];
        let half = (size(0) / (2.0 * FILL)).max(size(1) / (FILL + FILL_ABOVE)).max(least);
        let [x, y] = extent.middle();
        Self { middle: [x, y + (FILL - FILL_ABOVE) / 2.0 * half], half }
    }

    /// Half a side of the window about this one's middle that has `extent` in it.
    fn needed(&self, extent: &ViewExtent) -> f64 {
        let to = |k: usize| [extent.high[k] - self.middle[k], self.middle[k] - extent.low[k]];
        let ([right, left], [up, down]) = (to(0), to(1));
        (right.max(left).max(down) / FILL).max(up / FILL_ABOVE)
    }
}

impl ViewExtent {
    /// Of nothing.
    pub const NONE: Self = Self { low: [f64::INFINITY; 2], high: [f64::NEG_INFINITY; 2] };

    /// With another point.
    pub fn with(self, point: [f64; 2]) -> Self {
        self.and(&Self { low: point, high: point })
    }

    /// Of both.
    fn and(self, other: &Self) -> Self {
        Self {
            low: std::array::from_fn(|k| self.low[k].min(other.low[k])),
            high: std::array::from_fn(|k| self.high[k].max(other.high[k])),
        }
    }

    fn middle(&self) -> [f64; 2] {
        std::array::from_fn(|k| 0.5 * (self.low[k] + self.high[k]))
    }
}

/// The window of each frame, or one for all: `moving` has what moves in each frame, of whose
/// bodies the largest reaches `reach` (slopes), and `followed` the place in the view that goes with it, and how that goes
/// without jerks. The stillest one is taken unless another shows what
/// moves much larger; one that follows needs something that stands still to be seen against.
pub fn windows(
    moving: &[ViewExtent],
    reach: f64,
    followed: &[[[f64; 2]; 2]],
    has_ground: bool,
) -> Vec<Window> {
    let least = CONTEXT * reach;
    let all = moving.iter().fold(ViewExtent::NONE, |all, one| all.and(one));
    let mut still = Window::about(&all, least);
    if still.half * NEARER > Window::WHOLE.half {
        still = Window::WHOLE;
    }
    let following = following(moving, least, followed);
    // In this order what is no number stays still.
    if has_ground && following[0].half * NEARER <= still.half { following } else { vec![still] }
}

/// Windows that go where `followed` goes without jerks, and with what is about it.
fn following(moving: &[ViewExtent], least: f64, followed: &[[[f64; 2]; 2]]) -> Vec<Window> {
    let off = |(one, [place, _]): (&ViewExtent, &[[f64; 2]; 2])| {
        let middle = Window::about(one, least).middle;
        std::array::from_fn::<_, 2, _>(|axis| middle[axis] - place[axis])
    };
    let offs = smooth(&moving.iter().zip(followed).map(off).collect::<Vec<_>>());
    let window = |([_, place], off): (&[[f64; 2]; 2], &[f64; 2])| Window {
        middle: std::array::from_fn(|axis| place[axis] + off[axis]),
        half: least,
    };
    let mut windows: Vec<_> = followed.iter().zip(&offs).map(window).collect();
    let needed = windows.iter().zip(moving).map(|(window, one)| window.needed(one));
    let half = needed.fold(least, f64::max);
    windows.iter_mut().for_each(|window| window.half = half);
    windows
}

/// Places frame by frame, without jerks: what goes straight on stays as it is.
pub fn smooth<const N: usize>(places: &[[f64; N]]) -> Vec<[f64; N]> {
    let half = SMOOTH as isize;
    let weight = |off: isize| (half + 1 - off.abs()) as f64;
    let all: f64 = (-half..=half).map(weight).sum();
    let mean = |k: isize, axis: usize| {
        (-half..=half).map(|off| weight(off) * place(places, k + off, axis)).sum::<f64>() / all
    };
    (0..places.len()).map(|k| std::array::from_fn(|axis| mean(k as isize, axis))).collect()
}

/// A place, also beyond the ends: as far there from the end as within, on its other side.
fn place<const N: usize>(places: &[[f64; N]], at: isize, axis: usize) -> f64 {
    let last = places.len() as isize - 1;
    match at {
        _ if last <= 0 => places[0][axis],
        ..0 => 2.0 * places[0][axis] - place(places, -at, axis),
        _ if at > last => 2.0 * places[last as usize][axis] - place(places, 2 * last - at, axis),
        _ => places[at as usize][axis],
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Squares of the size 2 `half` about places.
    fn squares(places: &[[f64; 2]], half: f64) -> Vec<ViewExtent> {
        let square = |place: &[f64; 2]| {
            let corner = |sign: f64| place.map(|x| x + sign * half);
            ViewExtent::NONE.with(corner(-1.0)).with(corner(1.0))
        };
        places.iter().map(square).collect()
    }

    /// The windows of squares about places, each followed itself.
    fn windows_of(places: &[[f64; 2]], half: f64, has_ground: bool) -> Vec<Window> {
        let gone = smooth(places);
        let followed: Vec<_> = places.iter().zip(&gone).map(|(at, to)| [*at, *to]).collect();
        windows(&squares(places, half), half, &followed, has_ground)
    }

    #[test]
    fn what_goes_straight_on_is_in_the_middle_from_beginning_to_end() {
        for frames in [1, 2, 9, 40] {
            let places: Vec<_> = (0..frames).map(|k| [0.3 * f64::from(k) - 1.0, 0.2]).collect();
            for (at, to) in places.iter().zip(smooth(&places)) {
                assert!((0..2).all(|k| (at[k] - to[k]).abs() < 1e-12), "{frames}: {at:?} {to:?}");
            }
        }
    }

    #[test]
    fn a_long_way_is_followed_without_jerks_and_nothing_leaves_the_picture() {
        // Along a line, then at once along another, as after an impact.
        let place = |k: usize| [0.002 * k as f64 - 0.2, 0.003 * (k as f64 - 100.0).abs() - 0.1];
        let places: Vec<_> = (0..200).map(place).collect();
        let (moving, windows) = (squares(&places, 0.004), windows_of(&places, 0.004, true));
        assert_eq!(windows.len(), 200);
        assert!(windows.iter().all(|window| window.half == windows[0].half));
        for (window, one) in windows.iter().zip(&moving) {
            assert!(window.needed(one) <= window.half * (1.0 + 1e-12));
        }
        // A fifth of the picture, from beginning to end.
        assert!(0.004 / windows[0].half > 0.1, "{}", windows[0].half);
        for three in windows.windows(3) {
            for k in 0..2 {
                let speed = |a: usize| three[a + 1].middle[k] - three[a].middle[k];
                assert!((speed(1) - speed(0)).abs() < 0.006 / SMOOTH as f64);
            }
        }
    }

    #[test]
    fn what_stays_in_a_corner_is_shown_through_a_smaller_window_that_stands_still() {
        let places: Vec<_> = (0..60).map(|k| [0.1 + 0.0005 * f64::from(k), -0.1]).collect();
        let (moving, near) = (squares(&places, 0.01), windows_of(&places, 0.01, true));
        assert_eq!(near.len(), 1);
        assert!(near[0].half < HALF_VIEW / 3.0 && near[0].needed(&moving[59]) <= near[0].half);
    }

    #[test]
    fn without_need_or_without_ground_the_camera_stands_still() {
        let places: Vec<_> = (0..60).map(|k| [0.007 * f64::from(k) - 0.2, 0.0]).collect();
        assert_eq!(windows_of(&places, 0.06, true), [Window::WHOLE]);
        assert_eq!(windows_of(&places, 0.005, false), [Window::WHOLE]);
    }
}
