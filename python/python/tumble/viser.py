"""Runs in the viewer of viser, in a browser. It needs the package ``viser``."""

from __future__ import annotations

import threading
from typing import Any

import numpy as np
import viser

from ._checks import whole
from ._trajectory import Trajectory

_PICTURE = 1.0 / 30.0


class Player:
    """A run in a viser server: ``show(run)``.

    The page has a time slider and a button that plays. ``stop`` ends the playback and, if
    ``show`` made it, the server.
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
        residuals = self._run.residuals
        self._residual.value = f"{residuals[index]:.1e} m/s" if index < len(residuals) else "no step follows"

    def stop(self) -> None:
        """Ends the playback and the player's own server."""
        self._ended.set()
        self._thread.join()
        if self._is_own:
            self.server.stop()

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
