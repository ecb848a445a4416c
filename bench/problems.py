"""Times of solvers of contact problems W p + q = u with Coulomb's law: python bench/problems.py [DIR].

The problems are those of tumble's own steps in the scenes of bench/scenes, or the files of DIR in Siconos' text form
(.dat). The program local_problems of bench/measure, in BENCH_PROGRAMS, writes those of the scenes for bench/peers. A peer
solves them from no impulses (cold) and from the impulses of the step before (warm).
"""

import json
import os
import resource
import statistics
import subprocess
import sys
import tempfile
import time
from pathlib import Path

import numpy as np
import tumble
from tumble.bench._report import table

HERE = Path(__file__).resolve().parent
OWN = Path(os.environ.get("BENCH_PROGRAMS", "target/release"))
PEERS = HERE / "peers"
sys.path.insert(0, str(PEERS))
import common  # noqa: E402

# Siconos is Debian's python3-siconos and needs Debian's own Python.
PROGRAMS = {
    "Siconos": [os.environ.get("BENCH_SYSTEM_PYTHON", "/usr/bin/python3"), PEERS / "solve_siconos.py"],
    "Pinocchio": [sys.executable, PEERS / "solve_pinocchio.py"],
}
# Step of the first problem and distance between steps: at rest all problems are equal.
WANTED = {"stack": (100, 1000), "pyramid": (100, 1000), "wall": (100, 1000), "pile": (200, 50)}
SOLVED = 1e-9  # m/s
# Columns of the profile: the share of problems solved within this multiple of the fastest time.
WITHIN = (1.0, 2.0, 5.0, 10.0, 100.0)


def main() -> None:
    left_out: dict[str, str] = {}
    with tempfile.TemporaryDirectory() as folder:
        file = Path(folder) / "problems.bin"
        parts = of_folder(Path(sys.argv[1]), file, left_out) if len(sys.argv) > 1 else of_scenes(file, left_out)
    parts += [f"- left out: {peer} ({why})." for peer, why in left_out.items()]
    print("\n\n".join(parts))


def run(command: list, given: str | None = None) -> str:
    """Output of a program. Pinocchio uses the stack: 364 contacts need more than the default of 8 MiB."""
    _, most = resource.getrlimit(resource.RLIMIT_STACK)
    done = subprocess.run(
        command,
        input=given,
        capture_output=True,
        text=True,
        check=False,
        preexec_fn=lambda: resource.setrlimit(resource.RLIMIT_STACK, (most, most)),
    )
    if done.returncode != 0:
        raise RuntimeError(f"exit code {done.returncode}: {done.stderr or command[0]}")
    return done.stdout


def answers(file: Path, left_out: dict[str, str]) -> list[dict]:
    """Answers of every available peer to the problems of a file, with their residuals."""
    problems, found = common.read(file), []
    for peer, command in PROGRAMS.items():
        if peer in left_out or not problems:
            continue
        try:
            found += json.loads(run([*command, file]))
        except (OSError, RuntimeError) as error:
            left_out[peer] = str(error).strip().splitlines()[-1]
    for one in found:
        one["residual"] = residual(problems[one["problem"]], np.array(one["impulses"], dtype=float))
    return found


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


def of_scenes(file: Path, left_out: dict[str, str]) -> list[str]:
    """A table for each scene: times relative to tumble's whole step."""
    parts = []
    for name, (first, stride) in WANTED.items():
        scene = json.loads((HERE / "scenes" / f"{name}.json").read_text())
        run([OWN / "local_problems", file], json.dumps(scene | {"first": first, "stride": stride}))
        problems = common.read(file)
        own, contacts = [one.seconds for one in problems], [one.contacts for one in problems]
        solvers: dict[str, list[dict]] = {}
        for one in answers(file, left_out):
            solvers.setdefault(f"{one['solver']}, {one['start']}", []).append(one)
        heads = ["", "median, µs", "mean, µs", "to tumble's step", "not solved", "worst residual, m/s"]
        rows = [heads, ["tumble, the whole step", *middles(own), "1", "–", "–"]]
        for solver, found in solvers.items():
            seconds, residuals = [one["seconds"] for one in found], [one["residual"] for one in found]
            ratio = statistics.median(a / b for a, b in zip(seconds, own))
            unsolved = sum(not one <= SOLVED for one in residuals)
            rows.append([solver, *middles(seconds), f"{ratio:.3g}", str(unsolved), f"{max(residuals):.1g}"])
        parts += [f"*{name}*, problems: {len(problems)}, contacts: {min(contacts)} to {max(contacts)}", table(rows)]
    return parts


