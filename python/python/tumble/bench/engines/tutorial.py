"""The tutorial's program, CasADi and Ipopt, in data/generate: its own thrown cube alone."""

from __future__ import annotations

import os
import sys
import time
from pathlib import Path

import casadi
import numpy as np

from .._scene import Scene
from ._base import Engine, Motion, Unsupported

FOLDER = os.environ.get("BENCH_TUTORIAL", "")
if not (Path(FOLDER) / "tutorial_runs.py").is_file():
    raise ImportError("BENCH_TUTORIAL is not the absolute path of data/generate; set it")
sys.path.insert(0, FOLDER)
import step_nlp  # noqa: E402
import tutorial_runs  # noqa: E402


class Tutorial(Engine):
    """The unmodified program."""

    name = "tutorial"
    settings = "CasADi with its Ipopt, the tutorial's options; the Python loop over the solver's calls is timed"
    compliant = False

    def version(self) -> str:
        return str(casadi.__version__)

    def run(self, scene: Scene) -> Motion:
        start = np.zeros(step_nlp.VARIABLES)
        start[: step_nlp.STATE] = scene.states[0]
        usual = tutorial_runs.start_point(0)
        others = [step_nlp.POSITION, step_nlp.VELOCITY, step_nlp.SPIN]
        if len(scene.bodies) > 1 or any(not np.array_equal(start[part], usual[part]) for part in others):
            raise Unsupported("the program has its own scene, the thrown cube")
        problem = tutorial_runs.Problem()
        states, unsolved = [start[: step_nlp.STATE]], 0
        begin = time.process_time()
        for k in range(scene.steps):
            step = problem.solve(k, start)
            start = step.x
            unsolved += step.status != "Solve_Succeeded"
            states.append(start[: step_nlp.STATE])
        seconds = time.process_time() - begin
        return Motion(np.array(states)[:, None], seconds, facts={"not converged": unsolved})


ENGINES: list[Engine] = [Tutorial()]
