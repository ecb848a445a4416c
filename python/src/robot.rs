//! A robot of a scene: coordinates and contents of its file.

use crate::arrays::{Array, Numbers, list, numbers, shaped, states_array, to_states};
use crate::errors::refused;
use crate::scene::PyScene;
use nalgebra::{DMatrix, Vector3, Vector4};
use pyo3::prelude::*;
use std::sync::Arc;
use tumble_robot::LinkFrame;
use tumble_robot::model::{Actuator, Moves};
use tumble_robot::motion::{LinkMotion, RobotMotion};
use tumble_robot::sensors::RobotSite;
use tumble_scene::Assembled;
use tumble_scene::scene::Scene as Content;

/// One robot of a scene. It is immutable; methods take the states of a simulation.
#[pyclass(frozen, subclass, name = "CoreRobot", module = "tumble._tumble")]
pub struct PyRobot {
    content: Arc<Content>,
    index: usize,
}

impl PyRobot {
    /// The robot in its scene.
    pub fn own(&self) -> &Assembled {
        &self.content.robots[self.index]
    }

    /// Number of the robot in its scene.
    pub fn index(&self) -> usize {
        self.index
    }

    /// Hinges: joint and angular axis in the simulation, place among the coordinates, and reference
    /// coordinate.
    pub fn hinges(&self) -> impl Iterator<Item = ((usize, usize), usize, f64)> + '_ {
        let robot = self.own().robot();
        let joints = robot.joints.iter().zip(robot.places()).enumerate();
        let hinges = joints.filter(|(_, (joint, _))| joint.moves == Moves::Hinge);
        hinges.filter_map(|(index, (joint, (place, _)))| {
            let (number, axis) = self.own().axis(index)?;
            Some(((number, axis.checked_sub(3)?), place, joint.reference))
        })
    }

    fn at(&self, q: &Numbers<'_>, v: Option<&[f64]>) -> PyResult<RobotMotion> {
        let robot = self.own().robot();
        let still = vec![0.0; robot.counts().1];
        robot.motion(numbers("q", q)?, v.unwrap_or(&still)).map_err(refused)
    }
}

/// Converts a matrix to an array (rows, columns).
fn by_rows<'py>(py: Python<'py>, matrix: &DMatrix<f64>) -> PyResult<Array<'py>> {
    shaped(py, matrix.transpose().as_slice().to_vec(), &[matrix.nrows(), matrix.ncols()])
}

/// Positions (L, 3), attitudes (L, 4), velocities (L, 3) and spins (L, 3).
fn link_arrays<'py>(py: Python<'py>, links: &[LinkMotion]) -> PyResult<Vec<Array<'py>>> {
    let column = |of: &dyn Fn(&LinkMotion) -> Vec<f64>, width: usize| {
        shaped(py, links.iter().flat_map(of).collect(), &[links.len(), width])
    };
    Ok(vec![
        column(&|link| link.frame.position.as_slice().to_vec(), 3)?,
        column(&|link| link.frame.attitude.as_slice().to_vec(), 4)?,
        column(&|link| link.velocity.as_slice().to_vec(), 3)?,
        column(&|link| link.spin.as_slice().to_vec(), 3)?,
    ])
}

#[pymethods]
impl PyRobot {
    /// Creates the robot with this index in a scene.
    #[new]
    fn new(scene: PyRef<'_, PyScene>, index: usize) -> PyResult<Self> {
        let content = Arc::clone(&scene.content);
        match index < content.robots.len() {
            true => Ok(Self { content, index }),
            false => Err(refused(format!(
                "robot: the index does not exist; the scene has {} robots",
                content.robots.len()
            ))),
        }
    }

    /// Name in its file.
    #[getter]
    fn name(&self) -> &str {
        &self.own().robot().name
    }

    /// Prefix of its names in the scene.
    #[getter]
    fn prefix(&self) -> &str {
        self.own().prefix()
    }

    /// Contents of its file that are ignored.
    #[getter]
    fn notes(&self) -> Vec<String> {
        self.own().robot().notes.clone()
    }

    /// Sites of its file: name, and link with position and attitude.
    #[getter]
    fn site_list(&self) -> Vec<(String, LinkPlace)> {
        let place = |RobotSite { link, frame }: &RobotSite| -> LinkPlace {
            (*link, frame.position.into(), frame.attitude.into())
        };
        let sites = &self.own().robot().sites;
        sites.iter().map(|named| (named.name.clone(), place(&named.site))).collect()
    }

