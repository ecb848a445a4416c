"""tumble with its native solver and with Ipopt.

The section on speed times the loop of ``Simulation.run``, which records the states. ``BENCH_BOXES`` may name the program
several_bodies of bench/measure instead, whose loop records nothing.
"""

from __future__ import annotations

import os
import time
from pathlib import Path
from typing import Any

import numpy as np

from ... import Scene as OwnScene
from ... import TumbleError, __version__, has_ipopt
from .._scene import Body, Scene
from .._solids import matrix_of
from ._base import Engine, Motion, Sensitivities, Stopwatch, Unsupported
from ._program import asked

LOOP = os.environ.get("BENCH_BOXES", "")


class Tumble(Engine):
    """tumble with one of its solvers, solved to ``residual`` (m/s)."""

    compliant = False

    def __init__(self, name: str, solver: str, settings: str, residual: float | None = None) -> None:
        self.name, self.solver, self.settings, self.residual = name, solver, settings, residual
        if solver == "ipopt" and not has_ipopt:
            raise ImportError("this build of tumble has no Ipopt; build it with --features ipopt")

    def version(self) -> str:
        return __version__

    def run(self, scene: Scene) -> Motion:
        simulation = self._scene(scene).simulate()
        states = np.empty((scene.steps + 1, len(scene.free), 13))
        states[0] = scene.states
        stopwatch, unsolved, iterations, residual = Stopwatch(), 0, 0, 0.0
        for step in range(scene.steps):
            wrenches = _own_wrenches(scene, step, states[step])
            with stopwatch:
                done = simulation.step(wrenches)
            unsolved += not done.ok
            iterations += done.iterations
            residual = max(residual, done.residual)
            states[step + 1] = simulation.states
        note = f"{unsolved} steps did not converge" if unsolved else ""
        facts = {
            "not converged": unsolved,
            "iterations a step": iterations / scene.steps,
            "largest residual, m/s": residual,
        }
        return Motion(states, stopwatch.seconds, note, stopwatch.slowest, facts)

    def time(self, scene: Scene, before: int) -> float:
        if self._loops:
            return float(self._looped(scene, before)["seconds"])
        simulation = self._scene(scene).simulate()
        simulation.run(before, contacts=False)
        begin = time.process_time()
        simulation.run(scene.steps - before, contacts=False)
        return time.process_time() - begin

    def memory(self, scene: Scene, before: int) -> int:
        return int(self._looped(scene, before)["memory_kib"]) if self._loops else super().memory(scene, before)

    @property
    def _loops(self) -> bool:
        return self.solver == "native" and Path(LOOP).is_file()

    def _looped(self, scene: Scene, before: int) -> dict[str, Any]:
        return asked(LOOP, scene, before, residual=self.residual)

    def sensitivities(self, scene: Scene, body: int, component: int) -> Sensitivities | None:
        if self.solver == "ipopt":
            return None
        own = self._scene(scene)
        count = len(scene.free)
        states = own.simulate().states
        controls = np.zeros((scene.steps, count, 6))
        if scene.forces:
            simulation = own.simulate()
            for step in range(scene.steps):
                controls[step] = _own_wrenches(scene, step, simulation.states)
                simulation.step(controls[step])
        cotangents = np.zeros((count, 12))
        # Tangents have three numbers for the attitude, states four.
        cotangents[body, component if component < 3 else component - 1] = 1.0
        by = ["friction", "gravity", "mass"]
        # Cases ask for derivatives of the motion.
        found = own.vjp(cotangents, states, controls, steps=scene.steps, by=by, impact_times=True)
        return Sensitivities(
            position=found["states"][:, :3],
            velocity=found["states"][:, 6:9],
            friction=float(found["friction"]),
            gravity=found["gravity"],
            mass=found["mass"],
            force=found["controls"][:, :, :3],
        )

    def _scene(self, scene: Scene) -> OwnScene:
        ground: dict[str, Any] = {"friction": scene.friction, "restitution": scene.restitution}
        if not scene.ground:
            ground["none"] = True
        made = OwnScene(
            bodies=[_table(body) for body in scene.bodies if not body.fixed],
            fixed=[_table(body) for body in scene.bodies if body.fixed],
            ground=ground,
            gravity=scene.gravity.tolist(),
            time_step=scene.time_step,
            steps=scene.steps,
        )
        if self.solver == "native" and self.residual is None:
            return made
        try:
            text, path, _ = made._source
            return OwnScene.from_text(text, path, solver=self.solver, residual=self.residual)
        except TumbleError as error:
            raise Unsupported(str(error)) from None


def _own_wrenches(scene: Scene, step: int, states: Any) -> Any:
    """Wrenches of a step with torques in the bodies' frames."""
    wrenches = scene.wrenches(step, states)
    wrenches[:, 3:] = np.einsum("nji,nj->ni", matrix_of(states[:, 3:7]), wrenches[:, 3:])
    return wrenches


def _table(body: Body) -> dict[str, Any]:
    """Body as a table of a scenario file."""
    table: dict[str, Any] = {"name": body.name, "position": body.position.tolist()}
    table["attitude"] = body.attitude.tolist()
    if body.kind == "box":
        table["box"] = [2.0 * half for half in body.size]
    elif body.kind == "sphere":
        table["sphere"] = body.size[0]
    elif body.kind == "capsule":
        table["capsule"] = {"length": 2.0 * body.size[1], "radius": body.size[0]}
    else:
        table["hull"] = body.points.tolist()
    if not body.fixed:
        table |= {"mass": body.mass, "inertia": body.inertia.tolist(), "centre": [0.0, 0.0, 0.0]}
        table |= {"velocity": body.velocity.tolist(), "spin": body.spin.tolist()}
    return table


ENGINES: list[Engine] = [
    Tumble("tumble", "native", "native solver, no settings"),
    Tumble("tumble-1e-6", "native", "native solver, residual 1e-6 m/s", 1e-6),
]
if has_ipopt:
    ENGINES.append(Tumble("tumble-ipopt", "ipopt", "Ipopt, its default tolerance 1e-6"))
