"""Drake: compliant contacts, a convex problem a step (SAP), or error-controlled integration (CENIC)."""

from __future__ import annotations

import logging
from importlib.metadata import version
from typing import Any

import numpy as np
from pydrake.common import MemoryFile
from pydrake.common.eigen_geometry import Quaternion
from pydrake.geometry import (
    AddCompliantHydroelasticProperties,
    AddContactMaterial,
    AddRigidHydroelasticProperties,
    Box,
    Capsule,
    Convex,
    HalfSpace,
    InMemoryMesh,
    MeshSource,
    ProximityProperties,
    SceneGraphConfig,
    Sphere,
)
from pydrake.math import RigidTransform
from pydrake.multibody.math import SpatialForce, SpatialVelocity
from pydrake.multibody.plant import (
    AddMultibodyPlant,
    CoulombFriction,
    ExternallyAppliedSpatialForce,
    MultibodyPlantConfig,
)
from pydrake.multibody.tree import SpatialInertia, UnitInertia
from pydrake.systems.analysis import ApplySimulatorConfig, Simulator, SimulatorConfig
from pydrake.systems.framework import DiagramBuilder

from .._scene import Body, Scene
from ._base import Engine, Motion, Stopwatch, no_restitution, rows, world_spin

logging.getLogger("drake").setLevel(logging.ERROR)

MODULUS = 1e7
"""Hydroelastic modulus of bodies with flat faces, Pa, the default of SceneGraphConfig."""
ACCURACY = 1e-4
"""Accuracy of the error control."""


class Drake(Engine):
    """Drake's plant with one of its integrations.

    Boxes and hulls have hydroelastic contact, since point contact has only one point a pair. Balls and the ends of
    capsules have point contact, since their hydroelastic meshes have facets.
    """

    compliant = True
    # A step of 100 boxes takes 20 ms.
    most_bodies = 36

    def __init__(self, name: str, settings: str) -> None:
        self.name, self.settings = name, settings
        self.continuous = name == "drake-cenic"

    def version(self) -> str:
        return version("drake")

    def run(self, scene: Scene) -> Motion:
        no_restitution(scene)
        builder = DiagramBuilder()
        config = MultibodyPlantConfig(time_step=0.0 if self.continuous else scene.time_step)
        if not self.continuous:
            config.discrete_contact_approximation = "sap"
        plant, _ = AddMultibodyPlant(config, SceneGraphConfig(), builder)
        plant.mutable_gravity_field().set_gravity_vector(scene.gravity)
        if scene.ground:
            plant.RegisterCollisionGeometry(
                plant.world_body(), RigidTransform(), HalfSpace(), "ground", _properties(scene, None, True)
            )
        bodies = []
        for body in scene.bodies:
            bodies.append(plant.world_body() if body.fixed else _added(plant, body))
            _shapes(plant, bodies[-1], body, scene)
        plant.Finalize()
        simulator = Simulator(builder.Build())
        if self.continuous:
            control = SimulatorConfig(integration_scheme="cenic", accuracy=ACCURACY, use_error_control=True)
            control.max_step_size = 10.0 * scene.time_step
            ApplySimulatorConfig(control, simulator)
        context = plant.GetMyContextFromRoot(simulator.get_mutable_context())
        free = bodies[: len(scene.free)]
        for body, made in zip(scene.free, free):
            plant.SetFreeBodyPose(context, made, RigidTransform(Quaternion(body.attitude), body.position))
            velocity = SpatialVelocity(world_spin(body.state[None])[0], body.velocity)
            plant.SetFreeBodySpatialVelocity(context=context, body=made, V_JpJc=velocity)
        simulator.Initialize()
        port = plant.get_applied_spatial_force_input_port()
        states = np.empty((scene.steps + 1, len(free), 13))
        states[0] = scene.states
        stopwatch = Stopwatch()
        for step in range(scene.steps):
            if scene.forces:
                port.FixValue(context, _pushes(scene.wrenches(step, states[step]), free))
            with stopwatch:
                simulator.AdvanceTo((step + 1) * scene.time_step)
            states[step + 1] = _states(plant, context)
        return Motion(states, stopwatch.seconds, slowest=stopwatch.slowest)


def _added(plant: Any, body: Body) -> Any:
    inertia = SpatialInertia(body.mass, np.zeros(3), UnitInertia(*(body.inertia / body.mass)), skip_validity_check=True)
    return plant.AddRigidBody(body.name, inertia)


def _shapes(plant: Any, made: Any, body: Body, scene: Scene) -> None:
    """Registers the shapes of a body. A capsule also has a ball at each end: its flat contact has two points."""
    place = RigidTransform(Quaternion(body.attitude), body.position) if body.fixed else RigidTransform()

    def register(name: str, at: Any, shape: Any, extent: Any) -> None:
        properties = _properties(scene, extent, body.fixed)
        plant.RegisterCollisionGeometry(made, at, shape, f"{body.name} {name}", properties)

    if body.kind == "box":
        register("box", place, Box(*(2.0 * half for half in body.size)), min(body.size))
    elif body.kind == "sphere":
        register("ball", place, Sphere(body.size[0]), None)
    elif body.kind == "capsule":
        register("capsule", place, Capsule(body.size[0], 2.0 * body.size[1]), None)
        for end, point in enumerate(body.points):
            register(f"end {end}", place @ RigidTransform(point), Sphere(body.size[0]), None)
    else:
        register("hull", place, Convex(_mesh(body)), float(np.abs(body.points).max()))


def _mesh(body: Body) -> Any:
    """Corners as an OBJ mesh of which Drake takes the convex hull; the faces only name all corners."""
    lines = [f"v {x!r} {y!r} {z!r}" for x, y, z in body.points.tolist()]
    lines += [f"f 1 {corner} {corner + 1}" for corner in range(2, len(body.points))]
    return MeshSource(InMemoryMesh(mesh_file=MemoryFile("\n".join(lines) + "\n", ".obj", body.name)))


def _properties(scene: Scene, extent: Any, fixed: bool) -> Any:
    """Contact properties: hydroelastic for a shape with an ``extent`` and for the ground."""
    properties = ProximityProperties()
    friction = CoulombFriction(scene.friction, scene.friction)
    AddContactMaterial(properties=properties, friction=friction)
    properties.AddProperty("material", "relaxation_time", scene.time_step)
    if fixed:
        AddRigidHydroelasticProperties(1.0 if extent is None else extent, properties)
    elif extent is not None:
        AddCompliantHydroelasticProperties(extent, MODULUS, properties)
    return properties


def _pushes(wrenches: Any, free: list[Any]) -> list[Any]:
    pushes = []
    for wrench, body in zip(wrenches, free):
        push = ExternallyAppliedSpatialForce()
        push.body_index = body.index()
        push.p_BoBq_B = np.zeros(3)
        push.F_Bq_W = SpatialForce(wrench[3:], wrench[:3])
        pushes.append(push)
    return pushes


def _states(plant: Any, context: Any) -> Any:
    """States of the bodies; the plant has attitude and position, world spin and velocity."""
    positions = plant.GetPositions(context).reshape(-1, 7)
    velocities = plant.GetVelocities(context).reshape(-1, 6)
    return rows(positions[:, 4:], positions[:, :4], velocities[:, 3:], velocities[:, :3])


ENGINES: list[Engine] = [
    Drake("drake-sap", "discrete, SAP, relaxation time one step, hydroelastic boxes and hulls"),
    Drake("drake-cenic", f"CENIC, accuracy {ACCURACY:g}, default materials, hydroelastic boxes and hulls"),
]
