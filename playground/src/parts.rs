//! Parts of a live run: a change of the scene ends one and begins the next.
//!
//! run.json holds the constants of a run once, so a run cannot contain a change. A part is a scenario
//! text that repeats its steps, pulls included.

use crate::export;
use crate::session::Session;

/// Size limit of all texts (bytes).
const LARGEST: usize = 256 << 20;

/// Recorded parts.
#[derive(Debug, Default)]
pub struct Parts {
    is_recording: bool,
    texts: Vec<String>,
}

impl Parts {
    /// Parts that are recorded; [`Parts::default`] records nothing.
    pub fn recorded() -> Self {
        Self { is_recording: true, ..Self::default() }
    }

    /// Adds an ended session.
    ///
    /// # Errors
    /// Too many texts.
    pub fn add(&mut self, session: &Session) -> Result<(), String> {
        if !self.is_recording {
            return Ok(());
        }
        let text = export::whole(session).map_err(|failure| failure.to_string())?;
        let size: usize = self.texts.iter().map(String::len).sum();
        if size + text.len() > LARGEST {
            let limit = LARGEST >> 20;
            return Err(format!(
                "The record before this change is larger than {limit} MB; end the run to write it."
            ));
        }
        self.texts.push(text);
        Ok(())
    }

    /// Removes the last part, whose session continues.
    pub fn reopen(&mut self) {
        self.texts.pop();
    }

    /// Texts of the parts.
    pub fn texts(&self) -> &[String] {
        &self.texts
    }
}
