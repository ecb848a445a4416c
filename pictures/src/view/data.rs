//! Everything that the page knows, as JSON.

use super::curves::{Plot, plots};
use super::facts::facts;
use super::poses::Poses;
use crate::film::{Fact, Film, Status};
use crate::forces::Scale;
use crate::plot::Sheet;
use crate::shape::Shape;
use serde::Serialize;

#[derive(Serialize)]
pub struct Page {
    version: String,
    statuses: Vec<&'static str>,
    runs: Vec<RunData>,
    sheets: Vec<SheetData>,
}

#[derive(Serialize)]
struct RunData {
    title: String,
    facts: Vec<Fact>,
    rows: usize,
    /// h, s.
    step: f64,
    /// How many steps ended with each status.
    counts: Vec<(&'static str, usize)>,
    worst: Option<Worst>,
    body: Body,
    arrows: Arrows,
    ground: Option<Ground>,
    frames: Poses,
}

/// The step with the largest residual.
#[derive(Serialize)]
struct Worst {
    row: usize,
    residual: f64,
}

#[derive(Serialize)]
struct Body {
    /// Whether the points are the corners of a box, x fastest.
    is_box: bool,
    /// Body frame, m.
    points: Vec<[f64; 3]>,
}

/// How long arrows are; see [`Scale`].
#[derive(Serialize)]
struct Arrows {
    weight: f64,
    longest: f64,
}

/// The plane n · x = d, world.
#[derive(Serialize)]
struct Ground {
    normal: [f64; 3],
    offset: f64,
}

#[derive(Serialize)]
struct SheetData {
    name: &'static str,
    plots: Vec<Plot>,
}

impl Page {
    pub fn of(version: &str, films: &[&Film]) -> Self {
        let mut sheets: Vec<_> = [Sheet::Motion, Sheet::Energy]
            .map(|sheet| SheetData { name: sheet.name(), plots: plots(films, sheet.panels()) })
            .into();
        if let [a, b] = films {
            let plots = vec![super::distance::plot(a, b)];
            sheets.insert(0, SheetData { name: "Difference", plots });
        }
        Self {
            version: version.to_owned(),
            statuses: Status::ALL.map(Status::name).into(),
            runs: films.iter().map(|film| RunData::of(film)).collect(),
            sheets,
        }
    }
}

impl RunData {
    fn of(film: &Film) -> Self {
        let counts = Status::ALL[1..].iter().map(|status| {
            (status.name(), film.steps().iter().filter(|step| step.status == *status).count())
        });
        let points = &film.body().points;
        let scale = Scale::of(film);
        let ground =
            film.ground.map(|plane| Ground { normal: plane.normal.into(), offset: plane.offset });
        Self {
            title: film.title.clone(),
            facts: facts(film),
            rows: film.frames.len(),
            step: film.time_step,
            counts: counts.collect(),
            worst: worst(film),
            body: Body {
                is_box: Shape::of(points) == Shape::Box,
                points: points.iter().map(|&point| point.into()).collect(),
            },
            arrows: Arrows { weight: scale.weight, longest: scale.longest },
            ground,
            frames: Poses::of(film, &scale),
        }
    }
}

fn worst(film: &Film) -> Option<Worst> {
    let residuals = film.steps().iter().map(|step| step.residual).enumerate();
    // Of equal ones the first.
    residuals
        .reduce(|worst, other| if other.1 > worst.1 { other } else { worst })
        .map(|(row, residual)| Worst { row, residual })
}
