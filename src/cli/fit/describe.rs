//! What a fit says on the terminal.

use super::files::polish;
use super::names;
use super::results::{Mean, Results};
use super::task::Task;
use std::fmt::Write as _;
use tumble::fit::Toss;

/// The summary.
pub fn describe(task: &Task, results: &Results) -> String {
    let frames: usize = task.data.tosses.iter().map(Toss::count).sum();
    let mut text = format!(
        "{}, {frames} frames, from {} file{}\n",
        task.recordings(),
        task.data.files(),
        if task.data.files() == 1 { "" } else { "s" }
    );
    for (place, sought) in task.plan.sought.iter().enumerate() {
        let parameter = sought.parameter;
        let value = results.values.get(parameter);
        let _ = write!(
            text,
            "  {:<12} {:<9} from {}",
            names::name(parameter, &task.scene),
            short(value),
            short(task.start.get(parameter))
        );
        let unit = names::unit_of(parameter);
        if !unit.is_empty() {
            let _ = write!(text, " {unit}");
        }
        if let Some(polish) = polish(results) {
            let error = polish.covariance[(place, place)].sqrt();
            if !polish.shows(place) {
                text.push_str(", which the recordings do not show");
            } else if error.is_finite() {
                let _ = write!(text, " ± {} by its slope", short(error));
            }
        }
        if let Some(around) = &results.neighbourhood {
            let interval = &around.intervals[place];
            let [low, .., high] = interval.quantiles.map(short);
            let _ = write!(text, ", 95 % of the bootstrap in {low} to {high}");
            if interval.on_border > 0.05 {
                let percent = 100.0 * interval.on_border;
                let _ = write!(text, " ({percent:.0} % on the border of what was looked at)");
            }
        }
        if sought.bounds.contains(&value) {
            text.push_str(", on its bound");
        }
        text.push('\n');
    }
    let mut line = |name: &str, mean: Mean, of: usize| {
        let _ = writeln!(
            text,
            "  {name:<12} position {:.2} %, rotation {:.2}°, {} of {of} {}",
            mean.position,
            mean.rotation,
            mean.other_face,
            task.ended_elsewhere()
        );
    };
    let count = task.data.tosses.len();
    if task.is_search() {
        line("start", Mean::of(&results.scores_at_start), count);
    }
    line(if task.is_search() { "found" } else { "scored" }, Mean::of(&results.scores), count);
    if let Some(kept) = results.kept() {
        line("kept back", Mean::of(&kept), count);
    }
    if let Some(around) = &results.neighbourhood {
        let _ = writeln!(
            text,
            "  smoothed     position {:.2} ± {:.2} %, rotation {:.2} ± {:.2}°, over {} neighbours",
            100.0 * around.position.value,
            100.0 * around.position.roughness,
            around.rotation.value.to_degrees(),
            around.rotation.roughness.to_degrees(),
            around.points
        );
    }
    if let Some(means) = results.ensemble_means() {
        let _ = writeln!(
            text,
            "  ensemble     of {} starts within the noise: position {:.2} %, rotation {:.2}°; the \
             best of each toss {:.2} %, {:.2}°; {} tosses end on the same face and another",
            task.ensemble,
            means.all.position,
            means.all.rotation,
            means.best.position,
            means.best.rotation,
            means.divided
        );
    }
    if let Some(found) = &results.found {
        let _ = writeln!(
            text,
            "  search       {} evaluations, {} refused",
            found.evaluations, found.refused
        );
    }
    if let Some(polish) = polish(results) {
        let _ = writeln!(
            text,
            "  polish       {} of {} Gauss-Newton steps taken, loss {:.6} from {:.6}; {} simulated steps \
             without a derivative, {} with a part of their restitution, which it takes for a constant",
            polish.steps,
            polish.tried,
            task.plan.loss.mean(&results.scores),
            polish.loss_before,
            polish.blind,
            polish.limited
        );
    }
    let _ = writeln!(
        text,
        "  steps        {}, failed {}, largest residual {:.1e} m/s",
        results.steps,
        results.failed,
        Mean::of(&results.scores).residual
    );
    text
}

/// Four digits.
pub fn short(value: f64) -> String {
    if value == 0.0 || (1e-4..1e6).contains(&value.abs()) {
        let size = if value == 0.0 { 0 } else { value.abs().log10().floor() as i32 };
        let digits = (3 - size).clamp(0, 8) as usize;
        format!("{value:.digits$}")
    } else {
        format!("{value:.3e}")
    }
}
