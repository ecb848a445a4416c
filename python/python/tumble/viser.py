"""Runs in the viewer of viser, in a browser. It needs the package ``viser``."""

from __future__ import annotations

import threading
from typing import Any

import numpy as np
import viser

from ._checks import whole
from ._trajectory import Trajectory

_PICTURE = 1.0 / 30.0
_FORCES = (0xE0, 0x6C, 0x3C)


class Player:
    """A run in a viser server: ``show(run)``.

    The page has a time slider and a button that plays. Arrows are the contact forces of the step
    from a state on, with the lengths of the page: s/(1 + s) with s = √(force/weight). A grid is the ground.
    ``stop`` ends the playback and, if ``show`` made it, the server.
    """

    def __init__(self, run: Trajectory, server: Any | None, path: str) -> None:
        self._is_own = server is None
        self.server = viser.ViserServer(host="127.0.0.1", verbose=False) if server is None else server
        self._run = run
        bodies, fixed, _ = run._recording.surfaces()
        scene = self.server.scene
        self._frames = [scene.add_frame(f"{path}/bodies/{index}", show_axes=False) for index in range(len(bodies))]
        for kind, objects in (("bodies", bodies), ("fixed", fixed)):
            for index, meshes in enumerate(objects):
                for piece, (vertices, triangles, colour) in enumerate(meshes):
                    name = f"{path}/{kind}/{index}/{piece}"
                    scene.add_mesh_simple(name, np.array(vertices), np.array(triangles), color=colour)
        self._add_floor(f"{path}/ground")
        self._arrows = self._add_arrows(f"{path}/contacts")
        gui = self.server.gui
        self._slider = gui.add_slider("state", 0, len(run.time) - 1, 1, 0)
        self._residual = gui.add_text("residual", "", disabled=True)
        self._is_playing = gui.add_checkbox("play", False)
        self._slider.on_update(lambda _: self.set(int(self._slider.value)))
        self.set(0)
        self._ended = threading.Event()
        self._thread = threading.Thread(target=self._play, daemon=True, name="tumble-viser")
        self._thread.start()

    def set(self, index: int) -> None:
        """Shows the state at row ``index``."""
        whole("index", index, 0, len(self._run.time) - 1)
        with self.server.atomic():
            for body, frame in enumerate(self._frames):
                frame.position = self._run.positions[index, body]
                frame.wxyz = self._run.attitudes[index, body]
            if self._arrows is not None:
                arrows = self._ends[self._first[index] : self._first[index + 1]]
                self._arrows.visible = len(arrows) > 0
                self._arrows.points = arrows
        residuals = self._run.residuals
        self._residual.value = f"{residuals[index]:.1e} m/s" if index < len(residuals) else "no step follows"

    def stop(self) -> None:
        """Ends the playback and the player's own server."""
        self._ended.set()
        self._thread.join()
        if self._is_own:
            self.server.stop()

    def _add_floor(self, name: str) -> None:
        """Adds a grid in the plane of the ground, below the middle of the motion."""
        places = self._run.positions.reshape(-1, 3)
        middle = (places.min(axis=0) + places.max(axis=0)) / 2.0
        size = 2.0 * float(np.ptp(places, axis=0).max() + 2.0 * self._run.scene.extents.max())
        # One of these rays meets any plane.
        rays = (self._run.scene.cast_ray_all(middle, way) for way in (*np.eye(3), *-np.eye(3)))
        hit = next((hit for hits in rays for hit in hits if hit.owner == "ground"), None)
        if hit is None:
            return
        normal = hit.normal
        foot = middle - normal * np.dot(normal, middle - hit.point)
        # Rotation of z to the normal.
        turn = np.array([1.0 + normal[2], -normal[1], normal[0], 0.0])
        turn = turn / np.linalg.norm(turn) if turn.any() else np.array([0.0, 1.0, 0.0, 0.0])
        cell = 10.0 ** np.floor(np.log10(size / 2.0)) / 2.0
        self.server.scene.add_grid(name, size, size, cell_size=cell, section_size=2.0 * cell, wxyz=turn, position=foot)

    def _add_arrows(self, name: str) -> Any | None:
        """Adds the arrows of contact forces, if the run has contacts."""
        run = self._run
        if not run._recording.has_contacts:
            return None
        contacts = run.contacts
        loaded = np.any(contacts["force"] != 0.0, axis=1)
        steps = contacts["k"][loaded] - run.scene.start_index
        # The last state has no step, and no arrow.
        self._first = np.searchsorted(steps, np.arange(len(run.time) + 1))
        start, forces = contacts["point"][loaded], contacts["force"][loaded]
        size = 1.5 * float(run.scene.extents.mean())
        sizes = np.linalg.norm(forces, axis=1, keepdims=True)
        weight = float(run.scene.masses.mean() * np.linalg.norm(run.scene.gravity)) or sizes.max(initial=1e-300)
        root = np.sqrt(sizes / weight)
        self._ends = np.stack([start, start + size * root / (1.0 + root) * forces / sizes], axis=1)
        width = {"shaft_radius": 0.02 * size, "head_radius": 0.05 * size, "head_length": 0.1 * size}
        return self.server.scene.add_arrows(name, np.zeros((0, 2, 3)), _FORCES, **width)

    def _play(self) -> None:
        time = self._run.time
        while not self._ended.wait(_PICTURE):
            if self._is_playing.value:
                later = time[self._slider.value] + _PICTURE
                index = int(np.searchsorted(time, later))
                # From the end it plays again.
                self._slider.value = index if index < len(time) else 0


def show(run: Trajectory, *, server: Any | None = None, path: str = "/tumble") -> Player:
    """Shows a run in a viser server, by default a new one on 127.0.0.1.

    ``server`` is a ``viser.ViserServer`` with other things in it. Scene nodes are below ``path``.
    """
    return Player(run, server, path)
