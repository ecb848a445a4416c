//! Scenes and problems whose programs are held against differences.

/// A box that slides on the ground, a ball that rolls on it, and another box that it pushes.
pub const SEVERAL: &str = r#"
name = "several"
steps = 3
time_step = 0.05

[ground]
friction = 0.5

[[bodies]]
name = "lower"
box = [0.4, 0.3, 0.2]
mass = 1.5
position = [0.0, 0.0, 0.1]
velocity = [0.4, 0.1, 0.0]

[[bodies]]
name = "ball"
sphere = 0.1
mass = 0.7
position = [0.02, 0.01, 0.3]
spin = [0.3, -0.2, 0.5]

[[bodies]]
name = "next"
box = [0.2, 0.2, 0.2]
mass = 0.6
position = [0.31, 0.0, 0.1]
attitude = [0.9998, 0.0, 0.0, 0.02]
"#;

/// All kinds of controls that the program knows, all kinds of targets, and keeps.
pub const EVERYTHING: &str = r#"
steps = 3

[[controls]]
kind = "push"
body = "lower"
face = "-x"
normal = [0.0, 3.0]
tangential = [-0.7, 0.7]
tangential_2 = [-0.7, 0.7]
offset = [-0.1, 0.1]
offset_2 = [-0.1, 0.1]
friction = 0.4
knots = 2

[[controls]]
kind = "push"
body = "next"
face = "+y"
normal = [0.0, 3.0]
tangential = [-1.0, 1.0]
offset = [-0.05, 0.05]
knots = 3

[[controls]]
kind = "torque"
body = "ball"
x = [-1.0, 1.0]
z = [-1.0, 1.0]

[[controls]]
kind = "force"
body = "ball"
y = [-1.0, 1.0]

[[controls]]
kind = "start"
body = "ball"
of = "turn"
x = [-1.0, 1.0]
y = [-1.0, 1.0]
z = [-1.0, 1.0]

[[controls]]
kind = "start"
body = "lower"
of = "velocity"
x = [-1.0, 1.0]

[[target]]
body = "lower"
position = [0.5, 0.3]
velocity = [0.0, 0.1, 0.0]
spin = 0.0
turn = 40.0

[[target]]
body = "ball"
attitude = [0.8, 0.1, -0.5, 0.2]
after = 2

[[target]]
body = "next"
down = "+x"

[[keep]]
body = "ball"
above = { x = 0.1, width = 0.2, height = 0.3 }

[[keep]]
body = "lower"
away = { point = [1.0, 0.2, 0.1], radius = 0.8 }
"#;

/// Every kind of joint and of drive that the program knows, tied to the world and to each other, and a box on the ground.
pub const TIED: &str = r#"
name = "tied"
time_step = 0.05

[ground]
friction = 0.5

[[bodies]]
name = "lower"
box = [0.4, 0.3, 0.2]
mass = 1.5
position = [0.0, 0.0, 0.1]
velocity = [0.4, 0.0, 0.0]

[[bodies]]
name = "link"
box = [0.05, 0.06, 0.4]
mass = 0.5
touches = false
position = [0.0, 0.0, 0.45]
velocity = [0.4, 0.0, 0.0]

[[bodies]]
name = "slider"
box = [0.1, 0.12, 0.14]
mass = 0.3
touches = false
position = [0.0, 0.0, 0.75]
velocity = [0.4, 0.0, 0.0]

[[bodies]]
name = "tip"
box = [0.1, 0.05, 0.06]
mass = 0.2
touches = false
position = [0.1, 0.0, 0.9]
velocity = [0.4, 0.0, 0.0]

[[bodies]]
name = "wheel"
box = [0.3, 0.2, 0.1]
mass = 0.8
touches = false
position = [1.0, 0.0, 0.6]

[[bodies]]
name = "rider"
box = [0.1, 0.1, 0.1]
mass = 0.4
touches = false
position = [1.0, 0.0, 0.8]

[[joints]]
name = "hinge"
type = "revolute"
bodies = ["link", "lower"]
anchor = [0.0, 0.0, 0.25]
axis = [0, 1, 0]
limits = [-0.4, 0.0]
friction = 0.1
armature = 0.01

