//! Live runs: the page of the playground, served by this process.

use crate::errors::refused;
use crate::scene::PyScene;
use pyo3::prelude::*;
use std::net::{IpAddr, Ipv4Addr};
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Arc, Mutex, PoisonError};
use std::thread::{self, JoinHandle};
use tumble_playground::request::Program;
use tumble_playground::server::Server;

/// Scenario texts of a live run.
type Texts = Vec<String>;

/// A server of a live run on the loopback address, with threads of its own. It ends with this object.
#[pyclass(frozen, name = "CoreLive", module = "tumble._tumble")]
pub struct PyLive {
    url: String,
    end: Arc<AtomicBool>,
    state: Mutex<State>,
}

struct State {
    /// Thread of the server, which returns the texts of what was shown; `None` after its end.
    thread: Option<JoinHandle<Result<Texts, String>>>,
    texts: Result<Texts, String>,
}

#[pymethods]
impl PyLive {
    /// Serves a scene at `port`, 0 for a free one.
    #[new]
    fn new(py: Python<'_>, scene: PyRef<'_, PyScene>, port: u16) -> PyResult<Self> {
        let (content, end) = ((*scene.content).clone(), Arc::new(AtomicBool::new(false)));
        let program = py.detach(|| Program::from_scene(content, Arc::clone(&end)));
        let program = program.map_err(|why| refused(format!("live: {why}")))?;
        let address = (IpAddr::from(Ipv4Addr::LOCALHOST), port).into();
        let server = py.detach(|| Server::bind(address, program)).map_err(|error| {
            refused(format!("port: the page cannot be served at {address}: {error}"))
        })?;
        let (url, flag) = (server.url(), Arc::clone(&end));
        let serve = move || {
            server.serve(&flag);
            let program = server.program();
            program.texts()
        };
        let thread = thread::Builder::new().name("tumble-live".to_owned()).spawn(serve);
        let thread = thread.map_err(|error| refused(format!("live: no thread starts: {error}")))?;
        let state = State { thread: Some(thread), texts: Ok(Vec::new()) };
        Ok(Self { url, end, state: Mutex::new(state) })
    }

    /// Address of the page.
    #[getter]
    fn url(&self) -> &str {
        &self.url
    }

    /// True until the server ends.
    #[getter]
    fn is_running(&self) -> bool {
        !self.end.load(Ordering::Relaxed)
    }

    /// Ends the server. Returns the scenario texts of the run: its parts, each ended by a change of
    /// the scene, and at the end the present one.
    fn stop(&self, py: Python<'_>) -> PyResult<Texts> {
        py.detach(|| self.ended()).map_err(|why| refused(format!("live: {why}")))
    }
}

impl PyLive {
    fn ended(&self) -> Result<Texts, String> {
        self.end.store(true, Ordering::Relaxed);
        let mut state = self.state.lock().unwrap_or_else(PoisonError::into_inner);
        if let Some(thread) = state.thread.take() {
            let panicked = |_| Err("the server has panicked".to_owned());
            state.texts = thread.join().unwrap_or_else(panicked);
        }
        state.texts.clone()
    }
}

impl Drop for PyLive {
    fn drop(&mut self) {
        // The threads of the server need no lock of the interpreter.
        let _ = self.ended();
    }
}
