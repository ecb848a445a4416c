//! Mesh parsers for the contents of OBJ and STL files.

use super::{Mesh, refused};
use crate::error::Error;
use nalgebra::Vector3;
use std::io::Cursor;
use stl_io::create_stl_reader;

/// Parses the text of a Wavefront OBJ file: `v` and `f` lines of all objects together.
///
/// Polygons are cut into triangles. Lengths are taken as m. Messages count facets from 1, after the
/// cut.
///
/// # Errors
/// Text that is not OBJ; the errors of [`Mesh::new`].
pub fn parse_obj(text: &str) -> Result<Mesh, Error> {
    Mesh::from_facets(&facets_of_obj(text)?)
}

/// Facets of the text of an OBJ file (m), read like [`parse_obj`] but without a check of the
/// surface.
///
/// # Errors
/// Text that is not OBJ.
pub fn facets_of_obj(text: &str) -> Result<Vec<[Vector3<f64>; 3]>, Error> {
    let options = tobj::LoadOptions {
        triangulate: true,
        ignore_points: true,
        ignore_lines: true,
        ..Default::default()
    };
    let no_materials = |_: &std::path::Path| Ok(Default::default());
    let (models, _) = tobj::load_obj_buf(&mut text.as_bytes(), &options, no_materials)
        .map_err(|error| refused(format!("is not an OBJ file: {error}")))?;
    let mut facets = Vec::new();
    for model in &models {
        let at = |&index: &u32| {
            let three = model.mesh.positions.chunks_exact(3).nth(index as usize);
            three.map(Vector3::from_column_slice)
        };
        for three in model.mesh.indices.chunks_exact(3) {
            match (at(&three[0]), at(&three[1]), at(&three[2])) {
                (Some(a), Some(b), Some(c)) => facets.push([a, b, c]),
                _ => {
                    return Err(refused(format!("has no vertices for facet {}", facets.len() + 1)));
                }
            }
        }
    }
    Ok(facets)
}

/// Parses the bytes of an STL file, binary (80 bytes, a count, 50 bytes a facet) or ASCII.
///
/// The normals in the file are ignored, and equal corners become one vertex. Lengths are taken as
/// m.
///
/// # Errors
/// Bytes that are not STL; the errors of [`Mesh::new`].
pub fn parse_stl(bytes: &[u8]) -> Result<Mesh, Error> {
    Mesh::from_facets(&facets_of_stl(bytes)?)
}

/// Facets of the bytes of an STL file (m), read like [`parse_stl`] but without a check of the
/// surface.
///
/// # Errors
/// Bytes that are not STL.
pub fn facets_of_stl(bytes: &[u8]) -> Result<Vec<[Vector3<f64>; 3]>, Error> {
    let count = bytes.get(80..84).map_or([0; 4], |four| [four[0], four[1], four[2], four[3]]);
    let is_binary = bytes.len() as u64 == 84 + 50 * u64::from(u32::from_le_bytes(count));
    let no_stl = |error: std::io::Error| refused(format!("is not an STL file: {error}"));
    // The reader takes every file that starts with "solid " for ASCII, even a binary one, and
    // rejects a `solid` without a name. Here the length decides the format, and the name is
    // optional.
    let mut clear = if is_binary {
        [&[0; 80], &bytes[80..]].concat()
    } else if bytes.starts_with(b"solid") {
        let line = bytes.iter().position(|&byte| byte == b'\n').unwrap_or(bytes.len());
        [b"solid ", &bytes[line..]].concat()
    } else {
        let why = "is not an STL file: it does not start with `solid`, and its length does not \
                   match a binary file's facets";
        return Err(refused(why.into()));
    };
    let mut cursor = Cursor::new(&mut clear);
    let facets = create_stl_reader(&mut cursor);
    let mut corners = Vec::new();
    for facet in facets.map_err(no_stl)? {
        let facet = facet.map_err(no_stl)?;
        corners.push(facet.vertices.map(|vertex| Vector3::from(vertex.0.map(f64::from))));
    }
    Ok(corners)
}
