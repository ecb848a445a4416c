//! What a recording may be, and what is said of one that cannot be.

use super::synthetic::{HALF_SIDE, model, tosses};
use nalgebra::Vector4;
use std::fs;
use tumble::fit::recording::{Toss, read_csv, read_torch};
use tumble::mechanics::State;
use tumble::mechanics::quaternion::rotation;

fn file(name: &str) -> Vec<u8> {
    fs::read(format!("{}/data/tosses/{name}", env!("CARGO_MANIFEST_DIR"))).unwrap()
}

/// See data/generate/toss_files.py.
#[test]
fn tensor_and_table_are_the_same_toss() {
    let table = read_csv(&file("bounce.csv")).unwrap();
    let [toss] = &table[..] else { panic!("{} tosses", table.len()) };
    assert_eq!((toss.name.as_str(), toss.rate, toss.frames.len()), ("bounce", 148.0, 12));
    assert_eq!(*toss, read_torch(&file("bounce.pt"), "bounce", 148.0).unwrap());
    // Single precision, by columns, behind a gap.
    let single = read_torch(&file("bounce-f32.pt"), "bounce", 148.0).unwrap();
    for (a, b) in toss.frames.iter().zip(&single.frames) {
        assert!((a.to_vector() - b.to_vector()).amax() < 2e-7);
    }
}

#[test]
fn a_compressed_table_is_the_same() {
    use std::io::Write;
    let mut gzip = flate2::write::GzEncoder::new(Vec::new(), flate2::Compression::default());
    gzip.write_all(&file("bounce.csv")).unwrap();
    let bytes = gzip.finish().unwrap();
    assert_eq!(read_csv(&bytes).unwrap(), read_csv(&file("bounce.csv")).unwrap());
    let cut = read_csv(&bytes[..bytes.len() / 2]).unwrap_err().to_string();
    assert!(cut.starts_with("it is no table"), "{cut}");
}

#[test]
fn broken_tables_are_refused_with_toss_and_row() {
    let good = String::from_utf8(file("bounce.csv")).unwrap();
    let lines: Vec<&str> = good.lines().collect();
    let refused = |lines: &[String]| read_csv(lines.join("\n").as_bytes()).unwrap_err().to_string();
    let with = |row: usize, column: usize, text: &str| {
        let mut lines: Vec<String> = lines.iter().map(|line| (*line).to_owned()).collect();
        let mut cells: Vec<&str> = lines[row + 1].split(',').collect();
        cells[column] = text;
        lines[row + 1] = cells.join(",");
        lines
    };
    let mut gap: Vec<String> = lines.iter().map(|line| (*line).to_owned()).collect();
    gap.remove(5);
    assert_eq!(
        refused(&gap),
        "toss bounce, row 4: step is 5, 4 is needed: rows are missing or out of order"
    );
    for (lines, sentence) in [
        (with(3, 4, "NaN"), "toss bounce, row 3: y is NaN; a finite number is needed"),
        (with(3, 4, "inf"), "toss bounce, row 3: y is inf"),
        (with(3, 4, ""), "toss bounce, row 3: y_m is ``; a number is needed"),
        (with(6, 6, "0.1"), "toss bounce, row 6: the attitude quaternion has length"),
        (with(6, 2, "0.1"), "toss bounce, row 6: t_s is 0.1"),
        (vec![lines[0].replace("qz", "q")], "the table has no column qz"),
        (vec![lines[0].to_owned()], "the table has no rows"),
        (lines[..4].iter().map(|l| (*l).to_owned()).collect(), "toss bounce: it has 3 frames"),
    ] {
        assert!(refused(&lines).contains(sentence), "{} / {sentence}", refused(&lines));
    }
}

#[test]
fn broken_tensors_are_refused() {
    let good = file("bounce.pt");
    let refused = |bytes: &[u8]| read_torch(bytes, "x", 148.0).unwrap_err().to_string();
    assert!(refused(b"no archive").starts_with("it is no tensor of a toss"));
    assert!(refused(&good[..good.len() / 2]).starts_with("it is no tensor of a toss"));
    // Every single byte of the pickle changed: a sentence or a toss, never a panic.
    let pickle = good.windows(4).position(|four| four == b"\x80\x02ct").unwrap();
    for place in pickle..pickle + 180 {
        for byte in [0, b'(', b'R', b't', 0x86, 0xff] {
            let mut bytes = good.clone();
            bytes[place] = byte;
            let _ = read_torch(&bytes, "x", 148.0);
        }
    }
}

/// A recording in other units or frames, of a real motion.
#[test]
fn other_units_and_frames_are_named() {
    let good = tosses(&model().values(), 1, 1e-5, 0).remove(0);
    let refused = |change: &dyn Fn(&mut State)| {
        let mut toss = good.clone();
        toss.frames.iter_mut().for_each(change);
        toss.checked().unwrap_err().to_string()
    };
    let says = |sentence: &str, change: &dyn Fn(&mut State)| {
        let found = refused(change);
        assert!(found.starts_with("toss 0: ") && found.contains(sentence), "{found} / {sentence}");
    };
    says("look like millimetres", &|state| state.position *= 1000.0);
    says("look like mm/s", &|state| state.velocity *= 1000.0);
    says("look like degrees a second", &|state| state.spin *= 180.0 / std::f64::consts::PI);
    says("world's frame", &|state| state.spin = rotation(&state.attitude) * state.spin);
    says("look like (x, y, z, w)", &|state| {
        let [w, x, y, z] = state.attitude.into();
        state.attitude = Vector4::new(x, y, z, w);
    });
    says("look like world → body", &|state| {
        let [w, x, y, z] = state.attitude.into();
        state.attitude = Vector4::new(w, -x, -y, -z);
    });
}

#[test]
fn a_recording_of_another_body_or_ground_is_refused() {
    let good = tosses(&model().values(), 1, 0.0, 0).remove(0);
    let corners = model().corners(&model().values());
    good.check_against(&corners, 0.0).unwrap();
    let refused = |change: &dyn Fn(&mut State)| {
        let mut toss: Toss = good.clone();
        toss.frames.iter_mut().for_each(change);
        toss.check_against(&corners, 0.0).unwrap_err().to_string()
    };
    assert!(refused(&|state| state.position.z *= -1.0).contains("z looks downwards"));
    assert!(refused(&|state| state.position *= 1000.0).contains("look like millimetres"));
    assert!(refused(&|state| state.position.z += HALF_SIDE).contains("ground at z = 0"));
}
