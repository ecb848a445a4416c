//! A problem as a file: a text in TOML. `docs/planning.md` describes every field.

use super::control::{Control, ControlKind, Push, StartPart};
use super::keep::{Keep, KeepKind};
use super::target::{Target, TargetKind};
use super::{Leg, PlanError, Problem, Sample, Shoot};
use crate::scenario::failure::Failure;
use crate::scenario::fields::{Exactly, Numbers, Tables};
use crate::scenario::scene::Scene;
use crate::scenario::settings::Settings;
use crate::scenario::{self, ReadFile, shown};
use crate::world::Constant;
use crate::world::constants::extents;
use nalgebra::{Matrix3, Vector3};
use serde::Deserialize;
use std::path::{Path, PathBuf};

/// What a problem's file says.
pub struct ProblemFile {
    /// The problem.
    pub problem: Problem,
    /// Where the search starts.
    pub start: Start,
    /// By which legs.
    pub legs: Vec<LegName>,
    /// How a sampling goes.
    pub sample: Sample,
    /// How a shooting goes.
    pub shoot: Shoot,
    /// The most time for the search, s, for a caller that has a clock.
    pub time: Option<f64>,
}

/// Where a search starts.
#[derive(Debug, Clone, PartialEq)]
pub enum Start {
    /// No forces, the scene's own starts and constants.
    Zero,
    /// A table of controls, beside the problem's file.
    File(PathBuf),
}

/// A leg by its word.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum LegName {
    /// [`Sample`].
    Sample,
    /// [`Shoot`].
    Shoot,
    /// [`ProgramLeg`](super::program::ProgramLeg).
    #[cfg(feature = "ipopt")]
    Program,
    /// [`Polish`](super::Polish).
    #[cfg(feature = "ipopt")]
    Polish,
}

