//! The files of a fit: what was found as JSON, every toss as CSV, and a scenario with the values.

use super::names;
use super::results::{Mean, OTHER_FACE, Results};
use super::task::Task;
use crate::cli::outcome::Failure;
use crate::cli::output::quoted;
use nalgebra::{DMatrix, Vector3};
use serde::Serialize;
use serde_json::{Value, json};
use std::fmt::Write as _;
use tumble::contact::Plane;
use tumble::fit::neighbourhood::Smoothed;
use tumble::fit::polish::Polish;
use tumble::fit::protocol::Begin;
use tumble::fit::{Constant, Parameter, ParameterValues, Protocol, Toss};
use tumble::scenario::model::Model;
use tumble::scenario::scene::Scene;
use tumble::scenario::written;

/// fit.json.
pub fn json(task: &Task, results: &Results) -> Result<String, Failure> {
    let all = results.values.all().iter();
    let parameters: Vec<_> =
        all.map(|(parameter, _)| self::parameter(task, results, *parameter)).collect();
    let smoothed = results.neighbourhood.as_ref().map(|around| {
        let percent = |s: Smoothed| {
            json!({ "value": 100.0 * s.value, "roughness": 100.0 * s.roughness })
        };
        let degrees = |s: Smoothed| {
            json!({ "value": s.value.to_degrees(), "roughness": s.roughness.to_degrees() })
        };
        json!({
            "points": around.points,
            "position_percent": percent(around.position),
            "rotation_deg": degrees(around.rotation),
            "loss": { "value": around.loss.value, "roughness": around.loss.roughness },
        })
    });
    let folds = results.folds.iter().map(|fold| {
        let kept = fold.kept.iter().map(|&toss| &task.data.tosses[toss].name);
        json!({
            "values": values(task, &fold.found.values),
            "kept_back": kept.collect::<Vec<_>>(),
            "scores_of_kept": mean(Mean::of(&fold.scores)),
            "scores_of_kept_at_start": mean(Mean::of(&fold.scores_at_start)),
            "refused_evaluations": fold.found.refused,
        })
    });
    let folds: Vec<Value> = folds.collect();
    let found = results.found.as_ref();
    let file = json!({
        "tumble_version": env!("CARGO_PKG_VERSION"),
        "scene": task.file,
        "tosses": task.data.tosses.len(),
        "frames": task.data.tosses.iter().map(Toss::count).sum::<usize>(),
        "data_digest": format!("{:016x}", task.data.digest),
        "protocol": protocol(task),
        "loss": task.plan.loss.name(),
        "seed": task.plan.seed,
        "parameters": parameters,
        "scores_at_start": mean(Mean::of(&results.scores_at_start)),
        "scores": mean(Mean::of(&results.scores)),
        "loss_at_start": task.plan.loss.mean(&results.scores_at_start),
        "loss_found": task.plan.loss.mean(&results.scores),
        "smoothed": smoothed,
        "folds": folds,
        "cross_validated": results.kept().map(|scores| mean(Mean::of(&scores))),
        "ensemble": results.ensemble_means().map(|means| json!({
            "members": task.ensemble,
            "all_members": mean(means.all),
            "best_members": mean(means.best),
            "tosses_on_both_the_same_and_another_face": means.divided,
            "median_spread_of_ends_m": means.spread,
        })),
        "polish": polish(results).map(|polish| json!({
            "tried": polish.tried,
            "taken": polish.steps,
            "loss_before": polish.loss_before,
            "last_change_of_bounds": polish.last,
            "slope_over_bounds": polish.slope,
            "steps_without_derivative": polish.blind,
            "steps_of_limited_restitution": polish.limited,
            "covariance": rows(&polish.covariance),
            "ended_by": polish.ended,
        })),
        "evaluations": found.map(|found| found.evaluations),
        "refused_evaluations": found.map(|found| found.refused),
        "steps_of_all_evaluations": results.steps,
        "failed_steps": results.failed,
    });
    let mut text = pretty(&file)?;
    text.push('\n');
    Ok(text)
}

