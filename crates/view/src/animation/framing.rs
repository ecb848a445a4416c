//! Window of each frame on the view: the whole view, or the moving bodies, fixed or tracking.
//!
//! The camera has everything in view. Small motion is shown through a smaller window. Its size is
//! the same for all frames, so that sizes are comparable.

/// Half width of the picture over its distance, a field of view of 28°.
pub const HALF_VIEW: f64 = 0.249;

/// Usable fraction of the half picture: at the sides and below, and above, where the time is shown.
pub const FILL: f64 = 0.94;
pub const FILL_ABOVE: f64 = 0.84;

/// Square part of the view, in slopes: lengths across the view over distance along it.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Window {
    /// Centre, to the right and up.
    pub middle: [f64; 2],
    pub half: f64,
}

/// Bounding rectangle in the view, in slopes.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ViewExtent {
    low: [f64; 2],
    high: [f64; 2],
}

/// Minimum magnification that justifies a smaller window.
const NEARER: f64 = 1.6;

/// Half window over the size of the largest body in it, which keeps the surroundings visible.
const CONTEXT: f64 = 5.0;

/// Half width of the smoothing kernel in frames (half a second). Its weights are triangular.
const SMOOTH: usize = 15;

impl Window {
    /// The whole view.
    pub const WHOLE: Self = Self { middle: [0.0; 2], half: HALF_VIEW };

    /// Window around `extent` with half side at least `least`.
    fn about(extent: &ViewExtent, least: f64) -> Self {
        let size = |k: usize| extent.high[k] - extent.low[k];
        let half = (size(0) / (2.0 * FILL)).max(size(1) / (FILL + FILL_ABOVE)).max(least);
        let [x, y] = extent.middle();
        Self { middle: [x, y + (FILL - FILL_ABOVE) / 2.0 * half], half }
    }

    /// Half side of the window with the same centre that contains `extent`.
    fn needed(&self, extent: &ViewExtent) -> f64 {
        let to = |k: usize| [extent.high[k] - self.middle[k], self.middle[k] - extent.low[k]];
        let ([right, left], [up, down]) = (to(0), to(1));
        (right.max(left).max(down) / FILL).max(up / FILL_ABOVE)
    }
}

impl ViewExtent {
    /// Empty extent.
    pub const NONE: Self = Self { low: [f64::INFINITY; 2], high: [f64::NEG_INFINITY; 2] };

    /// Extent that also contains `point`.
    pub fn with(self, point: [f64; 2]) -> Self {
        self.and(&Self { low: point, high: point })
    }

    /// Union of both.
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

/// Window of each frame, or one window for all.
///
/// `moving` is the extent of the moving bodies in each frame, and `reach` the size of the largest
/// in slopes. `followed` holds their mean position and its smoothed value in each frame. A fixed
/// window is preferred unless another magnifies motion much more. Tracking needs a ground as
/// reference.
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
    // The comparison selects the fixed window for NaN.
    if has_ground && following[0].half * NEARER <= still.half { following } else { vec![still] }
}

/// Windows that track the smoothed positions `followed`.
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

/// Smooths positions over frames. Uniform straight motion is unchanged.
pub fn smooth<const N: usize>(places: &[[f64; N]]) -> Vec<[f64; N]> {
    let half = SMOOTH as isize;
    let weight = |off: isize| (half + 1 - off.abs()) as f64;
    let all: f64 = (-half..=half).map(weight).sum();
    let mean = |k: isize, axis: usize| {
        (-half..=half).map(|off| weight(off) * place(places, k + off, axis)).sum::<f64>() / all
    };
    (0..places.len()).map(|k| std::array::from_fn(|axis| mean(k as isize, axis))).collect()
}

/// Position at index `at`. Beyond the ends it is extrapolated by point reflection.
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
#[path = "tests/framing.rs"]
mod tests;
