"""The benchmark of solvers of contact problems, on problems of a folder."""

from __future__ import annotations

import importlib.util
import sys
from pathlib import Path

import numpy as np
import pytest
import tumble

BENCH = Path(__file__).resolve().parents[2] / "bench"


def test_problems_of_a_folder_are_solved_and_written_for_the_peers(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Spatial problems are written for other solvers, planar ones are not."""
    monkeypatch.syspath_prepend(str(BENCH / "peers"))
    spec = importlib.util.spec_from_file_location("bench_problems", BENCH / "problems.py")
    assert spec is not None and spec.loader is not None
    problems = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(problems)
    # A contact point of 2 kg with 1 m/s downwards and 0.3 m/s tangentially.
    for name, rows in [("a.dat", 2), ("b.dat", 3)]:
        free = np.array([-1.0, 0.3, 0.0])[:rows]
        tumble.ContactProblem(W=0.5 * np.eye(rows), q=free, mu=[0.25], dimension=rows).write(tmp_path / name)
    left_out = dict.fromkeys(problems.PROGRAMS, "not wanted")
    file = tmp_path / "problems.bin"
    text = "\n".join(problems.of_folder(tmp_path, file, left_out))
    assert "2 problems" in text and "| tumble | 2 of 2 |" in text
    [written] = problems.common.read(file)
    np.testing.assert_array_equal(written.w, 0.5 * np.eye(3))
    np.testing.assert_array_equal(np.concatenate([written.q, written.mu, written.start]), [-1.0, 0.3, 0, 0.25, 0, 0, 0])
    sys.modules.pop("common", None)
