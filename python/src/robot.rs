//! A robot of a scene: its coordinates, and what its file says.

use crate::arrays::{Array, numbers, of_states, shaped, to_states};
use crate::errors::refused;
use crate::scene::PyScene;
use nalgebra::{DMatrix, Vector3, Vector4};
use numpy::PyReadonlyArrayDyn;
use pyo3::prelude::*;
use std::sync::Arc;
use tumble_robot::model::Moves;
use tumble_robot::motion::{LinkMotion, RobotMotion};
use tumble_robot::sensors::RobotSite;
use tumble_robot::{Assembled, LinkFrame};
use tumble_scene::scene::Scene as Content;

/// One robot of a scene. Nothing of it changes; a simulation's states are given to it.
#[pyclass(frozen, subclass, name = "CoreRobot", module = "tumble._tumble")]
pub struct PyRobot {
    content: Arc<Content>,
    index: usize,
}

impl PyRobot {
    /// What it is in the scene.
    pub fn own(&self) -> &Assembled {
        &self.content.robots[self.index]
    }

    fn at(&self, q: &PyReadonlyArrayDyn<'_, f64>, v: Option<&[f64]>) -> PyResult<RobotMotion> {
        let robot = self.own().robot();
        let still = vec![0.0; robot.counts().1];
        robot.motion(numbers("q", q)?, v.unwrap_or(&still)).map_err(refused)
    }
}

/// Rows of a matrix as (rows, columns).
fn by_rows<'py>(py: Python<'py>, matrix: &DMatrix<f64>) -> PyResult<Array<'py>> {
    shaped(py, matrix.transpose().as_slice().to_vec(), &[matrix.nrows(), matrix.ncols()])
}

