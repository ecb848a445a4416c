//! Everything that the page knows, as JSON.

use super::Run;
use super::curves::{Plot, plots};
use super::facts::{Fact, facts};
use super::frames::Frames;
use crate::pictures::Film;
use crate::pictures::animation::{Scale, Shape, has_ground};
use crate::pictures::plot::{Sheet, steps};
use serde::Serialize;
use tumble::solver::StepStatus;

/// The statuses in the order of the page's numbers for them: a later one of several is the
/// more conspicuous.
pub const STATUSES: [StepStatus; 6] = [
    StepStatus::End,
    StepStatus::Free,
    StepStatus::Converged,
    StepStatus::Retried,
    StepStatus::Fallback,
    StepStatus::Failed,
];

#[derive(Serialize)]
pub struct Page {
    version: &'static str,
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
    frames: Frames,
}

/// The step with the largest certificate.
#[derive(Serialize)]
struct Worst {
    row: usize,
    certificate: f64,
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
    pub fn of(runs: &[Run<'_>]) -> Self {
        let films: Vec<&Film> = runs.iter().map(|run| run.film).collect();
        let mut sheets: Vec<_> = [Sheet::Motion, Sheet::Energy]
            .map(|sheet| SheetData { name: sheet.name(), plots: plots(&films, sheet.panels()) })
            .into();
        if let [a, b] = films[..] {
            let plots = vec![super::distance::plot(a, b)];
            sheets.insert(0, SheetData { name: "Difference", plots });
        }
        Self {
            version: env!("CARGO_PKG_VERSION"),
            statuses: STATUSES.map(StepStatus::name).into(),
            runs: runs.iter().map(RunData::of).collect(),
            sheets,
        }
    }
}

impl RunData {
    fn of(run: &Run<'_>) -> Self {
        let film = run.film;
        let counts = STATUSES[1..].iter().map(|status| {
            (status.name(), steps(film).iter().filter(|row| row.status == *status).count())
        });
        let points: Vec<_> =
            film.model.body().contact_points().iter().map(|point| point.position).collect();
        let scale = Scale::of(film);
        let lowest = (0..film.rows.len()).map(|k| film.model.lowest_height(&film.ground_state(k)));
        let plane = film.model.plane();
        let ground = Ground { normal: (*plane.normal()).into(), offset: plane.offset() };
        let has_ground = has_ground(film, lowest.fold(f64::INFINITY, f64::min));
        Self {
            title: film.title.clone(),
            facts: facts(run),
            rows: film.rows.len(),
            step: film.model.time_step(),
            counts: counts.collect(),
            worst: worst(film),
            body: Body {
                is_box: Shape::of(&points) == Shape::Box,
                points: points.iter().map(|&point| point.into()).collect(),
            },
            arrows: Arrows { weight: scale.weight(), longest: scale.longest() },
            ground: has_ground.then_some(ground),
            frames: Frames::of(film, &scale),
        }
    }
}

fn worst(film: &Film) -> Option<Worst> {
    let certificates = steps(film).iter().map(|row| row.certificate).enumerate();
    // Of equal ones the first.
    certificates
        .reduce(|worst, other| if other.1 > worst.1 { other } else { worst })
        .map(|(row, certificate)| Worst { row, certificate })
}
