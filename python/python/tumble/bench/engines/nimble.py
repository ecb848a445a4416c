"""Nimble: a differentiable engine that solves a linear complementarity problem a step."""

from __future__ import annotations

from importlib.metadata import version
from typing import Any

import nimblephysics
import numpy as np
import torch

from .._scene import Body, Scene
from .._solids import matrix_of
from ._base import Engine, Motion, Sensitivities, Stopwatch, Unsupported, rows

GROUND = 50.0
"""Side of the box that is the ground, m."""


class Nimble(Engine):
    """Nimble with its default settings."""

    name = "nimble"
    settings = "defaults, the ground is a box, derivatives by its backward pass"
    compliant = False

    def version(self) -> str:
        return version("nimblephysics")

    def run(self, scene: Scene) -> Motion:
        world, nodes = _world(scene)
        states = np.empty((scene.steps + 1, len(nodes), 13))
        states[0] = scene.states
        stopwatch = Stopwatch()
        for step in range(scene.steps):
            if scene.forces:
                world.setControlForces(_own_frame(states[step], scene.wrenches(step, states[step])))
            with stopwatch:
                world.step()
            states[step + 1] = _states(nodes)
        return Motion(states, stopwatch.seconds, slowest=stopwatch.slowest)

    def sensitivities(self, scene: Scene, body: int, component: int) -> Sensitivities | None:
        world, nodes = _world(scene)
        start = torch.tensor(np.concatenate([world.getPositions(), world.getVelocities()]), requires_grad=True)
        state = start
        for step in range(scene.steps):
            push = _own_frame(scene.states, scene.wrenches(step, scene.states))
            state = nimblephysics.timestep(world, state, torch.tensor(push))
        count = 6 * len(nodes)
        # Six positions and six velocities a body: rotation, then translation.
        place = 6 * body + 3 + component if component < 3 else count + 6 * body + 3 + component - 7
        state[place].backward()
        by = start.grad.numpy()
        return Sensitivities(
            position=by[:count].reshape(-1, 6)[:, 3:], velocity=by[count:].reshape(-1, 6)[:, 3:]
        )


def _world(scene: Scene) -> Any:
    """World at the start and the nodes of its free bodies."""
    world = nimblephysics.simulation.World()
    world.setGravity(scene.gravity)
    world.setTimeStep(scene.time_step)
    nodes = []
    for body in scene.bodies:
        skeleton = nimblephysics.dynamics.Skeleton()
        if body.fixed:
            _fixed(skeleton, _shape(body), body.position, body.attitude, scene)
        else:
            joint, node = skeleton.createFreeJointAndBodyNodePair()
            _cover(node, _shape(body), scene)
            node.setMass(body.mass)
            node.setMomentOfInertia(*body.inertia, 0.0, 0.0, 0.0)
            nodes.append(node)
        world.addSkeleton(skeleton)
    if scene.ground:
        skeleton = nimblephysics.dynamics.Skeleton()
        box = nimblephysics.dynamics.BoxShape(np.full(3, GROUND))
        _fixed(skeleton, box, np.array([0.0, 0.0, -0.5 * GROUND]), np.array([1.0, 0.0, 0.0, 0.0]), scene)
        world.addSkeleton(skeleton)
    states = scene.states
    rotations = [nimblephysics.math.logMap(matrix_of(state[3:7])) for state in states]
    world.setPositions(np.concatenate([[*rotation, *state[:3]] for rotation, state in zip(rotations, states)]))
    world.setVelocities(_own_frame(states, np.concatenate([states[:, 7:10], _world_spins(states)], axis=1)))
    return world, nodes


def _fixed(skeleton: Any, shape: Any, position: Any, attitude: Any, scene: Scene) -> None:
    joint, node = skeleton.createWeldJointAndBodyNodePair()
    place = nimblephysics.math.Isometry3(matrix_of(attitude), position)
    joint.setTransformFromParentBodyNode(place)
    _cover(node, shape, scene)


def _cover(node: Any, shape: Any, scene: Scene) -> None:
    """Gives a node its shape and material."""
    part = node.createShapeNode(shape)
    part.createVisualAspect()
    part.createCollisionAspect()
    node.setFrictionCoeff(scene.friction)
    node.setRestitutionCoeff(scene.restitution)


def _shape(body: Body) -> Any:
    dynamics = nimblephysics.dynamics
    if body.kind == "box":
        return dynamics.BoxShape(2.0 * np.array(body.size))
    if body.kind == "sphere":
        return dynamics.SphereShape(body.size[0])
    if body.kind == "capsule":
        return dynamics.CapsuleShape(body.size[0], 2.0 * body.size[1])
    raise Unsupported("no convex hulls in memory")


def _own_frame(states: Any, vectors: Any) -> Any:
    """Translations and rotations (N, 6) in the world's frame as rotations and translations in the bodies' frames."""
    turns = matrix_of(states[:, 3:7])
    parts = [np.einsum("nji,nj->ni", turns, vectors[:, part]) for part in (slice(3, 6), slice(0, 3))]
    return np.concatenate(parts, axis=1).ravel()


def _world_spins(states: Any) -> Any:
    return np.einsum("nij,nj->ni", matrix_of(states[:, 3:7]), states[:, 10:13])


def _states(nodes: list[Any]) -> Any:
    transforms = [node.getWorldTransform() for node in nodes]
    positions = np.array([transform.translation() for transform in transforms])
    attitudes = np.array([_quaternion(np.array(transform.rotation())) for transform in transforms])
    velocities = np.array([node.getLinearVelocity() for node in nodes])
    spins = np.array([node.getAngularVelocity() for node in nodes])
    return rows(positions, attitudes, velocities, spins)


def _quaternion(matrix: Any) -> Any:
    """Quaternion w, x, y, z of a rotation matrix: its largest column of 4 q qᵀ."""
    (a, b, c), (d, e, f), (g, h, i) = matrix
    table = np.array(
        [
            [1 + a + e + i, h - f, c - g, d - b],
            [h - f, 1 + a - e - i, b + d, c + g],
            [c - g, b + d, 1 - a + e - i, f + h],
            [d - b, c + g, f + h, 1 - a - e + i],
        ]
    )
    column = table[:, int(np.argmax(np.diag(table)))]
    return column / np.linalg.norm(column)


ENGINES: list[Engine] = [Nimble()]
