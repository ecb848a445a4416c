//! Unit tests of `layout.rs`.

use super::*;

#[test]
fn the_cube_has_61_variables_and_62_rows() {
    let layout = Layout::new(8);
    assert_eq!((layout.variables(), layout.constraints()), (61, 62));
    assert_eq!(layout.slip_speed(), 53..61);
    assert_eq!(layout.dissipation_rows(), 14..30);
    assert_eq!(layout.friction_complementarity_rows(), 54..62);
    assert_eq!(layout.equalities(), 30);
    assert_eq!(layout.contact_variables(7), [20, 28, 36, 44, 52, 60]);
    assert_eq!(layout.contact_rows(7), [28, 29, 37, 45, 53, 61]);
}
