//! Collada files (`.dae`): vertices, which collide as their convex hull, and triangles with colours
//! for drawing.
//!
//! A Collada scene is a tree of nodes with transforms, some of which show geometries. Lengths are
//! in the unit of the file. The up axis is ignored, following ROS. Textures are ignored.

use super::painted::{Facet, Painted, colour_of};
use super::xml::{Parsed, check_attributes};
use nalgebra::{Matrix4, Rotation3, Unit, Vector3, Vector4};
use roxmltree::{Document, Node, ParsingOptions};
use std::collections::HashMap;

/// Maximum number of elements.
const MOST_ELEMENTS: u32 = 200_000;
/// Maximum nesting depth of nodes, and maximum number of nodes.
const DEEPEST: usize = 50;
const MOST_NODES: usize = 10_000;
/// Maximum number of points, and of triangles.
const MOST_POINTS: usize = 2_000_000;

/// All points (m) shown by the scene of a file.
pub fn points(text: &str) -> Parsed<Vec<Vector3<f64>>> {
    let points = scene(text)?.points;
    if points.is_empty() { Err("it shows no points".to_owned()) } else { Ok(points) }
}

/// All triangles (m) shown by the scene of a file, in groups of one colour.
pub fn triangles(text: &str) -> Parsed<Vec<Painted>> {
    let groups = scene(text)?.groups;
    if groups.is_empty() { Err("it shows no triangles".to_owned()) } else { Ok(groups) }
}

/// Content of the scene of a file.
struct ColladaScene {
    points: Vec<Vector3<f64>>,
    groups: Vec<Painted>,
}

fn scene(text: &str) -> Parsed<ColladaScene> {
    check_attributes(text)?;
    let options = ParsingOptions { nodes_limit: MOST_ELEMENTS, ..ParsingOptions::default() };
    let document = Document::parse_with_options(text, options)
        .map_err(|error| format!("it is not XML: {error}"))?;
    let root = document.root_element();
    if root.tag_name().name() != "COLLADA" {
        return Err("it is not a Collada file".to_owned());
    }
    let unit = below(root, "asset").and_then(|asset| below(asset, "unit"));
    let meter = unit.and_then(|unit| unit.attribute("meter"));
    let meter = meter.map_or(Ok(1.0), |meter| number(meter.trim()))?;
    let named = root.descendants().filter_map(|node| Some((node.attribute("id")?, node)));
    let found = ColladaScene { points: Vec::new(), groups: Vec::new() };
    let mut reader = ColladaReader { named: named.collect(), found, nodes: 0 };
    let scale = Matrix4::new_scaling(meter);
    let shown = below(root, "scene").and_then(|scene| below(scene, "instance_visual_scene"));
    match shown.map(|shown| reader.named(shown, "visual_scene")).transpose()? {
        Some(scene) => {
            for node in all(scene, "node") {
                reader.add_node(node, &scale, 0)?;
            }
        }
        None => {
            for geometry in root.descendants().filter(|node| node.has_tag_name_of("geometry")) {
                reader.add_geometry(geometry, &scale, None)?;
            }
        }
    }
    Ok(reader.found)
}

/// Test of an element's tag that ignores its name space.
trait Tagged {
    fn has_tag_name_of(&self, tag: &str) -> bool;
}

impl Tagged for Node<'_, '_> {
    fn has_tag_name_of(&self, tag: &str) -> bool {
        self.is_element() && self.tag_name().name() == tag
    }
}

fn all<'a, 'd: 'a>(
    node: Node<'a, 'd>,
    tag: &'static str,
) -> impl Iterator<Item = Node<'a, 'd>> + 'a {
    node.children().filter(move |child| child.has_tag_name_of(tag))
}

fn below<'a, 'd: 'a>(node: Node<'a, 'd>, tag: &'static str) -> Option<Node<'a, 'd>> {
    all(node, tag).next()
}

fn number(word: &str) -> Parsed<f64> {
    let number = word.parse::<f64>().ok().filter(|number| number.is_finite());
    number.ok_or_else(|| format!("{:?} is not a number", tumble_model::shown::line(word)))
}

