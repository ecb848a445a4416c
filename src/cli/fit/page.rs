//! The report page of a fit: what `tumble_pictures::fit` draws, from what was found.

use super::describe::short;
use super::files;
use super::names;
use super::results::{Mean, OTHER_FACE, Results};
use super::task::Task;
use tumble::fit::protocol::turn_between;
use tumble::fit::{Toss, TossScore};
use tumble::mechanics::State;
use tumble_pictures::fit::{self, Means, Motion, Parameter, Report};

/// Tosses that are shown of each kind.
const SHOWN: usize = 6;

/// fit.html.
pub fn page(task: &Task, results: &Results) -> String {
    let tosses = &task.data.tosses;
    let mut means = Vec::new();
    if task.is_search() {
        means.push(row("start", &results.scores_at_start));
    }
    means.push(row(if task.is_search() { "found" } else { "as given" }, &results.scores));
    if let Some(kept) = results.kept() {
        let name = format!("kept back, in {} folds, each fitted without them", results.folds.len());
        means.push(row(&name, &kept));
    }
    // From the least loss to the largest.
    let mut order: Vec<usize> = (0..tosses.len()).collect();
    let loss = |toss: usize| task.plan.loss.of(&results.scores[toss]);
    order.sort_by(|a, b| loss(*a).total_cmp(&loss(*b)));
    let usual = (0..SHOWN.min(tosses.len())).map(|k| {
        let shown = SHOWN.min(tosses.len());
        order[(2 * k + 1) * order.len() / (2 * shown)]
    });
    let worst = order.iter().rev().take(SHOWN).copied();
    let toss = |k: usize| {
        let (before, score) = (&results.scores_at_start[k], &results.scores[k]);
        fit::Toss {
            position: [before, score].map(|score| 100.0 * score.position),
            rotation: [before, score].map(|score| score.rotation.to_degrees()),
            other_face: score.end > OTHER_FACE,
        }
    };
    fit::page(&Report {
        program: format!("tumble {}", env!("CARGO_PKG_VERSION")),
        scene: task.file.clone(),
        is_of_several: !task.model.is_of_tosses(),
        facts: facts(task, results),
        parameters: parameters(task, results),
        means,
        tosses: (0..tosses.len()).map(toss).collect(),
        progress: results.found.as_ref().map_or_else(Vec::new, |found| found.progress.clone()),
        usual: usual.map(|k| motion(task, results, k)).collect(),
        worst: worst.map(|k| motion(task, results, k)).collect(),
        steps: results.steps,
        failed: results.failed,
    })
}

fn row(name: &str, scores: &[TossScore]) -> Means {
    let mean = Mean::of(scores);
    Means {
        name: name.to_owned(),
        position: mean.position,
        rotation: mean.rotation,
        other_face: [mean.other_face, scores.len()],
    }
}

fn facts(task: &Task, results: &Results) -> Vec<String> {
    let frames: usize = task.data.tosses.iter().map(Toss::count).sum();
    let mut facts = vec![
        format!("{}, {frames} frames", task.recordings()),
        format!("{} substeps a frame", task.protocol.substeps),
    ];
    if let Some(found) = &results.found {
        facts.push(format!(
            "{} loss, {} evaluations in {} rounds, {} of them refused",
            task.plan.loss.name(),
            found.evaluations,
            task.plan.rounds,
            found.refused
        ));
    }
    if let Some(around) = &results.neighbourhood {
        facts.push(format!(
            "With chance averaged away over {} neighbours: distance {:.2} ± {:.2} %, angle {:.2} ± \
             {:.2}°",
            around.points,
            100.0 * around.position.value,
            100.0 * around.position.roughness,
            around.rotation.value.to_degrees(),
            around.rotation.roughness.to_degrees()
        ));
    }
    if let Some(means) = results.ensemble_means() {
        facts.push(format!(
            "From {} starts within the noise of the recordings: distance {:.2} %, angle {:.2}°; the \
             best of each toss {:.2} %, {:.2}°; {} tosses end both on the recorded face and on \
             another",
            task.ensemble,
            means.all.position,
            means.all.rotation,
            means.best.position,
            means.best.rotation,
            means.divided
        ));
    }
    facts
}

fn parameters(task: &Task, results: &Results) -> Vec<Parameter> {
    let around = results.neighbourhood.as_ref();
    let sought = task.plan.sought.iter().enumerate();
    let one = sought.map(|(place, sought)| {
        let parameter = sought.parameter;
        let value = results.values.get(parameter);
        let interval = around.map(|around| around.intervals[place]);
        let mut notes = Vec::new();
        if let Some(polish) = files::polish(results) {
            let error = polish.covariance[(place, place)].sqrt();
            if !polish.shows(place) {
                notes.push("the recordings do not show it".to_owned());
            } else if error.is_finite() {
                notes.push(format!("± {} by its slope", short(error)));
            }
        }
        if sought.bounds.contains(&value) {
            notes.push("on its bound".to_owned());
        }
        if let Some(interval) = interval.filter(|interval| interval.on_border > 0.05) {
            notes.push(format!(
                "{:.0} % of the samples end on the border of what was looked at: hardly determined",
                100.0 * interval.on_border
            ));
        }
        let unit = names::unit_of(parameter);
        let name = names::name(parameter, &task.scene);
        Parameter {
            name: if unit.is_empty() { name } else { format!("{name}, {unit}") },
            start: task.start.get(parameter),
            value,
            interval: interval.map(|i| [i.quantiles[0], i.quantiles[4]]),
            note: notes.join("; "),
        }
    });
    one.collect()
}

