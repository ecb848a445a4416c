"""Makes docs/pictures/pinch.gif: a pinched capsule in MuJoCo's steps and in hard steps.

python docs/figures/pinch.py [FILE]

The scene is that of python/examples/pinched_capsule.py. The picture shows two minutes at twenty times their speed.
Lengths are true to scale.
"""

from __future__ import annotations

import sys
from collections.abc import Callable
from pathlib import Path
from typing import Any, NamedTuple

import matplotlib

matplotlib.use("agg")

import matplotlib.pyplot as plt  # noqa: E402
import mujoco  # noqa: E402
import numpy as np  # noqa: E402
import numpy.typing as npt  # noqa: E402
import tumble.mujoco  # noqa: E402
from matplotlib.patches import BoxStyle, FancyBboxPatch, Rectangle  # noqa: E402
from PIL import Image  # noqa: E402

ROOT = Path(__file__).resolve().parents[2]
sys.path.insert(0, str(ROOT / "python/examples"))

import pinched_capsule as pinched  # noqa: E402

SECONDS = 120.0
FRAMES = 61
PAUSE = 100
"""Time of a frame, ms: the picture shows 2 s in it."""
Floats = npt.NDArray[np.float64]


class Panel(NamedTuple):
    title: str
    colour: str
    motion: Floats


def motion(impratio: float, step: Callable[[Any, Any], Any]) -> Floats:
    """Displacements of both fingers along x and of the capsule along z in each frame, mm: (frames, 3)."""
    model, data = pinched.scene(impratio)
    start = data.qpos.copy()
    found = [np.zeros(3)]
    for time in np.linspace(0.0, SECONDS, FRAMES)[1:]:
        while data.time < time - 0.5 * model.opt.timestep:
            step(model, data)
        found.append(1e3 * (data.qpos - start)[[0, 1, 4]])
    return np.array(found)


def hard(model: Any, data: Any) -> Any:
    """A hard step that must be solved."""
    return tumble.mujoco.hard_step(model, data, unsolved="raise")


def frame(number: int, panels: list[Panel]) -> Image.Image:
    """One picture of all panels."""
    figure, axes = plt.subplots(1, len(panels), figsize=(6.4, 2.5), dpi=100)
    figure.subplots_adjust(left=0.01, right=0.99, top=0.91, bottom=0.16, wspace=0.04)
    figure.text(0.5, 0.02, f"{number * SECONDS / (FRAMES - 1):.0f} s", ha="center", fontsize=9)
    for axis, panel in zip(axes, panels):
        left, right, height = panel.motion[number]
        axis.set(xlim=(-62, 62), ylim=(-76, 60), xticks=[], yticks=[], aspect="equal")
        axis.set_title(panel.title, fontsize=9)
        axis.set_xlabel("fell" if height < -100 else f"{abs(height):.1f} mm", fontsize=9)
        round_ends = BoxStyle.Round(pad=0, rounding_size=20)
        axis.add_patch(FancyBboxPatch((-20, height - 40), 40, 80, boxstyle=round_ends, fc=panel.colour, ec="none"))
        for side, moved in ((-30, left), (30, right)):
            axis.add_patch(Rectangle((side - 10 + moved, -30), 20, 60, fc="#9aa3ad", ec="none"))
        axis.axhline(0, color="#333333", lw=0.8)
        axis.plot([-8, 8], [height, height], color="white", lw=2)
    figure.canvas.draw()
    picture = Image.fromarray(np.asarray(figure.canvas.buffer_rgba())[:, :, :3].copy())  # type: ignore[attr-defined]
    plt.close(figure)
    return picture


def main() -> None:
    path = Path(sys.argv[1]) if len(sys.argv) > 1 else ROOT / "docs/pictures/pinch.gif"
    panels = [Panel(f"MuJoCo, impratio {ratio}", "#d1662a", motion(ratio, mujoco.mj_step)) for ratio in (1, 10, 100)]
    panels.append(Panel("tumble, hard steps", "#0b6e99", motion(1, hard)))
    pictures = [frame(number, panels) for number in range(FRAMES)]
    palette = pictures[-1].quantize(48, method=Image.Quantize.MEDIANCUT)
    frames = [picture.quantize(palette=palette, dither=Image.Dither.NONE) for picture in pictures]
    frames[0].save(path, save_all=True, append_images=frames[1:], duration=[PAUSE] * (FRAMES - 1) + [2000], loop=0)
    print(path)
    for panel in panels:
        print(f"{panel.title}: the capsule moved {abs(panel.motion[-1, 2]):.3g} mm in {SECONDS:g} s")


if __name__ == "__main__":
    main()
