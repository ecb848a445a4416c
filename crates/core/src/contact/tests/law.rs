//! Unit tests of `law.rs`.

use super::*;

const LAW: ContactLaw = ContactLaw::plastic(0.5);
const ALONE: Response = Response { normal: 1.0, tangential: 1.0 };

fn residual(p: [f64; 3], u: [f64; 3]) -> LawResidual {
    LAW.residual(&ALONE, &Vector3::z(), &p.into(), &u.into())
}

#[test]
fn lawful_contacts_have_zero_residual() {
    let exact = LawResidual { normal: 0.0, friction: 0.0, cone: 0.0 };
    assert_eq!(residual([0.0; 3], [3.0, 0.0, 1.0]), exact, "open");
    assert_eq!(residual([0.2, 0.1, 1.0], [0.0; 3]), exact, "stick");
    assert_eq!(residual([-0.5, 0.0, 1.0], [3.0, 0.0, 0.0]), exact, "slip");
}

#[test]
fn each_violation_of_the_law_has_a_residual() {
    assert_eq!(residual([0.0, 0.0, 1.0], [0.0, 0.0, 0.25]).normal, 0.25);
    assert_eq!(residual([0.0, 0.0, -1.0], [0.0, 0.0, 0.25]).normal, 1.0);
    assert_eq!(residual([0.0; 3], [0.0, 0.0, -2.0]).normal, 2.0);
    assert_eq!(residual([0.5, 0.0, 1.0], [3.0, 0.0, 0.0]).friction, 1.0);
    assert_eq!(residual([0.0, 0.75, 1.0], [0.0; 3]).cone, 0.25);
    assert!(residual([f64::NAN, 0.0, 1.0], [0.0; 3]).friction.is_nan());
    assert!(residual([0.0, 0.0, f64::NAN], [0.0; 3]).normal.is_nan());
}
