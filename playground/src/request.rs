//! Requests of the page and their answers, as JSON and numbers.

use crate::change::Change;
use crate::parts::Parts;
use crate::pull::Hand;
use crate::scenes::{self, SCENES};
use crate::session::{Hit, Session};
use crate::{export, frame};
use nalgebra::Vector3;
use serde::Deserialize;
use serde_json::{Value, json};
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use tumble_core::simulation::StepRecord;
use tumble_core::step::StepStatus;
use tumble_model::failure::Failure;
use tumble_scene::output::tables::IntervalRows;
use tumble_scene::scene::Scene;
use tumble_view::Film;

/// A request of the page.
#[derive(Debug, Deserialize)]
#[serde(tag = "do", rename_all = "kebab-case")]
pub enum Request {
    /// Titles and texts of the scenes, and names of the statuses.
    Scenes,
    /// A scene from its text.
    Open {
        /// Text of the scenario file.
        text: String,
    },
    /// Description of the open scene, and its present moment.
    Look,
    /// The scene from its start.
    Restart,
    /// Steps.
    Step {
        /// Number of steps.
        count: u32,
        /// True to add the contacts.
        contacts: bool,
    },
    /// Full states, and the certificate and status of the last step. Its numbers are those of
    /// [`frame::write_states`].
    States,
    /// One step back.
    Back {
        /// True to add the contacts.
        contacts: bool,
    },
    /// Grabs the body on a ray.
    Grab(Aim),
    /// Grabs a body at its centre of mass.
    Hold {
        /// Index of the body.
        body: usize,
    },
    /// Moves the target of the grabbed point.
    Pull {
        /// Target (m, world).
        target: [f64; 3],
    },
    /// Lets the grabbed body go.
    Release,
    /// A change of the scene.
    Change {
        /// The change.
        change: Change,
    },
    /// Text with the pulls.
    Export,
}

impl Request {
    /// A request in JSON.
    ///
    /// # Errors
    /// JSON that is no request.
    pub fn parse(json: &[u8]) -> Result<Self, String> {
        serde_json::from_slice(json).map_err(|error| error.to_string())
    }
}

/// A ray into the picture.
#[derive(Debug, Deserialize)]
pub struct Aim {
    /// Eye (m, world).
    origin: [f64; 3],
    /// Direction of the view, of any length.
    direction: [f64; 3],
}

/// The program behind the page: its session, and the last answer.
#[derive(Default)]
pub struct Program {
    session: Option<Session>,
    /// Scene that the list has first.
    first: Option<First>,
    /// Ends a request of many steps once it is true.
    end: Arc<AtomicBool>,
    /// Sessions before a change, the last at the end.
    past: Vec<Session>,
    /// The recorded sessions before the present one.
    parts: Parts,
    /// Number of descriptions so far. A window with an older one asks for the present one.
    described: u64,
    /// The scene at its start, with all changes.
    origin: Option<Session>,
    /// JSON of the last answer.
    pub text: String,
    /// Numbers of the last answer; see [`frame`].
    pub numbers: Vec<f64>,
}

/// A scene at the head of the list.
struct First {
    title: String,
    text: String,
}

impl Program {
    /// Program in which a scene is open. Once `end` is true, it takes no more steps.
    ///
    /// # Errors
    /// A scene that no text can hold, see [`Session::from_scene`].
    pub fn from_scene(scene: Scene, end: Arc<AtomicBool>) -> Result<Self, String> {
        let title = scene.name.clone();
        let session = Session::from_scene(scene)?;
        let first = First { title, text: session.text().to_owned() };
        let origin = Some(session.restarted()?);
        let parts = Parts::recorded();
        Ok(Self {
            first: Some(first),
            session: Some(session),
            origin,
            end,
            parts,
            ..Self::default()
        })
    }

    /// Scene of the steps since the last change, with the pulls. It has as many rows as were
    /// simulated. `None` if no scene is open.
    ///
    /// # Errors
    /// A text that cannot be read.
    pub fn recorded(&self) -> Result<Option<Scene>, Failure> {
        let Some(session) = &self.session else { return Ok(None) };
        scenes::read(&export::whole(session)?).map(Some)
    }

