"""The figures of the concept pages are those that their script makes."""

import os
import re
import subprocess
import sys

import pytest


def test_the_figures_are_up_to_date(root, tmp_path):
    for module in ("matplotlib", "mujoco"):
        pytest.importorskip(module)
    environment = dict(os.environ, MPLCONFIGDIR=str(tmp_path))
    command = [sys.executable, str(root / "docs/figures/make.py")]
    done = subprocess.run([*command, "--check"], capture_output=True, text=True, env=environment, timeout=300)
    assert done.returncode == 0, done.stdout + done.stderr
    wrong = subprocess.run([*command, "no-such"], capture_output=True, text=True, env=environment, timeout=60)
    assert wrong.returncode == 2 and "no figure is called no-such" in wrong.stderr


def test_every_concept_page_has_its_figure_and_its_file(root):
    pages = [page for page in (root / "docs/concepts").glob("*.md") if page.name != "README.md"]
    assert len(pages) >= 8
    for page in pages:
        shown = re.findall(r"\]\(\.\./figures/([\w-]+)\.svg\)", page.read_text())
        assert page.stem in shown, page.name
        assert (root / f"docs/figures/{page.stem}.svg").is_file()
