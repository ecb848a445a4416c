//! Triangles of the scene of binary glTF files (`.glb`), with the colours of their materials.
//!
//! A glTF scene is a tree of nodes with transforms, some of which show meshes. Lengths are in m.
//! The up axis y is ignored, consistent with Collada. Compressed meshes are rejected.

use super::painted::{Painted, colour_of};
use nalgebra::{Matrix4, Quaternion, Translation3, UnitQuaternion, Vector3, Vector4};
use serde_json::Value;

/// Maximum nesting depth of nodes, and maximum number of nodes.
const DEEPEST: usize = 50;
const MOST_NODES: usize = 10_000;
/// Maximum number of triangles.
const MOST_FACETS: usize = 2_000_000;

/// Chunk identifiers `glTF`, `JSON` and `BIN` as little-endian integers.
const MAGIC: u32 = 0x4654_6C67;
const JSON: u32 = 0x4E4F_534A;
const BIN: u32 = 0x004E_4942;

/// Component types, and the primitive mode of separate triangles.
const BYTES: u64 = 5121;
const SHORTS: u64 = 5123;
const INTS: u64 = 5125;
const FLOATS: u64 = 5126;
const TRIANGLES: u64 = 4;

/// All triangles (m) shown by the scene of a file, in groups of one colour.
pub fn facets(bytes: &[u8]) -> Result<Vec<Painted>, String> {
    let (json, data) = chunks(bytes)?;
    let root: Value =
        serde_json::from_slice(json).map_err(|error| format!("its JSON is invalid: {error}"))?;
    if let Some(needed) = root["extensionsRequired"].as_array().and_then(|all| all.first()) {
        return Err(format!("it needs the extension {needed}, which is not supported"));
    }
    let mut reader = GltfReader { root: &root, data, groups: Vec::new(), total: 0, nodes: 0 };
    let scene = root["scene"].as_u64().map_or(0, place);
    match root["scenes"].get(scene) {
        Some(scene) => {
            for node in list(&scene["nodes"]) {
                reader.add_node(node, &Matrix4::identity(), 0)?;
            }
        }
        None => {
            for mesh in 0..list(&root["meshes"]).len() {
                reader.add_mesh(mesh, &Matrix4::identity())?;
            }
        }
    }
    match reader.total {
        0 => Err("it shows no triangles".to_owned()),
        _ => Ok(reader.groups),
    }
}

/// JSON chunk and binary chunk of a file.
fn chunks(bytes: &[u8]) -> Result<(&[u8], &[u8]), String> {
    let word = |at: usize| {
        let four = bytes.get(at..at + 4).and_then(|four| four.first_chunk::<4>());
        four.map(|four| u32::from_le_bytes(*four)).ok_or("it ends too early")
    };
    if (word(0)?, word(4)?) != (MAGIC, 2) {
        return Err("is not a binary glTF of version 2".to_owned());
    }
    let chunk = |at: usize, kind: u32| {
        let length = word(at)? as usize;
        let end = (at + 8).checked_add(length).filter(|end| *end <= bytes.len());
        match (word(at + 4)? == kind, end) {
            (true, Some(end)) => Ok(&bytes[at + 8..end]),
            (true, None) => Err("it ends too early"),
            (false, _) => Err("its chunks are not JSON and binary data"),
        }
    };
    let json = chunk(12, JSON)?;
    let data = if bytes.len() > 20 + json.len() { chunk(20 + json.len(), BIN)? } else { &[] };
    Ok((json, data))
}

/// Elements of a list; empty for other values.
fn list(value: &Value) -> &[Value] {
    value.as_array().map_or(&[], Vec::as_slice)
}

fn place(number: u64) -> usize {
    usize::try_from(number).unwrap_or(usize::MAX)
}

/// Array of `N` numbers. `None` if the value is missing.
fn numbers<const N: usize>(value: &Value) -> Result<Option<[f64; N]>, String> {
    if value.is_null() {
        return Ok(None);
    }
    let all: Option<Vec<f64>> = list(value).iter().map(Value::as_f64).collect();
    let all = all.and_then(|all| <[f64; N]>::try_from(all).ok());
    let all = all.filter(|all| all.iter().all(|number| number.is_finite()));
    all.map(Some).ok_or_else(|| format!("a node has {value} where {N} numbers are needed"))
}

struct GltfReader<'a> {
    root: &'a Value,
    data: &'a [u8],
    groups: Vec<Painted>,
    /// Number of triangles.
    total: usize,
    nodes: usize,
}

/// Colour of a material: its base colour, which is in linear light.
fn colour(material: &Value) -> Option<[u8; 3]> {
    let encode = |light: &Value| {
        let light = light.as_f64()?;
        let curved = 1.055 * light.powf(1.0 / 2.4) - 0.055;
        Some(if light <= 0.003_130_8 { 12.92 * light } else { curved })
    };
    let channels = list(&material["pbrMetallicRoughness"]["baseColorFactor"]);
    let encoded: Option<Vec<_>> = channels.iter().take(3).map(encode).collect();
    colour_of(&encoded?)
}

