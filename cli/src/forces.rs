//! `tumble forces`: forces between bodies and in joints, over a time of a run.

use super::args::ForcesArgs;
use super::outcome::{Failure, Outcome};
use super::output::say;
use super::recording::Recording;
use nalgebra::Vector3;
use std::collections::BTreeMap;
use std::fmt::Write as _;
use tumble_core::contact::Partner;
use tumble_model::shown;
use tumble_scene::output::tables::IntervalRows;

/// Columns of `--csv`.
const HEAD: [&str; 14] = [
    "of",
    "and",
    "normal_N",
    "friction_N",
    "force_x_N",
    "force_y_N",
    "force_z_N",
    "largest_N",
    "largest_at_s",
    "torque_x_N_m",
    "torque_y_N_m",
    "torque_z_N_m",
    "largest_N_m",
    "largest_torque_at_s",
];

/// Sums of a vector over steps, and its largest norm with its time (s).
#[derive(Debug, Clone, Copy, Default)]
struct Course {
    sum: Vector3<f64>,
    largest: f64,
    at: f64,
}

impl Course {
    fn add(&mut self, value: Vector3<f64>, time: f64) {
        self.sum += value;
        if value.norm() > self.largest {
            (self.largest, self.at) = (value.norm(), time);
        }
    }
}

/// Forces of a pair of objects or of a joint (N, N m).
#[derive(Debug, Clone, Copy, Default)]
struct Forces {
    force: Course,
    torque: Course,
    /// Sums of the normal forces of all points, and of the norms of friction.
    normal: f64,
    friction: f64,
}

/// Forces of the steps of a run.
#[derive(Debug, Default)]
struct Table {
    pairs: BTreeMap<(usize, Partner), Forces>,
    joints: Vec<Forces>,
    steps: u64,
    /// First and last time (s).
    times: [f64; 2],
}

impl Table {
    fn add(&mut self, step: &IntervalRows) {
        let time = step.row.time;
        let mut resultants: BTreeMap<(usize, Partner), Vector3<f64>> = BTreeMap::new();
        for row in &*step.contacts {
            let pair = (row.body, row.partner);
            *resultants.entry(pair).or_default() += row.force;
            let along = row.normal.dot(&row.force);
            let forces = self.pairs.entry(pair).or_default();
            forces.normal += along;
            forces.friction += (row.force - row.normal * along).norm();
        }
        for (pair, force) in resultants {
            self.pairs.entry(pair).or_default().force.add(force, time);
        }
        self.joints.resize(step.joints.len(), Forces::default());
        for (forces, row) in self.joints.iter_mut().zip(&step.joints) {
            forces.force.add(row.force, time);
            forces.torque.add(row.torque, time);
        }
        if self.steps == 0 {
            self.times[0] = time;
        }
        (self.steps, self.times[1]) = (self.steps + 1, time);
    }

    /// Rows with the names of a recording: names, and forces with means instead of sums.
    fn rows(&self, recording: &Recording<'_>) -> Vec<([String; 2], Forces)> {
        let document = &recording.run.model;
        let share = 1.0 / self.steps.max(1) as f64;
        let mean = |forces: &Forces| {
            let mut means = *forces;
            means.force.sum *= share;
            means.torque.sum *= share;
            means.normal *= share;
            means.friction *= share;
            means
        };
        let name = |partner: Partner| document.name_of(document.owner(partner));
        let pairs = self.pairs.iter().map(|((body, partner), forces)| {
            ([name(Partner::Body(*body)), name(*partner)], mean(forces))
        });
        let joints = document.joint_names().zip(&self.joints);
        let joints =
            joints.map(|(joint, forces)| ([joint.to_owned(), String::new()], mean(forces)));
        pairs.chain(joints).collect()
    }
}

/// Runs `tumble forces`.
pub fn run(args: &ForcesArgs) -> Result<Outcome, Failure> {
    let mut recording = Recording::open(&args.file)?;
    let [from, to] = [args.from.unwrap_or(f64::NEG_INFINITY), args.to.unwrap_or(f64::INFINITY)];
    let mut table = Table::default();
    let mut ends = Vec::new();
    while let Some(step) = recording.next_step()? {
        // The last row is a state without a step.
        if let Some(step) =
            ends.pop().filter(|step: &IntervalRows| (from..=to).contains(&step.row.time))
        {
            table.add(&step);
        }
        ends.push(step);
    }
    if table.steps == 0 {
        return Err(Failure::Input(format!(
            "{} has no step between --from and --to; its last state is at {} s",
            shown::path(&args.file),
            ends.pop().map_or(0.0, |end| end.row.time)
        )));
    }
    let rows = table.rows(&recording);
    say(&if args.csv { csv(&rows) } else { text(&table, &rows) })?;
    Ok(Outcome::Done)
}

fn csv(rows: &[([String; 2], Forces)]) -> String {
    let mut writer = csv::Writer::from_writer(Vec::new());
    let numbers = |Course { sum, largest, at }: Course| [sum.x, sum.y, sum.z, largest, at];
    let head = writer.write_record(HEAD);
    let written = rows.iter().try_fold((), |(), (names, forces)| {
        let Forces { force, torque, normal, friction } = *forces;
        writer.serialize((names, normal, friction, numbers(force), numbers(torque)))
    });
    // A list of numbers and names can be written.
    let bytes = head.and(written).ok().and_then(|()| writer.into_inner().ok()).unwrap_or_default();
    String::from_utf8_lossy(&bytes).into_owned()
}

fn text(table: &Table, rows: &[([String; 2], Forces)]) -> String {
    let [from, to] = table.times;
    let mut text = format!(
        "forces of {} steps from {} to {} s; contacts in the world frame, joints along their axes\n",
        table.steps,
        shown::rounded(from),
        shown::rounded(to)
    );
    let vector = |v: &Vector3<f64>| {
        let [x, y, z] = [v.x, v.y, v.z].map(shown::rounded);
        format!("[{x}, {y}, {z}]")
    };
    for ([first, second], Forces { force, torque, normal, friction }) in rows {
        let largest = format!(
            "largest {} N at {} s",
            shown::rounded(force.largest),
            shown::rounded(force.at)
        );
        let _ = if second.is_empty() {
            writeln!(
                text,
                "  {}\n    mean {} N and {} N m, {largest}, {} N m at {} s",
                shown::line(first),
                vector(&force.sum),
                vector(&torque.sum),
                shown::rounded(torque.largest),
                shown::rounded(torque.at)
            )
        } else {
            writeln!(
                text,
                "  {} on {}\n    mean {} N, normal {} N, friction {} N, {largest}",
                shown::line(second),
                shown::line(first),
                vector(&force.sum),
                shown::rounded(*normal),
                shown::rounded(*friction)
            )
        };
    }
    text
}
