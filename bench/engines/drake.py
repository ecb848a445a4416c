"""Drake: compliant contact with regularised friction, a convex problem per step."""

import logging
import time
from importlib.metadata import version

import numpy as np
from engines.base import Engine, Motion
from pydrake.common.eigen_geometry import Quaternion
from pydrake.geometry import HalfSpace, ProximityProperties, SceneGraphConfig, Sphere
from pydrake.math import RigidTransform
from pydrake.multibody.plant import AddMultibodyPlant, CoulombFriction, MultibodyPlantConfig
from pydrake.multibody.tree import SpatialInertia, UnitInertia
from pydrake.systems.analysis import Simulator
from pydrake.systems.framework import DiagramBuilder
from scene import Scene, rotations


class Drake(Engine):
    """A discrete MultibodyPlant with one of its contact approximations."""

    def __init__(self, mode: str, plant: dict, material: dict, settings: str) -> None:
        self.name = f"Drake {mode}"
        self.plant, self.material = plant, material
        self.settings = (
            f"{settings}; point contact, a sphere of radius 0 at each corner; timed: one call of "
            "`Simulator.AdvanceTo`, processor time"
        )

    def time(self, scene: Scene) -> float:
        simulator = self.begin(scene)[0]
        clock = time.process_time()
        simulator.AdvanceTo(scene.seconds)
        return time.process_time() - clock

    def record(self, scene: Scene) -> Motion:
        simulator, plant, corners = self.begin(scene)
        context = plant.GetMyContextFromRoot(simulator.get_mutable_context())
        results = plant.get_contact_results_output_port()
        states, forces = [state_of(plant, context)], np.zeros((scene.steps, 8, 3))
        for k in range(scene.steps):
            # The contact results are sampled: after the step they are those of the step.
            simulator.AdvanceTo((k + 1) * scene.step_seconds)
            states.append(state_of(plant, context))
            contacts = results.Eval(context)
            for i in range(contacts.num_point_pair_contacts()):
                contact = contacts.point_pair_contact_info(i)
                pair = contact.point_pair()
                # The force is that on body B.
                if pair.id_B in corners:
                    forces[k, corners[pair.id_B]] += contact.contact_force()
                else:
                    forces[k, corners[pair.id_A]] -= contact.contact_force()
        # The solver throws where it does not converge.
        return Motion(np.array(states), forces, 0)

    def begin(self, scene: Scene) -> tuple:
        """Simulator, plant and the corner of each sphere, at the start of the scene."""
        builder = DiagramBuilder()
        config = MultibodyPlantConfig(time_step=scene.step_seconds, **self.plant)
        plant, graph = AddMultibodyPlant(config, SceneGraphConfig(), builder)
        inertia = UnitInertia(*(scene.inertia / scene.mass))
        body = plant.AddRigidBody("box", SpatialInertia(scene.mass, np.zeros(3), inertia))
        ground = RigidTransform()
        plant.RegisterCollisionGeometry(
            plant.world_body(), ground, HalfSpace(), "ground", self.properties(scene)
        )
        corners = {}
        for i, corner in enumerate(scene.corners):
            sphere = plant.RegisterCollisionGeometry(
                body, RigidTransform(corner), Sphere(0.0), f"corner {i}", self.properties(scene)
            )
            corners[sphere] = i
        plant.mutable_gravity_field().set_gravity_vector(scene.gravity)
        plant.Finalize()
        simulator = Simulator(builder.Build())
        context = plant.GetMyContextFromRoot(simulator.get_mutable_context())
        attitude = scene.start[3:7] / np.linalg.norm(scene.start[3:7])
        pose = RigidTransform(Quaternion(attitude), scene.start[:3])
        plant.SetFreeBodyPose(context, body, pose)
        # Plant order: spin, then velocity, both in world axes.
        spin = rotations(scene.start[None, 3:7])[0] @ scene.start[10:]
        plant.SetVelocities(context, np.concatenate((spin, scene.start[7:10])))
        simulator.Initialize()
        return simulator, plant, corners

    def properties(self, scene: Scene) -> ProximityProperties:
        """Friction, and what the mode sets of the contact material."""
        properties = ProximityProperties()
        friction = CoulombFriction(scene.friction, scene.friction)
        properties.AddProperty("material", "coulomb_friction", friction)
        for name, value in self.material.items():
            properties.AddProperty("material", name, value)
        return properties


def state_of(plant, context) -> np.ndarray:
    """r, q, v, ω (body) from the plant's q, r and ω (world), v."""
    positions, velocities = plant.GetPositions(context), plant.GetVelocities(context)
    attitude = positions[:4] / np.linalg.norm(positions[:4])
    spin = rotations(attitude[None])[0].T @ velocities[:3]
    return np.concatenate((positions[4:], attitude, velocities[3:], spin))


STIFF = {"point_contact_stiffness": 1e8, "hunt_crossley_dissipation": 50.0}


def engines() -> list[Engine]:
    # It warns that half spaces are not for deformable bodies, of which there are none.
    logging.getLogger("drake").setLevel(logging.ERROR)
    sap = {"discrete_contact_approximation": "sap"}
    fine = {"stiction_tolerance": 1e-5}
    return [
        Drake(
            "SAP",
            sap,
            {},
            f"{version('drake')}: SAP, its own default material (stiffness 10⁶ N/m, relaxation "
            "time 0.1 s)",
        ),
        Drake(
            "SAP, stiff",
            sap,
            {"point_contact_stiffness": 1e8, "relaxation_time": 0.002},
            "SAP, stiffness 10⁸ N/m (its near-rigid regime), relaxation time one step",
        ),
        Drake(
            "lagged, stiff",
            {"discrete_contact_approximation": "lagged", **fine},
            STIFF,
            "`lagged`, stiffness 10⁸ N/m, Hunt–Crossley dissipation 50 s/m, stiction tolerance "
            "10⁻⁵ m/s",
        ),
        Drake(
            "similar, stiff",
            {"discrete_contact_approximation": "similar", **fine},
            STIFF,
            "`similar`, otherwise as `lagged`",
        ),
    ]
