"""Program of the tutorial: CasADi and Ipopt, data/generate/tutorial_runs.py."""

import sys
import time
from pathlib import Path

import numpy as np
from engines.base import Engine, Motion
from scene import Scene

sys.path.insert(0, str(Path(__file__).resolve().parents[2] / "data" / "generate"))
import casadi  # noqa: E402
import step_nlp as nlp  # noqa: E402
import tutorial_runs  # noqa: E402


class Tutorial(Engine):
    """Unmodified program of the tutorial. Its scene is built in, so it only runs the drop."""

    name = "tutorial (CasADi, Ipopt)"
    slow = True
    kinds = ["one"]
    settings = (
        f"CasADi {casadi.__version__} with its Ipopt, the tutorial's options; timed: the Python "
        "loop over the solver's calls"
    )

    def __init__(self) -> None:
        self.problem = tutorial_runs.Problem()
        self.steps = {}

    def runs(self, scene: Scene) -> bool:
        return scene.seed is not None

    def time(self, scene: Scene) -> float:
        clock = time.perf_counter()
        self.steps[scene.seed] = tutorial_runs.simulate(self.problem, scene.seed)
        return time.perf_counter() - clock

    def record(self, scene: Scene) -> Motion:
        if scene.seed not in self.steps:
            self.time(scene)
        steps = self.steps[scene.seed]
        rows = np.array([step.x for step in steps])
        forces = np.stack([rows[1:, block] for block in (nlp.FX, nlp.FY, nlp.FZ)], axis=2)
        unsolved = sum(step.status != "Solve_Succeeded" for step in steps[1:])
        return Motion(rows[:, : nlp.STATE], forces, unsolved)


def engines() -> list[Engine]:
    return [Tutorial()]