fn numbers(node: Node<'_, '_>) -> Parsed<Vec<f64>> {
    node.text().unwrap_or("").split_ascii_whitespace().map(number).collect()
}

fn exactly<const N: usize>(node: Node<'_, '_>) -> Parsed<[f64; N]> {
    let wrong = |given: Vec<f64>| {
        format!("<{}>: {} numbers are given; {N} are needed", node.tag_name().name(), given.len())
    };
    <[f64; N]>::try_from(numbers(node)?).map_err(wrong)
}

struct ColladaReader<'a> {
    /// Elements by identifier.
    named: HashMap<&'a str, Node<'a, 'a>>,
    found: ColladaScene,
    /// Number of visited nodes.
    nodes: usize,
}

impl<'a> ColladaReader<'a> {
    /// The element `tag` that another element refers to.
    fn named(&self, by: Node<'a, 'a>, tag: &str) -> Parsed<Node<'a, 'a>> {
        let reference = by.attribute("url").or_else(|| by.attribute("source")).unwrap_or("");
        let id = reference.strip_prefix('#').unwrap_or(reference);
        let found = self.named.get(id).copied().filter(|node| node.has_tag_name_of(tag));
        found.ok_or_else(|| format!("there is no <{tag}> {:?}", tumble_model::shown::line(id)))
    }

    fn add_node(&mut self, node: Node<'a, 'a>, outer: &Matrix4<f64>, depth: usize) -> Parsed<()> {
        self.nodes += 1;
        if depth > DEEPEST || self.nodes > MOST_NODES {
            return Err(format!("more than {MOST_NODES} nodes, or more than {DEEPEST} deep"));
        }
        let mut place = *outer;
        for child in node.children().filter(Node::is_element) {
            match child.tag_name().name() {
                "matrix" => place *= Matrix4::from_row_slice(&exactly::<16>(child)?),
                "translate" => place *= Matrix4::new_translation(&exactly::<3>(child)?.into()),
                "scale" => {
                    place *= Matrix4::new_nonuniform_scaling(&exactly::<3>(child)?.into());
                }
                "rotate" => {
                    let [x, y, z, degrees] = exactly::<4>(child)?;
                    if let Some(axis) = Unit::try_new(Vector3::new(x, y, z), 1e-12) {
                        let turn = Rotation3::from_axis_angle(&axis, degrees.to_radians());
                        place *= turn.to_homogeneous();
                    }
                }
                unsupported @ ("lookat" | "skew") => {
                    return Err(format!("<{unsupported}> is not supported"));
                }
                "instance_geometry" => {
                    self.add_geometry(self.named(child, "geometry")?, &place, Some(child))?;
                }
                "instance_node" => self.add_node(self.named(child, "node")?, &place, depth + 1)?,
                "node" => self.add_node(child, &place, depth + 1)?,
                _ => {}
            }
        }
        Ok(())
    }

    /// Adds the points and triangles of a geometry. `instance` binds its materials.
    fn add_geometry(
        &mut self,
        geometry: Node<'a, 'a>,
        place: &Matrix4<f64>,
        instance: Option<Node<'a, 'a>>,
    ) -> Parsed<()> {
        for mesh in all(geometry, "mesh") {
            for vertices in all(mesh, "vertices") {
                let points = self.positions(vertices, place)?;
                self.found.points.extend(points);
                if self.found.points.len() > MOST_POINTS {
                    return Err(format!("there are more than {MOST_POINTS} points"));
                }
            }
            for faces in mesh.children().filter(Node::is_element) {
                if ["triangles", "polylist"].iter().any(|tag| faces.has_tag_name_of(tag)) {
                    self.add_faces(faces, place, instance)?;
                }
            }
        }
        Ok(())
    }

