//! Vertices of Collada files (`.dae`), which collide as their convex hull.
//!
//! A Collada scene is a tree of nodes with transforms, some of which show geometries. Lengths are
//! in the unit of the file. The up axis is ignored, following ROS.

use nalgebra::{Matrix4, Rotation3, Unit, Vector3, Vector4};
use roxmltree::{Document, Node, ParsingOptions};
use std::collections::HashMap;

/// Maximum number of elements.
const MOST_ELEMENTS: u32 = 200_000;
/// Maximum nesting depth of nodes, and maximum number of nodes.
const DEEPEST: usize = 50;
const MOST_NODES: usize = 10_000;
/// Maximum number of points.
const MOST_POINTS: usize = 2_000_000;

/// All points (m) shown by the scene of a file.
pub fn points(text: &str) -> Result<Vec<Vector3<f64>>, String> {
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
    let mut reader = ColladaReader { named: named.collect(), points: Vec::new(), nodes: 0 };
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
                reader.add_geometry(geometry, &scale)?;
            }
        }
    }
    match reader.points.is_empty() {
        true => Err("it shows no points".to_owned()),
        false => Ok(reader.points),
    }
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

fn number(word: &str) -> Result<f64, String> {
    let number = word.parse::<f64>().ok().filter(|number| number.is_finite());
    number.ok_or_else(|| format!("{:?} is not a number", tumble_model::shown::line(word)))
}

fn numbers(node: Node<'_, '_>) -> Result<Vec<f64>, String> {
    node.text().unwrap_or("").split_ascii_whitespace().map(number).collect()
}

fn exactly<const N: usize>(node: Node<'_, '_>) -> Result<[f64; N], String> {
    let wrong = |given: Vec<f64>| {
        format!("<{}>: {} numbers are given; {N} are needed", node.tag_name().name(), given.len())
    };
    <[f64; N]>::try_from(numbers(node)?).map_err(wrong)
}

struct ColladaReader<'a> {
    /// Elements by identifier.
    named: HashMap<&'a str, Node<'a, 'a>>,
    points: Vec<Vector3<f64>>,
    /// Number of visited nodes.
    nodes: usize,
}

impl<'a> ColladaReader<'a> {
    /// The element `tag` that another element refers to.
    fn named(&self, by: Node<'a, 'a>, tag: &str) -> Result<Node<'a, 'a>, String> {
        let said = by.attribute("url").or_else(|| by.attribute("source")).unwrap_or("");
        let id = said.strip_prefix('#').unwrap_or(said);
        let found = self.named.get(id).copied().filter(|node| node.has_tag_name_of(tag));
        found.ok_or_else(|| format!("there is no <{tag}> {:?}", tumble_model::shown::line(id)))
    }

    fn add_node(
        &mut self,
        node: Node<'a, 'a>,
        outer: &Matrix4<f64>,
        depth: usize,
    ) -> Result<(), String> {
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
                odd @ ("lookat" | "skew") => return Err(format!("<{odd}> is not supported")),
                "instance_geometry" => {
                    self.add_geometry(self.named(child, "geometry")?, &place)?;
                }
                "instance_node" => self.add_node(self.named(child, "node")?, &place, depth + 1)?,
                "node" => self.add_node(child, &place, depth + 1)?,
                _ => {}
            }
        }
        Ok(())
    }

    /// Adds the points of a geometry: the `POSITION` input of its vertices.
    fn add_geometry(&mut self, geometry: Node<'a, 'a>, place: &Matrix4<f64>) -> Result<(), String> {
        let meshes = geometry.children().filter(|child| child.has_tag_name_of("mesh"));
        for vertices in meshes.flat_map(|mesh| all(mesh, "vertices")) {
            let is_place = |input: &Node<'_, '_>| input.attribute("semantic") == Some("POSITION");
            for input in all(vertices, "input").filter(is_place) {
                let source = self.named(input, "source")?;
                let array = below(source, "float_array").ok_or("<float_array> is needed")?;
                let found = numbers(array)?;
                if !found.len().is_multiple_of(3) {
                    return Err(format!("<float_array>: {} numbers are not points", found.len()));
                }
                if self.points.len() + found.len() / 3 > MOST_POINTS {
                    return Err(format!("there are more than {MOST_POINTS} points"));
                }
                let placed = found
                    .chunks_exact(3)
                    .map(|point| (place * Vector4::new(point[0], point[1], point[2], 1.0)).xyz());
                self.points.extend(placed);
            }
        }
        Ok(())
    }
}
