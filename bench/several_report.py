"""Tables of the scenes with several boxes."""

import statistics

import numpy as np
from scene import Scene
from tables import NOTHING, length, table

MUJOCO = "MuJoCo elliptic"


def title(pile: Scene) -> str:
    what = "in motion" if pile.moves else "at rest"
    return f"**{pile.name}**: {len(pile.boxes)} boxes {what}, {pile.steps} steps"


def table_of(results, pile: Scene) -> str:
    """Speed, overlap and energy of every engine on one scene."""
    heads = ["µs a step", "to MuJoCo elliptic", "deepest overlap", "overlap at the end"]
    heads += ["moved" if not pile.moves else "kinetic energy at the end, J", "energy rise, J"]
    heads += ["not converged"]
    rows = []
    for engine in results.engines:
        seconds = results.times.get(engine.name, {}).get(pile.name)
        if seconds is None:
            continue
        figures = results.measured[engine.name][pile.name]
        row = [f"{1e6 * statistics.median(seconds) / pile.steps:.1f}"]
        row += [results.ratio(seconds, MUJOCO, pile)]
        row += [length(figures["overlap_m"]), length(figures["last_overlap_m"])]
        row += [length(figures["moved_m"]) if not pile.moves else energy(figures)]
        row += [f"{figures['energy_rise_J']:.1g}"]
        row += ["not reported" if figures["unsolved"] is None else str(figures["unsolved"])]
        rows.append([engine.name, *row])
    return table(heads, rows)


def energy(figures: dict) -> str:
    return f"{figures['kinetic_energy_J']:.3g}"


def remarks(results, pile: Scene) -> str:
    """Remarks of the engines about the run."""
    lines = []
    for engine in results.engines:
        figures = results.measured.get(engine.name, {}).get(pile.name, {})
        if figures.get("remarks"):
            lines.append(f"{engine.name}: {figures['remarks']}.")
    return "\n".join(lines)


def growth(results) -> str:
    """Time and memory by number of boxes, and the fitted power from 100 boxes on."""
    engines = [engine for engine in results.engines if engine.name in results.times]
    engines = [engine for engine in engines if any(map(engine.runs, results.growth))]
    others = [engine for engine in engines if engine.name != MUJOCO]
    heads = [f"{engine.name}: µs a step" for engine in engines]
    heads += [f"{engine.name} to {MUJOCO}" for engine in others]
    heads += [f"{engine.name}: MiB" for engine in engines]
    rows = []
    for scene in results.growth:
        row = [shown(cost(results, engine, scene, "time"), 1e6) for engine in engines]
        for engine in others:
            seconds = results.times[engine.name].get(scene.name, [])
            row.append(results.ratio(seconds, MUJOCO, scene) if seconds else NOTHING)
        row += [shown(cost(results, engine, scene, "memory"), 1 / 1024) for engine in engines]
        rows.append([str(len(scene.boxes)), *row])
    powers = [power(results, engine, "time") for engine in engines] + [NOTHING] * len(others)
    powers += [power(results, engine, "memory") for engine in engines]
    rows.append(["power of n from 100 on", *powers])
    return table(heads, rows)


def firsts(results) -> str:
    """Time and memory of the first step of each structure."""
    engines = [engine for engine in results.engines if any(map(engine.runs, results.firsts))]
    heads = [f"{engine.name}: ms" for engine in engines] + [f"{engine.name}: MiB" for engine in engines]
    heads += [f"{engine.name} to {MUJOCO}" for engine in engines if engine.name != MUJOCO]
    rows = []
    for scene in results.firsts:
        row = [shown(cost(results, engine, scene, "time"), 1e3) for engine in engines]
        row += [shown(cost(results, engine, scene, "memory"), 1 / 1024) for engine in engines]
        for engine in engines:
            if engine.name != MUJOCO:
                seconds = results.times[engine.name].get(scene.name, [])
                row.append(results.ratio(seconds, MUJOCO, scene) if seconds else NOTHING)
        rows.append([scene.name, *row])
    return table(heads, rows)


def cost(results, engine, scene: Scene, what: str) -> float | None:
    """Time per step (s) or memory (KiB); `None` if the engine did not run."""
    seconds = results.times[engine.name].get(scene.name)
    if seconds is None:
        return None
    if what == "time":
        return statistics.median(seconds) / scene.steps
    return results.measured[engine.name][scene.name]["memory_kib"]


def shown(value: float | None, scale: float) -> str:
    return NOTHING if value is None else f"{value * scale:.3g}"


def power(results, engine, what: str) -> str:
    """Slope of log cost over log n by least squares, from 100 boxes on."""
    large = [scene for scene in results.growth if len(scene.boxes) >= 100]
    points = [(len(scene.boxes), cost(results, engine, scene, what)) for scene in large]
    points = [point for point in points if point[1]]
    if len(points) < 2:
        return NOTHING
    return f"{np.polyfit(*np.log(np.array(points)).T, 1)[0]:.2f}"