/// Places (L, 3), attitudes (L, 4), velocities (L, 3) and spins (L, 3).
fn of_links<'py>(py: Python<'py>, links: &[LinkMotion]) -> PyResult<Vec<Array<'py>>> {
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
    /// The robot of this number in a scene.
    #[new]
    fn new(scene: PyRef<'_, PyScene>, index: usize) -> PyResult<Self> {
        let content = Arc::clone(&scene.content);
        match index < content.robots.len() {
            true => Ok(Self { content, index }),
            false => Err(refused(format!("robot: the scene has {}", content.robots.len()))),
        }
    }

    /// What its file calls it.
    #[getter]
    fn name(&self) -> &str {
        &self.own().robot().name
    }

    /// What stands before its names in the scene.
    #[getter]
    fn prefix(&self) -> &str {
        self.own().prefix()
    }

    /// What stands in its file and has no meaning here.
    #[getter]
    fn notes(&self) -> Vec<String> {
        self.own().robot().notes.clone()
    }

    /// Of its file's sites the names, links and frames there.
    #[getter]
    fn site_list(&self) -> Vec<(String, LinkPlace)> {
        let place = |RobotSite { link, frame }: &RobotSite| -> LinkPlace {
            (*link, frame.position.into(), frame.attitude.into())
        };
        let sites = &self.own().robot().sites;
        sites.iter().map(|named| (named.name.clone(), place(&named.site))).collect()
    }

    /// The names of its links, the world first.
    #[getter]
    fn links(&self) -> Vec<String> {
        self.own().robot().links.iter().map(|link| link.name.clone()).collect()
    }

    /// The body of the scene that each link moves with; None of what is fixed.
    #[getter]
    fn bodies(&self) -> Vec<Option<usize>> {
        let own = self.own();
        (0..own.robot().links.len()).map(|link| own.body(link)).collect()
    }

    /// Of each joint its name, how it moves, where its coordinates and its rates begin, and its reference.
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
        let told = joints
            .map(|(joint, (q, v))| (joint.name.clone(), word(joint.moves), q, v, joint.reference));
        told.collect()
    }

    /// The range of a joint, and the forces that its motors have together.
    fn bounds(&self, joint: usize) -> (Option<[f64; 2]>, Option<[f64; 2]>) {
        let of = self.own().robot().joints.get(joint);
        of.map_or((None, None), |joint| (joint.range, joint.effort))
    }

    /// The joint of the scene that a slide or a hinge is, and which of its axes.
    fn axis(&self, joint: usize) -> Option<(usize, usize)> {
        self.own().axis(joint)
    }

    /// The names of its actuators.
    #[getter]
    fn actuators(&self) -> Vec<String> {
        self.own().robot().actuators.iter().map(|actuator| actuator.name.clone()).collect()
    }

    /// The ranges of the controls of its actuators; None of what has none.
    #[getter]
    fn control_ranges(&self) -> Vec<Option<[f64; 2]>> {
        self.own().robot().actuators.iter().map(|actuator| actuator.control_range).collect()
    }

    /// How many coordinates and rates it has.
    #[getter]
    fn counts(&self) -> (usize, usize) {
        self.own().robot().counts()
    }

    /// The names of its poses.
    #[getter]
    fn poses(&self) -> Vec<String> {
        self.own().robot().keys.iter().map(|key| key.name.clone()).collect()
    }

    /// The coordinates at the start.
    #[getter]
    fn start<'py>(&self, py: Python<'py>) -> PyResult<Array<'py>> {
        let start = self.own().start().to_vec();
        let count = start.len();
        shaped(py, start, &[count])
    }

    /// The controls at the start.
    #[getter]
    fn first_controls<'py>(&self, py: Python<'py>) -> PyResult<Array<'py>> {
        let controls = self.own().controls().to_vec();
        let count = controls.len();
        shaped(py, controls, &[count])
    }

    /// Coordinates and rates where the bodies are at states (N, 13), angles nearest to those of `near`.
    fn coordinates<'py>(
        &self,
        py: Python<'py>,
        states: PyReadonlyArrayDyn<'py, f64>,
        near: PyReadonlyArrayDyn<'py, f64>,
    ) -> PyResult<(Array<'py>, Array<'py>)> {
        let states = to_states("states", &states)?;
        let found = self.own().coordinates(&states, numbers("near", &near)?);
        let (q, v) = found.map_err(refused)?;
        let (positions, rates) = (q.len(), v.len());
        Ok((shaped(py, q, &[positions])?, shaped(py, v, &[rates])?))
    }

    /// The states (N, 13) with those of its bodies at these coordinates and rates.
    fn placed<'py>(
        &self,
        py: Python<'py>,
        q: PyReadonlyArrayDyn<'py, f64>,
        v: PyReadonlyArrayDyn<'py, f64>,
        states: PyReadonlyArrayDyn<'py, f64>,
    ) -> PyResult<Array<'py>> {
        let mut states = to_states("states", &states)?;
        let set = self.own().set_states(numbers("q", &q)?, numbers("v", &v)?, &mut states);
        set.map_err(refused)?;
        of_states(py, &states)
    }

    /// The least height of any body above the ground where the bodies are at states (N, 13), m; infinite without one.
    fn lowest(&self, states: PyReadonlyArrayDyn<'_, f64>) -> PyResult<f64> {
        Ok(self.content.world.lowest_height(&to_states("states", &states)?))
    }

    /// How its links move where the bodies are at states (N, 13).
    fn moving<'py>(
        &self,
        py: Python<'py>,
        states: PyReadonlyArrayDyn<'py, f64>,
    ) -> PyResult<Vec<Array<'py>>> {
        let links = self.own().links_at(&to_states("states", &states)?);
        of_links(py, &links.map_err(refused)?)
    }

    /// How its links move at these coordinates and rates.
    fn forward<'py>(
        &self,
        py: Python<'py>,
        q: PyReadonlyArrayDyn<'py, f64>,
        v: PyReadonlyArrayDyn<'py, f64>,
    ) -> PyResult<Vec<Array<'py>>> {
        of_links(py, self.at(&q, Some(numbers("v", &v)?))?.links())
    }

    /// The mass matrix (V, V) at coordinates.
    fn masses<'py>(
        &self,
        py: Python<'py>,
        q: PyReadonlyArrayDyn<'py, f64>,
    ) -> PyResult<Array<'py>> {
        by_rows(py, &self.at(&q, None)?.mass_matrix(self.own().robot()))
    }

    /// The bias forces (V,) at coordinates and rates, under the gravity of the scene.
    fn biases<'py>(
        &self,
        py: Python<'py>,
        q: PyReadonlyArrayDyn<'py, f64>,
        v: PyReadonlyArrayDyn<'py, f64>,
    ) -> PyResult<Array<'py>> {
        let motion = self.at(&q, Some(numbers("v", &v)?))?;
        let bias = motion.bias(self.own().robot(), self.content.world.gravity());
        let bias = bias.as_slice().to_vec();
        let count = bias.len();
        shaped(py, bias, &[count])
    }

    /// The Jacobians (3, V) of a point's place and of the turn of its link.
    fn jacobians<'py>(
        &self,
        py: Python<'py>,
        link: usize,
        point: [f64; 3],
        q: PyReadonlyArrayDyn<'py, f64>,
    ) -> PyResult<(Array<'py>, Array<'py>)> {
        if link >= self.own().robot().links.len() {
            return Err(refused("link: there is no such link"));
        }
        let [place, turn] = self.at(&q, None)?.jacobian(link, &Vector3::from(point));
        Ok((by_rows(py, &place)?, by_rows(py, &turn)?))
    }

    /// How a site moves, a frame at a point of a link with an attitude there, where the bodies are at states (N, 13).
    fn site_motion<'py>(
        &self,
        py: Python<'py>,
        site: LinkPlace,
        states: PyReadonlyArrayDyn<'py, f64>,
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
        .map(|numbers| shaped(py, numbers.to_vec(), &[numbers.len()]))
        .collect()
    }

    /// What a gyroscope and an accelerometer there read of a step from states (N, 13) to others.
    fn site_inertial<'py>(
        &self,
        py: Python<'py>,
        site: LinkPlace,
        start: PyReadonlyArrayDyn<'py, f64>,
        end: PyReadonlyArrayDyn<'py, f64>,
    ) -> PyResult<(Array<'py>, Array<'py>)> {
        let links = |name, states| -> PyResult<_> {
            self.own().links_at(&to_states(name, states)?).map_err(refused)
        };
        let (site, world) = (at_place(site)?, &self.content.world);
        let (start, end) = (links("before", &start)?, links("after", &end)?);
        let gyroscope = site.gyroscope(&end).map_err(refused)?;
        let read =
            site.accelerometer([&start, &end], world.time_step(), world.gravity()).map_err(refused);
        let three = |of: Vector3<f64>| shaped(py, vec![of[0], of[1], of[2]], &[3]);
        Ok((three(gyroscope)?, three(read?)?))
    }
}

/// A link, a point of it (m), and an attitude there.
pub type LinkPlace = (usize, [f64; 3], [f64; 4]);

/// The frame at a place.
pub fn at_place((link, point, attitude): LinkPlace) -> PyResult<RobotSite> {
    let attitude = Vector4::from(attitude);
    if attitude.norm().is_nan() || attitude.norm() < 1e-12 {
        return Err(refused("attitude: four numbers are needed that are not all zero"));
    }
    let frame = LinkFrame { position: point.into(), attitude: attitude.normalize() };
    Ok(RobotSite { link, frame })
}
