//! Force law of one row: a maximal monotone, piecewise linear graph of impulse against speed.
//!
//! Every force along an axis is a non-increasing function of the speed. A stop is a vertical line,
//! dry friction a jump, a spring a slope, and a motor a slope between two bounds. Their sum is
//! again such a graph, so that each row has a single impulse.
//!
//! ```text
//! (u, p) on the graph   ⟺   p = P(p − ρ u)                                 (J3)
//! ```
//!
//! for any ρ > 0, where P(y) is the impulse of the graph's point with p − ρ u = y.

/// Sum of the forces along an axis. Each is a non-increasing function of the speed u.
#[derive(Debug, Clone, Copy)]
pub(super) struct ForceSum {
    /// Linear part, p = value − slope u.
    value: f64,
    slope: f64,
    /// Jumps as (u, p): the impulse is p below u and −p above.
    jumps: [Option<(f64, f64)>; 2],
    /// Saturated line as (value, slope, most): value − slope u, clamped to ±most.
    ramp: Option<(f64, f64, f64)>,
    /// Speeds of the two stops.
    stops: (f64, f64),
}

impl ForceSum {
    pub(super) fn constant(value: f64) -> Self {
        let stops = (f64::NEG_INFINITY, f64::INFINITY);
        Self { value, slope: 0.0, jumps: [None; 2], ramp: None, stops }
    }

    /// Adds p = `at_zero` − `slope` u.
    pub(super) fn add_line(&mut self, at_zero: f64, slope: f64) {
        self.value += at_zero;
        self.slope += slope;
    }

    /// Adds `most` below the speed `at` and −`most` above. Two jumps fit.
    pub(super) fn add_jump(&mut self, at: f64, most: f64) {
        if let Some(free) = self.jumps.iter_mut().find(|jump| jump.is_none()) {
            *free = Some((at, most));
        }
    }

    /// Adds p = `at_zero` − `slope` u, clamped to ±`most`. One ramp fits.
    pub(super) fn add_ramp(&mut self, at_zero: f64, slope: f64, most: f64) {
        if slope > 0.0 {
            self.ramp = Some((at_zero, slope, most));
        } else {
            self.value += at_zero.clamp(-most, most);
        }
    }

    /// Sets the stops.
    pub(super) fn add_stops(&mut self, low: f64, high: f64) {
        self.stops = (low, high.max(low));
    }

    /// Limit of p at u from the right or from the left.
    pub(super) fn beside(&self, u: f64, right: bool) -> f64 {
        let mut p = self.value - self.slope * u;
        for (at, most) in self.jumps.into_iter().flatten() {
            let is_left = if right { u < at } else { u <= at };
            p += if is_left { most } else { -most };
        }
        if let Some((at_zero, slope, most)) = self.ramp {
            p += (at_zero - slope * u).clamp(-most, most);
        }
        p
    }

    /// Builds the graph.
    pub(super) fn graph(&self) -> Graph {
        let (low, high) = self.stops;
        let outer = (1.0, -self.slope);
        let is_line = self.jumps == [None; 2] && self.ramp.is_none();
        if is_line && low == f64::NEG_INFINITY && high == f64::INFINITY {
            return Graph::with_one_corner(self.value, outer.0, outer.1);
        }
        let ends = self
            .ramp
            .map(|(at_zero, slope, most)| [(at_zero - most) / slope, (at_zero + most) / slope]);
        let jumps = self.jumps.into_iter().flatten().map(|(at, _)| at);
        let mut breaks = [f64::INFINITY; 4];
        let inside = jumps.chain(ends.into_iter().flatten()).filter(|u| *u > low && *u < high);
        breaks.iter_mut().zip(inside).for_each(|(at, u)| *at = u);
        breaks.sort_unstable_by(f64::total_cmp);
        let mut graph = Graph { first: outer, last: outer, ..Graph::EMPTY };
        if low.is_finite() {
            graph.first = DOWN;
            graph.add(low, self.beside(low, low < high));
        }
        for u in breaks.into_iter().filter(|u| u.is_finite()) {
            graph.add(u, self.beside(u, false));
            graph.add(u, self.beside(u, true));
        }
        if high.is_finite() {
            graph.last = DOWN;
            graph.add(high, self.beside(high, false));
        }
        if graph.count == 0 {
            graph.add(0.0, self.beside(0.0, true));
        }
        for piece in 0..=graph.count {
            graph.lines[piece] = self.line(graph.inside(piece));
        }
        Graph { has_lines: true, ..graph }
    }