fn protocol(task: &Task) -> Value {
    let Protocol { begin, length, substeps } = &task.protocol;
    let mut object = json!({ "length_m": length, "substeps": substeps });
    if let Begin::AtTouch { height, gravity, lead } = begin {
        object["touch_height_m"] = json!(height);
        object["gravity_m_s2"] = json!(gravity);
        object["lead_frames"] = json!(lead);
    }
    object
}

fn pretty(value: &impl Serialize) -> Result<String, Failure> {
    serde_json::to_string_pretty(value)
        .map_err(|error| Failure::Other(format!("fit.json cannot be written: {error}")))
}

fn mean(mean: Mean) -> Value {
    json!({
        "position_percent": mean.position,
        "rotation_deg": mean.rotation,
        "on_another_face": mean.other_face,
        "largest_residual_m_s": mean.residual,
    })
}

fn values(task: &Task, values: &ParameterValues) -> Value {
    let sought = task.plan.sought.iter().map(|sought| sought.parameter);
    let named = |parameter| (names::name(parameter, &task.scene), json!(values.get(parameter)));
    sought.map(named).collect()
}

/// What Gauss–Newton steps made of the search.
pub fn polish(results: &Results) -> Option<&Polish> {
    results.found.as_ref()?.polish.as_ref()
}

/// A matrix as its rows.
fn rows(matrix: &DMatrix<f64>) -> Vec<Vec<f64>> {
    matrix.row_iter().map(|row| row.iter().copied().collect()).collect()
}

fn parameter(task: &Task, results: &Results, parameter: Parameter) -> Value {
    let place = task.plan.sought.iter().position(|sought| sought.parameter == parameter);
    let value = results.values.get(parameter);
    let mut object = json!({
        "name": names::name(parameter, &task.scene),
        "unit": names::unit_of(parameter),
        "sought": place.is_some(),
        "start": task.start.get(parameter),
        "value": value,
    });
    if let Some(place) = place {
        let bounds = task.plan.sought[place].bounds;
        object["bounds"] = json!(bounds);
        object["on_bound"] = json!(bounds.contains(&value));
        if let Some(polish) = polish(results) {
            object["standard_error"] = json!(polish.covariance[(place, place)].sqrt());
            object["shown_over_bounds"] = json!(polish.shown.get(place));
        }
        if let Some(around) = &results.neighbourhood {
            let interval = &around.intervals[place];
            let [q025, q16, q50, q84, q975] = interval.quantiles;
            object["bootstrap"] = json!({
                "looked_at": interval.looked,
                "q025": q025, "q16": q16, "q50": q50, "q84": q84, "q975": q975,
                "on_border": interval.on_border,
            });
        }
    }
    object
}

/// tosses.csv: the errors of every toss.
pub fn table(task: &Task, results: &Results) -> Result<String, Failure> {
    let mut text = String::from(
        "toss_id,frames,start_frame,position_percent,rotation_deg,end_rotation_deg,other_face,\
         start_values_position_percent,start_values_rotation_deg,fold,kept_position_percent,\
         kept_rotation_deg,steps,failed,largest_residual_m_s\n",
    );
    let fold_of = |toss: usize| {
        results.folds.iter().enumerate().find_map(|(number, fold)| {
            let place = fold.kept.binary_search(&toss).ok()?;
            Some((number, &fold.scores[place]))
        })
    };
    for (index, toss) in task.data.tosses.iter().enumerate() {
        let (score, before) = (&results.scores[index], &results.scores_at_start[index]);
        let kept = match fold_of(index) {
            Some((fold, kept)) => {
                format!("{fold},{},{}", 100.0 * kept.position, kept.rotation.to_degrees())
            }
            None => ",,".to_owned(),
        };
        let _ = writeln!(
            text,
            "{},{},{},{},{},{},{},{},{},{kept},{},{},{}",
            quoted(&toss.name),
            toss.count(),
            task.protocol.start_frame(toss),
            100.0 * score.position,
            score.rotation.to_degrees(),
            score.end.to_degrees(),
            u8::from(score.end > OTHER_FACE),
            100.0 * before.position,
            before.rotation.to_degrees(),
            score.steps,
            score.failed,
            score.residual,
        );
    }
    Ok(text)
}

