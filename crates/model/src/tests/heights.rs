//! Unit tests of `heights.rs`.

use super::*;

#[test]
fn text_has_rows_and_comments() {
    let grid = HeightGrid::from_text(b"# heights\n0, 1, 2\n3,4,5e-1,\n").unwrap();
    assert_eq!(grid, HeightGrid { values: vec![0.0, 1.0, 2.0, 3.0, 4.0, 0.5], columns: 3 });
    for (text, expected) in [
        ("1,2\n3\n", "row 2 has 1 heights and row 1 has 2; all rows need the same number"),
        ("x,y\n1,2\n", "line 1: \"x\" is not a number; remove headings"),
        ("1\t2\n\n3\t\t4\n", "line 3: \"\" is not a number; remove headings"),
        ("0,00;0,30\n0;0\n", "line 1: \"0,00\" is not a number; write 0"),
        ("0 1\n0,5 2\n", "line 1: \"0 1\" is not a number; remove headings"),
        ("0;1\n2,3\n", "line 2: \"2,3\" is not a number; write 2.3"),
        ("1,2\n3,nan\n", "the height in row 2, column 2 is NaN; finite numbers are needed"),
    ] {
        assert_eq!(HeightGrid::from_text(text.as_bytes()).unwrap_err(), expected);
    }
    for text in ["0  0.5\n\n 1 2 \n", "0;0.5;\n1; 2;\n", "0\t0.5\n1\t2\n"] {
        let grid = HeightGrid::from_text(text.as_bytes()).unwrap();
        assert_eq!(grid, HeightGrid { values: vec![0.0, 0.5, 1.0, 2.0], columns: 2 });
    }
    assert!(HeightGrid::from_text(b"1,2\n").unwrap_err().contains("2 × 2 or more"));
}

/// An array as `numpy.save` writes it.
fn npy(kind: &str, by_columns: bool, shape: &str, data: &[u8]) -> Vec<u8> {
    let order = if by_columns { "True" } else { "False" };
    let header = format!("{{'descr': '{kind}', 'fortran_order': {order}, 'shape': {shape}, }}\n");
    let length = (header.len() as u16).to_le_bytes();
    [b"\x93NUMPY\x01\x00", &length[..], header.as_bytes(), data].concat()
}

#[test]
fn arrays_have_both_orders_and_several_types() {
    let expected = HeightGrid { values: vec![0.0, 1.0, 2.0, 3.0, 4.0, 5.0], columns: 3 };
    let bytes = npy("|u1", false, "(2, 3)", &[0, 1, 2, 3, 4, 5]);
    assert_eq!(HeightGrid::from_file("a.npy", &bytes).unwrap(), expected);
    let floats: Vec<u8> = [0.0, 3.0, 1.0, 4.0, 2.0, 5.0_f32].map(f32::to_le_bytes).concat();
    let bytes = npy("<f4", true, "(2, 3)", &floats);
    assert_eq!(HeightGrid::from_file("a.npy", &bytes).unwrap(), expected);
    let words: Vec<u8> = [0, 1, 2, 3, 4, 5_i16].map(i16::to_be_bytes).concat();
    let bytes = npy(">i2", false, "(2, 3)", &words);
    assert_eq!(HeightGrid::from_file("a.npy", &bytes).unwrap(), expected);
    let halves: Vec<u8> = [0x3e00, 0xc000, 0x7bff, 0x0001_u16].map(u16::to_le_bytes).concat();
    let grid = HeightGrid::from_npy(&npy("<f2", false, "(2, 2)", &halves)).unwrap();
    assert_eq!(grid.values, [1.5, -2.0, 65504.0, 2f64.powi(-24)]);
    let why = HeightGrid::from_npy(&npy("|u1", false, "(6,)", &[0; 6])).unwrap_err();
    assert_eq!(why, "the array has the shape (6,); two dimensions are needed");
    assert!(HeightGrid::from_npy(&npy("<c16", false, "(2, 2)", &[0; 64])).is_err());
    assert!(HeightGrid::from_npy(&npy("|u1", false, "(2, 3)", &[0; 5])).is_err());
}

#[test]
fn the_upper_row_of_an_image_is_far() {
    let mut bytes = Vec::new();
    let mut encoder = png::Encoder::new(&mut bytes, 2, 3);
    encoder.set_color(png::ColorType::Grayscale);
    encoder.set_depth(png::BitDepth::Sixteen);
    let mut writer = encoder.write_header().unwrap();
    let pixels: Vec<u8> = [0, 1, 2, 3, 4, 65535_u16].map(u16::to_be_bytes).concat();
    writer.write_image_data(&pixels).unwrap();
    writer.finish().unwrap();
    let grid = HeightGrid::from_file("a.PNG", &bytes).unwrap();
    let expected = [4.0, 65535.0, 2.0, 3.0, 0.0, 1.0].map(|grey| grey / 65535.0);
    assert_eq!(grid, HeightGrid { values: expected.to_vec(), columns: 2 });
}
