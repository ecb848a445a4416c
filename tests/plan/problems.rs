//! The problems of docs/planning.md: a scene each, and what is sought of it.

use tumble::plan::Problem;

/// Name, scene, problem.
pub const ALL: &[(&str, &str, &str)] = &[
    ("puck", PUCK, PUCK_STOPS),
    ("slide", BOX, SLIDE),
    ("push", BOX, PUSH),
    ("flip", BOX, FLIP),
    ("hop", POINT, HOP),
    ("throw", CUBE, THROW),
];

/// A problem's name and its start.
pub type Guess = (&'static str, fn(&Problem) -> Vec<f64>);

/// Starts that are not zero.
pub const GUESSES: &[Guess] = &[
    ("puck", |_| vec![1.5]),
    ("push", |problem| {
        // Half the weight along the face's middle.
        let of = |component: usize| if component == 0 { 6.0 } else { 0.0 };
        problem.variables().iter().map(|variable| of(variable.component)).collect()
    }),
    ("flip", |problem| problem.variables().iter().map(|of| if of.component == 0 { 2.0 } else { 0.0 }).collect()),
    ("hop", |problem| {
        problem.variables().iter().map(|of| if of.component == 2 { 9.81 } else { 1.0 }).collect()
    }),
];

/// A flat box on its face.
const PUCK: &str = r#"
name = "puck"
steps = 70
time_step = 0.01

[body]
box = [0.1, 0.1, 0.05]
mass = 1.0

[ground]
friction = 0.3

[start]
position = [0.0, 0.0, 0.025]
"#;

/// Which speed lets it stop after 0.3 m?
const PUCK_STOPS: &str = r#"
steps = 70

[[controls]]
kind = "start"
of = "velocity"
x = [0.0, 4.0]

[target]
x = 0.3
tolerance = { position = 1e-3 }
weight = { position = 1000.0 }

[search]
legs = ["program", "polish"]
"#;

const BOX: &str = r#"
name = "box"
steps = 60
time_step = 0.02

[body]
box = [0.2, 0.2, 0.2]
mass = 1.0

[ground]
friction = 0.5

[start]
position = [0.0, 0.0, 0.1]
"#;

/// From rest to x = 0.5 m and to rest.
const SLIDE: &str = r#"
steps = 50

[[controls]]
kind = "force"
x = [-20.0, 20.0]
knots = 50

[target]
x = 0.5
velocity = [0.0, 0.0, 0.0]
tolerance = { position = 1e-2, velocity = 1e-2 }
weight = { position = 400.0, velocity = 40.0 }

[cost]
effort = 1e-3

[search]
legs = ["program", "polish"]
"#;

/// To a pose by a push of friction at one face.
const PUSH: &str = r#"
steps = 60

[[controls]]
kind = "push"
face = "-x"
normal = [0.0, 20.0]
tangential = [-6.0, 6.0]
offset = [-0.09, 0.09]
knots = 60

[target]
position = [0.5, 0.3]
turn = 90.0
velocity = [0.0, 0.0, 0.0]
spin = 0.0
tolerance = { position = 1e-2, turn = 1.0, velocity = 1e-1, spin = 1e-1 }
weight = { position = 200.0, turn = 50.0, velocity = 5.0, spin = 0.5 }

[cost]
effort = 1e-4

[search]
legs = ["program", "polish"]
"#;

/// Over an edge onto the next face.
const FLIP: &str = r#"
steps = 50

[[controls]]
kind = "force"
x = [-20.0, 20.0]
z = [-20.0, 20.0]
knots = 50

[target]
turn = 90.0
axis = [0.0, 1.0, 0.0]
velocity = [0.0, 0.0, 0.0]
spin = 0.0
tolerance = { turn = 1.0, velocity = 1e-1, spin = 1e-1 }
weight = { turn = 10.0, velocity = 1.0, spin = 0.1 }

[cost]
effort = 1e-4

[search]
runs = 20000
legs = ["sample", "program", "polish"]
"#;

const POINT: &str = r#"
name = "point"
steps = 60
time_step = 0.02

[body]
point_mass = true
mass = 1.0

[ground]
friction = 0.5

[start]
position = [0.0, 0.0, 0.0]
"#;

/// Over a wall.
const HOP: &str = r#"
steps = 60

[[controls]]
kind = "force"
x = [-10.0, 10.0]
z = [0.0, 30.0]
knots = 60

[target]
x = 2.0
z = 0.0
velocity = [0.0, 0.0, 0.0]
tolerance = { position = 1e-1, velocity = 1e-1 }
weight = { position = 100.0, velocity = 10.0 }

[[keep]]
above = { x = 1.0, width = 0.2, height = 0.5 }
weight = 1000.0
tolerance = 1e-2

[cost]
effort = 1e-4

[search]
runs = 20000
legs = ["sample", "program", "polish"]
"#;

const CUBE: &str = r#"
name = "cube"
steps = 35
time_step = 0.02

[body]
box = [0.2, 0.2, 0.2]
mass = 1.0

[ground]
friction = 0.4

[start]
position = [0.0, 0.0, 0.5]
"#;

/// Thrown to a pose, another face down.
const THROW: &str = r#"
steps = 35

[[controls]]
kind = "start"
of = "velocity"
x = [-3.0, 3.0]
y = [-3.0, 3.0]
z = [-3.0, 3.0]

[[controls]]
kind = "start"
of = "spin"
x = [-10.0, 10.0]
y = [-10.0, 10.0]
z = [-10.0, 10.0]

[target]
position = [0.5, 0.2]
down = "+x"
velocity = [0.0, 0.0, 0.0]
tolerance = { position = 1e-2, down = 1.0, velocity = 1e-1 }
weight = { position = 10.0, down = 1.0, velocity = 0.1 }

[search]
runs = 4000
legs = ["sample", "program", "polish"]
"#;
