//! `tumble convert` for meshes: a scene of one body of convex pieces.

use super::args::{ConvertArgs, MeshArgs};
use super::input;
use super::outcome::{Failure, refuse_flags};
use nalgebra::Vector3;
use std::path::Path;
use tumble_core::geometry::mesh::Mesh;
use tumble_decompose::DecompositionSettings;
use tumble_model::shown;
use tumble_scene::LARGEST_PART;
use tumble_scene::scene::Scene;
use tumble_scene::written::quoted;

/// Density without `--density` (kg/m³): that of water.
const USUAL_DENSITY: f64 = 1000.0;

/// Question about the unit of a large part.
const MILLIMETRES: &str = "is the file in millimetres? Then add --scale 0.001";

impl MeshArgs {
    /// Rejects these flags for a file that is not a mesh.
    pub fn refuse(&self) -> Result<(), Failure> {
        let flags = [
            ("pieces", self.pieces.is_some()),
            ("resolution", self.resolution.is_some()),
            ("concavity", self.concavity.is_some()),
            ("scale", self.scale.is_some()),
            ("density", self.density.is_some()),
        ];
        refuse_flags("anything but a mesh file", &flags)
    }

    fn settings(&self) -> Result<DecompositionSettings, Failure> {
        let mut settings = DecompositionSettings::default();
        settings.pieces = self.pieces.unwrap_or(settings.pieces);
        settings.resolution = self.resolution.unwrap_or(settings.resolution);
        settings.concavity = self.concavity.unwrap_or(settings.concavity);
        settings.check().map_err(|error| Failure::Input(format!("--{error}")))?;
        Ok(settings)
    }
}

/// True if the file is a mesh by its extension.
pub fn is_mesh(path: &Path) -> bool {
    let end = path.extension().map(|end| end.to_ascii_lowercase());
    end.is_some_and(|end| end == "obj" || end == "stl")
}

/// Scene in which the mesh lies on level ground, and a report on its pieces.
pub fn scene(args: &ConvertArgs) -> Result<(Scene, String), Failure> {
    let settings = args.mesh.settings()?;
    let scale = args.mesh.scale.unwrap_or(1.0);
    let mesh = tumble_scene::read_mesh(&args.file, scale, &input::bytes)?;
    let lowest = mesh.vertices().iter().map(|vertex| vertex.z).fold(f64::INFINITY, f64::min);
    let name = args.file.file_name().unwrap_or_default().to_string_lossy();
    let text = format!(
        "[ground]\nfriction = 0.5\n[[bodies]]\nmesh = {}\nscale = {scale:?}\ndensity = {:?}\nposition = [0, 0, {:?}]\n\
         decompose = {{ pieces = {}, resolution = {}, concavity = {:?} }}\n",
        quoted(&name),
        args.mesh.density.unwrap_or(USUAL_DENSITY),
        0.0 - lowest,
        settings.pieces,
        settings.resolution,
        settings.concavity,
    );
    let scene = Scene::parse_with(&text, &args.file, &[], &args.robot, &input::bytes);
    let scene = scene.map_err(|failure| match failure.as_flag() {
        Failure::Input(why)
            if why.contains(".mass is ") && sides_of(&mesh).max() > LARGEST_PART =>
        {
            Failure::Input(format!("{why}; {MILLIMETRES}"))
        }
        other => other,
    })?;
    let report = report(&scene, &mesh, &args.file)?;
    Ok((scene, report))
}

/// Size, mass and pieces of the mesh.
fn report(scene: &Scene, mesh: &Mesh, path: &Path) -> Result<String, Failure> {
    let mut pieces = 0;
    let mut corners = 0;
    for piece in scene.world.bodies().iter().flat_map(|body| body.pieces()) {
        pieces += 1;
        corners += piece.core().vertices().len();
    }
    let sides = sides_of(mesh);
    let [x, y, z] = [sides.x, sides.y, sides.z].map(shown::rounded);
    let mut text = format!(
        "{}: {x} × {y} × {z} m, {} m³, {} kg; {pieces} pieces with {corners} corners\n",
        shown::path(path),
        shown::rounded(mesh.volume()),
        shown::rounded(scene.world.bodies()[0].mass()),
    );
    if sides.max() > LARGEST_PART {
        text += MILLIMETRES;
        text.push('\n');
    }
    Ok(text)
}

/// Lengths of a mesh along the axes (m).
fn sides_of(mesh: &Mesh) -> Vector3<f64> {
    let fold = |fold: fn(&Vector3<f64>, &Vector3<f64>) -> Vector3<f64>| {
        mesh.vertices().iter().copied().reduce(|a, b| fold(&a, &b)).unwrap_or_default()
    };
    fold(Vector3::sup) - fold(Vector3::inf)
}
