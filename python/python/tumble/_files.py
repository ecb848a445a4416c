"""Files that are whole or not there."""

from __future__ import annotations

import contextlib
import os
import re
from pathlib import Path
from typing import Iterable, Iterator

from ._tumble import TumbleError

_TEMPORARY = re.compile(r"\.tumble-[0-9A-Za-z]{6}\.tmp")
"""The names of files that are not complete, the command line's too."""


def written(path: Path, content: bytes) -> Path:
    """Writes a file under a temporary name and renames it. What fails has the file's name."""
    handle = None
    while handle is None:
        temporary = path.parent / f".tumble-{os.urandom(3).hex()}.tmp"
        try:
            handle = os.open(temporary, os.O_WRONLY | os.O_CREAT | os.O_EXCL, 0o666)
        except FileExistsError:
            continue
        except OSError as error:
            error.filename = os.fspath(path)
            raise
    try:
        with os.fdopen(handle, "wb") as stream:
            stream.write(content)
            stream.flush()
            os.fsync(stream.fileno())
        os.replace(temporary, path)
    except BaseException:
        os.unlink(temporary)
        raise
    return path


@contextlib.contextmanager
def folder_of_a_run(folder: Path, may_be_there: Iterable[str]) -> Iterator[None]:
    """Makes the folder for the files of a run, which nobody else writes to meanwhile, and removes from it what runs that
    were killed have left of theirs, and files of another run, whose names ``may_be_there`` has."""
    folder.mkdir(parents=True, exist_ok=True)
    with _claimed(folder):
        for name in os.listdir(folder):
            if _TEMPORARY.fullmatch(name) or name in may_be_there:
                (folder / name).unlink(missing_ok=True)
        yield


@contextlib.contextmanager
def _claimed(folder: Path) -> Iterator[None]:
    """The lock that the command line has on a folder; none where the system has none."""
    try:
        import fcntl

        handle = os.open(folder, os.O_RDONLY)
    except (ImportError, OSError):
        yield
        return
    try:
        try:
            fcntl.flock(handle, fcntl.LOCK_EX | fcntl.LOCK_NB)
        except BlockingIOError:
            raise TumbleError(
                f"{folder}: another run is writing there; wait for it, or name another folder"
            ) from None
        except OSError:
            # A file system without locks.
            pass
        yield
    finally:
        os.close(handle)
