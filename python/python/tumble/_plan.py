"""Trajectory optimisation through contact: docs/planning.md."""

from __future__ import annotations

import os
from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from functools import cached_property
from typing import TYPE_CHECKING, Any, NamedTuple

from . import _tumble
from ._arrays import numbers
from ._checks import real, tables, whole
from ._scene import Scene
from ._toml import document
from ._tumble import TumbleError
from ._types import Fields, Floats

if TYPE_CHECKING:
    from ._trajectory import Trajectory


MOST_THREADS = 1024
"""Largest number of threads, as on the command line."""


class Miss(NamedTuple):
    """Distance of a plan from a target or a path constraint."""

    by: float
    """Distance, in ``unit``."""
    tolerance: float
    unit: str
    """Unit: m, m/s, rad or rad/s."""
    after: int
    """Number of steps after which it is measured."""

    @property
    def ok(self) -> bool:
        """True if the distance is within the tolerance."""
        return self.by <= self.tolerance


@dataclass(frozen=True)
class Plan:
    """Controls and their replay, the simulation with them.

    All attributes except the controls belong to the replay.
    """

    status: str
    """"replayed" if the replay meets all targets, otherwise "missed" or "failed"."""
    reason: str
    """Missed targets and reasons; empty if all targets are met."""
    controls: Floats
    """Variables of the search, in the form of ``start``; ``names`` has their names."""
    names: list[str]
    columns: dict[str, Floats]
    """Components of the controls by name, (T,)."""
    wrenches: Floats
    """Wrenches of the controls on each body in each step, (T, N, 6), in the form of Simulation.step."""
    starts: Floats
    """States at the start, (N, 13)."""
    cost: float
    effort: float
    """Part of the cost that is effort."""
    residual: float
    """Largest residual of a step, m/s."""
    miss: dict[str, Miss]
    """Misses of the targets and path constraints by name."""
    modes: list[list[tuple[str, str, int, str]]]
    """Contacts of each step: body, partner, the body's point, and "open", "stick" or "slip"."""
    stages: list[dict[str, Any]]
    """Result of each stage: name, iterations, runs, message, cost, kept."""
    scene: Scene
    """Scene of the replay, with the plan's starts, constants and loads."""
    steps: int

    @property
    def ok(self) -> bool:
        """True if the replay meets all targets."""
        return self.status == "replayed"

    @cached_property
    def run(self) -> Trajectory:
        """Trajectory of the replay."""
        return self.scene.run(self.steps)

    def __repr__(self) -> str:
        return f"<tumble.Plan: {self.status}, cost {self.cost:.6g}>"


def plan(
    scene: Scene,
    steps: int,
    controls: Iterable[Fields],
    target: Fields | Iterable[Fields],
    *,
    cost: Fields | None = None,
    path_constraints: Fields | Iterable[Fields] = (),
    start: Any = None,
    states: Any = None,
    stages: Iterable[str] | None = None,
    seed: int = 1,
    runs: int | None = None,
    iterations: int | None = None,
    time: float | None = None,
    threads: int | None = None,
) -> Plan:
    """Searches controls with which ``scene`` meets ``target`` after ``steps`` steps.

    ``controls``, ``target``, ``path_constraints`` and ``cost`` have the fields of a problem file
    (docs/planning.md), as dictionaries::

        tumble.plan(
            scene, 60,
            controls=[{"kind": "push", "face": "-x", "normal": [0, 20], "tangential": [-6, 6]}],
            target={"position": [0.5, 0.3], "turn": 90, "speed": 0},
        )

    ``start`` has the ``controls`` of another plan of the same problem. None starts from zero
    forces. ``states`` (N, 13) replaces the scene's start, for example to plan again during a run.

    ``stages`` has names of ``"ddp"``, ``"sample"`` and ``"shoot"`` in their order. None is the
    default of a problem file: ``["ddp", "sample", "shoot"]``, where ``"sample"`` is skipped if
    ``"ddp"`` meets the targets. ``runs`` limits a sampling. ``iterations`` limits ``"ddp"`` and
    ``"shoot"``. ``time`` (s) ends the search with the best plan so far. ``threads`` is one per core
    by default; the plan does not depend on it.

    Raises TumbleError for an invalid problem.
    """
    if not isinstance(scene, Scene):
        raise TumbleError(f"scene is {scene!r}; a tumble.Scene is needed")
    targets = [target] if isinstance(target, Mapping) else tables("target", target)
    paths = (
        [path_constraints] if isinstance(path_constraints, Mapping) else tables("path_constraints", path_constraints)
    )
    search: dict[str, Any] = {}
    if stages is not None:
        names = None if isinstance(stages, str) else stages
        try:
            search["stages"] = [str(name) for name in names]  # type: ignore[union-attr]
        except TypeError:
            raise TumbleError(f'stages is {stages!r}; a list of names is needed, as ["shoot"]') from None
    if runs is not None:
        search["runs"] = whole("runs", runs, 1, 2**32 - 1)
    if iterations is not None:
        search["iterations"] = whole("iterations", iterations, 1, 2**32 - 1)
    text = document(
        {
            "scene": "-",
            "steps": whole("steps", steps, 1, 2**32 - 1),
            "seed": whole("seed", seed, 0),
            "controls": tables("controls", controls),
            "target": targets,
            "path_constraints": paths,
            "cost": cost,
            "search": search,
        }
    )
    if time is not None and not real("time", time) > 0:
        raise TumbleError(f"time is {time!r}; a number of seconds above 0 is needed")
    if threads is None:
        threads = min(os.cpu_count() or 1, MOST_THREADS)
    threads = whole("threads", threads, 1, MOST_THREADS)
    guess = None if start is None else numbers("start", start, ("V",))
    if states is not None:
        bodies = len(scene.bodies)
        shapes = [(bodies, 13), (13,)] if bodies == 1 else [(bodies, 13)]
        states = numbers("states", states, *shapes).reshape(bodies, 13)
    found = _tumble.plan(scene._core, text, guess, states, time, threads)
    misses = {name: Miss(*rest) for name, *rest in found["misses"]}
    planned = scene._with_model(found["model"], scene.start_index)
    parts = ("status", "reason", "controls", "names", "columns", "wrenches", "starts", "cost")
    others = ("effort", "residual", "modes", "stages")
    return Plan(**{name: found[name] for name in (*parts, *others)}, miss=misses, scene=planned, steps=steps)
