//! What the page is made of.

/// All that was found.
#[derive(Debug, Clone, PartialEq)]
pub struct Report {
    /// Which version of what.
    pub program: String,
    /// The scene.
    pub scene: String,
    /// Whether recordings are of several bodies, and not of one that is thrown.
    pub is_of_several: bool,
    /// Facts in words: the data, the protocol, the search.
    pub facts: Vec<String>,
    /// What was looked for; empty where values were only scored.
    pub parameters: Vec<Parameter>,
    /// The mean errors: of the start, of what was found, of tosses that were kept back.
    pub means: Vec<Means>,
    /// Every toss.
    pub tosses: Vec<Toss>,
    /// The least loss after each evaluation with all substeps.
    pub progress: Vec<f64>,
    /// Usual tosses, recorded and simulated.
    pub usual: Vec<Motion>,
    /// Those that go wrong most.
    pub worst: Vec<Motion>,
    /// Steps of all simulations.
    pub steps: u64,
    /// Those of them that did not converge.
    pub failed: u64,
}

/// A parameter that was looked for.
#[derive(Debug, Clone, PartialEq)]
pub struct Parameter {
    /// Its name, with its unit.
    pub name: String,
    /// Where the search began.
    pub start: f64,
    /// What it found.
    pub value: f64,
    /// Where 95 % of the bootstrap lie.
    pub interval: Option<[f64; 2]>,
    /// What must be said of it: that it is on a bound. Empty if nothing.
    pub note: String,
}

/// Mean errors over tosses.
#[derive(Debug, Clone, PartialEq)]
pub struct Means {
    /// Of what.
    pub name: String,
    /// The distance, % of the body's length.
    pub position: f64,
    /// The angle, degrees.
    pub rotation: f64,
    /// How many end on another face, or more than 45° apart, and of how many.
    pub other_face: [usize; 2],
}

/// The errors of one toss.
#[derive(Debug, Clone, PartialEq)]
pub struct Toss {
    /// The distance, % of the body's length: with the values of the start, and with those found.
    pub position: [f64; 2],
    /// The angle, degrees; the same.
    pub rotation: [f64; 2],
    /// Whether it ends on another face, or more than 45° apart, with the values found.
    pub other_face: bool,
}

/// A recorded motion and the simulated one.
#[derive(Debug, Clone, PartialEq)]
pub struct Motion {
    /// Which toss.
    pub name: String,
    /// How it goes, in words.
    pub words: String,
    /// s, from the start of the recording.
    pub times: Vec<f64>,
    /// The centre's places, m, world: recorded.
    pub recorded: Vec<[f64; 3]>,
    /// The same, simulated; no numbers before the simulation starts.
    pub simulated: Vec<[f64; 3]>,
    /// The angle between both attitudes, degrees; no number before the simulation starts.
    pub angle: Vec<f64>,
}
