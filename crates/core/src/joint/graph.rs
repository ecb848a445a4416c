//! The law of one row: a maximal monotone graph of straight pieces, impulse against speed.
//!
//! Everything that acts along an axis falls, or stays, as the axis goes faster: a stop is a vertical
//! line, dry friction a jump, a spring a slope, a motor a slope between two bounds. Their sum is one
//! graph, and the row has one impulse, however many of them there are.
//!
//! ```text
//! (u, p) on the graph   ⟺   p = P(p − ρ u)                                 (J3)
//! ```
//!
//! for any ρ > 0, P(y) being the impulse of the graph's point with p − ρ u = y.

/// What acts along an axis, added up: each falls, or stays, with the speed u.
#[derive(Debug, Clone, Copy)]
pub(super) struct ForceSum {
    /// p = value − slope u.
    value: f64,
    slope: f64,
    /// (u, p): p to the left of u, −p to the right.
    jumps: [Option<(f64, f64)>; 2],
    /// (value, slope, most): value − slope u between −most and most.
    ramp: Option<(f64, f64, f64)>,
    /// Where it ends.
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

    /// Adds `most` to the left of `at` and −`most` to the right of it. There may be two.
    pub(super) fn add_jump(&mut self, at: f64, most: f64) {
        if let Some(free) = self.jumps.iter_mut().find(|jump| jump.is_none()) {
            *free = Some((at, most));
        }
    }

    /// Adds p = `at_zero` − `slope` u, between −`most` and `most`. There may be one.
    pub(super) fn add_ramp(&mut self, at_zero: f64, slope: f64, most: f64) {
        if slope > 0.0 {
            self.ramp = Some((at_zero, slope, most));
        } else {
            self.value += at_zero.clamp(-most, most);
        }
    }

    /// Ends it at two stops.
    pub(super) fn add_stops(&mut self, low: f64, high: f64) {
        self.stops = (low, high.max(low));
    }

    /// p just to the left or to the right of u.
    fn beside(&self, u: f64, right: bool) -> f64 {
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

    /// The graph.
    pub(super) fn graph(&self) -> Graph {
        let (low, high) = self.stops;
        let outer = (1.0, -self.slope);
        let is_line = self.jumps == [None; 2] && self.ramp.is_none();
        if is_line && low == f64::NEG_INFINITY && high == f64::INFINITY {
            return Graph::of_one_corner(self.value, outer.0, outer.1);
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

    /// (value, slope) of the line p = value − slope u that it follows around u, where it does not jump.
    fn line(&self, u: f64) -> (f64, f64) {
        let (mut value, mut slope) = (self.value, self.slope);
        for (at, most) in self.jumps.into_iter().flatten() {
            value += if u <= at { most } else { -most };
        }
        if let Some((at_zero, by, most)) = self.ramp {
            let pull = at_zero - by * u;
            if pull.abs() < most {
                value += at_zero;
                slope += by;
            } else {
                value += most.copysign(pull);
            }
        }
        (value, slope)
    }
}

/// Two stops, two jumps, and two ends of a ramp.
const MOST: usize = 8;
/// Along a stop.
const DOWN: (f64, f64) = (0.0, -1.0);

/// A falling graph of straight pieces.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Graph {
    /// The corners (u, p), u rising and p falling.
    corners: [(f64, f64); MOST],
    count: usize,
    /// The directions of what comes before the first corner and after the last one.
    first: (f64, f64),
    last: (f64, f64),
    /// Whether the impulse of a vertical piece, whose speed is known, is taken from the pull itself: along the piece it would
    /// be lost in the rounding of bounds that are far away, as those may be that a caller gives.
    by_pull: bool,
    /// (value, slope) of every piece p = value − slope u of a sum that is not vertical, if it has them: between corners that
    /// are far away, as stops are that the axis is not near, a point of it would be lost in their rounding.
    lines: [(f64, f64); MOST + 1],
    has_lines: bool,
}

/// A piece of a graph: a point of it, and the direction in which u rises or p falls.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Segment {
    pub(crate) u: f64,
    pub(crate) p: f64,
    pub(crate) du: f64,
    pub(crate) dp: f64,
}

impl Segment {
    /// No impulse, whatever the speed.
    pub(crate) const NONE: Self = Self { u: 0.0, p: 0.0, du: 1.0, dp: 0.0 };

