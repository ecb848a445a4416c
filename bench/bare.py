"""Bare contact problems of a folder: performance profiles of tumble and of local solvers.

bench/measure/src/bin/bare_problems.rs solves the files and writes the problems for bench/peers.
A peer solves the problems of contacts with three rows from zero impulses.
"""

import json
import os
import statistics
import sys
import tempfile
from pathlib import Path

import local
import numpy as np
from tables import table

PROGRAM = os.environ.get("BENCH_BARE", "target/release/bare_problems")
OWN = {"any": "tumble", "rule": "tumble, by its rule"}
SOLVED = 1e-9  # m/s
# Columns of the profile: the share of problems solved within this multiple of the fastest time.
WITHIN = (1.0, 2.0, 5.0, 10.0, 100.0)


def run(folder: Path, left_out: dict[str, str]) -> list[dict]:
    """Runs one round. Returns each problem's size, and time (s) and residual (m/s) per solver."""
    sys.path.insert(0, str(local.PEERS))
    import common

    with tempfile.TemporaryDirectory() as made:
        file = Path(made) / "problems.bin"
        found = json.loads(local.run([PROGRAM, folder, file]))
        for one in found:
            one["solvers"] = {name: one.pop(key) for key, name in OWN.items()}
        placed = {one["place"]: one for one in found if one["place"] is not None}
        problems = common.read(file)
        for peer, (python, program) in local.PROGRAMS.items():
            if peer in left_out or not problems:
                continue
            print(f"bare problems: {peer}", flush=True)
            try:
                answers = json.loads(local.run([python, local.PEERS / program, file]))
            except (OSError, RuntimeError) as error:
                left_out[peer] = str(error).strip().splitlines()[-1]
                continue
            for one in answers:
                if one["start"] != "cold":
                    continue
                impulses = np.array(one["impulses"], dtype=float)
                residual = local.residual(problems[one["problem"]], impulses)
                placed[one["problem"]]["solvers"][one["solver"]] = (one["seconds"], residual)
    return found


def tables(rounds: list[list[dict]]) -> str:
    """Profiles over the problems given to every solver, and a table of all problems."""
    problems = [merged(runs) for runs in zip(*rounds)]
    names = list(dict.fromkeys(name for one in problems for name in one["solvers"]))
    common = [one for one in problems if set(names) == set(one["solvers"])]
    best = [min((s for s, _ in solved(one).values()), default=float("inf")) for one in common]
    heads = ["solved", "mean of what it solved, ms", *(f"within {factor:g} ×" for factor in WITHIN)]
    rows = []
    for name in names:
        times = [solved(one).get(name, (None,))[0] for one in common]
        done = [seconds for seconds in times if seconds is not None]
        mean = f"{1e3 * statistics.mean(done):.3g}" if done else "–"
        shares = []
        for factor in WITHIN:
            count = sum(a is not None and a <= factor * b for a, b in zip(times, best))
            shares.append(f"{count / len(common):.2f}" if common else "–")
        rows.append([name, f"{len(done)} of {len(common)}", mean, *shares])
    each = [[one["name"], str(one["contacts"]), *(shown(one["solvers"].get(name)) for name in names)] for one in problems]
    what = f"{len(common)} problems, solved to {SOLVED:g} m/s from no impulses; the part within so many times the fastest solver's time:"
    return "\n\n".join([what, table(heads, rows), table(["contacts", *(f"{name}, ms" for name in names)], each)])


def merged(runs: tuple[dict, ...]) -> dict:
    """Median times over the rounds and the worst residual."""
    solvers = {}
    for name in runs[0]["solvers"]:
        pairs = [run["solvers"][name] for run in runs if name in run["solvers"]]
        solvers[name] = (statistics.median(s for s, _ in pairs), max(r for _, r in pairs))
    return runs[0] | {"solvers": solvers}


def solved(one: dict) -> dict:
    return {name: pair for name, pair in one["solvers"].items() if pair[1] <= SOLVED}


def shown(pair: tuple[float, float] | None) -> str:
    if pair is None:
        return "–"
    return f"{1e3 * pair[0]:.3g}" if pair[1] <= SOLVED else f"not solved ({pair[1]:.1g} m/s)"
