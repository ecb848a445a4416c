"""Live runs: a page in the browser in which bodies are pulled while the scene runs."""

from __future__ import annotations

import time
import weakref
from pathlib import Path
from types import TracebackType

from ._core import core_property
from ._files import refuse_foreign
from ._scene import Scene
from ._trajectory import RUN_FILES, Trajectory
from ._tumble import CoreLive
from ._types import Location

_PERIOD = 0.1
_HEIGHT = 760


class Live:
    """Server of a live run: ``scene.live()``.

    ``url`` is the address of the page, with its token. In a notebook the object shows the page.
    ``stop`` ends the server, as do the end of a ``with`` block, garbage collection, Ctrl-C in
    ``wait`` and the end of the program::

        with scene.live(record="touched") as live:
            print(live.url)
            live.wait()
    """

    url: str
    """Address of the page."""

    def __init__(self, scene: Scene, record: Location | None = None, *, overwrite: bool = False, port: int = 0) -> None:
        folder = None if record is None else Path(record)
        if folder is not None:
            folder.mkdir(parents=True, exist_ok=True)
            parts = (path.name for path in folder.glob("part-*.toml"))
            refuse_foreign(folder, [*RUN_FILES, *parts], overwrite)
        core = CoreLive(scene._core, port)
        self.url = core.url
        self._core = core
        self._end = weakref.finalize(self, _end, core, folder, overwrite)

    is_running: bool = core_property("is_running", "True until the server ends.")

    def stop(self) -> None:
        """Ends the server, frees its port, and writes the record. A second call does nothing."""
        self._end()

    def wait(self) -> None:
        """Serves until Ctrl-C, and stops."""
        try:
            while self.is_running:
                time.sleep(_PERIOD)
        except KeyboardInterrupt:
            pass
        self.stop()

    def scenes(self) -> list[Scene]:
        """Scenes of a stopped run: those that changes ended, and the last one.

        ``scene.run()`` repeats what the page showed, pulls included, to the last bit.
        """
        self.stop()
        return [Scene.from_text(text) for text in self._core.stop()]

    def __enter__(self) -> Live:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self.stop()

    def _repr_html_(self) -> str:
        if not self.is_running:
            return "<p>The live run has ended.</p>"
        style = f"width: 100%; height: {_HEIGHT}px; border: 0"
        return f'<iframe src="{self.url}" style="{style}" title="tumble, live"></iframe>'

    def __repr__(self) -> str:
        state = self.url if self.is_running else "ended"
        return f"<tumble.Live {state}>"


def _end(core: CoreLive, folder: Path | None, overwrite: bool) -> None:
    texts = core.stop()
    if folder is None or not texts:
        return
    *parts, text = texts
    scene = Scene.from_text(text)
    run: Trajectory = scene.run(scene.steps)
    files: dict[str, bytes] = {f"part-{number}.toml": part.encode() for number, part in enumerate(parts, start=1)}
    run._to_folder(folder, overwrite, files)
