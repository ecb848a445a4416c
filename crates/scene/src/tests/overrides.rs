//! Unit tests of `overrides.rs`.

use super::*;

const SCENE: &str =
    "[ground]\nfriction = 0.3\n[[bodies]]\nname = \"a\"\nmass = 1.0\n[[bodies]]\nbox = 1.0\n";

fn overridden(text: &str, fields: &[&str]) -> Result<Table, String> {
    let mut table: Table = toml::from_str(text).unwrap();
    for field in fields {
        let set = FieldOverride::parse(field).unwrap().apply(&mut table);
        assert!(set.map_err(|failure| failure.to_string())?, "{field}");
    }
    Ok(table)
}

fn with(fields: &[&str]) -> Result<Table, String> {
    overridden(SCENE, fields)
}

#[test]
fn fields_of_tables_and_entries_are_set() {
    let found = with(&[
        "ground.friction=0.5",
        "time_step = 1e-3",
        "bodies.a.position=[0, 0, 2]",
        "bodies.1.box=0.5",
        "solver.name=native",
    ])
    .unwrap();
    assert_eq!(found["ground"]["friction"].as_float(), Some(0.5));
    assert_eq!(found["time_step"].as_float(), Some(1e-3));
    assert_eq!(found["bodies"][0]["position"][2].as_integer(), Some(2));
    assert_eq!(found["bodies"][0]["mass"].as_float(), Some(1.0));
    assert_eq!(found["bodies"][1]["box"].as_float(), Some(0.5));
    assert_eq!(found["solver"]["name"].as_str(), Some("native"));
}

/// A value with a line break is a text, which no field with a number takes. Its further lines are no fields.
#[test]
fn a_value_is_one_value() {
    let found = with(&["ground.friction=0.5\ntime_step = 0.1"]).unwrap();
    assert_eq!(found["ground"]["friction"].as_str(), Some("0.5\ntime_step = 0.1"));
    assert!(found.get("time_step").is_none());
}

/// The manual says: "Numbers of a vector are joined by commas."
#[test]
fn numbers_joined_by_commas_are_a_vector() {
    let found = with(&[
        "gravity=0,0,-1.5",
        "bodies.a.velocity= 1, .5,-2e-3",
        "bodies.1.copies.count=1,2,3",
        "ground.normal=[0, 0, 1]",
        "bodies.a.name=b,c",
        "title=4,",
    ])
    .unwrap();
    let floats = |value: &Value| -> Vec<f64> {
        value.as_array().unwrap().iter().map(|x| x.clone().try_into().unwrap()).collect()
    };
    assert_eq!(floats(&found["gravity"]), [0.0, 0.0, -1.5]);
    assert_eq!(floats(&found["bodies"][0]["velocity"]), [1.0, 0.5, -2e-3]);
    assert_eq!(found["bodies"][1]["copies"]["count"][2].as_integer(), Some(3));
    assert_eq!(found["ground"]["normal"][2].as_integer(), Some(1));
    assert_eq!(found["bodies"][0]["name"].as_str(), Some("b,c"));
    assert_eq!(found["title"].as_str(), Some("4,"));
}

#[test]
fn entries_without_a_name_have_that_of_their_joint() {
    let text =
        "[[motors]]\njoint = \"hip\"\n[[motors]]\njoint = \"knee\"\n[[motors]]\njoint = \"knee\"\n";
    let set = |field: &str| overridden(text, &[field]);
    let found = set("motors.hip.speed=2").unwrap();
    assert_eq!(found["motors"][0]["speed"].as_integer(), Some(2));
    assert!(set("motors.knee.speed=2").unwrap_err().contains("several entries \"knee\""));
    assert!(set("motors.neck.speed=2").unwrap_err().contains("there are: hip, knee"));
}

#[test]
fn paths_that_lead_nowhere_are_refused() {
    for (field, words) in [
        ("bodies.b.mass=1", "has no entry \"b\"; there are: a"),
        ("bodies.7.mass=1", "has no entry"),
        ("bodies.mass=1", "is a list"),
        ("ground.friction.x=1", "friction is not a table"),
    ] {
        let why = with(&[field]).unwrap_err();
        assert!(why.contains(words), "{field}: {why}");
    }
    for text in ["ground.friction", "=1", "ground..friction=1", "ground.friction="] {
        assert!(FieldOverride::parse(text).unwrap_err().contains("for example"), "{text}");
    }
}