    /// Whether no other speed is on it than its own.
    pub(crate) fn is_vertical(&self) -> bool {
        self.du == 0.0
    }

    /// The impulse where p − ρ u = `pull`.
    fn impulse(&self, pull: f64, rho: f64) -> f64 {
        if self.dp == 0.0 {
            return self.p;
        }
        let along = (pull - (self.p - rho * self.u)) / (self.dp - rho * self.du);
        self.p + along * self.dp
    }
}

impl Graph {
    /// Without a corner, which no graph is.
    const EMPTY: Self = Self {
        corners: [(0.0, 0.0); MOST],
        count: 0,
        first: DOWN,
        last: DOWN,
        by_pull: false,
        lines: [(0.0, 0.0); MOST + 1],
        has_lines: false,
    };

    /// u = 0, whatever the impulse.
    #[must_use]
    pub const fn locked() -> Self {
        Self::of_one_corner(0.0, 0.0, -1.0)
    }

    /// Whether it is that.
    pub(crate) fn is_locked(&self) -> bool {
        let [first, ..] = self.corners;
        self.count == 1 && first == (0.0, 0.0) && self.first == DOWN && self.last == DOWN
    }

    /// Whether it is one straight line.
    pub(crate) fn is_straight(&self) -> bool {
        self.count == 1 && self.first == self.last
    }

    /// p = 0, whatever the speed.
    #[must_use]
    pub const fn free() -> Self {
        Self::of_one_corner(0.0, 1.0, 0.0)
    }

    /// A straight line through (0, `value`) along (`du`, `dp`).
    const fn of_one_corner(value: f64, du: f64, dp: f64) -> Self {
        let direction = (du, dp);
        let mut line = Self { count: 1, first: direction, last: direction, ..Self::EMPTY };
        line.corners[0] = (0.0, value);
        line
    }

    /// 0 ≤ u ⊥ p ≥ 0: a stop at the left end.
    #[must_use]
    pub fn limit() -> Self {
        let mut sum = ForceSum::constant(0.0);
        sum.add_stops(0.0, f64::INFINITY);
        sum.graph()
    }