impl LegName {
    /// The leg, which draws as `sample` says and shoots as `shoot` does.
    #[must_use]
    pub fn leg(self, sample: Sample, shoot: Shoot) -> Box<dyn Leg> {
        match self {
            Self::Sample => Box::new(sample),
            Self::Shoot => Box::new(shoot),
            #[cfg(feature = "ipopt")]
            Self::Program => Box::new(super::program::ProgramLeg::default()),
            #[cfg(feature = "ipopt")]
            Self::Polish => Box::new(super::Polish::default()),
        }
    }
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct File {
    scene: PathBuf,
    steps: u32,
    seed: Option<u64>,
    #[serde(default)]
    controls: Vec<ControlTable>,
    #[serde(default)]
    target: Tables<TargetTable>,
    #[serde(default)]
    keep: Tables<KeepTable>,
    #[serde(default)]
    cost: CostTable,
    #[serde(default)]
    search: SearchTable,
}

#[derive(Deserialize, Default)]
#[serde(deny_unknown_fields)]
struct CostTable {
    effort: Option<f64>,
}

#[derive(Deserialize, Default)]
#[serde(deny_unknown_fields)]
struct SearchTable {
    start: Option<String>,
    legs: Option<Vec<LegName>>,
    runs: Option<u32>,
    knots: Option<u16>,
    rounds: Option<u8>,
    iterations: Option<u32>,
    time: Option<f64>,
}

/// A range of a component, or its value.
#[derive(Deserialize, Clone, Copy)]
#[serde(untagged, expecting = "two numbers, [low, high], or one are needed")]
enum Range {
    Fixed(f64),
    Between(Numbers<2>),
}

impl Range {
    fn bounds(of: Option<Self>) -> [f64; 2] {
        match of {
            None => [0.0; 2],
            Some(Self::Fixed(value)) => [value; 2],
            Some(Self::Between(Exactly(bounds))) => bounds,
        }
    }
}

#[derive(Deserialize, Clone, Copy, PartialEq, Eq, Debug)]
#[serde(rename_all = "lowercase")]
enum KindName {
    Force,
    Torque,
    Push,
    Start,
    Constant,
}

#[derive(Deserialize, Clone, Copy)]
#[serde(rename_all = "lowercase")]
enum PartName {
    Position,
    Turn,
    Velocity,
    Spin,
}

/// A direction along an axis of a body.
#[derive(Deserialize, Clone, Copy)]
enum Side {
    #[serde(rename = "+x")]
    XUp,
    #[serde(rename = "-x")]
    XDown,
    #[serde(rename = "+y")]
    YUp,
    #[serde(rename = "-y")]
    YDown,
    #[serde(rename = "+z")]
    ZUp,
    #[serde(rename = "-z")]
    ZDown,
}

impl Side {
    fn direction(self) -> Vector3<f64> {
        match self {
            Self::XUp => Vector3::x(),
            Self::XDown => -Vector3::x(),
            Self::YUp => Vector3::y(),
            Self::YDown => -Vector3::y(),
            Self::ZUp => Vector3::z(),
            Self::ZDown => -Vector3::z(),
        }
    }
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct ControlTable {
    name: Option<String>,
    kind: KindName,
    body: Option<String>,
    knots: Option<u32>,
    effort: Option<f64>,
    x: Option<Range>,
    y: Option<Range>,
    z: Option<Range>,
    face: Option<Side>,
    at: Option<Numbers<3>>,
    direction: Option<Numbers<3>>,
    friction: Option<f64>,
    normal: Option<Range>,
    tangential: Option<Range>,
    tangential_2: Option<Range>,
    offset: Option<Range>,
    offset_2: Option<Range>,
    of: Option<PartName>,
    constant: Option<String>,
    value: Option<Range>,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct TargetTable {
    body: Option<String>,
    after: Option<u32>,
    position: Option<Vec<f64>>,
    x: Option<f64>,
    y: Option<f64>,
    z: Option<f64>,
    velocity: Option<Numbers<3>>,
    speed: Option<f64>,
    spin: Option<f64>,
    attitude: Option<Numbers<4>>,
    turn: Option<f64>,
    axis: Option<Numbers<3>>,
    down: Option<Side>,
    #[serde(default)]
    tolerance: Each,
    #[serde(default)]
    weight: Each,
}

/// A number for each quantity of a target.
#[derive(Deserialize, Default)]
#[serde(deny_unknown_fields)]
struct Each {
    position: Option<f64>,
    velocity: Option<f64>,
    speed: Option<f64>,
    spin: Option<f64>,
    attitude: Option<f64>,
    turn: Option<f64>,
    down: Option<f64>,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct KeepTable {
    name: Option<String>,
    body: Option<String>,
    above: Option<WallTable>,
    away: Option<PointTable>,
    x: Option<Numbers<2>>,
    y: Option<Numbers<2>>,
    z: Option<Numbers<2>>,
    tolerance: Option<f64>,
    weight: Option<f64>,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct WallTable {
    x: f64,
    width: f64,
    height: f64,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct PointTable {
    point: Numbers<3>,
    radius: f64,
}

/// Tolerances where none is given: m, m/s, rad/s, degrees.
const USUAL: (f64, f64, f64, f64) = (1e-3, 1e-2, 1e-2, 0.5);

/// The weight of an effort where none is given, N⁻².
const USUAL_EFFORT: f64 = 1e-4;

impl ProblemFile {
    /// What the file `path`, whose text is `text`, says; the scene's file and what it names are read by `read`.
    ///
    /// # Errors
    /// One sentence about the first thing that cannot be, with the file.
    pub fn of_text(text: &str, path: &Path, read: ReadFile<'_>) -> Result<Self, Failure> {
        let odd = |why: String| Failure::Input(format!("{}: {why}", shown::path(path)));
        let file: File = scenario::parse(text).map_err(odd)?;
        let folder = path.parent().unwrap_or(Path::new(""));
        let scene = folder.join(&file.scene);
        let bytes = read(&scene, scenario::LARGEST_FILE).map_err(|error| {
            odd(format!("scene: {} cannot be read: {error}", shown::path(&scene)))
        })?;
        let text = String::from_utf8(bytes)
            .map_err(|_| odd(format!("scene: {} is no text", shown::path(&scene))))?;
        let scene = Scene::of_text(&text, &scene, Settings::default(), read)?;
        Self::of_scene(scene, file, folder).map_err(odd)
    }

    /// What a text without a scene of its own says of `scene`.
    ///
    /// # Errors
    /// As [`ProblemFile::of_text`].
    pub fn of_scene_text(scene: Scene, text: &str) -> Result<Self, String> {
        let file: File = scenario::parse(text)?;
        Self::of_scene(scene, file, Path::new(""))
    }

    fn of_scene(scene: Scene, file: File, folder: &Path) -> Result<Self, String> {
        let steps = file.steps as usize;
        let effort = file.cost.effort.unwrap_or(USUAL_EFFORT);
        let named = |of: &str, index: usize, why: String| format!("{of}[{index}]: {why}");
        let controls = file.controls.into_iter().enumerate().map(|(index, table)| {
            table.control(&scene, steps, effort).map_err(|why| named("controls", index, why))
        });
        let controls = controls.collect::<Result<Vec<_>, _>>()?;
        let mut targets = Vec::new();
        for (index, table) in file.target.0.into_iter().enumerate() {
            let found = table.targets(&scene, steps);
            targets.extend(found.map_err(|why| named("target", index, why))?);
        }
        let mut keeps = Vec::new();
        for (index, table) in file.keep.0.into_iter().enumerate() {
            let found = table.keeps(&scene);
            keeps.extend(found.map_err(|why| named("keep", index, why))?);
        }
        let problem = Problem::new(scene, steps, controls, targets, keeps).map_err(plain)?;
        let search = file.search;
        let start = match search.start.as_deref() {
            None | Some("zero") => Start::Zero,
            Some(file) => Start::File(folder.join(file)),
        };
        let usual = Sample::default();
        let sample = Sample {
            seed: file.seed.unwrap_or(usual.seed),
            runs: search.runs.map(u64::from),
            knots: search.knots.map_or(usual.knots, usize::from),
            rounds: search.rounds.map_or(usual.rounds, u32::from),
        };
        if sample.knots == 0 || sample.rounds == 0 || sample.runs == Some(0) {
            return Err("search: runs, knots and rounds of 1 or more are needed".to_owned());
        }
        let usual = Shoot::default().iterations;
        let shoot = Shoot { iterations: search.iterations.map_or(usual, u64::from) };
        let time = search.time;
        if time.is_some_and(|time| !(time > 0.0 && time.is_finite())) {
            return Err("search.time: a number above 0 is needed".to_owned());
        }
        let legs = search.legs.unwrap_or_else(|| vec![LegName::Sample, LegName::Shoot]);
        Ok(Self { problem, start, legs, sample, shoot, time })
    }

    /// The legs, made.
    #[must_use]
    pub fn made_legs(&self) -> Vec<Box<dyn Leg>> {
        self.legs.iter().map(|leg| leg.leg(self.sample, self.shoot)).collect()
    }
}

fn plain(error: PlanError) -> String {
    error.to_string()
}

/// The body of a name; the only one where none is given.
fn body_of(scene: &Scene, name: Option<&str>) -> Result<usize, String> {
    match name {
        None if scene.bodies.len() == 1 => Ok(0),
        None => Err("body: it is not given, and the scene has several".to_owned()),
        Some(name) => scene.bodies.iter().position(|known| known == name).ok_or_else(|| {
            format!("body: the scene has none that is called {name:?}; it has {}", {
                let known: Vec<_> = scene.bodies.iter().take(8).cloned().collect();
                known.join(", ")
            })
        }),
    }
}

fn unit(of: &str, vector: &Numbers<3>) -> Result<Vector3<f64>, String> {
    let vector = Vector3::from(vector.0);
    let norm = vector.norm();
    if norm > 1e-6 && norm < 1e6 {
        return Ok(vector / norm);
    }
    Err(format!("{of}: a vector of a length from 1e-6 to 1e6 is needed"))
}

impl ControlTable {
    fn control(self, scene: &Scene, steps: usize, effort: f64) -> Result<Control, String> {
        self.refuse_idle()?;
        let each = |ranges: &[Option<Range>]| ranges.iter().map(|of| Range::bounds(*of)).collect();
        let axes = [self.x, self.y, self.z];
        let body = || body_of(scene, self.body.as_deref());
        let word = format!("{:?}", self.kind).to_lowercase();
        let of_body = |body: usize| format!("{}.{word}", scene.bodies[body]);
        let (kind, bounds, usual): (_, Vec<[f64; 2]>, _) = match self.kind {
            KindName::Force => {
                let body = body()?;
                (ControlKind::Force { body }, each(&axes), of_body(body))
            }
            KindName::Torque => {
                let body = body()?;
                (ControlKind::Torque { body }, each(&axes), of_body(body))
            }
            KindName::Push => {
                let body = body()?;
                let push = self.push(scene, body)?;
                let ranges =
                    [self.normal, self.tangential, self.tangential_2, self.offset, self.offset_2];
                (ControlKind::Push(push), each(&ranges), of_body(body))
            }
            KindName::Start => {
                let body = body()?;
                let (part, word) = match self.of {
                    Some(PartName::Position) => (StartPart::Position, "position"),
                    Some(PartName::Turn) => (StartPart::Turn, "turn"),
                    Some(PartName::Velocity) => (StartPart::Velocity, "velocity"),
                    Some(PartName::Spin) => (StartPart::Spin, "spin"),
                    None => {
                        let why = "of: position, turn, velocity or spin is needed";
                        return Err(why.to_owned());
                    }
                };
                let bounds = self.start_bounds(&scene.starts[body], part);
                let name = format!("{}.{word}", scene.bodies[body]);
                (ControlKind::Start { body, part }, bounds, name)
            }
            KindName::Constant => {
                let wanted = self.constant.as_deref().unwrap_or_default();
                let constant = Constant::of_name(wanted)
                    .ok_or_else(|| format!("constant: {wanted:?} is none; friction is one"))?;
                if self.value.is_none() {
                    return Err("value: its range is needed".to_owned());
                }
                (ControlKind::Constant(constant), each(&[self.value]), wanted.to_owned())
            }
        };
        let knots = match self.knots {
            Some(knots) => knots as usize,
            None if kind.is_of_the_run() => 1,
            None => steps,
        };
        let name = self.name.unwrap_or(usual);
        shown::checked_name(&name)?;
        Ok(Control { name, kind, bounds, knots, effort: self.effort.unwrap_or(effort) })
    }

    /// Refuses fields of other kinds.
    fn refuse_idle(&self) -> Result<(), String> {
        use KindName::{Constant, Force, Push, Start, Torque};
        let fields: [(&str, bool, &[KindName]); 15] = [
            ("body", self.body.is_some(), &[Force, Torque, Push, Start]),
            ("knots", self.knots.is_some(), &[Force, Torque, Push]),
            ("effort", self.effort.is_some(), &[Force, Torque, Push]),
            ("x", self.x.is_some(), &[Force, Torque, Start]),
            ("y", self.y.is_some(), &[Force, Torque, Start]),
            ("z", self.z.is_some(), &[Force, Torque, Start]),
            ("face", self.face.is_some(), &[Push]),
            ("at", self.at.is_some(), &[Push]),
            ("direction", self.direction.is_some(), &[Push]),
            ("friction", self.friction.is_some(), &[Push]),
            ("normal", self.normal.is_some(), &[Push]),
            ("tangential", self.tangential.or(self.tangential_2).is_some(), &[Push]),
            ("offset", self.offset.or(self.offset_2).is_some(), &[Push]),
            ("of", self.of.is_some(), &[Start]),
            ("constant or value", self.constant.is_some() || self.value.is_some(), &[Constant]),
        ];
        match fields.iter().find(|(_, given, kinds)| *given && !kinds.contains(&self.kind)) {
            None => Ok(()),
            Some((field, ..)) => {
                let kind = format!("{:?}", self.kind).to_lowercase();
                Err(format!("{field}: it means nothing in a control of kind {kind}"))
            }
        }
    }

    fn push(&self, scene: &Scene, body: usize) -> Result<Push, String> {
        if self.normal.is_none() {
            return Err("normal: its range is needed, N".to_owned());
        }
        let (point, into) = match (self.face, &self.at, &self.direction) {
            (Some(face), at, None) => {
                let out = face.direction();
                let reach = extents(&scene.world.bodies()[body]);
                let centre = out.component_mul(&reach);
                (at.map_or(centre, |at| at.0.into()), -out)
            }
            (None, Some(at), Some(direction)) => (at.0.into(), unit("direction", direction)?),
            _ => {
                let why = "face, or at and direction, are needed to say where it pushes";
                return Err(why.to_owned());
            }
        };
        // Along y, or x where it pushes along y or z.
        let along = if into[0].abs() > 0.9 { Vector3::y() } else { Vector3::x() };
        let first = (along - into * into.dot(&along)).normalize();
        let frame = Matrix3::from_columns(&[into, first, into.cross(&first)]);
        Ok(Push { body, point, frame, friction: self.friction })
    }

    /// The bounds of a start, of which what is not given stays the scene's.
    fn start_bounds(&self, own: &crate::mechanics::State, part: StartPart) -> Vec<[f64; 2]> {
        let own = match part {
            StartPart::Position => own.position,
            StartPart::Turn => Vector3::zeros(),
            StartPart::Velocity => own.velocity,
            StartPart::Spin => own.spin,
        };
        let ranges = [self.x, self.y, self.z].into_iter().zip(own.iter());
        ranges.map(|(range, own)| range.map_or([*own; 2], |of| Range::bounds(Some(of)))).collect()
    }
}

/// A quantity that is asked for: its name, what it is to be, tolerance and weight as far as they are given, and the usual tolerance.
type Asked = (&'static str, TargetKind, Option<f64>, Option<f64>, f64);

impl TargetTable {
    fn targets(self, scene: &Scene, steps: usize) -> Result<Vec<Target>, String> {
        let body = body_of(scene, self.body.as_deref())?;
        let after = self.after.map_or(steps, |after| after as usize);
        let mut kinds: Vec<Asked> = Vec::new();
        let (tolerance, weight) = (&self.tolerance, &self.weight);
        let (m, m_s, rad_s, degrees) = USUAL;
        let mut position = [self.x, self.y, self.z];
        if let Some(values) = &self.position {
            if position.iter().any(Option::is_some) || !(1..=3).contains(&values.len()) {
                let why = "position: one to three numbers are needed, and then no x, y or z";
                return Err(why.to_owned());
            }
            position.iter_mut().zip(values).for_each(|(of, value)| *of = Some(*value));
        }
        if position.iter().any(Option::is_some) {
            let kind = TargetKind::Position(position);
            kinds.push(("position", kind, tolerance.position, weight.position, m));
        }
        if let Some(Exactly(velocity)) = self.velocity {
            let kind = TargetKind::Velocity(velocity.map(Some));
            kinds.push(("velocity", kind, tolerance.velocity, weight.velocity, m_s));
        }
        for (name, value) in [("speed", self.speed), ("spin", self.spin)] {
            if value.is_some_and(|value| value != 0.0) {
                let why = "0 is the only one that can be asked for; velocity asks for others";
                return Err(format!("{name}: {why}"));
            }
        }
        if self.speed.is_some() {
            let kind = TargetKind::Velocity([Some(0.0); 3]);
            kinds.push(("speed", kind, tolerance.speed, weight.speed, m_s));
        }
        if self.spin.is_some() {
            let kind = TargetKind::Spin([Some(0.0); 3]);
            kinds.push(("spin", kind, tolerance.spin, weight.spin, rad_s));
        }
        let radians = |of: Option<f64>| of.map(f64::to_radians);
        if let Some(Exactly(attitude)) = self.attitude {
            let attitude = nalgebra::Vector4::from(attitude);
            let norm = attitude.norm();
            if !(norm > 1e-6 && norm < 1e6) {
                return Err("attitude: a length from 1e-6 to 1e6 is needed".to_owned());
            }
            let kind = TargetKind::Attitude(attitude / norm);
            kinds.push(("attitude", kind, radians(tolerance.attitude), weight.attitude, degrees));
        }
        if let Some(turn) = self.turn {
            let axis = self.axis.as_ref().map_or(Ok(Vector3::z()), |axis| unit("axis", axis))?;
            let from = scene.starts[body].attitude;
            let kind = TargetKind::Turn { axis, angle: turn.to_radians(), from };
            kinds.push(("turn", kind, radians(tolerance.turn), weight.turn, degrees));
        } else if self.axis.is_some() {
            return Err("axis: it means nothing without turn".to_owned());
        }
        if let Some(down) = self.down {
            let kind = TargetKind::Direction { of: down.direction(), to: -Vector3::z() };
            kinds.push(("down", kind, radians(tolerance.down), weight.down, degrees));
        }
        if kinds.is_empty() {
            let all = "position, velocity, speed, spin, attitude, turn, down";
            return Err(format!("nothing is asked for; one or more of {all} are needed"));
        }
        let each = [
            ("position", tolerance.position, weight.position),
            ("velocity", tolerance.velocity, weight.velocity),
            ("speed", tolerance.speed, weight.speed),
            ("spin", tolerance.spin, weight.spin),
            ("attitude", tolerance.attitude, weight.attitude),
            ("turn", tolerance.turn, weight.turn),
            ("down", tolerance.down, weight.down),
        ];
        for (name, tolerance, weight) in each {
            let idle = tolerance.or(weight).is_some() && kinds.iter().all(|kind| kind.0 != name);
            if idle {
                return Err(format!("tolerance and weight: {name} is not asked for"));
            }
        }
        let target = |(name, kind, tolerance, weight, usual): Asked| {
            let usual = if kind.unit() == "rad" { usual.to_radians() } else { usual };
            let tolerance = tolerance.unwrap_or(usual);
            let weight = weight.unwrap_or(1.0 / (tolerance * tolerance));
            let mut name = format!("{}.{name}", scene.bodies[body]);
            if after != steps {
                name += &format!("@{after}");
            }
            Target { name, body, after, kind, tolerance, weight }
        };
        Ok(kinds.into_iter().map(target).collect())
    }
}

impl KeepTable {
    fn keeps(self, scene: &Scene) -> Result<Vec<Keep>, String> {
        let body = body_of(scene, self.body.as_deref())?;
        let positive = |what: &str, value: f64| {
            let fits = value > 0.0 && value.is_finite();
            if fits { Ok(()) } else { Err(format!("{what}: a number above 0 is needed")) }
        };
        let mut kinds = Vec::new();
        if let Some(WallTable { x, width, height }) = self.above {
            positive("above.width", width)?;
            positive("above.height", height)?;
            kinds.push(("above", KeepKind::Above { at: x, width, height }));
        }
        if let Some(PointTable { point, radius }) = self.away {
            positive("away.radius", radius)?;
            kinds.push(("away", KeepKind::Away { point: point.0.into(), radius }));
        }
        for (component, (name, range)) in
            [("x", self.x), ("y", self.y), ("z", self.z)].into_iter().enumerate()
        {
            let Some(Exactly([low, high])) = range else { continue };
            if low.is_nan() || high.is_nan() || low > high {
                return Err(format!("{name}: two numbers in order are needed"));
            }
            kinds.push((name, KeepKind::AtLeast { component, low }));
            kinds.push((name, KeepKind::AtMost { component, high }));
        }
        if kinds.is_empty() {
            return Err("nothing is to be kept; above, away, x, y or z is needed".to_owned());
        }
        let tolerance = self.tolerance.unwrap_or(USUAL.0);
        let weight = self.weight.unwrap_or(1.0 / (tolerance * tolerance));
        let name = self.name.unwrap_or_else(|| format!("{}.keep", scene.bodies[body]));
        let keep = |(word, kind): (&str, KeepKind)| {
            let name = format!("{name}.{word}");
            Keep { name, body, kind, tolerance, weight }
        };
        Ok(kinds.into_iter().map(keep).collect())
    }
}