    /// Linear function p = value − slope u around u, outside of jumps, as (value, slope).
    fn line(&self, u: f64) -> (f64, f64) {
        let (mut value, mut slope) = (self.value, self.slope);
        for (at, most) in self.jumps.into_iter().flatten() {
            value += if u <= at { most } else { -most };
        }
        if let Some((at_zero, by, most)) = self.ramp {
            let projection = at_zero - by * u;
            if projection.abs() < most {
                value += at_zero;
                slope += by;
            } else {
                value += most.copysign(projection);
            }
        }
        (value, slope)
    }
}

/// Largest number of corners: two stops, two jumps of two corners each, and two ends of a ramp.
const MOST: usize = 8;
/// Direction along a stop.
const DOWN: (f64, f64) = (0.0, -1.0);

/// Non-increasing piecewise linear graph.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Graph {
    /// Corners (u, p) with increasing u and decreasing p.
    corners: [(f64, f64); MOST],
    count: usize,
    /// Directions before the first corner and after the last one.
    first: (f64, f64),
    last: (f64, f64),
    /// True if the impulse on a vertical piece is computed from the projection argument.
    /// Interpolation between distant bounds given by a caller would lose it to rounding.
    by_pull: bool,
    /// Linear function p = value − slope u of every piece that is not vertical, as (value, slope).
    /// Interpolation between distant corners, such as stops, would lose digits.
    lines: [(f64, f64); MOST + 1],
    has_lines: bool,
}

/// Piece of a graph: a point, and the direction of increasing u or decreasing p.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Segment {
    pub(crate) u: f64,
    pub(crate) p: f64,
    pub(crate) du: f64,
    pub(crate) dp: f64,
}

impl Segment {
    /// Zero impulse at any speed.
    pub(crate) const NONE: Self = Self { u: 0.0, p: 0.0, du: 1.0, dp: 0.0 };

    /// True if the speed is fixed.
    pub(crate) fn is_vertical(&self) -> bool {
        self.du == 0.0
    }

    /// Impulse with p − ρ u = `projection`.
    fn impulse(&self, projection: f64, rho: f64) -> f64 {
        if self.dp == 0.0 {
            return self.p;
        }
        let along = (projection - (self.p - rho * self.u)) / (self.dp - rho * self.du);
        self.p + along * self.dp
    }
}

impl Graph {
    /// Graph without corners, an invalid placeholder.
    const EMPTY: Self = Self {
        corners: [(0.0, 0.0); MOST],
        count: 0,
        first: DOWN,
        last: DOWN,
        by_pull: false,
        lines: [(0.0, 0.0); MOST + 1],
        has_lines: false,
    };

    /// Locked row: u = 0 at any impulse.
    pub const fn locked() -> Self {
        Self::with_one_corner(0.0, 0.0, -1.0)
    }

    /// True if this is the graph of a locked row.
    pub(crate) fn is_locked(&self) -> bool {
        let [first, ..] = self.corners;
        self.count == 1 && first == (0.0, 0.0) && self.first == DOWN && self.last == DOWN
    }

    /// Largest and smallest impulse of a row at rest; `None` unless it is held in a range.
    pub(crate) fn jump_at_zero(&self) -> Option<[f64; 2]> {
        let corners = self.corners[..self.count].windows(2);
        let jump = corners.map(|two| [two[0], two[1]]).find(|[a, b]| a.0 == 0.0 && b.0 == 0.0);
        jump.map(|[a, b]| [a.1, b.1]).filter(|[high, low]| high > low)
    }

    /// True if the graph is one straight line.
    pub(crate) fn is_straight(&self) -> bool {
        self.count == 1 && self.first == self.last
    }

    /// Free row: p = 0 at any speed.
    pub const fn free() -> Self {
        Self::with_one_corner(0.0, 1.0, 0.0)
    }

    /// Straight line through (0, `value`) along (`du`, `dp`).
    const fn with_one_corner(value: f64, du: f64, dp: f64) -> Self {
        let direction = (du, dp);
        let mut line = Self { count: 1, first: direction, last: direction, ..Self::EMPTY };
        line.corners[0] = (0.0, value);
        line
    }

