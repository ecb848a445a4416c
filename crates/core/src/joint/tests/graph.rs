//! Unit tests of `graph.rs`.

use super::*;

/// Stops at ±2, friction of 1, and a motor of ±3 with slope 2 towards u = 1.
fn crowded() -> Graph {
    let mut sum = ForceSum::constant(0.0);
    sum.add_jump(0.0, 1.0);
    sum.add_ramp(2.0, 2.0, 3.0);
    sum.add_stops(-2.0, 2.0);
    sum.graph()
}

#[test]
fn the_projection_is_a_point_of_the_graph() {
    // Points (u, p): on the left stop, saturated ramp, in the jump, on the ramp, on the right
    // stop.
    for (u, p) in [(-2.0, 9.0), (-1.0, 4.0), (0.0, 1.5), (0.5, 0.0), (1.0, -1.0), (2.0, -50.0)] {
        for rho in [0.1, 1.0, 30.0] {
            assert!(crowded().residual(u, p, rho) < 1e-12, "{u} {p} {rho}");
            // A point above and to the right is not on a non-increasing graph.
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

/// A point near the middle of a stiff line between distant stops keeps its digits.
#[test]
fn distant_stops_lose_no_digits() {
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
fn graph_pieces_follow_each_other_in_order() {
    let graph = crowded();
    let pieces: Vec<_> = (0..200).map(|k| graph.piece(10.0 - 0.1 * f64::from(k), 1.0)).collect();
    assert!(pieces.is_sorted() && pieces[0] == 0 && pieces[199] == graph.count);
}