/// The states of one body of a toss, recorded from the start of the simulation on, and simulated.
type Beside<'a> = (Vec<&'a State>, Vec<&'a State>);

/// The body of a toss whose simulation is farthest off, and its states.
fn farthest<'a>(task: &'a Task, results: &'a Results, index: usize) -> (usize, Beside<'a>) {
    let (toss, simulated) = (&task.data.tosses[index], &results.motions[index]);
    let first = task.protocol.start_frame(toss);
    let of = |body: usize| -> Beside<'a> {
        let recorded = (first..toss.count()).map(|frame| &toss.frame(frame)[body]);
        (recorded.collect(), simulated.iter().skip(body).step_by(toss.bodies).collect())
    };
    let off = |(recorded, simulated): &Beside<'_>| {
        let pairs = recorded.iter().zip(simulated);
        pairs.map(|(a, b)| (a.position - b.position).norm()).sum::<f64>()
    };
    let all = (0..toss.bodies).map(|body| (body, of(body)));
    let farther = |most: (usize, Beside<'a>), other: (usize, Beside<'a>)| {
        if off(&other.1) > off(&most.1) { other } else { most }
    };
    all.reduce(farther).unwrap_or_default()
}

/// A toss beside its simulation, in numbers and words.
fn motion(task: &Task, results: &Results, index: usize) -> Motion {
    let toss = &task.data.tosses[index];
    let (body, (_, simulated)) = farthest(task, results, index);
    let first = task.protocol.start_frame(toss);
    let nothing = [f64::NAN; 3];
    let at = |frame: usize| frame.checked_sub(first).map(|k| simulated[k]);
    let recorded = |frame: usize| &toss.frame(frame)[body];
    let angle = |frame: usize| {
        at(frame).map_or(f64::NAN, |state| {
            turn_between(&recorded(frame).attitude, &state.attitude).norm().to_degrees()
        })
    };
    let frames = 0..toss.count();
    let name = match toss.bodies {
        1 => toss.name.clone(),
        _ => format!("{}, {}", toss.name, task.scene.bodies[body]),
    };
    Motion {
        name,
        words: words(task, results, index),
        times: frames.clone().map(|frame| frame as f64 / toss.rate).collect(),
        recorded: frames.clone().map(|frame| recorded(frame).position.into()).collect(),
        simulated: frames
            .clone()
            .map(|frame| at(frame).map_or(nothing, |state| state.position.into()))
            .collect(),
        angle: frames.map(angle).collect(),
    }
}

/// Apart is what is farther than this, in parts of the length, or 10°.
const APART: f64 = 0.1;

/// How a toss goes wrong.
fn words(task: &Task, results: &Results, index: usize) -> String {
    let toss = &task.data.tosses[index];
    let score = &results.scores[index];
    let (_, (recorded, simulated)) = farthest(task, results, index);
    let pairs = || recorded.iter().zip(&simulated);
    let mut words = format!(
        "Mean distance {:.1} %, mean angle {:.1}°. ",
        100.0 * score.position,
        score.rotation.to_degrees()
    );
    let apart = pairs().position(|(recorded, state)| {
        (recorded.position - state.position).norm() > APART * task.protocol.length
            || turn_between(&recorded.attitude, &state.attitude).norm() > 10f64.to_radians()
    });
    match apart {
        Some(frame) => {
            words += &format!(
                "The motions part (10 % or 10°) {:.0} ms after the start of the simulation. ",
                1000.0 * frame as f64 / toss.rate
            );
        }
        None => words += "The motions never part by 10 % or 10°. ",
    }
    if let (Some(begin), Some(end), Some(state)) =
        (recorded.first(), recorded.last(), simulated.last())
    {
        let way = (end.position - begin.position).xy();
        let off = (state.position - end.position).xy();
        let along = off.dot(&way) / way.norm().max(f64::MIN_POSITIVE);
        let aside = (off.norm_squared() - along * along).max(0.0).sqrt();
        let far = if along > 0.0 { "too far" } else { "too short" };
        words += &format!(
            "In the end it is {:.0} mm {far} on a way of {:.0} mm, {:.0} mm to the side, and turned by \
             {:.0}°",
            1000.0 * along.abs(),
            1000.0 * way.norm(),
            1000.0 * aside,
            turn_between(&end.attitude, &state.attitude).norm().to_degrees()
        );
        let is_elsewhere = task.model.is_of_tosses() && score.end > OTHER_FACE;
        words += if is_elsewhere { ": on another face." } else { "." };
    }
    words
}
