"""Drake: compliant contact with regularised friction, a convex problem per step."""

import logging
import time
from importlib.metadata import version

import numpy as np
from engines.base import Engine, Motion, one_or_all
from pydrake.common.eigen_geometry import Quaternion
from pydrake.geometry import Box as Block
from pydrake.geometry import CollisionFilterDeclaration, GeometrySet, HalfSpace
from pydrake.geometry import ProximityProperties, SceneGraphConfig, Sphere
from pydrake.math import RigidTransform
from pydrake.multibody.math import SpatialVelocity
from pydrake.multibody.plant import AddMultibodyPlant, CoulombFriction, MultibodyPlantConfig
from pydrake.multibody.tree import SpatialInertia, UnitInertia
from pydrake.systems.analysis import Simulator
from pydrake.systems.framework import DiagramBuilder
from scene import Scene, rotations


# Two stacks of ten; a step takes 3 ms with 20 boxes and 20 ms with 100.
MOST_BOXES = 20


class Drake(Engine):
    """Discrete MultibodyPlant with one of its contact approximations."""

    def __init__(
        self, mode: str, kinds: str, plant: dict, material: dict, settings: str
    ) -> None:
        self.name = f"Drake {mode}"
        self.kinds = kinds.split()
        self.plant, self.material = plant, material
        self.settings = (
            f"{settings}; point contact, a sphere of radius 0 at each corner, several boxes are "
            "also boxes to each other; timed: one call of `Simulator.AdvanceTo`, processor time"
        )

    def runs(self, scene: Scene) -> bool:
        small = scene.kind != "growth" or len(scene.boxes) <= MOST_BOXES
        return super().runs(scene) and small

    def time(self, scene: Scene) -> float:
        simulator = self.begin(scene)[0]
        before = scene.untimed * scene.step_seconds
        simulator.AdvanceTo(before)
        clock = time.process_time()
        simulator.AdvanceTo(before + scene.seconds)
        return time.process_time() - clock

    def record(self, scene: Scene) -> Motion:
        simulator, plant, corners = self.begin(scene)
        context = plant.GetMyContextFromRoot(simulator.get_mutable_context())
        results = plant.get_contact_results_output_port()
        states, forces = [states_of(plant, context)], np.zeros((scene.steps, 8, 3))
        for k in range(scene.steps):
            # The contact results are sampled: after the step they belong to the step.
            simulator.AdvanceTo((k + 1) * scene.step_seconds)
            states.append(states_of(plant, context))
            if scene.kind != "one":
                continue
            contacts = results.Eval(context)
            for i in range(contacts.num_point_pair_contacts()):
                contact = contacts.point_pair_contact_info(i)
                pair = contact.point_pair()
                # The force acts on body B.
                if pair.id_B in corners:
                    forces[k, corners[pair.id_B]] += contact.contact_force()
                else:
                    forces[k, corners[pair.id_A]] -= contact.contact_force()
        # The solver throws an exception if it does not converge.
        return Motion(one_or_all(states), forces if scene.kind == "one" else None, 0)

    def begin(self, scene: Scene) -> tuple:
        """Creates the simulator, the plant and the map from spheres to corners."""
        builder = DiagramBuilder()
        config = MultibodyPlantConfig(time_step=scene.step_seconds, **self.plant)
        plant, graph = AddMultibodyPlant(config, SceneGraphConfig(), builder)
        ground, surface = RigidTransform(), self.properties(scene)
        floor = plant.RegisterCollisionGeometry(
            plant.world_body(), ground, HalfSpace(), "ground", surface
        )
        bodies, corners, blocks = [], {}, []
        for k, box in enumerate(scene.boxes):
            inertia = SpatialInertia(box.mass, np.zeros(3), UnitInertia(*(box.inertia / box.mass)))
            body = plant.AddRigidBody(f"box {k}", inertia)
            bodies.append(body)
            for i, corner in enumerate(box.corners):
                sphere = plant.RegisterCollisionGeometry(
                    body, RigidTransform(corner), Sphere(0.0), f"corner {k} {i}", surface
                )
                corners[sphere] = i
            if scene.kind != "one":
                block = plant.RegisterCollisionGeometry(
                    body, RigidTransform(), Block(*box.sides), f"block {k}", surface
                )
                blocks.append(block)
        keep_apart(graph, floor, list(corners), blocks)
        plant.mutable_gravity_field().set_gravity_vector(scene.gravity)
        plant.Finalize()
        simulator = Simulator(builder.Build())
        context = plant.GetMyContextFromRoot(simulator.get_mutable_context())
        for body, box in zip(bodies, scene.boxes):
            attitude = box.start[3:7] / np.linalg.norm(box.start[3:7])
            pose = RigidTransform(Quaternion(attitude), box.start[:3])
            plant.SetFreeBodyPose(context, body, pose)
            spin = rotations(box.start[None, 3:7])[0] @ box.start[10:]
            velocity = SpatialVelocity(spin, box.start[7:10])
            plant.SetFreeBodySpatialVelocity(context=context, body=body, V_JpJc=velocity)
        simulator.Initialize()
        return simulator, plant, corners

    def properties(self, scene: Scene) -> ProximityProperties:
        """Contact properties: friction, and the material parameters of the mode."""
        properties = ProximityProperties()
        friction = CoulombFriction(scene.friction, scene.friction)
        properties.AddProperty("material", "coulomb_friction", friction)
        for name, value in self.material.items():
            properties.AddProperty("material", name, value)
        return properties


