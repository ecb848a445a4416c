"""DART: a boxed linear complementarity problem, or Coulomb's law by Gauss–Seidel: boxes alone."""

from __future__ import annotations

from importlib.metadata import version
from typing import Any

import dartpy
import numpy as np
from dartpy import constraint, dynamics

from .._scene import Body, Scene
from .._solids import matrix_of
from ._base import Engine, Motion, Stopwatch, Unsupported, no_restitution


class Dart(Engine):
    """DART with one of its contact solvers, ODE's collision detector and no deactivation."""

    compliant = False
    # A step of 36 bricks takes half a second.
    most_bodies = 15

    def __init__(self, name: str, make_solver: Any, settings: str) -> None:
        self.name, self.make_solver, self.settings = name, make_solver, settings

    def version(self) -> str:
        return version("dartpy")

    def run(self, scene: Scene) -> Motion:
        no_restitution(scene)
        if scene.forces or any(body.kind != "box" for body in scene.bodies):
            raise Unsupported("the adapter poses boxes without forces")
        world = dartpy.simulation.World()
        world.setTimeStep(scene.time_step)
        world.setGravity(scene.gravity)
        world.setCollisionDetector(dartpy.simulation.CollisionDetectorType.ODE)
        awake = world.getDeactivationOptions()
        awake.mEnabled = False
        world.setDeactivationOptions(awake)
        if self.make_solver is not None:
            world.getConstraintSolver().setBoxedLcpSolver(self.make_solver())
        bodies = [_added(world, body, scene) for body in scene.bodies][: len(scene.free)]
        if scene.ground:
            # A slab with its top at z = 0.
            _, slab = _skeleton(world, "ground").createWeldJointAndBodyNodePair()
            node = _covered(slab, np.array([100.0, 100.0, 1.0]), scene)
            node.setRelativeTranslation([0.0, 0.0, -0.5])
        states = np.empty((scene.steps + 1, len(bodies), 13))
        states[0] = scene.states
        stopwatch = Stopwatch()
        for step in range(scene.steps):
            with stopwatch:
                world.step()
            states[step + 1] = [_state(body) for body in bodies]
        return Motion(states, stopwatch.seconds, slowest=stopwatch.slowest)


def _skeleton(world: Any, name: str) -> Any:
    skeleton = dynamics.Skeleton(name)
    world.addSkeleton(skeleton)
    return skeleton


def _added(world: Any, body: Body, scene: Scene) -> Any:
    """Body in its initial state."""
    skeleton = dynamics.Skeleton(body.name)
    pose = dartpy.math.Isometry3()
    pose.set_translation(body.position)
    pose.set_rotation(matrix_of(body.attitude))
    if body.fixed:
        joint, node = skeleton.createWeldJointAndBodyNodePair()
        joint.setTransformFromParentBodyNode(pose)
        _covered(node, 2.0 * np.array(body.size), scene)
    else:
        joint, node = skeleton.createFreeJointAndBodyNodePair()
        _covered(node, 2.0 * np.array(body.size), scene)
        node.setMass(body.mass)
        node.setMomentOfInertia(*body.inertia)
        joint.setPositions(dynamics.FreeJoint.convertToPositions(pose))
        # Both velocities are in the body's frame.
        joint.setVelocities(np.concatenate([body.spin, matrix_of(body.attitude).T @ body.velocity]))
    world.addSkeleton(skeleton)
    return node


def _covered(body: Any, sides: Any, scene: Scene) -> Any:
    """Gives a body its shape, a box, and its material."""
    node = body.createShapeNode(dynamics.BoxShape(sides))
    node.createCollisionAspect()
    surface = node.createDynamicsAspect()
    surface.setFrictionCoeff(scene.friction)
    surface.setRestitutionCoeff(0.0)
    return node


def _state(body: Any) -> Any:
    """Position, attitude, velocity, spin in the body's frame."""
    pose = body.getWorldTransform()
    spin = pose.rotation().T @ body.getAngularVelocity()
    return np.concatenate((pose.translation(), pose.quaternion().wxyz(), body.getLinearVelocity(), spin))


ENGINES: list[Engine] = [
    Dart("dart", None, "defaults: a boxed LCP"),
    Dart("dart-exact", constraint.NsgsFrictionSolver, "NsgsFrictionSolver, at most 100 sweeps, 1e-5"),
]
