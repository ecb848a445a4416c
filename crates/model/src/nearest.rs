//! Suggestions for misspelt names.

/// Smallest similarity of a suggested name, by Jaro and Winkler.
const SIMILAR: f64 = 0.7;

/// Tumble's names, and those for the same thing in other simulators and earlier versions, separated by
/// spaces. They only serve suggestions.
const OTHERS: [(&str, &str); 19] = [
    ("spin", "angvel angular_velocity omega"),
    ("sphere", "ball"),
    ("centre", "center com"),
    ("colour", "color rgba"),
    ("box", "cube size"),
    ("time_step", "dt timestep"),
    ("restitution", "elasticity"),
    ("ground", "floor plane"),
    ("max_force", "most effort max_torque"),
    ("fixed", "weld"),
    ("revolute", "hinge"),
    ("prismatic", "slide slider"),
    ("velocity", "linvel speed vel"),
    ("friction", "mu"),
    ("coefficient", "mu"),
    ("attitude", "orientation quat rotation"),
    ("position", "pos"),
    ("limits", "range"),
    ("mass", "weight"),
];

/// Loss of similarity by a slip. It ranks a few slips above the same letters in another order.
const SLIP: f64 = 0.05;

/// Number of slips that turn `name` into `word`: wrong, missing and surplus letters, and swapped
/// neighbours. At most one for every four letters, or one; `None` beyond and for two letters.
fn slips(word: &str, name: &str) -> Option<usize> {
    let (length, slips) = (name.chars().count(), strsim::osa_distance(word, name));
    (length > 2 && slips <= (length / 4).max(1)).then_some(slips)
}

/// Name among `names` for the unknown `word`: the one for the same thing in another simulator, or
/// else the most similar one, if it is similar enough.
pub fn nearest<'a>(word: &str, names: impl IntoIterator<Item = &'a str>) -> Option<&'a str> {
    let of_other = |name: &str| {
        let known = OTHERS.iter().find(|(own, _)| *own == name);
        known.is_some_and(|(_, others)| others.split(' ').any(|other| other == word))
    };
    let similarity = |name: &str| {
        let slipped = slips(word, name).map_or(0.0, |slips| 1.0 - SLIP * slips as f64);
        if of_other(name) { f64::INFINITY } else { strsim::jaro_winkler(word, name).max(slipped) }
    };
    names
        .into_iter()
        .map(|name| (similarity(name), name))
        .filter(|(similarity, _)| *similarity >= SIMILAR)
        .max_by(|a, b| a.0.total_cmp(&b.0))
        .map(|(_, name)| name)
}

/// Name among `names` that `word` is a slip of, by few letters.
pub fn misspelt<'a>(word: &str, names: impl IntoIterator<Item = &'a str>) -> Option<&'a str> {
    nearest(word, names.into_iter().filter(|name| slips(word, name).is_some()))
}

/// End of an error about the unknown `word`: a question about the nearest name, or nothing.
pub fn hint<'a>(word: &str, names: impl IntoIterator<Item = &'a str>) -> String {
    nearest(word, names).map_or_else(String::new, |name| format!("; did you mean `{name}`?"))
}

/// Adds a hint to serde's `message` about an unknown field or word. Other messages stay as they are.
pub fn with_hint(message: &str) -> String {
    let unknown = ["unknown field `", "unknown variant `"];
    let rest = unknown.iter().find_map(|begin| message.strip_prefix(begin));
    let Some((word, names)) = rest.and_then(|rest| rest.split_once("`, expected ")) else {
        return message.to_owned();
    };
    // The names stand between backticks.
    let hint = hint(word, names.split('`').skip(1).step_by(2));
    if hint.is_empty() {
        return message.to_owned();
    }
    message.replacen("`, expected ", &format!("`{hint} Expected "), 1)
}

#[cfg(test)]
#[path = "tests/nearest.rs"]
mod tests;
