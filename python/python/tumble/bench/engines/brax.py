"""Brax with its positional pipeline, in single precision."""

from __future__ import annotations

import os
import warnings
from typing import Any

# Compilation takes most of the time: read when jax is first imported.
os.environ.setdefault("XLA_FLAGS", "--xla_backend_optimization_level=0 --xla_llvm_disable_expensive_passes=true")

import jax
import jax.numpy as jnp
import numpy as np
from brax import __version__
from brax.io import mjcf
from brax.positional import pipeline

from .._scene import Scene
from ._base import Engine, Motion, Sensitivities, Stopwatch, Unsupported, rows
from .mujoco_c import model_of

warnings.filterwarnings("ignore", module="brax")


class Brax(Engine):
    """Brax's positional pipeline with its default settings."""

    name = "brax"
    settings = "positional pipeline, defaults, single precision, derivatives by jax.grad"
    compliant = True

    def version(self) -> str:
        return str(__version__)

    def run(self, scene: Scene) -> Motion:
        if scene.forces:
            raise Unsupported("no forces on free bodies")
        system, q, qd = _start(scene)

        def trajectory(q: Any, qd: Any) -> Any:
            def step(state: Any, _: Any) -> Any:
                after = pipeline.step(system, state, jnp.zeros(0))
                return after, (after.x.pos, after.x.rot, after.xd.vel, after.xd.ang)

            return jax.lax.scan(step, pipeline.init(system, q, qd), None, scene.steps)[1]

        motion = jax.jit(trajectory)
        # The first call compiles.
        jax.block_until_ready(motion(q, qd))
        stopwatch = Stopwatch()
        with stopwatch:
            parts = [np.asarray(part, float) for part in jax.block_until_ready(motion(q, qd))]
        later = [rows(*(part[step] for part in parts)) for step in range(scene.steps)]
        return Motion(np.array([scene.states, *later]), stopwatch.seconds)

    def sensitivities(self, scene: Scene, body: int, component: int) -> Sensitivities | None:
        if scene.forces:
            raise Unsupported("no forces on free bodies")
        system, q, qd = _start(scene)

        def end(q: Any, qd: Any, friction: Any) -> Any:
            changed = system.replace(geom_friction=system.geom_friction.at[:, 0].set(friction))

            def step(state: Any, _: Any) -> Any:
                return pipeline.step(changed, state, jnp.zeros(0)), None

            state = jax.lax.scan(step, pipeline.init(changed, q, qd), None, scene.steps)[0]
            return state.x.pos[body, component] if component < 3 else state.xd.vel[body, component - 7]

        by_q, by_qd, by_friction = jax.jit(jax.grad(end, (0, 1, 2)))(q, qd, jnp.float32(scene.friction))
        return Sensitivities(
            position=np.asarray(by_q, float).reshape(-1, 7)[:, :3],
            velocity=np.asarray(by_qd, float).reshape(-1, 6)[:, :3],
            friction=float(by_friction),
        )


def _start(scene: Scene) -> Any:
    """System, positions and velocities."""
    system = mjcf.load_model(model_of(scene, ""))
    system = system.replace(elasticity=jnp.full(system.elasticity.shape, scene.restitution))
    states = scene.states
    return system, jnp.array(states[:, :7].ravel()), jnp.array(states[:, 7:].ravel())


ENGINES: list[Engine] = [Brax()]
