//! `<asset>`: meshes from files or from vertex lists.

use super::MjcfReader;
use super::compiler::Compiler;
use crate::meshes::{self, Hulled, Volume, stem, turned_back};
use crate::painted::colour_of;
use crate::xml::{Attributes, Element, Parsed};
use nalgebra::Vector3;

impl MjcfReader<'_> {
    /// Reads meshes. Notes assets that only affect drawing.
    pub(super) fn read_assets(&mut self, section: &Element) -> Parsed<()> {
        for asset in &section.children {
            match &*asset.tag {
                "mesh" => self.read_mesh(asset)?,
                "material" => self.read_material(asset),
                "hfield" => self.read_field(asset)?,
                "texture" | "skin" => self.notes.idle(&asset.tag),
                _ => return Err(asset.wrong("this asset is not supported")),
            }
        }
        Ok(())
    }

    /// Reads the colour of a material. Its other attributes have no effect.
    fn read_material(&mut self, element: &Element) {
        let colour = element.numbers("rgba").ok().flatten().and_then(|rgba| colour_of(&rgba));
        if let (Some(name), Some(colour)) = (element.own("name"), colour) {
            self.materials.insert(name.to_owned(), colour);
        }
        self.notes.idle(&element.tag);
    }

    fn read_mesh(&mut self, element: &Element) -> Parsed<()> {
        const IDLE: &str = "\
            normal texcoord smoothnormal maxhullvert content_type material needsdf \
            octree_maxdepth refpos refquat";
        element.refuse_others("name class file vertex face scale inertia", IDLE)?;
        let read = self.defaulted(element, "")?;
        let scale = read.exactly::<3>("scale")?.unwrap_or([1.0; 3]);
        if let Some(name) =
            ["refpos", "refquat"].into_iter().find(|name| element.get(name).is_some())
        {
            let why = format!("{name} is not supported; move and turn the vertices in the file");
            return Err(element.wrong(why));
        }
        // Source of the mass
        let kinds = [("legacy", 0), ("exact", 1), ("convex", 2), ("shell", 3)];
        let usual = i32::from(self.compiler.exact_meshes);
        let inertia = read.word("inertia", &kinds)?.unwrap_or(usual);
        // Vertices from a file or from the element. Without faces the mesh is their hull.
        let (name, found) = match (element.get("file"), element.numbers("vertex")?) {
            (Some(file), None) => {
                let name = element.own("name").map_or_else(|| stem(file), str::to_owned);
                let file = self.mesh_file(file);
                let found = meshes::read(self.reading, &file, scale);
                if let Ok(found) = &found {
                    self.notes.hull(&file, found);
                }
                self.files.insert(name.clone(), (file, scale));
                (name, found)
            }
            (None, Some(numbers)) if numbers.len().is_multiple_of(3) => {
                let point = |three: &[f64]| std::array::from_fn(|k| three[k] * scale[k]);
                let points: Vec<[f64; 3]> = numbers.chunks_exact(3).map(point).collect();
                let found = match faces(element, &points, scale)? {
                    Some(facets) => meshes::hull_from_facets(&facets),
                    None => meshes::hull(points.into_iter()),
                };
                (element.needed("name")?.to_owned(), found)
            }
            _ => {
                return Err(element
                    .wrong("either file or vertex, with three numbers per vertex, is needed"));
            }
        };
        // Volume from which mass and inertia follow, by the kind of `inertia`
        let counted = |hulled: Hulled| {
            let is_whole = hulled.outside == 0.0;
            let volume = match (inertia, hulled.volume) {
                (1, Volume::Triangles(both)) => Volume::Triangles(Box::new([both[1]; 2])),
                (2, Volume::Triangles(_)) if is_whole => Volume::Hull,
                (2, Volume::Triangles(_)) | (3, _) => Volume::Unknown,
                (_, volume) => volume,
            };
            Hulled { volume, ..hulled }
        };
        let found = found.map(counted).map_err(|why| element.wrong(why));
        self.meshes.insert(name, found);
        Ok(())
    }

    pub(super) fn mesh_file(&self, file: &str) -> String {
        let Compiler { meshes, strip, .. } = &self.compiler;
        let file = if *strip { file.rsplit(['/', '\\']).next().unwrap_or(file) } else { file };
        if meshes.is_empty() { file.to_owned() } else { format!("{meshes}/{file}") }
    }

    /// Notes the faults of meshes that no shape uses.
    pub(super) fn note_unused(&mut self) {
        let invalid = |(name, mesh): (&String, &Parsed<Hulled>)| {
            let why = mesh.as_ref().err().filter(|_| !self.flat.contains(name));
            why.map(|why| format!("an unused mesh: {why}"))
        };
        let mut sentences: Vec<_> = self.meshes.iter().filter_map(invalid).collect();
        sentences.sort();
        sentences.into_iter().for_each(|sentence| self.notes.say(sentence));
    }
}

/// Triangles of a mesh given by `face`, if present. `points` are already multiplied by `scale`.
fn faces(
    element: &Element,
    points: &[[f64; 3]],
    scale: [f64; 3],
) -> Parsed<Option<Vec<[Vector3<f64>; 3]>>> {
    let Some(indices) = element.numbers("face")? else { return Ok(None) };
    let corner = |index: &f64| {
        let place = (*index >= 0.0 && index.fract() == 0.0).then_some(*index as usize);
        let point = place.and_then(|place| points.get(place));
        point.copied().map(Vector3::from).ok_or_else(|| {
            element
                .wrong(format!("face: {index:?} is not an index of its {} vertices", points.len()))
        })
    };
    let (three, rest) = indices.as_chunks::<3>();
    if !rest.is_empty() || three.is_empty() {
        return Err(element.wrong("face: three indices per face are needed"));
    }
    let facet = |[a, b, c]: &[f64; 3]| Ok(turned_back([corner(a)?, corner(b)?, corner(c)?], scale));
    three.iter().map(facet).collect::<Result<_, _>>().map(Some)
}
