//! MuJoCo's mesh format (`.msh`), little-endian.
//!
//! It begins with the numbers of vertices, normals, texture coordinates and faces as 32-bit
//! integers. Their data follow: 32-bit floats, and vertex indices for faces.

use nalgebra::Vector3;
use tumble_core::error::Error;

/// Triangles of a file.
pub fn facets(bytes: &[u8]) -> Result<Vec<[Vector3<f64>; 3]>, Error> {
    let bad_input =
        |why: &str| Error::Shape { shape: "the mesh", why: format!("is not a .msh file: {why}") };
    let (words, rest) = bytes.as_chunks::<4>();
    let counts = words.first_chunk::<4>().ok_or_else(|| bad_input("it has no counts"))?;
    let [vertices, normals, texture, faces] =
        counts.map(|word| usize::try_from(i32::from_le_bytes(word)).unwrap_or(usize::MAX));
    let numbers = |count: usize, each: usize| count.checked_mul(each);
    let length =
        [numbers(vertices, 3), numbers(normals, 3), numbers(texture, 2), numbers(faces, 3)];
    let sum = length.iter().try_fold(4_usize, |sum, more| sum.checked_add((*more)?));
    if !rest.is_empty() || sum != Some(words.len()) {
        return Err(bad_input("its length does not match its counts"));
    }
    if faces == 0 {
        return Err(bad_input("it has no faces"));
    }
    let points = &words[4..4 + 3 * vertices];
    let indices = &words[words.len() - 3 * faces..];
    let points: Vec<_> = points
        .chunks_exact(3)
        .map(|three| Vector3::from_fn(|k, _| f64::from(f32::from_le_bytes(three[k]))))
        .collect();
    if points.iter().flatten().any(|number| !number.is_finite()) {
        return Err(bad_input("a coordinate is not a number"));
    }
    let corner = |word: &[u8; 4]| {
        let index = usize::try_from(i32::from_le_bytes(*word)).unwrap_or(usize::MAX);
        points
            .get(index)
            .copied()
            .ok_or_else(|| bad_input("a face has a vertex that does not exist"))
    };
    indices
        .chunks_exact(3)
        .map(|three| Ok([corner(&three[0])?, corner(&three[1])?, corner(&three[2])?]))
        .collect()
}