    /// Names of its links, the world first.
    #[getter]
    fn links(&self) -> Vec<String> {
        self.own().robot().links.iter().map(|link| link.name.clone()).collect()
    }

    /// Scene body of each link; None for fixed links.
    #[getter]
    fn bodies(&self) -> Vec<Option<usize>> {
        let own = self.own();
        (0..own.robot().links.len()).map(|link| own.body(link)).collect()
    }

    /// Indices of the scene's fixed pieces of each link and of links fixed to it; empty for moving
    /// links.
    #[getter]
    fn pieces(&self) -> Vec<Vec<usize>> {
        let own = self.own();
        (0..own.robot().links.len()).map(|link| own.pieces(link)).collect()
    }

    /// Joints: name, type, first coordinate, first rate and reference coordinate.
    #[getter]
    fn joint_list(&self) -> Vec<(String, &'static str, usize, usize, f64)> {
        let robot = self.own().robot();
        let word = |moves: Moves| match moves {
            Moves::Free => "free",
            Moves::Ball => "ball",
            Moves::Slide => "slide",
            Moves::Hinge => "hinge",
        };
        let joints = robot.joints.iter().zip(robot.places());
        let named = joints
            .map(|(joint, (q, v))| (joint.name.clone(), word(joint.moves), q, v, joint.reference));
        named.collect()
    }

    /// Range of a joint, and the range of the total force of its motors.
    fn bounds(&self, joint: usize) -> (Option<[f64; 2]>, Option<[f64; 2]>) {
        let of = self.own().robot().joints.get(joint);
        of.map_or((None, None), |joint| (joint.range, joint.effort))
    }

    /// Scene joint and axis of a slide or a hinge.
    fn axis(&self, joint: usize) -> Option<(usize, usize)> {
        self.own().axis(joint)
    }

    /// Names of its actuators.
    #[getter]
    fn actuators(&self) -> Vec<String> {
        self.own().robot().actuators.iter().map(|actuator| actuator.name.clone()).collect()
    }

    /// Control ranges of its actuators; None for unlimited ones.
    #[getter]
    fn control_ranges(&self) -> Vec<Option<[f64; 2]>> {
        self.own().robot().actuators.iter().map(|actuator| actuator.control_range).collect()
    }

    /// Actuators: joints with their factors, gear, gain, bias and force range.
    #[getter]
    fn actuator_list(&self) -> Vec<ActuatorParts> {
        let parts = |of: &Actuator| (of.joints.clone(), of.gear, of.gain, of.bias, of.force_range);
        self.own().robot().actuators.iter().map(parts).collect()
    }

    /// Indices of the joints whose coordinate follows that of another joint.
    #[getter]
    fn followers(&self) -> Vec<usize> {
        self.own().robot().follows.iter().map(|mimic| mimic.joints[0]).collect()
    }

    /// Numbers of coordinates and rates.
    #[getter]
    fn counts(&self) -> (usize, usize) {
        self.own().robot().counts()
    }

    /// Names of its keyframe poses.
    #[getter]
    fn poses(&self) -> Vec<String> {
        self.own().robot().keys.iter().map(|key| key.name.clone()).collect()
    }