    /// Unilateral stop at the left end: 0 ≤ u ⊥ p ≥ 0.
    pub fn limit() -> Self {
        let mut sum = ForceSum::constant(0.0);
        sum.add_stops(0.0, f64::INFINITY);
        sum.graph()
    }

    /// Dry friction: u = 0 for impulses from `least` to `most`, `least` for u > 0 and `most` for u
    /// < 0.
    pub fn between(least: f64, most: f64) -> Self {
        let level = (1.0, 0.0);
        let mut graph = Self { first: level, last: level, by_pull: true, ..Self::EMPTY };
        // Stores the bounds themselves; a midpoint would lose digits of a narrow range.
        graph.add(0.0, most);
        graph.add(0.0, least);
        graph
    }

    fn add(&mut self, u: f64, p: f64) {
        let is_new = self.count == 0 || self.corners[self.count - 1] != (u, p);
        if is_new && self.count < MOST {
            self.corners[self.count] = (u, p);
            self.count += 1;
        }
    }

    /// Index of the piece with p − ρ u = `projection`: the number of corners before it.
    pub(crate) fn piece(&self, projection: f64, rho: f64) -> usize {
        let corners = &self.corners[..self.count];
        corners.iter().take_while(|(u, p)| p - rho * u > projection).count()
    }

    /// Distance of `projection` from the nearest corner, divided by ρ.
    pub(crate) fn margin(&self, projection: f64, rho: f64) -> f64 {
        let corners = self.corners[..self.count].iter();
        corners.map(|(u, p)| (p - rho * u - projection).abs() / rho).fold(f64::INFINITY, f64::min)
    }

    /// A speed inside a piece; for a vertical piece, its speed.
    fn inside(&self, piece: usize) -> f64 {
        let beyond = |u: f64, sign: f64| u + sign * (1.0 + u.abs());
        match piece {
            0 => beyond(self.corners[0].0, -1.0),
            last if last >= self.count => beyond(self.corners[self.count - 1].0, 1.0),
            _ => 0.5 * (self.corners[piece - 1].0 + self.corners[piece].0),
        }
    }

    /// Geometry of a piece.
    pub(crate) fn segment(&self, piece: usize) -> Segment {
        let by_corners = self.by_corners(piece);
        if !self.has_lines || by_corners.is_vertical() {
            return by_corners;
        }
        let (value, slope) = self.lines[piece.min(self.count)];
        Segment { u: 0.0, p: value, du: 1.0, dp: -slope }
    }

    fn by_corners(&self, piece: usize) -> Segment {
        let segment = |(u, p): (f64, f64), (du, dp): (f64, f64)| Segment { u, p, du, dp };
        if piece == 0 {
            return segment(self.corners[0], self.first);
        }
        let from = self.corners[piece - 1];
        if piece >= self.count {
            return segment(from, self.last);
        }
        let to = self.corners[piece];
        segment(from, (to.0 - from.0, to.1 - from.1))
    }

    /// Projection P(y) (J3) of the argument y = `projection`.
    pub fn projected(&self, projection: f64, rho: f64) -> f64 {
        let segment = self.segment(self.piece(projection, rho));
        if self.by_pull && segment.is_vertical() {
            return projection + rho * segment.u;
        }
        segment.impulse(projection, rho)
    }

    /// Natural residual (p − P(p − ρ u))/ρ of (u, p), in units of u. On the piece through (u₀, p₀) along
    /// (u′, p′) it is
    ///
    /// ```text
    /// (p′ (u − u₀) − u′ (p − p₀))/(p′ − ρ u′),                                (J3a)
    /// ```
    ///
    /// which does not divide rounding errors of impulses by a small ρ.
    pub(crate) fn missed(&self, u: f64, p: f64, rho: f64) -> f64 {
        let on = self.segment(self.piece(p - rho * u, rho));
        (on.dp * (u - on.u) - on.du * (p - on.p)) / (on.dp - rho * on.du)
    }

    /// Size of the natural residual of (u, p), in units of u.
    pub fn residual(&self, u: f64, p: f64, rho: f64) -> f64 {
        self.missed(u, p, rho).abs()
    }
}

#[cfg(test)]
#[path = "tests/graph.rs"]
mod tests;