def keep_apart(graph, ground, corners: list, blocks: list) -> None:
    """Excludes contacts between corners and contacts of blocks with the ground."""
    filters = CollisionFilterDeclaration()
    filters.ExcludeWithin(GeometrySet(corners))
    filters.ExcludeBetween(GeometrySet([ground]), GeometrySet(blocks))
    graph.collision_filter_manager().Apply(filters)


def states_of(plant, context) -> list[np.ndarray]:
    """State r, q, v, ω (body frame) of each box; the plant stores q, r and ω (world), v."""
    positions = plant.GetPositions(context).reshape(-1, 7)
    velocities = plant.GetVelocities(context).reshape(-1, 6)
    attitudes = positions[:, :4] / np.linalg.norm(positions[:, :4], axis=1, keepdims=True)
    spins = np.einsum("nji,nj->ni", rotations(attitudes), velocities[:, :3])
    return list(np.concatenate((positions[:, 4:], attitudes, velocities[:, 3:], spins), axis=1))


STIFF = {"point_contact_stiffness": 1e8, "hunt_crossley_dissipation": 50.0}


def engines() -> list[Engine]:
    # Drake warns that half spaces do not support deformable bodies; the scenes have none.
    logging.getLogger("drake").setLevel(logging.ERROR)
    sap = {"discrete_contact_approximation": "sap"}
    fine = {"stiction_tolerance": 1e-5}
    return [
        Drake(
            "SAP",
            "one several growth",
            sap,
            {},
            f"{version('drake')}: SAP, its own default material (stiffness 10⁶ N/m, relaxation "
            "time 0.1 s)",
        ),
        Drake(
            "SAP, stiff",
            "one several",
            sap,
            {"point_contact_stiffness": 1e8, "relaxation_time": 0.002},
            "SAP, stiffness 10⁸ N/m (its near-rigid regime), relaxation time one step",
        ),
        Drake(
            "lagged, stiff",
            "one",
            {"discrete_contact_approximation": "lagged", **fine},
            STIFF,
            "`lagged`, stiffness 10⁸ N/m, Hunt–Crossley dissipation 50 s/m, stiction tolerance "
            "10⁻⁵ m/s",
        ),
        Drake(
            "similar, stiff",
            "one",
            {"discrete_contact_approximation": "similar", **fine},
            STIFF,
            "`similar`, otherwise as `lagged`",
        ),
    ]