def middles(seconds: list[float]) -> list[str]:
    return [f"{1e6 * middle(seconds):.3g}" for middle in (statistics.median, statistics.mean)]


def of_folder(folder: Path, file: Path, left_out: dict[str, str]) -> list[str]:
    """Profiles over the problems given to every solver, and a table of all problems, solved cold."""
    problems, written = [], []
    for path in sorted(folder.glob("*.dat")):
        problem = tumble.ContactProblem.read(path)
        any_one, by_rule = solved(problem, "any"), solved(problem, "compliance")
        place = len(written) if set(problem.sizes) == {3} and not np.isnan(problem.mu).any() else None
        if place is not None:
            written.append((place, any_one[0], problem.to_local()))
        solvers = {"tumble": any_one, "tumble, by its rule": by_rule}
        problems.append({"name": path.stem, "contacts": len(problem.sizes), "place": place, "solvers": solvers})
    if not problems:
        raise SystemExit(f"problems: {folder}: no file there ends in .dat")
    write(file, written)
    placed = {one["place"]: one for one in problems if one["place"] is not None}
    for one in answers(file, left_out):
        if one["start"] == "cold":
            placed[one["problem"]]["solvers"][one["solver"]] = (one["seconds"], one["residual"])
    names = list(dict.fromkeys(name for one in problems for name in one["solvers"]))
    common_ones = [one for one in problems if set(names) == set(one["solvers"])]
    times = [{name: s for name, (s, r) in one["solvers"].items() if r <= SOLVED} for one in common_ones]
    rows = [["", "solved", "mean of what it solved, ms", *(f"within {factor:g} ×" for factor in WITHIN)]]
    for name in names:
        done = [own[name] for own in times if name in own]
        shares = [np.mean([name in own and own[name] <= factor * min(own.values()) for own in times] or [0.0]) for factor in WITHIN]
        mean = f"{1e3 * statistics.mean(done):.3g}" if done else "–"
        rows.append([name, f"{len(done)} of {len(times)}", mean, *(f"{share:.2f}" for share in shares)])
    each = [["", "contacts", *(f"{name}, ms" for name in names)]]
    for one in problems:
        each.append([one["name"], str(one["contacts"]), *(shown(one["solvers"].get(name)) for name in names)])
    what = f"{len(times)} problems, solved to {SOLVED:g} m/s from no impulses; the part within so many times the fastest solver's time:"
    return [what, table(rows), table(each)]


def solved(problem: tumble.ContactProblem, rule: str) -> tuple[float, float]:
    """Processor time (s) and residual (m/s) of a solution from no impulses. The fastest of some tries counts."""
    least, spent, residual = float("inf"), 0.0, float("inf")
    for _ in range(common.TRIES):
        clock = time.process_time()
        residual = problem.solve(rule=rule).residual
        taken = time.process_time() - clock
        least, spent = min(least, taken), spent + taken
        if spent > common.LONG_SECONDS:
            break
    return least, residual


def write(file: Path, problems: list[tuple[int, float, tumble.ContactProblem]]) -> None:
    """Writes local problems with their numbers and times (s) for the peers, without impulses to start from."""
    with file.open("wb") as out:
        for number, seconds, local in problems:
            rows = sum(local.sizes)
            out.write(np.array([len(local.sizes), number], "<u8").tobytes())
            parts = [seconds], local.matrix("W").ravel(), local.vector("q"), local.mu, np.zeros(rows)
            out.write(np.concatenate(parts).astype("<f8").tobytes())


def shown(pair: tuple[float, float] | None) -> str:
    if pair is None:
        return "–"
    return f"{1e3 * pair[0]:.3g}" if pair[1] <= SOLVED else f"not solved ({pair[1]:.1g} m/s)"


if __name__ == "__main__":
    main()
