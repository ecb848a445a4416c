//! `tumble stands`: whether a scene can stand, by how much, and where it is weak.

use super::args::StandsArgs;
use super::outcome::{Failure, Outcome, refuse_flags};
use super::{output, scene};
use std::fmt::Write as _;
use tumble_model::shown;
use tumble_scene::overrides::FieldOverride;
use tumble_scene::scene::Scene;
use tumble_scene::statics::{self, FieldSlope, LimitReport, PairSlope, Report};

/// Number of pairs and bodies that a list shows.
const MOST_NAMED: usize = 5;
/// Derivative that is not worth a line, as a fraction of the largest.
const NEGLIGIBLE: f64 = 1e-6;

/// Judges the scene and prints the answer.
pub fn run(args: &StandsArgs) -> Result<Outcome, Failure> {
    let asked = &args.asked;
    refuse_flags("neither --push nor --mass", &[("at", asked.has_idle_point())])?;
    let scene = scene::from_args(&args.setup)?;
    let with = |field: FieldOverride| -> Result<Scene, Failure> {
        scene::from_fields(&args.setup, &[field])
    };
    let report = statics::answer(&scene, &asked.question(), &with).map_err(Failure::as_flag)?;
    if args.json {
        output::say(&(report.text()? + "\n"))?;
    } else {
        output::say(&described(&report))?;
    }
    Ok(if report.is_certain() { Outcome::Done } else { Outcome::Unconverged })
}

/// Answer as text.
fn described(report: &Report) -> String {
    let name = shown::line(&report.name);
    let mut text = match report.verdict {
        "equilibrium" => format!("{name} can stand: forces balance all bodies\n"),
        "none" => {
            format!("{name} cannot stand: no forces in the friction cones balance all bodies\n")
        }
        _ => format!("{name}: undecided, neither forces nor a mechanism were found\n"),
    };
    let contacts = report.contacts.len();
    let _ = writeln!(text, "  bodies       {}, {contacts} contacts", report.bodies);
    if let Some([low, high]) = report.friction {
        let _ = writeln!(text, "  friction     the worst of {low} to {high}");
    }
    if let Some(check) = &report.force_check {
        let _ = writeln!(
            text,
            "  forces       imbalance {:.1e} N of {} N, smallest cone margin {} N",
            check.imbalance,
            shown::rounded(check.loads),
            shown::rounded(check.cone_margin)
        );
    }
    if let Some(check) = &report.mechanism_check {
        let _ = writeln!(
            text,
            "  mechanism    power of the loads {} W, violation {:.1e} m/s, largest speed 1 m/s",
            shown::rounded(check.power),
            check.violation
        );
        for line in fastest(report) {
            text += &line;
        }
    }
    if let Some(step) = &report.simulator {
        let does = if step.moves { "moves" } else { "stays" };
        let _ = writeln!(
            text,
            "  simulator    {does}: {:.1e} m/s after a step from rest, {}",
            step.speed, step.status
        );
    }
    if let Some(limit) = &report.limit {
        text += &limit_text(limit);
    }
    if let Some(least) = &report.least_friction {
        let _ = match (least.result, least.factor, least.lower) {
            ("factor", Some(factor), Some(lower)) => writeln!(
                text,
                "  friction     at least {} times the scene's; {} is too little",
                shown::number(factor),
                shown::number(lower)
            ),
            ("frictionless", ..) => writeln!(text, "  friction     none is needed"),
            ("never", ..) => writeln!(text, "  friction     1000 times the scene's is too little"),
            _ => writeln!(text, "  friction     undecided"),
        };
    }
    text
}

/// Fastest bodies of the mechanism, a line each.
fn fastest(report: &Report) -> Vec<String> {
    let mut bodies: Vec<_> = report.mechanism.iter().collect();
    let square = |v: &[f64; 3]| v.iter().map(|x| x * x).sum::<f64>();
    bodies.sort_by(|a, b| square(&b.velocity).total_cmp(&square(&a.velocity)));
    let line = |motion: &&statics::BodyMotion| {
        let [x, y, z] = motion.velocity;
        format!("    {:<12} {x:.3}, {y:.3}, {z:.3} m/s\n", shown::line(&motion.body))
    };
    bodies.iter().take(MOST_NAMED).map(line).collect()
}

/// Limit of a load.
fn limit_text(limit: &LimitReport) -> String {
    let name = limit.load;
    let Some(factor) = limit.factor else {
        let what = match limit.result {
            "unlimited" => "no factor is too large: forces balance it alone",
            "never" => "it stands with no factor",
            _ => "undecided: a certificate is missing",
        };
        return format!("  {name:<12} {what}\n");
    };
    let shown_factor = match name {
        "mass" => format!("{} kg", shown::number(factor)),
        "tilt" => format!("a slope of {}", shown::number(factor)),
        _ => format!("{} times", shown::number(factor)),
    };
    let mut text = format!("  {name:<12} up to {shown_factor}\n");
    let checks = limit.force_check.as_ref().zip(limit.mechanism_check.as_ref());
    if let Some((forces, mechanism)) = checks {
        let _ = writeln!(
            text,
            "    checked    imbalance {:.1e} N at the limit; a mechanism with a violation of {:.1e} m/s above it",
            forces.imbalance, mechanism.violation
        );
    }
    for weak in limit.weak.iter().take(MOST_NAMED) {
        let way = if weak.opening > 0.7 { "opens" } else { "slides" };
        let between = pair(&weak.between);
        let _ = writeln!(text, "    weak       {between} {way}, part {:.2}", weak.part);
    }
    let largest = limit.friction_slopes.first().map_or(0.0, |slope| slope.slope);
    let counts = |slope: &&PairSlope| slope.slope.abs() > NEGLIGIBLE * largest;
    for slope in limit.friction_slopes.iter().filter(counts).take(MOST_NAMED) {
        let between = pair(&slope.between);
        let _ = writeln!(text, "    by friction of {between}: {}", shown::rounded(slope.slope));
    }
    for slope in &limit.slopes {
        text += &slope_text(slope);
    }
    text
}

/// Derivative, with both sides where it is not unique.
fn slope_text(slope: &FieldSlope) -> String {
    let by = shown::line(&slope.by);
    match (slope.slope, slope.sides) {
        (Some(value), _) if slope.is_unique => format!("    by {by}: {}\n", shown::rounded(value)),
        (Some(_), Some([below, above])) => format!(
            "    by {by}: one-sided, {} below and {} above\n",
            shown::rounded(below),
            shown::rounded(above)
        ),
        _ => format!("    by {by}: none, the contacts change or a limit is missing\n"),
    }
}

fn pair([one, other]: &[String; 2]) -> String {
    format!("{} and {}", shown::line(one), shown::line(other))
}