    /// Points of `<vertices>`: their `POSITION` input.
    fn positions(&self, vertices: Node<'a, 'a>, place: &Matrix4<f64>) -> Parsed<Vec<Vector3<f64>>> {
        let is_place = |input: &Node<'_, '_>| input.attribute("semantic") == Some("POSITION");
        let mut points = Vec::new();
        for input in all(vertices, "input").filter(is_place) {
            let source = self.named(input, "source")?;
            let array = below(source, "float_array").ok_or("<float_array> is needed")?;
            let found = numbers(array)?;
            let (three, rest) = found.as_chunks::<3>();
            if !rest.is_empty() {
                return Err(format!("<float_array>: {} numbers are not points", found.len()));
            }
            points
                .extend(three.iter().map(|&[x, y, z]| (place * Vector4::new(x, y, z, 1.0)).xyz()));
        }
        Ok(points)
    }

    /// Adds the faces of `<triangles>` or `<polylist>`, which are fans of triangles.
    fn add_faces(
        &mut self,
        faces: Node<'a, 'a>,
        place: &Matrix4<f64>,
        instance: Option<Node<'a, 'a>>,
    ) -> Parsed<()> {
        let offset = |input: Node<'_, '_>| -> usize {
            input.attribute("offset").and_then(|offset| offset.parse().ok()).unwrap_or(0)
        };
        let inputs: Vec<_> = all(faces, "input").collect();
        let corner = inputs.iter().find(|input| input.attribute("semantic") == Some("VERTEX"));
        let (Some(corner), Some(list)) = (corner, below(faces, "p")) else { return Ok(()) };
        // Corners of the faces: one index of `stride` numbers is that of the vertex.
        let stride = inputs.iter().map(|input| offset(*input)).max().unwrap_or(0) + 1;
        let points = self.positions(self.named(*corner, "vertices")?, place)?;
        let indices = numbers(list)?;
        let corners: Parsed<Vec<_>> = indices
            .chunks_exact(stride)
            .map(|each| {
                let index = each[offset(*corner)];
                let point = (index >= 0.0).then(|| points.get(index as usize)).flatten();
                point.copied().ok_or_else(|| "a face has an unknown vertex".to_owned())
            })
            .collect();
        let corners = corners?;
        let counts = below(faces, "vcount").map(numbers).transpose()?;
        let counts = counts.unwrap_or_else(|| vec![3.0; corners.len() / 3]);
        let mut facets: Vec<Facet> = Vec::new();
        let mut rest = &corners[..];
        // Polygons become fans of triangles.
        for count in counts {
            let (face, after) = rest.split_at_checked(count as usize).unwrap_or((rest, &[]));
            rest = after;
            facets.extend((2..face.len()).map(|k| [face[0], face[k - 1], face[k]]));
        }
        // Mirrored nodes turn the faces inside out.
        if place.fixed_view::<3, 3>(0, 0).determinant() < 0.0 {
            facets.iter_mut().for_each(|[_, b, c]| std::mem::swap(b, c));
        }
        let total: usize = self.found.groups.iter().map(|group| group.facets.len()).sum();
        if total + facets.len() > MOST_POINTS {
            return Err(format!("there are more than {MOST_POINTS} triangles"));
        }
        let colour = faces.attribute("material").and_then(|name| self.colour(name, instance?));
        if !facets.is_empty() {
            self.found.groups.push(Painted { colour, facets });
        }
        Ok(())
    }

    /// Diffuse colour of the material that an instance binds to a name. `None` without one.
    fn colour(&self, name: &str, instance: Node<'a, 'a>) -> Option<[u8; 3]> {
        let bound = instance.descendants().find(|node| {
            node.has_tag_name_of("instance_material") && node.attribute("symbol") == Some(name)
        })?;
        let named = |id: &str, tag: &str| {
            let node = self.named.get(id.strip_prefix('#').unwrap_or(id)).copied();
            node.filter(|node| node.has_tag_name_of(tag))
        };
        let material = named(bound.attribute("target")?, "material")?;
        let effect = named(below(material, "instance_effect")?.attribute("url")?, "effect")?;
        let diffuse = effect.descendants().find(|node| node.has_tag_name_of("diffuse"))?;
        colour_of(&numbers(below(diffuse, "color")?).ok()?)
    }
}

#[cfg(test)]
#[path = "tests/collada.rs"]
mod tests;
