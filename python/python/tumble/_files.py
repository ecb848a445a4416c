"""Atomic writes of files."""

from __future__ import annotations

import contextlib
import os
from collections.abc import Iterable, Iterator, Sequence
from pathlib import Path

from ._tumble import TumbleError, listed_files

_TEXT_HEAD, _BINARY_HEAD = 31, 6
"""Number of first bytes that tell files of tumble from others."""


def written(path: Path, content: bytes) -> Path:
    """Writes a file under a temporary name and renames it. Errors name the final file."""
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


def replaced(path: Path, content: bytes) -> Path:
    """Writes a file as ``written``. An existing file must begin as the new one."""
    size = _TEXT_HEAD if content[:1] in (b"<", b"#") else _BINARY_HEAD
    begin = b""
    if path.is_file():
        with open(path, "rb") as stream:
            begin = stream.read(size)
    if begin and begin != content[:size]:
        raise TumbleError(f"{path} was not written by tumble; move it, or choose another name")
    return written(path, content)


@contextlib.contextmanager
def folder_of_a_run(folder: Path, names: Sequence[str], overwrite: bool) -> Iterator[None]:
    """Creates and locks the folder for the files ``names`` of a run.

    Files listed in the folder's run.json belong to the previous run and are removed at the end.
    Any other file with one of the names is refused, unless ``overwrite`` is true.
    """
    folder.mkdir(parents=True, exist_ok=True)
    with _claimed(folder):
        listed = refuse_foreign(folder, names, overwrite)
        yield
        for name in listed.difference(names):
            (folder / name).unlink(missing_ok=True)


def refuse_foreign(folder: Path, names: Iterable[str], overwrite: bool) -> set[str]:
    """Refuses a folder with foreign files of these names. Returns the files of its run.json."""
    try:
        listed = set(listed_files((folder / "run.json").read_text("utf-8")))
    except (OSError, UnicodeDecodeError):
        listed = set()
    for name in names:
        path = folder / name
        is_listed = name in listed and path.is_file() and not path.is_symlink()
        is_there = os.path.lexists(path)
        if is_there and not is_listed and (not overwrite or path.is_dir()):
            raise TumbleError(
                f"{path} was not written by an earlier run: no run.json lists it; move it, choose another folder, or "
                "set overwrite=True"
            )
    return listed


@contextlib.contextmanager
def _claimed(folder: Path) -> Iterator[None]:
    """Locks a folder as the command line does, if the system has locks."""
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
                f"{folder}: another run is writing there; wait for it, or choose another folder"
            ) from None
        except OSError:
            # The file system has no locks.
            pass
        yield
    finally:
        os.close(handle)