    /// u = 0 under impulses from `least` to `most`, which are those of u > 0 and of u < 0.
    #[must_use]
    pub fn between(least: f64, most: f64) -> Self {
        let level = (1.0, 0.0);
        let mut graph = Self { first: level, last: level, by_pull: true, ..Self::EMPTY };
        // From the bounds themselves: of a narrow one beside a wide one their middle keeps little.
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

    /// Which piece has the point with p − ρ u = `pull`: the number of corners before it.
    pub(crate) fn piece(&self, pull: f64, rho: f64) -> usize {
        let corners = &self.corners[..self.count];
        corners.iter().take_while(|(u, p)| p - rho * u > pull).count()
    }

    /// How far `pull` is from the next piece, over ρ.
    pub(crate) fn margin(&self, pull: f64, rho: f64) -> f64 {
        let corners = self.corners[..self.count].iter();
        corners.map(|(u, p)| (p - rho * u - pull).abs() / rho).fold(f64::INFINITY, f64::min)
    }

    /// A speed on a piece, or that of one that is vertical.
    fn inside(&self, piece: usize) -> f64 {
        let beyond = |u: f64, sign: f64| u + sign * (1.0 + u.abs());
        match piece {
            0 => beyond(self.corners[0].0, -1.0),
            last if last >= self.count => beyond(self.corners[self.count - 1].0, 1.0),
            _ => 0.5 * (self.corners[piece - 1].0 + self.corners[piece].0),
        }
    }

    /// A piece.
    pub(crate) fn segment(&self, piece: usize) -> Segment {
        let by_corners = self.by_corners(piece);
        if !self.has_lines || by_corners.is_vertical() {
            return by_corners;
        }
        let (value, slope) = self.lines[piece.min(self.count)];
        Segment { u: 0.0, p: value, du: 1.0, dp: -slope }
    }

    fn by_corners(&self, piece: usize) -> Segment {
        let of = |(u, p): (f64, f64), (du, dp): (f64, f64)| Segment { u, p, du, dp };
        if piece == 0 {
            return of(self.corners[0], self.first);
        }
        let from = self.corners[piece - 1];
        if piece >= self.count {
            return of(from, self.last);
        }
        let to = self.corners[piece];
        of(from, (to.0 - from.0, to.1 - from.1))
    }

    /// P(y) (J3) of the pull y.
    #[must_use]
    pub fn projected(&self, pull: f64, rho: f64) -> f64 {
        let segment = self.segment(self.piece(pull, rho));
        if self.by_pull && segment.is_vertical() {
            return pull + rho * segment.u;
        }
        segment.impulse(pull, rho)
    }

    /// |p − P(p − ρ u)|/ρ: how far (u, p) is from the graph, in the unit of u.
    #[must_use]
    pub fn residual(&self, u: f64, p: f64, rho: f64) -> f64 {
        (p - self.projected(p - rho * u, rho)).abs() / rho
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A stop at ±2, friction of 1 and a motor of ±3 with a slope of 2 towards u = 1.
    fn crowded() -> Graph {
        let mut sum = ForceSum::constant(0.0);
        sum.add_jump(0.0, 1.0);
        sum.add_ramp(2.0, 2.0, 3.0);
        sum.add_stops(-2.0, 2.0);
        sum.graph()
    }

    #[test]
    fn the_projection_is_a_point_of_the_graph() {
        // (u, p) by hand: on the left stop, free of the ramp's bound, in the jump, between, on the right stop.
        for (u, p) in [(-2.0, 9.0), (-1.0, 4.0), (0.0, 1.5), (0.5, 0.0), (1.0, -1.0), (2.0, -50.0)]
        {
            for rho in [0.1, 1.0, 30.0] {
                assert!(crowded().residual(u, p, rho) < 1e-12, "{u} {p} {rho}");
                // What is above and to the right of it is not on a falling graph.
                assert!(crowded().residual(u + 0.3, p + 0.3, rho) > 1e-3, "{u} {p} {rho}");
            }
        }
    }

    #[test]
    fn a_locked_row_takes_any_impulse_and_no_speed() {
        let locked = Graph::locked();
        assert_eq!(locked.residual(0.0, 7.0, 2.0), 0.0);
        assert_eq!(locked.residual(0.25, -3.0, 2.0), 0.25);
        assert!(locked.segment(0).is_vertical() && locked.segment(1).is_vertical());
    }

    #[test]
    fn stops_and_bounds_hold_on_their_side() {
        for (graph, u, p) in [
            (Graph::free(), 3.0, 0.0),
            (Graph::limit(), 0.0, 5.0),
            (Graph::limit(), 2.0, 0.0),
            (Graph::between(-1.0, 3.0), 0.0, 2.0),
            (Graph::between(-1.0, 3.0), -4.0, 3.0),
            (Graph::between(-1.0, 3.0), 4.0, -1.0),
        ] {
            assert_eq!(graph.residual(u, p, 1.0), 0.0, "{u} {p}");
        }
        assert_eq!(Graph::limit().residual(-0.5, 0.0, 1.0), 0.5);
        assert_eq!(Graph::limit().residual(1.0, -2.0, 1.0), 2.0);
    }

    /// A point near the middle of a stiff line between far stops keeps its digits.
    #[test]
    fn far_stops_take_no_digits() {
        let mut sum = ForceSum::constant(0.25);
        sum.add_line(0.0, 3e2);
        sum.add_stops(-7e5, 5e5);
        let graph = sum.graph();
        for u in [0.0, 1e-6, -3e-4, 0.1] {
            let p = 0.25 - 3e2 * u;
            assert!(graph.residual(u, p, 0.7) < 1e-14, "{u}");
        }
        assert!(graph.residual(-7e5, 3e8, 0.7) < 1e-6);
    }

    #[test]
    fn pulls_fall_from_piece_to_piece() {
        let graph = crowded();
        let pieces: Vec<_> =
            (0..200).map(|k| graph.piece(10.0 - 0.1 * f64::from(k), 1.0)).collect();
        assert!(pieces.is_sorted() && pieces[0] == 0 && pieces[199] == graph.count);
    }
}
