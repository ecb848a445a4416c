"""Files that are whole or not there."""

from __future__ import annotations

import os
from pathlib import Path


def written(path: Path, content: bytes) -> Path:
    """Writes a file under a temporary name and renames it. What fails has the file's name."""
    # Where it is needed: it takes long to import.
    import tempfile

    try:
        handle, temporary = tempfile.mkstemp(dir=path.parent, prefix=f".{path.name}.")
    except OSError as error:
        error.filename = os.fspath(path)
        raise
    try:
        with os.fdopen(handle, "wb") as stream:
            stream.write(content)
            stream.flush()
            os.fsync(stream.fileno())
        umask = os.umask(0)
        os.umask(umask)
        os.chmod(temporary, 0o666 & ~umask)
        os.replace(temporary, path)
    except BaseException:
        os.unlink(temporary)
        raise
    return path