[[joints]]
name = "slide"
type = "prismatic"
bodies = ["slider", "link"]
anchor = [0.0, 0.0, 0.7]
axis = [0, 0.6, 0.8]
stiffness = 30.0
rest = 0.02
damping = 0.5

[[joints]]
name = "ball"
type = "spherical"
bodies = ["tip", "slider"]
anchor = [0.05, 0.0, 0.82]

[[joints]]
name = "axle"
type = "cylindrical"
bodies = "wheel"
anchor = [1.0, 0.1, 0.6]
axis = [0, 1, 0.2]

[[joints]]
name = "weld"
type = "fixed"
bodies = ["rider", "wheel"]
anchor = [1.0, 0.0, 0.7]

[[motors]]
joint = "slide"
position = 0.05
stiffness = 40.0
damping = 1.0
most = 1.2

[[motors]]
joint = "axle"
axis = "turn"
speed = 0.7
most = 0.4
"#;

pub const DRIVEN: &str = r#"
steps = 3

[[controls]]
kind = "motor"
joint = "hinge"
force = [-2.0, 3.0]
knots = 2

[[controls]]
kind = "motor"
joint = "axle"
axis = "slide"
force = [-2.0, 3.0]

[[controls]]
kind = "force"
body = "tip"
x = [-1.0, 1.0]

[[target]]
body = "tip"
position = [0.5, 0.3]

[[target]]
body = "rider"
spin = 0.0
"#;

/// A box on a tray that is driven: it goes, turns and rises.
pub const CARRIED: &str = r#"
name = "carried"
time_step = 0.02

[ground]
friction = 0.5

[[bodies]]
name = "tray"
box = [1.0, 0.8, 0.1]
mass = 3.0
position = [0.0, 0.0, 0.3]

[[bodies]]
name = "box"
box = [0.2, 0.24, 0.2]
mass = 1.0
position = [0.1, 0.05, 0.45]

[[driven]]
body = "tray"
times = [0.0, 0.2, 0.6, 1.0]
positions = [[0.0, 0.0, 0.3], [0.1, 0.0, 0.3], [0.4, 0.05, 0.32], [0.5, 0.05, 0.32]]
attitudes = [
    { axis = [0, 0, 1], degrees = 0 },
    { axis = [0, 0, 1], degrees = 2 },
    { axis = [0, 0, 1], degrees = 15 },
    { axis = [0, 0, 1], degrees = 20 },
]
"#;

pub const PULLED: &str = r#"
steps = 3

[[controls]]
kind = "force"
body = "box"
x = [-9.0, 9.0]
y = [-9.0, 9.0]

[target]
body = "box"
position = [0.35, 0.1]
velocity = [0.1, 0, 0.05]
"#;

/// A wheel with an axle in the world, a nut that slides as it turns, and an arm that it carries and turns back.
pub const GEARED: &str = r#"
name = "geared"
time_step = 0.01

[ground]
none = true
friction = 0.5

[[bodies]]
name = "wheel"
box = [0.3, 0.1, 0.2]
mass = 1.0
touches = false
position = [0.0, 0.0, 1.0]

[[bodies]]
name = "nut"
box = [0.1, 0.1, 0.1]
mass = 0.5
touches = false
position = [1.0, 0.0, 1.0]

[[bodies]]
name = "arm"
box = [0.4, 0.06, 0.05]
mass = 0.3
touches = false
position = [0.1, 0.0, 1.02]

[[joints]]
name = "axle"
type = "revolute"
bodies = "wheel"
anchor = [0.0, 0.0, 1.0]
axis = [0, 1, 0]
damping = 0.02

[[joints]]
name = "guide"
type = "prismatic"
bodies = "nut"
anchor = [1.0, 0.0, 1.0]
axis = [0.6, 0, 0.8]

[[joints]]
name = "elbow"
type = "revolute"
bodies = ["arm", "wheel"]
anchor = [0.1, 0.0, 1.02]
axis = [0, 1, 0]

[[gears]]
joints = ["guide", "axle"]
ratio = 0.15

[[gears]]
joints = ["elbow", "axle"]
ratio = -2.5
"#;

pub const TURNED: &str = r#"
steps = 3

[[controls]]
kind = "motor"
joint = "axle"
force = [-3.0, 3.0]

[target]
body = "nut"
x = 1.09
speed = 0
"#;
