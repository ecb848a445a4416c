//! Unit tests of `png.rs`.

use super::*;

#[test]
fn texts_end_at_their_anchor_and_shifted_letters_are_raised() {
    let svg = "<svg xmlns=\"http://www.w3.org/2000/svg\"><text x=\"100\" y=\"50\" \
                   text-anchor=\"end\" font-size=\"12\">10<tspan dy=\"-4\" font-size=\"9\">8\
                   </tspan></text></svg>";
    let paths = outlined(svg).unwrap();
    let numbers = |path: &str| -> Vec<f64> {
        let data = path.split("d=\"").nth(1).unwrap().split('"').next().unwrap();
        let data = data.replace(|c: char| c.is_alphabetic(), " ");
        data.split_whitespace().map(|number| number.parse().unwrap()).collect()
    };
    let ends: Vec<_> = paths.split("<path").skip(1).map(numbers).collect();
    let [base, raised] = &ends[..] else { panic!("{paths}") };
    let right = raised.iter().step_by(2).copied().fold(0.0, f64::max);
    assert!((98.0..100.0).contains(&right), "{right}");
    let lowest = |path: &[f64]| path.iter().skip(1).step_by(2).copied().fold(0.0, f64::max);
    assert!((lowest(base) - lowest(raised) - 4.0).abs() < 0.2, "{paths}");
    assert!(!paths.contains("<text"));
}

#[test]
fn characters_without_a_glyph_are_drawn_as_question_marks() {
    let text = |letters: &str| {
        let svg = "<svg xmlns=\"http://www.w3.org/2000/svg\"><text x=\"9\" y=\"9\">";
        outlined(&format!("{svg}{letters}</text></svg>")).unwrap()
    };
    assert_eq!(text("立"), text("?"));
    assert!(text("?").contains("<path"));
}
