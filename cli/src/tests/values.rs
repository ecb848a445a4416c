//! Unit tests of `values.rs`.

use super::*;
use nalgebra::Matrix3;

#[test]
fn matrices_come_from_one_three_or_nine_numbers() {
    let matrix = |text: &str| inertia(text).unwrap().matrix().unwrap();
    assert_eq!(matrix("2"), Matrix3::identity() * 2.0);
    assert_eq!(matrix("1,2,3")[(2, 2)], 3.0);
    assert_eq!(matrix("1,2,3,4,5,6,7,8,9")[(0, 2)], 3.0);
    assert!(inertia("solid").unwrap().matrix().is_none());
    for bad in ["", "1,2", "nan", "1,inf,2", "1;2;3", "hollow"] {
        assert!(inertia(bad).is_err(), "{bad}");
    }
}

#[test]
fn planes_come_from_a_slope_or_a_normal() {
    assert!(plane("0").unwrap().is_level());
    assert_eq!(plane("30").unwrap(), Plane::sloping(30.0).unwrap());
    assert_eq!(plane("0,3,4,-2").unwrap().offset(), -2.0);
    for bad in ["", "1,2", "0,0,0", "nan", "1,2,3,4,5", "400", "0,0,1,inf"] {
        assert!(plane(bad).is_err(), "{bad}");
    }
}

#[test]
fn knots_of_a_load_may_have_a_time() {
    assert_eq!(load_knot("1,2,3").unwrap(), (None, Vector3::new(1.0, 2.0, 3.0)));
    assert_eq!(load_knot("0.5:1,2,3").unwrap().0, Some(0.5));
    for bad in ["", "1,2", "a:1,2,3", "0:1,2", "1:2:3,4,5"] {
        assert!(load_knot(bad).is_err(), "{bad}");
    }
}
