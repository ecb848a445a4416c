//! `tumble run` with a range in `--set`: one run for each combination of values, and a table of them.

use super::args::{FieldValues, SimulateArgs};
use super::directory::OutputDirectory;
use super::file_names::SWEEP;
use super::outcome::{Failure, Outcome, refuse_flags};
use super::output::{PendingFile, StderrReporter};
use super::scene;
use super::simulate::{self, Finished};
use tumble_core::mechanics::State;
use tumble_model::shown;

/// Largest number of runs.
const MOST_RUNS: usize = 10_000;

/// Runs all combinations of the ranges in `--set`, the last one fastest. All scenes are checked before the
/// first run.
pub fn run(args: &SimulateArgs) -> Result<Outcome, Failure> {
    refuse_others(args)?;
    let all = combinations(&args.setup.scene.overrides)?;
    let runs: Vec<_> = all.into_iter().map(|fields| SweepRun::new(args, fields)).collect();
    for run in &runs {
        scene::from_args(&run.args.setup)?;
    }
    let directory = OutputDirectory::for_pictures(args.out())?;
    let pending = PendingFile::create(&directory, SWEEP)?;
    let mut table = csv::Writer::from_writer(Vec::new());
    let mut reporter = StderrReporter::new(args.output.quiet);
    let mut outcome = Outcome::Done;
    for (number, SweepRun { args, fields, name }) in runs.iter().enumerate() {
        let Finished { outcome: of_run, word, unsolved, bodies, states } =
            simulate::finished(args)?;
        if number == 0 {
            write_header(&mut table, fields, &bodies)?;
        }
        let values = fields.iter().map(|field| field.values[0].clone());
        let row = [name.clone()].into_iter().chain(values);
        let row = row.chain([word.to_owned(), unsolved.to_string()]);
        table.write_record(row.chain(states.iter().flat_map(numbers))).map_err(cannot_write)?;
        reporter.say(&format!("{name}: {word}, {unsolved} steps unsolved\n"));
        outcome = match of_run {
            Outcome::Done => outcome,
            other => other,
        };
        if outcome == Outcome::Interrupted {
            break;
        }
    }
    let rows = table.into_inner().map_err(|error| cannot_write(error.into_error()))?;
    pending.write(&rows)?;
    let path = pending.publish()?;
    reporter.say(&format!("wrote {}\n", shown::path(&path)));
    reporter.end(outcome)
}

/// One run of a sweep.
struct SweepRun {
    args: SimulateArgs,
    /// Fields with a range, at the value of this run.
    fields: Vec<FieldValues>,
    /// Name of its directory: the fields and their values.
    name: String,
}

impl SweepRun {
    /// Run of the command `args` with one value for each field.
    fn new(args: &SimulateArgs, chosen: Vec<FieldValues>) -> Self {
        let given = &args.setup.scene.overrides;
        let varied = chosen.iter().zip(given).filter(|(_, given)| given.values.len() > 1);
        let fields: Vec<_> = varied.map(|(field, _)| field.clone()).collect();
        let words: Vec<_> = fields.iter().map(FieldValues::text).collect();
        let name = words.join(",").replace(['/', '\\'], "_");
        let mut of_run = args.clone();
        of_run.setup.scene.overrides = chosen;
        of_run.output.quiet = true;
        of_run.set_out(args.out().join(&name));
        Self { args: of_run, fields, name }
    }
}

/// All combinations of the values of `fields`, with one value each.
fn combinations(fields: &[FieldValues]) -> Result<Vec<Vec<FieldValues>>, Failure> {
    let mut all: Vec<Vec<FieldValues>> = vec![Vec::new()];
    for field in fields {
        if all.len().saturating_mul(field.values.len()) > MOST_RUNS {
            let why =
                format!("--set: the ranges make more than {MOST_RUNS} runs; use longer steps");
            return Err(Failure::Input(why));
        }
        let extended = |before: Vec<FieldValues>| {
            let one = |value: &String| {
                let one = FieldValues { path: field.path.clone(), values: vec![value.clone()] };
                [&before[..], &[one]].concat()
            };
            field.values.iter().map(one).collect::<Vec<_>>()
        };
        all = all.into_iter().flat_map(extended).collect();
    }
    Ok(all)
}

/// Writes the names of the columns.
fn write_header(
    table: &mut csv::Writer<Vec<u8>>,
    fields: &[FieldValues],
    bodies: &[String],
) -> Result<(), Failure> {
    let paths = fields.iter().map(|field| field.path.clone());
    let names = ["directory".to_owned()].into_iter().chain(paths);
    let names = names.chain(["outcome", "unsolved"].map(str::to_owned));
    let columns = ["x", "y", "z", "qw", "qx", "qy", "qz"];
    let of_body = |body: &String| columns.map(|column| format!("{body}.{column}"));
    table.write_record(names.chain(bodies.iter().flat_map(of_body))).map_err(cannot_write)
}

fn cannot_write(error: impl std::fmt::Display) -> Failure {
    Failure::Other(format!("{SWEEP} cannot be written: {error}"))
}

/// Position and attitude of a state.
fn numbers(state: &State) -> Vec<String> {
    state.to_vector().iter().take(7).map(|number| format!("{number:?}")).collect()
}

/// Refuses options of a single run.
fn refuse_others(args: &SimulateArgs) -> Result<(), Failure> {
    let flags = [
        ("continue", args.continued.is_some()),
        ("live", args.live.is_live),
        ("export-problems", args.output.export_problems.is_some()),
        ("json", args.output.json),
    ];
    refuse_flags("a range in --set", &flags)
}