/// fitted.toml: the scene with the found values, from the start of the first recording.
pub fn scenario(task: &Task, results: &Results) -> Result<String, Failure> {
    match task.model.ground() {
        Some(ground) => Ok(thrown(task, results, ground)),
        None => several(task, results),
    }
}

/// The scene of several bodies with the found values.
fn several(task: &Task, results: &Results) -> Result<String, Failure> {
    let (scene, toss) = (&task.scene, &task.data.tosses[0]);
    let Some(model) = scene.model() else { return Err(Failure::needed("bodies")) };
    let substeps = task.protocol.substeps;
    let dt = 1.0 / (toss.rate * substeps as f64);
    let world = task.model.world(&results.values, dt)?;
    let mut model = Model { dt, ..model.clone() }.with_constants_of(&world);
    let start_index = (toss.begin / dt).round() as u64;
    let begin = start_index as f64 * dt;
    let mut there = world;
    there.follow(&scene.courses, begin);
    let begun = tumble::fit::Model::begun(&there, &task.protocol.starts(toss))?;
    model.start_at(begun.states(), begin)?;
    let rows = ((toss.count() - 1) * substeps) as u64 + 1;
    let fitted = Scene { name: "fitted".to_owned(), rows, start_index, ..scene.clone() };
    let text = written::text(&fitted.with_model(model)?)?;
    let name = one_line(&toss.name);
    Ok(format!(
        "# Found by `tumble fit`: what fit.json says, as a scenario. It starts like {name} of the data,\n# and each \
         {substeps} steps are one frame.\n\n{text}"
    ))
}

/// A name without what would end a line.
fn one_line(name: &str) -> String {
    name.chars().filter(|letter| !letter.is_control()).collect()
}

/// The scene of one body that is thrown on a ground with the found values.
fn thrown(task: &Task, results: &Results, ground: &Plane) -> String {
    let (model, values, toss) = (&task.model, &results.values, &task.data.tosses[0]);
    let substeps = task.protocol.substeps;
    let frames = toss.frames.len() - task.protocol.start_frame(toss);
    let start = task.protocol.start(toss);
    let gravity = model.gravity() * (values.get(Constant::Gravity) / model.gravity().norm());
    let corners: Vec<_> = model.corners(values).iter().map(list).collect();
    let inertia = model.inertia(values);
    let rows: Vec<_> = (0..3).map(|row| list(&inertia.row(row).transpose())).collect();
    let radius = values.get(Constant::Radius);
    let shape = match radius {
        0.0 => format!("points = [\n  {},\n]\n", corners.join(",\n  ")),
        _ => format!("hull = [\n  {},\n]\nradius = {radius:?}\n", corners.join(",\n  ")),
    };
    format!(
        "# Found by `tumble fit`: what fit.json says, as a scenario. It starts like toss {name} of \
         the data,\n# and each {substeps} steps are one frame.\n\n\
         name = \"fitted\"\nsteps = {steps}\ntime_step = {h:?}\ngravity = {gravity}\n\n\
         [ground]\nfriction = {friction:?}\nrestitution = {restitution:?}\nnormal = {normal}\n\
         offset = {offset:?}\n\n\
         [[bodies]]\nname = \"body\"\n{shape}mass = {mass:?}\ninertia = [{rows}]\n\
         position = {position}\nattitude = {attitude:?}\nvelocity = {velocity}\nspin = {spin}\n",
        name = one_line(&toss.name),
        steps = (frames - 1) * substeps + 1,
        h = 1.0 / (toss.rate * substeps as f64),
        gravity = list(&gravity),
        friction = values.get(Constant::Friction),
        restitution = values.get(Constant::Restitution),
        normal = list(ground.normal()),
        offset = ground.offset() + values.get(Constant::Ground),
        mass = model.mass(),
        rows = rows.join(", "),
        position = list(&start.position),
        attitude = <[f64; 4]>::from(start.attitude),
        velocity = list(&start.velocity),
        spin = list(&start.spin),
    )
}

fn list(vector: &Vector3<f64>) -> String {
    format!("{:?}", <[f64; 3]>::from(*vector))
}
