//! Film of a recorded run, for plots, animations and pages.

use crate::errors::refused;
use crate::recording::PyRecording;
use crate::scene::in_python;
use pyo3::PyResult;
use tumble_film::{Cast, Keys, Role};
use tumble_view::{Fact, Film};

/// Largest number of rows for pictures, which need all rows in memory again.
const MOST_ROWS: usize = 1_000_000;

impl PyRecording {
    /// Frames of all rows, with the looks of the scene.
    pub fn film(&self) -> PyResult<Film> {
        if self.rows.len() > MOST_ROWS {
            return Err(refused(format!("a picture can have at most {MOST_ROWS} rows")));
        }
        let content = &self.content;
        let mut keys = Keys::new();
        let frame = |row| tumble_film::frame(&content.world, row, &mut keys);
        let frames = self.rows.iter().map(frame).collect();
        let roles: Vec<_> = content.model.bodies.iter().map(Role::from).collect();
        let cast = Cast {
            world: &content.world,
            bodies: &roles,
            fixed: &words(&content.fixed),
            joints: &words(&content.joints),
            loads: &content.loads,
            floating: content.contact.is_none(),
        };
        let mut film = tumble_film::film(cast, frames);
        tumble_film::dress(&content.model, &mut film).map_err(in_python)?;
        let seed = content.drawn_seed().map_or(String::new(), |seed| format!("seed {seed}, "));
        film.title = format!("{}, {seed}{}", content.name, content.solver());
        film.facts = vec![Fact::new("scene", content.name.clone())];
        film.facts.extend(content.drawn_seed().map(|seed| Fact::new("seed", seed.to_string())));
        film.facts.push(Fact::new("solver", content.solver()));
        film.facts.push(Fact::new("tumble", env!("CARGO_PKG_VERSION")));
        Ok(film)
    }
}

fn words(names: &[String]) -> Vec<&str> {
    names.iter().map(String::as_str).collect()
}
