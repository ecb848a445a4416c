//! Unit tests of `png.rs`.

use super::*;
use crate::png::{COMMENT, HEADER};

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

/// The chunk is as the PNG specification wants it (§ 5.3): length, kind, data and CRC-32 of both.
#[test]
fn a_picture_has_the_mark_in_a_chunk_of_text() {
    let svg = "<svg xmlns=\"http://www.w3.org/2000/svg\" width=\"9\" height=\"9\"/>";
    let png = rasterise(svg).unwrap();
    assert_eq!(&png[HEADER..HEADER + COMMENT.len()], COMMENT);
    assert_eq!(Pixmap::decode_png(&png).unwrap().width(), 18);
    let (body, sum) = COMMENT[4..].split_last_chunk::<4>().unwrap();
    assert!(body.ends_with(crate::MARK.as_bytes()));
    assert_eq!(COMMENT[..4], (body.len() as u32 - 4).to_be_bytes());
    let crc = body.iter().fold(u32::MAX, |crc, byte| {
        (0..8).fold(crc ^ u32::from(*byte), |crc, _| {
            (crc >> 1) ^ (0xedb8_8320 & 0_u32.wrapping_sub(crc & 1))
        })
    });
    assert_eq!(*sum, (!crc).to_be_bytes());
}
