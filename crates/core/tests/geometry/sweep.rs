//! The broad phase against all pairs, bounding boxes against the points of their pieces, and both
//! phases without allocation.

use crate::common::prelude::*;
use crate::pieces::*;
use allocation_counter::measure;
use tumble_core::geometry::{
    Aabb, Advance, Hint, Moving, PairScratch, PieceSide, Sweep, first_overlap, manifold, overlap,
    signed_distance, travel,
};
use tumble_core::mechanics::Trajectory;

fn boxes(draw: &mut WideDraw, count: usize, spread: V) -> Vec<Aabb> {
    let place = |draw: &mut WideDraw| {
        let low = v(draw.within(0.0, 1.0), draw.within(0.0, 1.0), draw.within(0.0, 1.0));
        let low = low.component_mul(&spread);
        Aabb { low, high: low + draw.half_sides() }
    };
    (0..count).map(|_| place(draw)).collect()
}

fn all_pairs(sweep: &mut Sweep, boxes: &[Aabb]) -> Vec<(usize, usize)> {
    let mut found = Vec::new();
    sweep.pairs(boxes, |i, j| found.push((i, j)));
    found
}

#[test]
fn the_sweep_finds_the_pairs_that_meet_in_order() {
    let mut draw = WideDraw::wide(1);
    let mut sweep = Sweep::new();
    let mut met = 0;
    for round in 0..100 {
        let spread = [v(5., 1., 1.), v(1., 8., 2.), v(3., 3., 3.)][round % 3];
        let mut boxes = boxes(&mut draw, round, spread);
        // A floor below all, equal boxes, and boxes that touch exactly.
        boxes.push(Aabb { low: v(-9., -9., -1.), high: v(9., 9., 0.2) });
        boxes.extend_from_within(..boxes.len() / 3);
        let first = boxes[0];
        let side = v(first.high.x - first.low.x, 0.0, 0.0);
        boxes.push(Aabb { low: first.low + side, high: first.high + side });
        let mut expected = Vec::new();
        for i in 0..boxes.len() {
            for j in i + 1..boxes.len() {
                let apart = (0..3).any(|k| {
                    boxes[i].high[k] < boxes[j].low[k] || boxes[j].high[k] < boxes[i].low[k]
                });
                if !apart {
                    expected.push((i, j));
                }
            }
        }
        met += expected.len();
        sweep.set_fixed(&[]);
        assert_eq!(all_pairs(&mut sweep, &boxes), expected);
        // The same with the last boxes fixed. Pairs of two fixed boxes are not reported.
        for moving in [0, boxes.len() / 3, boxes.len() - 1] {
            sweep.set_fixed(&boxes[moving..]);
            let expected: Vec<_> = expected.iter().copied().filter(|(i, _)| *i < moving).collect();
            assert_eq!(all_pairs(&mut sweep, &boxes[..moving]), expected);
        }
    }
    assert!(met > 1000, "{met}");
    sweep.set_fixed(&[]);
    assert!(all_pairs(&mut sweep, &[]).is_empty());
}

#[test]
fn boxes_hold_their_pieces_at_both_ends() {
    let mut draw = WideDraw::wide(2);
    for _ in 0..200 {
        let piece = draw.piece();
        let (from, to) = (draw.pose(2.0), draw.pose(2.0));
        let swept = Aabb::swept(&piece, &from, &to);
        let mut slack = [f64::INFINITY; 6];
        for pose in [&from, &to] {
            for axis in 0..3 {
                let e = V::ith(axis, 1.0);
                let high = support(&piece, pose, &e).1;
                let low = -support(&piece, pose, &-e).1;
                slack[axis] = slack[axis].min(swept.high[axis] - high);
                slack[axis + 3] = slack[axis + 3].min(low - swept.low[axis]);
            }
        }
        assert!(slack.iter().all(|slack| slack.abs() < 1e-12), "{slack:?}");
        let grown = swept.grown(0.5);
        assert_eq!(grown.high, swept.high + V::repeat(0.5));
    }
}

