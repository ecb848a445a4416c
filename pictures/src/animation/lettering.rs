//! The few letters of the clock, as strokes.

use super::canvas::{Canvas, Pixel};
use super::palette::Colour;
use tiny_skia::{Path, PathBuilder};

/// Height of a digit in the units of [`strokes`].
const DIGIT_HEIGHT: f32 = 14.0;
/// From one digit to the next; the same for all, so that the clock does not jitter.
const ADVANCE: f32 = 11.5;

/// Writes `text` with its upper left corner at `at` and digits `height` pixels high.
/// Characters without strokes leave a space.
pub fn write(canvas: &mut Canvas, text: &str, at: Pixel, height: f32, colour: Colour) {
    let scale = height / DIGIT_HEIGHT;
    let mut left = at[0];
    for letter in text.chars() {
        if let Some(path) = path(strokes(letter), [left, at[1]], scale) {
            canvas.stroke(&path, 1.9 * scale, colour);
        }
        left += scale * if letter == '.' { 0.5 * ADVANCE } else { ADVANCE };
    }
}

/// Moves, lines, cubic curves and closures; a digit is 8 wide and 14 high, y down.
fn strokes(letter: char) -> &'static str {
    match letter {
        '0' => "M 4 0 C 7 0 8 3 8 7 C 8 11 7 14 4 14 C 1 14 0 11 0 7 C 0 3 1 0 4 0 Z",
        '1' => "M 1.2 2.8 L 4.8 0 L 4.8 14",
        '2' => {
            "M 0.4 3.8 C 0.4 1.4 2 0 4 0 C 6.2 0 7.7 1.5 7.7 3.7 C 7.7 5.5 6.6 6.9 5 8.6 L 0.2 14 \
             L 8 14"
        }
        '3' => {
            "M 0.4 2.6 C 1 1 2.4 0 4 0 C 6.2 0 7.5 1.4 7.5 3.3 C 7.5 5.2 6 6.5 3.4 6.5 C 6.3 6.5 \
             8 7.9 8 10.1 C 8 12.5 6.3 14 4 14 C 2 14 0.6 13 0 11.2"
        }
        '4' => "M 6 14 L 6 0 L 0 9.8 L 8.2 9.8",
        '5' => {
            "M 7.2 0 L 1.4 0 L 0.8 6.4 C 1.6 5.6 2.8 5.2 4 5.2 C 6.4 5.2 8 7 8 9.5 C 8 12.2 6.3 \
             14 3.9 14 C 2 14 0.6 13 0 11.4"
        }
        '6' => {
            "M 7 1.6 C 6.3 0.5 5.3 0 4.3 0 C 1.6 0 0 3 0 8 C 0 12 1.6 14 4 14 C 6.4 14 8 12.2 8 \
             9.6 C 8 7 6.4 5.4 4.1 5.4 C 2 5.4 0.4 6.9 0 9"
        }
        '7' => "M 0 0 L 8 0 L 3 14",
        '8' => {
            "M 4 6.5 C 1.9 6.5 0.6 5.2 0.6 3.3 C 0.6 1.4 1.9 0 4 0 C 6.1 0 7.4 1.4 7.4 3.3 C 7.4 \
             5.2 6.1 6.5 4 6.5 C 1.6 6.5 0 8 0 10.2 C 0 12.4 1.6 14 4 14 C 6.4 14 8 12.4 8 10.2 C \
             8 8 6.4 6.5 4 6.5 Z"
        }
        '9' => {
            "M 1 12.4 C 1.7 13.5 2.7 14 3.7 14 C 6.4 14 8 11 8 6 C 8 2 6.4 0 4 0 C 1.6 0 0 1.8 0 \
             4.4 C 0 7 1.6 8.6 3.9 8.6 C 6 8.6 7.6 7.1 8 5"
        }
        '.' => "M 1.4 13.9 L 1.5 13.9",
        '=' => "M 0.5 6.4 L 7.5 6.4 M 0.5 10.2 L 7.5 10.2",
        't' => "M 3.2 1.6 L 3.2 11.4 C 3.2 13.2 4 14 5.4 14 L 6.4 14 M 0.6 4.8 L 6.4 4.8",
        's' => {
            "M 6.6 6.4 C 6.1 5.3 5.1 4.7 3.8 4.7 C 2 4.7 0.8 5.6 0.8 7 C 0.8 8.4 2 8.9 3.8 9.3 C \
             5.8 9.7 7 10.3 7 11.7 C 7 13.1 5.7 14 3.8 14 C 2.2 14 1.1 13.3 0.5 12.1"
        }
        '×' => "M 1 5 L 7.4 12.4 M 7.4 5 L 1 12.4",
        _ => "",
    }
}

fn path(strokes: &str, [left, top]: Pixel, scale: f32) -> Option<Path> {
    let mut path = PathBuilder::new();
    let mut words = strokes.split_whitespace();
    while let Some(command) = words.next() {
        let mut point = || -> Option<Pixel> {
            let mut number = || words.next()?.parse::<f32>().ok();
            Some([left + scale * number()?, top + scale * number()?])
        };
        match command {
            "M" => {
                let [x, y] = point()?;
                path.move_to(x, y);
            }
            "L" => {
                let [x, y] = point()?;
                path.line_to(x, y);
            }
            "C" => {
                let ([x1, y1], [x2, y2], [x, y]) = (point()?, point()?, point()?);
                path.cubic_to(x1, y1, x2, y2, x, y);
            }
            _ => path.close(),
        }
    }
    path.finish()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_letter_of_the_clock_has_strokes() {
        for letter in "0123456789.=ts×".chars() {
            assert!(path(strokes(letter), [0.0, 0.0], 1.0).is_some(), "{letter}");
        }
        assert!(path(strokes(' '), [0.0, 0.0], 1.0).is_none());
    }
}
