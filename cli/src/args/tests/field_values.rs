//! Unit tests of `field_values.rs`.

use super::*;

#[test]
fn a_range_has_the_decimals_of_its_numbers() {
    let values = |text: &str| FieldValues::parse(text).map(|field| field.values);
    assert_eq!(values("ground.friction=0.2:0.4:0.1").unwrap(), ["0.2", "0.3", "0.4"]);
    assert_eq!(values("a.b = 3:1:-1").unwrap(), ["3", "2", "1"]);
    assert_eq!(values("a=0:1:0.4").unwrap(), ["0.0", "0.4", "0.8"]);
    assert_eq!(values("a=1e-3:2e-3:1e-3").unwrap(), ["0.001", "0.002"]);
    assert_eq!(values("name=a:b:c").unwrap(), ["a:b:c"]);
    for text in ["a=1:2:0", "a=1:2:-1", "a=0:1:1e-9", "a=nan:1:1"] {
        assert!(values(text).unwrap_err().contains("FIRST:LAST:STEP"), "{text}");
    }
}
