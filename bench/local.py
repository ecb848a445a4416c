"""Local problems: times of solvers of W p + q = u with Coulomb's law, and of tumble's whole step.

bench/measure/src/bin/local_problems.rs writes the problems of tumble's own steps. bench/peers has
a program for each peer.
"""

import json
import os
import resource
import statistics
import subprocess
import sys
import tempfile
from pathlib import Path

import numpy as np
import scene
from tables import table

PROBLEMS = os.environ.get("BENCH_LOCAL", "target/release/local_problems")
PEERS = Path(__file__).resolve().parent / "peers"
# Siconos is Debian's python3-siconos and needs Debian's own Python.
PROGRAMS = {
    "Siconos": [os.environ.get("BENCH_SYSTEM_PYTHON", "/usr/bin/python3"), "solve_siconos.py"],
    "Pinocchio": [sys.executable, "solve_pinocchio.py"],
}
# Step of the first problem and distance between steps: at rest all problems are equal.
WANTED = {"stack": (100, 1000), "pyramid": (100, 1000), "wall": (100, 1000), "pile": (200, 50)}
SOLVED = 1e-9  # m/s
NOT_ASKED = "see above"


def compare() -> dict:
    """Times and residuals of all solvers on the problems of all scenes."""
    found: dict = {"left_out": {}, "scenes": {}}
    with tempfile.TemporaryDirectory() as folder:
        for name, (first, stride) in WANTED.items():
            file = Path(folder) / f"{name}.bin"
            request = scene.several(name).request() | {"first": first, "stride": stride}
            run([PROBLEMS, file], json.dumps(request))
            found["scenes"][name] = judge(file, found["left_out"])
    return found


def judge(file: Path, left_out: dict[str, str]) -> dict:
    """Solves the problems of one file with every available peer."""
    sys.path.insert(0, str(PEERS))
    import common

    problems = common.read(file)
    judged = {
        "contacts": [problem.contacts for problem in problems],
        "steps": [problem.step for problem in problems],
        "tumble_seconds": [problem.seconds for problem in problems],
        "solvers": {},
    }
    for peer, (python, program) in PROGRAMS.items():
        if peer in left_out:
            continue
        print(f"local problems: {file.stem}, {peer}", flush=True)
        try:
            answers = json.loads(run([python, PEERS / program, file]))
        except (OSError, RuntimeError) as error:
            left_out[peer] = str(error).strip().splitlines()[-1]
            continue
        for one in answers:
            key = f"{one['solver']}, {one['start']}"
            entry = judged["solvers"].setdefault(key, {"seconds": [], "residuals": []})
            entry["seconds"].append(one["seconds"])
            impulses = np.array(one["impulses"], dtype=float)
            entry["residuals"].append(residual(problems[one["problem"]], impulses))
    return judged


def run(command: list, given: str | None = None) -> str:
    """Output of a program.

    Pinocchio uses the stack: 364 contacts need more than the default of 8 MiB.
    """
    done = subprocess.run(
        command,
        input=given,
        capture_output=True,
        text=True,
        check=False,
        preexec_fn=whole_stack,
    )
    if done.returncode != 0:
        raise RuntimeError(f"exit code {done.returncode}: {done.stderr or command[0]}")
    return done.stdout


def whole_stack() -> None:
    """Raises the stack limit to the system's maximum."""
    _, most = resource.getrlimit(resource.RLIMIT_STACK)
    resource.setrlimit(resource.RLIMIT_STACK, (most, most))


def residual(problem, impulses: np.ndarray) -> float:
    """Maximum of eq. 18b to 18e over the contacts (m/s), each in its own scale."""
    if not np.isfinite(impulses).all():
        return float("inf")
    diagonal = np.diag(problem.w).reshape(-1, 3)
    w_n, w_t = diagonal[:, 0], diagonal[:, 1:].mean(axis=1)
    u = (problem.w @ impulses + problem.q).reshape(-1, 3)
    p = impulses.reshape(-1, 3)
    pull, limit = w_t[:, None] * p[:, 1:], problem.mu * w_t * p[:, 0]
    target = pull - u[:, 1:]
    reach = np.maximum(np.linalg.norm(target, axis=1), np.finfo(float).tiny)
    shrink = np.minimum(1.0, np.maximum(limit, 0.0) / reach)
    friction = np.linalg.norm(pull - target * shrink[:, None], axis=1)
    normal = np.abs(np.minimum(w_n * p[:, 0], u[:, 0]))
    cone = np.maximum(0.0, np.linalg.norm(pull, axis=1) - limit)
    return float(np.concatenate((friction, normal, cone)).max())


def tables(found: dict) -> str:
    """Creates one table per scene."""
    parts = []
    for name, judged in found["scenes"].items():
        contacts, own = judged["contacts"], judged["tumble_seconds"]
        what = f"one problem of {contacts[0]} contacts"
        if len(contacts) > 1:
            what = f"{len(contacts)} problems of {min(contacts)} to {max(contacts)} contacts"
        parts.append(f"*{name}*: {what}")
        heads = ["median, µs", "mean, µs", "to tumble's step", "not solved", "worst residual, m/s"]
        rows = [["tumble, the whole step", *times(own), "1", NOT_ASKED, NOT_ASKED]]
        for solver, entry in judged["solvers"].items():
            seconds, residuals = entry["seconds"], entry["residuals"]
            ratio = statistics.median(a / b for a, b in zip(seconds, own))
            unsolved = sum(not one <= SOLVED for one in residuals)
            row = [*times(seconds), f"{ratio:.3g}", str(unsolved), f"{max(residuals):.1g}"]
            rows.append([solver, *row])
        parts.append(table(heads, rows))
    parts += [f"- left out: {peer} ({why})." for peer, why in found["left_out"].items()]
    return "\n\n".join(parts)


def times(seconds: list[float]) -> list[str]:
    return [f"{1e6 * middle(seconds):.3g}" for middle in (statistics.median, statistics.mean)]