    /// Scenario texts of the parts that changes ended, in their order. Each repeats its steps.
    pub fn parts(&self) -> &[String] {
        self.parts.texts()
    }

    /// Texts of all parts, each with its number of rows. The last one is the present session.
    ///
    /// # Errors
    /// A text in which the number of rows cannot be set.
    pub fn texts(&self) -> Result<Vec<String>, String> {
        let present = self.session.as_ref().map(export::whole).transpose();
        let present = present.map_err(|failure| failure.to_string())?;
        Ok(self.parts().iter().cloned().chain(present).collect())
    }

    /// Takes one step.
    ///
    /// # Errors
    /// No scene; a step that cannot be posed.
    pub fn step(&mut self) -> Result<(), String> {
        self.session()?.step()
    }

    /// Number of descriptions of scenes so far. It grows when the scene changes.
    pub fn described(&self) -> u64 {
        self.described
    }

    /// Answers the request of a window in JSON.
    pub fn answer(&mut self, hand: Hand, request: &[u8]) {
        self.respond(hand, Request::parse(request));
    }

    /// Answers a parsed request, or its fault, in JSON.
    pub fn respond(&mut self, hand: Hand, request: Result<Request, String>) {
        self.numbers.clear();
        let answer = request.and_then(|request| self.answered(hand, request));
        let answer = answer.map(|mut answer| {
            answer["scene"] = self.described.into();
            answer
        });
        self.text = answer.unwrap_or_else(|error| json!({ "error": error })).to_string();
    }

    /// Lets the body go that a closed window held.
    pub fn leave(&mut self, hand: Hand) {
        if let Some(session) = &mut self.session {
            session.release(hand);
        }
    }

    fn answered(&mut self, hand: Hand, request: Request) -> Result<Value, String> {
        let mut contacts = false;
        let answer = match request {
            Request::Scenes => return Ok(self.list()),
            Request::Look => self.look()?,
            Request::Open { text } => {
                let session = Session::open(&text)?;
                let origin = session.restarted()?;
                self.begin(session)?;
                self.origin = Some(origin);
                self.look()?
            }
            Request::Restart => {
                let origin = self.origin.as_ref().ok_or_else(no_scene)?;
                self.begin(origin.restarted()?)?;
                self.look()?
            }
            Request::Step { count, contacts: wanted } => {
                contacts = wanted;
                let end = Arc::clone(&self.end);
                let session = self.session()?;
                (0..count)
                    .take_while(|_| !end.load(Ordering::Relaxed))
                    .try_for_each(|_| session.step())?;
                json!({})
            }
            Request::States => return self.states(),
            Request::Back { contacts: wanted } => {
                contacts = wanted;
                let is_at_start = self.session()?.rows() == 1;
                if is_at_start && let Some(mut before) = self.past.pop() {
                    // It ends where the later one starts.
                    let _ = before.back();
                    self.session = Some(before);
                    self.parts.reopen();
                    self.described += 1;
                    self.look()?
                } else {
                    self.session()?.back()?;
                    json!({})
                }
            }
            Request::Grab(aim) => {
                let hit = self.session()?.hit(aim.origin.into(), aim.direction.into());
                self.grab(hand, hit)?
            }
            Request::Hold { body } => {
                let state = self.session()?.simulation().states().get(body);
                let hit = state.map(|state| Hit { body, point: state.position });
                self.grab(hand, hit)?
            }
            Request::Pull { target } => {
                self.session()?.pull(hand, Vector3::from(target))?;
                json!({})
            }
            Request::Release => {
                self.session()?.release(hand);
                json!({})
            }
            Request::Change { change } => {
                let changed = self.session()?.changed(change)?;
                let origin = self.origin.as_ref().ok_or_else(no_scene)?;
                let origin = origin.changed(change)?;
                self.replace(changed)?;
                self.origin = Some(origin);
                self.described += 1;
                self.look()?
            }
            Request::Export => {
                let text = export::text(self.session()?).map_err(|failure| failure.to_string())?;
                json!({ "text": text })
            }
        };
        if let Some(session) = &self.session {
            frame::write(session, hand, contacts, &mut self.numbers);
        }
        Ok(answer)
    }

