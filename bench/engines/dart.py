"""DART with a boxed LCP (default) or exact Coulomb friction by Gauss–Seidel."""

import time
from importlib.metadata import version

import dartpy
import numpy as np
from dartpy import constraint, dynamics
from engines.base import Engine, Motion
from scene import Box, Scene, rotations


class Dart(Engine):
    """DART with one of its contact solvers."""

    kinds = ["several"]
    # A step takes up to 16 ms, and half a second for the wall: few steps, no wall, no pile.
    most_steps = 20

    def __init__(self, mode: str, make_solver, settings: str) -> None:
        self.name = f"DART {mode}"
        self.make_solver = make_solver
        timed = "the Python loop over `World.step`, processor time"
        self.settings = (
            f"{settings}; ODE's collision detector, no deactivation; stack and "
            f"pyramid alone, their first {self.most_steps} steps, time and figures; timed: {timed}"
        )

    def runs(self, scene: Scene) -> bool:
        return super().runs(scene) and scene.name in ("stack", "pyramid")

    def time(self, scene: Scene) -> float:
        world, _ = self.begin(scene)
        clock = time.process_time()
        for _ in range(self.most_steps):
            world.step()
        return (time.process_time() - clock) * scene.steps / self.most_steps

    def record(self, scene: Scene) -> Motion:
        world, bodies = self.begin(scene)
        states = [[box.start for box in scene.boxes]]
        for _ in range(self.most_steps):
            world.step()
            states.append([state_of(body) for body in bodies])
        return Motion(np.array(states), None, None)

    def begin(self, scene: Scene) -> tuple:
        """Creates the world and its bodies in their initial states."""
        world = dartpy.simulation.World()
        world.setTimeStep(scene.step_seconds)
        world.setGravity(scene.gravity)
        world.setCollisionDetector(dartpy.simulation.CollisionDetectorType.ODE)
        awake = world.getDeactivationOptions()
        awake.mEnabled = False
        world.setDeactivationOptions(awake)
        if self.make_solver is not None:
            world.getConstraintSolver().setBoxedLcpSolver(self.make_solver())
        # A slab with its top at z = 0.
        ground = dynamics.Skeleton("ground")
        _, slab = ground.createWeldJointAndBodyNodePair()
        node = add_shape(slab, dynamics.BoxShape([100.0, 100.0, 1.0]), scene)
        node.setRelativeTranslation([0.0, 0.0, -0.5])
        world.addSkeleton(ground)
        bodies = []
        for k, box in enumerate(scene.boxes):
            skeleton = dynamics.Skeleton(f"box {k}")
            bodies.append(add_box(skeleton, box, scene))
            world.addSkeleton(skeleton)
        return world, bodies


def add_box(skeleton: dynamics.Skeleton, box: Box, scene: Scene) -> dynamics.BodyNode:
    """Creates a free body in its initial state, at rest."""
    joint, body = skeleton.createFreeJointAndBodyNodePair()
    add_shape(body, dynamics.BoxShape(box.sides), scene)
    body.setMass(box.mass)
    body.setMomentOfInertia(*box.inertia)
    pose = dartpy.math.Isometry3()
    pose.set_translation(box.start[:3])
    pose.set_rotation(rotations(box.start[None, 3:7])[0])
    joint.setPositions(dynamics.FreeJoint.convertToPositions(pose))
    return body


def add_shape(body: dynamics.BodyNode, shape: dynamics.Shape, scene: Scene):
    """Adds a colliding shape without restitution."""
    node = body.createShapeNode(shape)
    node.createCollisionAspect()
    surface = node.createDynamicsAspect()
    surface.setFrictionCoeff(scene.friction)
    surface.setRestitutionCoeff(0.0)
    return node


def state_of(body: dynamics.BodyNode) -> np.ndarray:
    """State r, q, v, ω (body frame)."""
    pose = body.getWorldTransform()
    spin = pose.rotation().T @ body.getAngularVelocity()
    attitude = pose.quaternion().wxyz()
    return np.concatenate((pose.translation(), attitude, body.getLinearVelocity(), spin))


def engines() -> list[Engine]:
    return [
        Dart("default", None, f"{version('dartpy')}: its default solver"),
        Dart(
            "exact",
            constraint.NsgsFrictionSolver,
            "`NsgsFrictionSolver`, Coulomb's law, at its default of 100 sweeps and 10⁻⁵",
        ),
    ]
