//! Known optimum, computed with this crate only.

mod common;

use common::{HS071, assert_optimal, silent, solve};

#[test]
fn hs071_reaches_its_known_optimum() {
    let mut lock = ipopt_sys::lock().unwrap();
    assert_optimal(&solve(&mut silent(&mut lock, &HS071)));
    assert!(ipopt_sys::VERSION.starts_with("3."), "{}", ipopt_sys::VERSION);
}