    fn session(&mut self) -> Result<&mut Session, String> {
        self.session.as_mut().ok_or_else(no_scene)
    }

    /// Begins with another session, without a way back to the one before.
    fn begin(&mut self, session: Session) -> Result<(), String> {
        self.end_part()?;
        self.session = Some(session);
        self.past.clear();
        self.described += 1;
        Ok(())
    }

    /// Continues with another session. The one before stays for the way back.
    fn replace(&mut self, session: Session) -> Result<(), String> {
        let has_steps = self.end_part()?;
        if let Some(mut before) = self.session.replace(session).filter(|_| has_steps) {
            before.shorten();
            self.past.push(before);
        }
        if self.past.len() > MOST_PAST {
            self.past.remove(0);
        }
        Ok(())
    }

    /// Ends the pulls of the present session and records it. Returns false if it has no steps.
    fn end_part(&mut self) -> Result<bool, String> {
        let Some(session) = &mut self.session else { return Ok(false) };
        session.release_all();
        let has_steps = session.rows() > 1;
        if has_steps {
            self.parts.add(session)?;
        }
        Ok(has_steps)
    }

    /// Grabs the body of a hit.
    fn grab(&mut self, hand: Hand, hit: Option<Hit>) -> Result<Value, String> {
        let Some(hit) = hit else { return Ok(json!({ "body": null })) };
        if let Some(session) = self.session()?.for_pulls()? {
            self.replace(session)?;
        }
        self.session()?.grab(hand, &hit)?;
        Ok(json!({ "body": hit.body, "point": <[f64; 3]>::from(hit.point) }))
    }

    /// Scenes and names of the statuses.
    fn list(&self) -> Value {
        let first = self.first.iter().map(|first| (first.title.as_str(), first.text.as_str()));
        let scenes = first.chain(SCENES.iter().map(|scene| (scene.title, scene.text)));
        let scenes: Vec<_> =
            scenes.map(|(title, text)| json!({ "title": title, "text": text })).collect();
        json!({ "scenes": scenes, "statuses": StepStatus::ALL.map(StepStatus::name) })
    }

    /// Answer to [`Request::States`].
    fn states(&mut self) -> Result<Value, String> {
        let session = self.session.as_ref().ok_or_else(no_scene)?;
        frame::write_states(session, &mut self.numbers);
        let Some(record) = session.record() else { return Ok(json!({})) };
        let report = record.report();
        Ok(json!({
            "status": report.status.name(),
            "isSolved": report.status.is_solved(),
            "iterations": report.iterations,
        }))
    }

    /// Description of the scene for the drawing and the controls.
    fn look(&mut self) -> Result<Value, String> {
        let parts = self.parts.texts().len();
        let session = self.session()?;
        let (scene, world) = (session.scene(), &session.scene().world);
        let drawing = drawing(session).map_err(|failure| failure.to_string())?;
        let film: Value = serde_json::from_str(&drawing).map_err(|error| error.to_string())?;
        Ok(json!({
            "film": film,
            "name": scene.name,
            "bodies": scene.bodies,
            "fixed": scene.fixed,
            "notes": scene.notes(),
            "friction": world.friction(),
            "restitution": world.restitution(),
            "gravity": <[f64; 3]>::from(*world.gravity()),
            "timeStep": world.time_step(),
            "masses": world.bodies().iter().map(|body| body.mass()).collect::<Vec<_>>(),
            "parts": parts,
        }))
    }
}

/// Number of sessions for the way back.
const MOST_PAST: usize = 20;

fn no_scene() -> String {
    "No scene is open.".to_owned()
}

/// Bodies, fixed pieces and ground as the page draws them, as JSON.
fn drawing(session: &Session) -> Result<String, Failure> {
    let scene = session.scene();
    let mut end = StepRecord::new();
    session.simulation().end(&mut end);
    let frames = IntervalRows::from_step(&scene.world, &end);
    let floating = scene.contact.is_none();
    let mut film = Film::new(&scene.world, &scene.document, floating, frames)?;
    // A recorded run hides a ground that its bodies do not reach. Here they may still fall to it.
    film.ground = scene.world.ground().filter(|_| !floating).cloned();
    tumble_view::view::drawing(&film).map_err(Failure::Other)
}
