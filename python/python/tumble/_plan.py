"""Plans through contact: docs/planning.md."""

from __future__ import annotations

import os
from dataclasses import dataclass
from functools import cached_property
from typing import TYPE_CHECKING, Any, Dict, Iterable, List, Mapping, NamedTuple, Optional, Tuple, Union

from . import _tumble
from ._arrays import numbers
from ._checks import real, tables, whole
from ._scene import Fields, Scene
from ._toml import document
from ._tumble import TumbleError

if TYPE_CHECKING:
    import numpy as np
    import numpy.typing as npt

    from ._trajectory import Trajectory

    Floats = npt.NDArray[np.float64]


MOST_THREADS = 1024
"""More threads than this are not started, as on the command line."""


class Miss(NamedTuple):
    """How far something is from what was asked for."""

    by: float
    """In its unit."""
    tolerance: float
    unit: str
    """m, m/s, rad or rad/s."""
    after: int
    """After how many steps."""

    @property
    def ok(self) -> bool:
        """Whether it is no more than is allowed."""
        return self.by <= self.tolerance


@dataclass(frozen=True)
class Plan:
    """Controls, and what the simulator makes of them.

    Everything but the controls is of the replay: the run of ``scene`` that they make.
    """

    status: str
    """"exact" or "replayed" of a plan that does what it should; "missed", "failed"."""
    reason: str
    """What is missed and why; empty of a plan that does what it should."""
    controls: "Floats"
    """The numbers that were looked for, to start from again; ``names`` says which."""
    names: List[str]
    columns: Dict[str, "Floats"]
    """Every component of every control by its name, (T,)."""
    wrenches: "Floats"
    """What pushed each body in each step, (T, N, 6), as Simulation.step takes it."""
    starts: "Floats"
    """The states at the start, (N, 13)."""
    cost: float
    effort: float
    """The part of the cost that is effort."""
    residual: float
    """The largest of all steps, m/s."""
    apart: Optional[float]
    """How far the own run of the leg that found it is from the replay, m; None of a leg without one."""
    miss: Dict[str, Miss]
    """By how much each target is missed."""
    modes: List[List[Tuple[str, str, int, str]]]
    """Of each step the contacts: body, partner, the body's point, and "open", "stick" or "slip"."""
    legs: Dict[str, Dict[str, Any]]
    """What each leg came to: iterations, runs, message, cost, apart, other_modes, kept."""
    scene: Scene
    """The scene that runs as the plan: its starts, constants and loads."""
    steps: int

    @property
    def ok(self) -> bool:
        """Whether the replay does what it should."""
        return self.status in ("exact", "replayed")

    @cached_property
    def run(self) -> "Trajectory":
        """The replay."""
        return self.scene.run(self.steps)

    def __repr__(self) -> str:
        return f"<tumble.Plan: {self.status}, cost {self.cost:.6g}>"


def plan(
    scene: Scene,
    steps: int,
    controls: Iterable[Fields],
    target: Union[Fields, Iterable[Fields]],
    *,
    cost: Optional[Fields] = None,
    keep: Union[Fields, Iterable[Fields]] = (),
    start: Any = None,
    states: Any = None,
    legs: Iterable[str] = ("sample", "shoot"),
    seed: int = 1,
    runs: Optional[int] = None,
    iterations: Optional[int] = None,
    time: Optional[float] = None,
    threads: Optional[int] = None,
) -> Plan:
    """Looks for controls with which ``scene`` does what ``target`` says after ``steps`` steps.

    ``controls``, ``target``, ``keep`` and ``cost`` have the fields of a problem's file (docs/planning.md), as
    dictionaries::

        tumble.plan(
            scene, 60,
            controls=[{"kind": "push", "face": "-x", "normal": [0, 20], "tangential": [-6, 6]}],
            target={"position": [0.5, 0.3], "turn": 90, "speed": 0},
        )

    ``start`` is the ``controls`` of another plan of the same problem, None for no forces. ``states`` (N, 13) is where the bodies
    start, None for where the scene has them: to plan again from where they have come to. ``legs``, of ``"sample"``, ``"shoot"``,
    ``"ddp"`` (and, built with Ipopt, ``"program"``, ``"polish"``), come one after the other, each
    from the best replay so far; the plan does not depend on the number of ``threads``, None for one a core. ``runs`` are the most of a
    sampling, ``iterations`` those of a shooting. ``time`` (s) and
    Ctrl-C end a search; after a time the best so far is the plan. Raises TumbleError for what is no problem.
    """
    if not isinstance(scene, Scene):
        raise TumbleError(f"scene is {scene!r}; a tumble.Scene is needed")
    targets = [target] if isinstance(target, Mapping) else tables("target", target)
    keeps = [keep] if isinstance(keep, Mapping) else tables("keep", keep)
    names = None if isinstance(legs, str) else legs
    try:
        names = list(names)  # type: ignore[arg-type]
    except TypeError:
        raise TumbleError(f'legs is {legs!r}; a list of names is needed, as ["shoot"]') from None
    search: Dict[str, Any] = {"legs": [str(leg) for leg in names]}
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
            "keep": keeps,
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
    found = _tumble.plan(scene, text, guess, states, time, threads)
    misses = {name: Miss(*rest) for name, *rest in found["misses"]}
    if found["model"] is None:
        planned = Scene.from_text(found["text"], "plan.toml")
    else:
        planned = scene._with_model(found["model"], scene.start_index)
    parts = ("status", "reason", "controls", "names", "columns", "wrenches", "starts", "cost")
    others = ("effort", "residual", "apart", "modes", "legs")
    return Plan(
        **{name: found[name] for name in (*parts, *others)},
        miss=misses,
        scene=planned,
        steps=steps,
    )
