"""PyBullet: projected Gauss–Seidel on impulses."""

import time
from importlib.metadata import version

import numpy as np
import pybullet
from engines.base import Engine, Motion, nearest_corner
from scene import Scene, rotations


class Pybullet(Engine):
    """PyBullet with given solver parameters."""

    kinds = ["one"]

    def __init__(self, mode: str, parameters: dict, settings: str) -> None:
        self.name = f"PyBullet {mode}"
        self.parameters = parameters
        self.settings = (
            f"{settings}; damping of both velocities 0 (the default is 0.04); timed: one call of "
            "`stepSimulation` with all steps as its substeps, a loop in C++, processor time"
        )

    def time(self, scene: Scene) -> float:
        client, _ = self.begin(scene)
        pybullet.setPhysicsEngineParameter(
            fixedTimeStep=scene.seconds, numSubSteps=scene.steps, physicsClientId=client
        )
        clock = time.process_time()
        pybullet.stepSimulation(physicsClientId=client)
        seconds = time.process_time() - clock
        pybullet.disconnect(client)
        return seconds

    def record(self, scene: Scene) -> Motion:
        client, box = self.begin(scene)
        states, forces = [scene.box.start], np.zeros((scene.steps, 8, 3))
        for k in range(scene.steps):
            pybullet.stepSimulation(physicsClientId=client)
            before = states[-1]
            turn = rotations(before[None, 3:7])[0]
            # The forces of the step act at the contact points of its start; the box is body A.
            for contact in pybullet.getContactPoints(bodyA=box, physicsClientId=client):
                corner = nearest_corner(scene, (np.array(contact[5]) - before[:3]) @ turn)
                normal, tangent1, tangent2 = (np.array(contact[i]) for i in (7, 11, 13))
                forces[k, corner] += (
                    contact[9] * normal + contact[10] * tangent1 + contact[12] * tangent2
                )
            states.append(state_of(client, box))
        pybullet.disconnect(client)
        return Motion(np.array(states), forces, None)

    def begin(self, scene: Scene) -> tuple[int, int]:
        """Creates a separate server with the box in its initial state."""
        client = pybullet.connect(pybullet.DIRECT)
        own = {"physicsClientId": client}
        pybullet.setGravity(*scene.gravity, **own)
        pybullet.setPhysicsEngineParameter(
            fixedTimeStep=scene.step_seconds, numSubSteps=0, **self.parameters, **own
        )
        plane = pybullet.createCollisionShape(pybullet.GEOM_PLANE, planeNormal=(0, 0, 1), **own)
        ground = pybullet.createMultiBody(0, plane, **own)
        shape = pybullet.createCollisionShape(
            pybullet.GEOM_BOX, halfExtents=scene.box.sides / 2, **own
        )
        w, x, y, z = scene.box.start[3:7]
        box = pybullet.createMultiBody(
            scene.box.mass, shape, -1, scene.box.start[:3], (x, y, z, w), **own
        )
        # The friction of a contact is the product of both bodies' coefficients.
        pybullet.changeDynamics(ground, -1, lateralFriction=1.0, restitution=0, **own)
        pybullet.changeDynamics(
            box,
            -1,
            lateralFriction=scene.friction,
            restitution=0,
            linearDamping=0,
            angularDamping=0,
            localInertiaDiagonal=scene.box.inertia,
            maxJointVelocity=1e4,
            **own,
        )
        spin = rotations(scene.box.start[None, 3:7])[0] @ scene.box.start[10:]
        pybullet.resetBaseVelocity(box, scene.box.start[7:10], spin, **own)
        return client, box


def state_of(client: int, box: int) -> np.ndarray:
    """State r, q, v, ω (body frame)."""
    position, (x, y, z, w) = pybullet.getBasePositionAndOrientation(box, physicsClientId=client)
    velocity, spin = pybullet.getBaseVelocity(box, physicsClientId=client)
    attitude = np.array((w, x, y, z))
    turn = rotations(attitude[None])[0]
    return np.concatenate((position, attitude, velocity, np.array(spin) @ turn))


def engines() -> list[Engine]:
    return [
        Pybullet("default", {}, f"{version('pybullet')}: 50 iterations"),
        Pybullet(
            "accurate",
            {
                "numSolverIterations": 1000,
                "solverResidualThreshold": 0.0,
                "enableConeFriction": 1,
            },
            "1000 iterations, residual threshold 0, friction cone instead of pyramid",
        ),
    ]