    /// Initial coordinates.
    #[getter]
    fn start<'py>(&self, py: Python<'py>) -> PyResult<Array<'py>> {
        list(py, self.own().start().to_vec())
    }

    /// Initial controls.
    #[getter]
    fn first_controls<'py>(&self, py: Python<'py>) -> PyResult<Array<'py>> {
        list(py, self.own().controls().to_vec())
    }

    /// Coordinates and rates for the states (N, 13). Angles are the ones nearest to `near`.
    fn coordinates<'py>(
        &self,
        py: Python<'py>,
        states: Numbers<'py>,
        near: Numbers<'py>,
    ) -> PyResult<(Array<'py>, Array<'py>)> {
        let states = to_states("states", &states)?;
        let found = self.own().coordinates(&states, numbers("near", &near)?);
        let (q, v) = found.map_err(refused)?;
        Ok((list(py, q)?, list(py, v)?))
    }

    /// States (N, 13) with the robot's bodies at these coordinates and rates.
    fn placed<'py>(
        &self,
        py: Python<'py>,
        q: Numbers<'py>,
        v: Numbers<'py>,
        states: Numbers<'py>,
    ) -> PyResult<Array<'py>> {
        let mut states = to_states("states", &states)?;
        let set = self.own().set_states(numbers("q", &q)?, numbers("v", &v)?, &mut states);
        set.map_err(refused)?;
        states_array(py, &states)
    }

    /// Least height of any body above the ground at states (N, 13), m. Infinite without a ground.
    fn lowest(&self, states: Numbers<'_>) -> PyResult<f64> {
        Ok(self.content.world.lowest_height(&to_states("states", &states)?))
    }

    /// Motion of its links at states (N, 13).
    fn moving<'py>(&self, py: Python<'py>, states: Numbers<'py>) -> PyResult<Vec<Array<'py>>> {
        let links = self.own().links_at(&to_states("states", &states)?);
        link_arrays(py, &links.map_err(refused)?)
    }

    /// Motion of its links at these coordinates and rates (forward kinematics).
    fn forward<'py>(
        &self,
        py: Python<'py>,
        q: Numbers<'py>,
        v: Numbers<'py>,
    ) -> PyResult<Vec<Array<'py>>> {
        link_arrays(py, self.at(&q, Some(numbers("v", &v)?))?.links())
    }

    /// Mass matrix (V, V) at coordinates.
    fn masses<'py>(&self, py: Python<'py>, q: Numbers<'py>) -> PyResult<Array<'py>> {
        by_rows(py, &self.at(&q, None)?.mass_matrix(self.own().robot()))
    }

    /// Bias forces (V,) at coordinates and rates, under the gravity of the scene.
    fn biases<'py>(
        &self,
        py: Python<'py>,
        q: Numbers<'py>,
        v: Numbers<'py>,
    ) -> PyResult<Array<'py>> {
        let motion = self.at(&q, Some(numbers("v", &v)?))?;
        let bias = motion.bias(self.own().robot(), self.content.world.gravity());
        list(py, bias.as_slice().to_vec())
    }

    /// Jacobians (3, V) of a point's position and of its link's rotation.
    fn jacobians<'py>(
        &self,
        py: Python<'py>,
        link: usize,
        point: [f64; 3],
        q: Numbers<'py>,
    ) -> PyResult<(Array<'py>, Array<'py>)> {
        if link >= self.own().robot().links.len() {
            return Err(refused("link: it does not exist"));
        }
        let [place, turn] = self.at(&q, None)?.jacobian(link, &Vector3::from(point));
        Ok((by_rows(py, &place)?, by_rows(py, &turn)?))
    }

    /// Motion of a site at states (N, 13). A site is a frame at a point of a link.
    fn site_motion<'py>(
        &self,
        py: Python<'py>,
        site: LinkPlace,
        states: Numbers<'py>,
    ) -> PyResult<Vec<Array<'py>>> {
        let links = self.own().links_at(&to_states("states", &states)?).map_err(refused)?;
        let moving = at_place(site)?.motion(&links).map_err(refused)?;
        [
            moving.frame.position.as_slice(),
            moving.frame.attitude.as_slice(),
            moving.velocity.as_slice(),
            moving.spin.as_slice(),
        ]
        .into_iter()
        .map(|numbers| list(py, numbers.to_vec()))
        .collect()
    }

    /// Readings of a gyroscope and an accelerometer at a site over a step between two states (N,
    /// 13).
    fn site_inertial<'py>(
        &self,
        py: Python<'py>,
        site: LinkPlace,
        start: Numbers<'py>,
        end: Numbers<'py>,
    ) -> PyResult<(Array<'py>, Array<'py>)> {
        let links = |name, states| -> PyResult<_> {
            self.own().links_at(&to_states(name, states)?).map_err(refused)
        };
        let (site, world) = (at_place(site)?, &self.content.world);
        let (start, end) = (links("before", &start)?, links("after", &end)?);
        let gyroscope = site.gyroscope(&end).map_err(refused)?;
        let read =
            site.accelerometer([&start, &end], world.time_step(), world.gravity()).map_err(refused);
        let three = |of: Vector3<f64>| list(py, of.as_slice().to_vec());
        Ok((three(gyroscope)?, three(read?)?))
    }
}

/// Joints with their factors, gear, gain, bias and force range.
type ActuatorParts = (Vec<(usize, f64)>, f64, f64, [f64; 3], Option<[f64; 2]>);

/// Frame on a link: link, point (m) and attitude.
pub type LinkPlace = (usize, [f64; 3], [f64; 4]);

/// Converts a frame on a link to a site.
pub fn at_place((link, point, attitude): LinkPlace) -> PyResult<RobotSite> {
    let attitude = Vector4::from(attitude);
    if attitude.norm().is_nan() || attitude.norm() < 1e-12 {
        return Err(refused("attitude: four numbers, not all zero, are needed"));
    }
    let frame = LinkFrame { position: point.into(), attitude: attitude.normalize() };
    Ok(RobotSite { link, frame })
}
