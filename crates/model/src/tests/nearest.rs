//! Unit tests of `nearest.rs`.

use super::*;

#[test]
fn a_name_of_another_simulator_comes_before_a_similar_one() {
    assert_eq!(nearest("frction", ["restitution", "friction"]), Some("friction"));
    assert_eq!(nearest("size", ["sphere", "box"]), Some("box"));
    assert_eq!(nearest("mu", ["between", "coefficient"]), Some("coefficient"));
    assert_eq!(nearest("most", ["position", "max_force"]), Some("max_force"));
    assert_eq!(nearest("xyzzy", ["sphere", "box"]), None);
    assert_eq!(nearest("pos", []), None);
}

#[test]
fn swapped_neighbouring_letters_count_as_one_edit() {
    let commands = ["verify", "view", "run", "plan"];
    assert_eq!(nearest("rnu", commands), Some("run"));
    assert_eq!(nearest("veiw", commands), Some("view"));
    assert_eq!(misspelt("colision", ["collision", "visual"]), Some("collision"));
    assert_eq!(misspelt("sensor", ["collision", "visual", "inertial"]), None);
    assert_eq!(misspelt("spring", ["lower", "friction", "x"]), None);
}

#[test]
fn only_messages_about_unknown_words_get_a_hint() {
    let message = "unknown field `pos`, expected one of `box`, `position`";
    let hinted = "unknown field `pos`; did you mean `position`? Expected one of `box`, `position`";
    assert_eq!(with_hint(message), hinted);
    for message in [
        "unknown field `qqq`, expected `box` or `position`",
        "unknown field `pos`, there are no fields",
        "missing field `position`",
        "unknown field `",
    ] {
        assert_eq!(with_hint(message), message);
    }
}
