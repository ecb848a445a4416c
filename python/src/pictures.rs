//! Film of a recorded run, for plots, animations and pages.

use crate::arrays::{Array, shaped};
use crate::errors::refused;
use crate::recording::PyRecording;
use crate::scene::in_python;
use pyo3::prelude::*;
use tumble_view::{Fact, Film, Triangles};

/// Largest number of rows for pictures, which need all rows in memory again.
const MOST_ROWS: usize = 1_000_000;

impl PyRecording {
    /// Frames of all rows, with the looks of the scene.
    pub fn film(&self) -> PyResult<Film> {
        if self.rows.len() > MOST_ROWS {
            return Err(refused(format!("a picture can have at most {MOST_ROWS} rows")));
        }
        let content = &self.content;
        let floating = content.contact.is_none();
        let film = Film::new(&content.world, &content.document, floating, self.rows.clone());
        let mut film = film.map_err(in_python)?;
        let seed = content.drawn_seed().map_or(String::new(), |seed| format!("seed {seed}, "));
        film.title.clone_from(&content.name);
        film.variant = format!("{seed}{}", content.solver());
        film.facts = vec![Fact::new("scene", content.name.clone())];
        film.facts.extend(content.drawn_seed().map(|seed| Fact::new("seed", seed.to_string())));
        film.facts.push(Fact::new("solver", content.solver()));
        film.facts.push(Fact::new("tumble", env!("CARGO_PKG_VERSION")));
        Ok(film)
    }
}

/// Mesh for another viewer: vertices (V, 3), triangles (F, 3), and red, green and blue.
pub type Surface<'py> = (Array<'py>, Array<'py, u32>, (u8, u8, u8));

/// Meshes as arrays.
pub fn surfaces<'py>(
    py: Python<'py>,
    objects: Vec<Vec<Triangles>>,
) -> PyResult<Vec<Vec<Surface<'py>>>> {
    let surface = |mesh: Triangles| {
        let Triangles { vertices, triangles, colour: [red, green, blue] } = mesh;
        let shapes = [[vertices.len(), 3], [triangles.len(), 3]];
        let numbers = vertices.iter().flat_map(|vertex| vertex.iter().copied()).collect();
        let corners = triangles.into_iter().flatten().map(|corner| corner as u32).collect();
        let vertices = shaped(py, numbers, &shapes[0])?;
        Ok((vertices, shaped(py, corners, &shapes[1])?, (red, green, blue)))
    };
    let of_object = |meshes: Vec<Triangles>| meshes.into_iter().map(surface).collect();
    objects.into_iter().map(of_object).collect()
}