#[test]
fn warm_memory_is_enough() {
    let mut draw = WideDraw::wide(3);
    let pieces: Vec<Piece> = (0..20).map(|_| draw.piece()).collect();
    let poses: Vec<_> = (0..20).map(|_| draw.pose(0.4)).collect();
    let (mut sweep, mut scratch) = (Sweep::new(), PairScratch::default());
    let (mut boxes, mut out, mut pairs) = (Vec::new(), Vec::new(), 0);
    let mut hint = Hint::default();
    let mut round = || {
        boxes.clear();
        boxes.extend(pieces.iter().zip(&poses).map(|(piece, pose)| Aabb::from_piece(piece, pose)));
        pairs = 0;
        sweep.pairs(&boxes, |i, j| {
            let (a, b) = ((&pieces[i], &poses[i]), (&pieces[j], &poses[j]));
            manifold(a, b, 1e-2, PieceSide::B, &mut hint, &mut scratch, &mut out);
            signed_distance(a, b, &mut hint, &mut scratch);
            overlap(a, b, &mut hint, &mut scratch);
            pairs += 1;
        });
    };
    assert!(measure(&mut round).count_total > 0);
    assert_eq!(measure(&mut round).count_total, 0);
    assert!(pairs > 50, "{pairs}");
}

/// Checks that hints of earlier queries do not change the results.
#[test]
fn hints_do_not_change_results() {
    let mut draw = WideDraw::wide(4);
    let mut scratch = PairScratch::default();
    for _ in 0..100 {
        let (a, b) = (draw.piece(), draw.piece());
        let mut hint = Hint::default();
        let start = draw.pose(0.5);
        for _ in 0..20 {
            let mut pose = draw.pose(0.1);
            pose.position += start.position;
            pose.rotation *= start.rotation;
            let (a, b) = ((&a, &at(0., 0., 0.)), (&b, &pose));
            let mut out = Vec::new();
            manifold(a, b, 1e-2, PieceSide::B, &mut hint, &mut scratch, &mut out);
            let (_, fresh) = touches(a, b, 1e-2);
            assert_eq!(out, fresh);
            assert_eq!(signed_distance(a, b, &mut hint, &mut scratch), separate(a, b));
            let depth = overlap(a, b, &mut hint, &mut scratch);
            assert_eq!(depth, (-separate(a, b).distance).max(0.0));
        }
    }
}

/// Checks the first overlap on a path. No earlier position overlaps by more than the requested
/// depth, and the found one overlaps by at least half of it. If none is found, none overlaps. The
/// tolerance is an eighth, for a change of the axis (checked at 1000 positions per path).
#[test]
fn the_first_overlap_is_the_first() {
    let mut draw = WideDraw::wide(5);
    let mut scratch = PairScratch::default();
    let (mut met, mut clear) = (0, 0);
    for _ in 0..400 {
        let pieces = [draw.piece(), draw.piece()];
        let depth = 1e-3;
        let ends = pieces.each_ref().map(|_| {
            let mut state = |size: f64, place: V| State {
                position: place + draw.vector(size),
                attitude: Vector4::from_fn(|_, _| draw.within(-1.0, 1.0)).normalize(),
                velocity: V::zeros(),
                spin: V::zeros(),
            };
            let from = state(1.5, V::zeros());
            let mut to = state(1.5, V::zeros());
            to.attitude = (from.attitude + 0.3 * to.attitude).normalize();
            [from, to]
        });
        let poses = ends.map(|ends| ends.map(|state| state.pose()));
        let ways = ends.map(|[from, to]| Trajectory::between(&from, &to));
        let moving: [Moving<'_>; 2] = std::array::from_fn(|i| Moving {
            piece: &pieces[i],
            trajectory: &ways[i],
            ends: (&poses[i][0], &poses[i][1]),
            arm: pieces[i].core().vertices().iter().map(V::norm).fold(0.0, f64::max),
        });
        let gap = |share: f64| {
            let [a, b] = ways.map(|way| way.at(share));
            separate((&pieces[0], &a), (&pieces[1], &b)).distance
        };
        if gap(0.0) < 0.0 {
            continue;
        }
        let hint = &mut Hint::default();
        let end = match first_overlap(&moving[0], &moving[1], depth, hint, &mut scratch) {
            Advance::Clear => 1.0,
            Advance::Met(share) => share,
            Advance::GaveUp(share) => panic!("gave up at {share}"),
        };
        let places = (0..=1000).map(|i| end * f64::from(i) / 1000.0);
        let deepest = places.map(gap).fold(f64::INFINITY, f64::min);
        assert!(deepest >= -1.125 * depth, "{deepest:e}");
        if end < 1.0 {
            met += 1;
            assert!(gap(end) <= -0.5 * depth);
        } else {
            clear += 1;
        }
        let travel = travel(&moving[0], &moving[1]);
        assert!((gap(0.0) - gap(1.0)).abs() <= travel + 1e-12);
    }
    assert!(met > 50 && clear > 50, "{met} {clear}");
}