impl GltfReader<'_> {
    fn add_node(
        &mut self,
        index: &Value,
        above: &Matrix4<f64>,
        depth: usize,
    ) -> Result<(), String> {
        self.nodes += 1;
        if depth > DEEPEST || self.nodes > MOST_NODES {
            return Err(format!(
                "more than {MOST_NODES} nodes, or nodes nested more than {DEEPEST} deep"
            ));
        }
        let root = self.root;
        let node = index.as_u64().and_then(|index| root["nodes"].get(place(index)));
        let node = node.ok_or_else(|| format!("there is no node {index}"))?;
        let own = match numbers::<16>(&node["matrix"])? {
            Some(columns) => Matrix4::from_column_slice(&columns),
            None => {
                let moved = numbers::<3>(&node["translation"])?.unwrap_or_default();
                let [x, y, z, w] = numbers::<4>(&node["rotation"])?.unwrap_or([0.0, 0.0, 0.0, 1.0]);
                let scale = numbers::<3>(&node["scale"])?.unwrap_or([1.0; 3]);
                let turn = UnitQuaternion::from_quaternion(Quaternion::new(w, x, y, z));
                Translation3::from(Vector3::from(moved)).to_homogeneous()
                    * turn.to_homogeneous()
                    * Matrix4::new_nonuniform_scaling(&scale.into())
            }
        };
        let placed = above * own;
        if let Some(mesh) = node["mesh"].as_u64() {
            self.add_mesh(place(mesh), &placed)?;
        }
        for child in list(&node["children"]) {
            self.add_node(child, &placed, depth + 1)?;
        }
        Ok(())
    }

    fn add_mesh(&mut self, index: usize, placed: &Matrix4<f64>) -> Result<(), String> {
        let root = self.root;
        let mesh = root["meshes"].get(index).ok_or_else(|| format!("there is no mesh {index}"))?;
        // A mirroring transform reverses the order of the vertices.
        let is_mirrored = placed.fixed_view::<3, 3>(0, 0).determinant() < 0.0;
        for primitive in list(&mesh["primitives"]) {
            if primitive["mode"].as_u64().unwrap_or(TRIANGLES) != TRIANGLES {
                return Err("only meshes of separate triangles are supported".to_owned());
            }
            let points = self.points(&primitive["attributes"]["POSITION"], placed)?;
            let corners = match &primitive["indices"] {
                Value::Null => (0..points.len()).collect(),
                indices => self.indices(indices)?,
            };
            let mut facets = Vec::new();
            for three in corners.chunks_exact(3) {
                let corner = |k: usize| points.get(three[k]).copied();
                let (Some(a), Some(b), Some(c)) = (corner(0), corner(1), corner(2)) else {
                    return Err("a triangle has a vertex that does not exist".to_owned());
                };
                facets.push(if is_mirrored { [a, c, b] } else { [a, b, c] });
            }
            self.total += facets.len();
            if self.total > MOST_FACETS {
                return Err(format!("it has more than {MOST_FACETS} triangles"));
            }
            let material = primitive["material"].as_u64().map(place);
            let material = material.and_then(|index| root["materials"].get(index));
            self.groups.push(Painted { colour: material.and_then(colour), facets });
        }
        Ok(())
    }

    fn points(&self, index: &Value, placed: &Matrix4<f64>) -> Result<Vec<Vector3<f64>>, String> {
        let (kind, each) = self.numbers(index, "VEC3", 3)?;
        if kind != FLOATS {
            return Err("its points are not floats".to_owned());
        }
        let number = |four: &[u8]| {
            four.first_chunk::<4>().map_or(f64::NAN, |four| f32::from_le_bytes(*four).into())
        };
        let point = |bytes: &[u8]| {
            let [x, y, z] = [0, 4, 8].map(|at| number(&bytes[at..]));
            let seen = placed * Vector4::new(x, y, z, 1.0);
            let is_finite = seen.iter().all(|number| number.is_finite());
            is_finite.then(|| seen.xyz()).ok_or_else(|| "a coordinate is not a number".to_owned())
        };
        each.map(point).collect()
    }

    fn indices(&self, index: &Value) -> Result<Vec<usize>, String> {
        let (kind, each) = self.numbers(index, "SCALAR", 1)?;
        if kind == FLOATS {
            return Err("its indices are floats".to_owned());
        }
        let whole =
            |bytes: &[u8]| bytes.iter().rev().fold(0, |sum, byte| sum << 8 | usize::from(*byte));
        Ok(each.map(whole).collect())
    }

    /// Component type of an accessor and the bytes of each element. Its element type has to be
    /// `kind` with `count` components.
    fn numbers(
        &self,
        index: &Value,
        kind: &str,
        count: usize,
    ) -> Result<(u64, impl Iterator<Item = &[u8]>), String> {
        let root = self.root;
        let number = |of: &Value, name: &str| of[name].as_u64().map_or(0, place);
        let accessor = index.as_u64().and_then(|index| root["accessors"].get(place(index)));
        let accessor = accessor.ok_or_else(|| format!("there is no accessor {index}"))?;
        let view = accessor["bufferView"].as_u64();
        let view = view.and_then(|view| root["bufferViews"].get(place(view)));
        let (Some(view), Some(kind_of), true) = (
            view.filter(|view| number(view, "buffer") == 0 && accessor["sparse"].is_null()),
            accessor["componentType"].as_u64(),
            accessor["type"].as_str() == Some(kind),
        ) else {
            return Err(format!("accessor {index} does not refer to numbers in the file itself"));
        };
        let width = match kind_of {
            BYTES => 1,
            SHORTS => 2,
            INTS | FLOATS => 4,
            _ => return Err(format!("accessor {index} has an unknown number type")),
        };
        let (size, items) = (width * count, number(accessor, "count"));
        let stride = view["byteStride"].as_u64().map_or(size, place);
        let begin = number(view, "byteOffset").checked_add(number(accessor, "byteOffset"));
        let most = begin.and_then(|begin| {
            items.saturating_sub(1).checked_mul(stride)?.checked_add(size)?.checked_add(begin)
        });
        let fits = items > 0 && stride >= size && most.is_some_and(|most| most <= self.data.len());
        let (Some(begin), true) = (begin, fits) else {
            return Err(format!("accessor {index} is beyond the end of the file"));
        };
        Ok((kind_of, self.data[begin..].chunks(stride).take(items).map(move |item| &item[..size])))
    }
}
