//! A run that one can touch: the page of the playground, with the steps computed here.

use super::args::{SetupArgs, SimulateArgs};
use super::continued;
use super::outcome::{Failure, refuse_flags};
use super::output;
use super::recording::Recording;
use super::scene::Scene;
use std::net::{Ipv4Addr, SocketAddr};
use std::sync::Arc;
use std::sync::atomic::AtomicBool;
use tumble_model::shown;
use tumble_playground::request::Program;
use tumble_playground::server::Server;

/// Maximum number of rows of a run.
const MOST_ROWS: u64 = 10_000_000;

/// A live run before its first step.
pub struct Live {
    server: Server,
}

/// Record of a live run.
pub struct Played {
    /// Scene of the steps since the last change.
    pub scene: Scene,
    /// Scenario texts of the parts that changes ended.
    pub parts: Vec<String>,
}

impl Live {
    /// Live run of `scene` until `end` is true. The tutorial's scenes and those of `--from` get the
    /// native solver.
    pub fn new(args: &SimulateArgs, scene: Scene, end: &Arc<AtomicBool>) -> Result<Self, Failure> {
        check(args)?;
        let is_named_by_file = args.setup.scene.file.is_some();
        let scene = if is_named_by_file { scene } else { scene.with_native_solver() };
        let program = Program::from_scene(scene, Arc::clone(end));
        let program = program.map_err(|why| Failure::Input(format!("--live: {why}")))?;
        let address = args.live.address.unwrap_or((Ipv4Addr::LOCALHOST, 0).into());
        let server = Server::bind(address, program).map_err(|error| cannot_serve(address, &error));
        Ok(Self { server: server? })
    }

    /// Scene of the run as far as it went: with the changes, the pulls and the number of rows.
    pub fn scene(&self) -> Result<Scene, Failure> {
        recorded(&self.server.program())
    }

    /// Prints the address, serves until `end` is true, and returns the record of what was shown.
    pub fn play(self, args: &SimulateArgs, end: &AtomicBool) -> Result<Played, Failure> {
        let out = shown::path(args.out());
        // Without the address nobody could open the page, so it is printed with --quiet as well.
        output::say(&format!(
            "{}\nCtrl-C ends the run and writes it to {out}\n",
            self.server.url()
        ))?;
        self.server.serve(end);
        let program = self.server.program();
        Ok(Played { scene: recorded(&program)?, parts: program.parts().to_vec() })
    }
}

/// Scene of the run of `--from`, at its moment `--at`; `None` without them.
pub fn taken_over(args: &SimulateArgs) -> Result<Option<Scene>, Failure> {
    let Some(path) = &args.live.from else { return Ok(None) };
    let given = args.setup.given();
    let flags: Vec<_> = given.iter().map(|flag| (*flag, true)).collect();
    refuse_flags("--from, whose run has it", &flags)?;
    let mut recording = Recording::open(path)?;
    let mut scene = continued::scene_of(&recording.run)?;
    let mut moment = None;
    while let Some(step) = recording.next_step()? {
        let index = step.row.index;
        moment = Some((index, step.instant_states().to_vec()));
        if args.live.at.is_some_and(|requested| requested <= index) {
            break;
        }
    }
    let (index, states) = moment.ok_or_else(|| recording.invalid(&"it has no rows"))?;
    if let Some(requested) = args.live.at.filter(|requested| *requested != index) {
        let why = format!("{} has no row k = {requested}; give one of its rows", shown::path(path));
        return Err(Failure::setting("at", why).as_flag());
    }
    let mut document = scene.document.clone();
    document.start_at(&states, index as f64 * scene.world.time_step())?;
    scene.start_index = index;
    scene.with_document(document).map(Some)
}

fn recorded(program: &Program) -> Result<Scene, Failure> {
    let none = || Failure::Other("--live: no scene is open".to_owned());
    let mut scene = program.recorded()?.ok_or_else(none)?;
    scene.rows = scene.rows.min(MOST_ROWS);
    Ok(scene)
}

/// Refuses flags that a live run does not have.
fn check(args: &SimulateArgs) -> Result<(), Failure> {
    let SetupArgs { solver, fields, .. } = &args.setup;
    let flags = [
        ("solver ipopt", fields.get("solver").is_some_and(|name| name.is_text("ipopt"))),
        ("preset", fields.get("preset").is_some()),
        ("residual", fields.get("residual").is_some()),
        ("threads", solver.threads.is_some()),
        ("substeps", solver.substeps.is_some()),
        ("on-failure", fields.get("on-failure").is_some()),
        ("steps", fields.get("steps").is_some()),
        ("export-problems", args.output.export_problems.is_some()),
    ];
    refuse_flags("--live, whose page decides the number of steps and has the native solver", &flags)
}

fn cannot_serve(address: SocketAddr, error: &std::io::Error) -> Failure {
    Failure::Input(format!("--live-address {address}: the page cannot be served there: {error}"))
}
