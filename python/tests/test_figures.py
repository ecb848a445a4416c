"""The figures of the concept pages are those that their script makes."""

import os
import re
import shutil
import subprocess
import sys

import pytest


@pytest.fixture
def make(root, tmp_path):
    for module in ("matplotlib", "mujoco"):
        pytest.importorskip(module)
    environment = dict(os.environ, MPLCONFIGDIR=str(tmp_path))

    def run(*arguments, folder=root / "docs/figures"):
        command = [sys.executable, str(folder / "make.py"), *arguments]
        return subprocess.run(command, capture_output=True, text=True, env=environment, timeout=600)

    return run


def test_the_figures_are_up_to_date(make):
    done = make("--check")
    assert done.returncode == 0, done.stdout + done.stderr
    wrong = make("no-such")
    assert wrong.returncode == 2 and "no figure is called no-such" in wrong.stderr


def test_a_figure_with_another_curve_is_named(make, root, tmp_path):
    folder = tmp_path / "docs/figures"
    shutil.copytree(root / "docs/figures", folder)
    path, name = folder / "unphysical-steps.svg", "unphysical-steps"
    text = path.read_text(encoding="utf-8")
    # The first point of a curve in the description, moved by half of the axes or by less than a line's width.
    x = re.search(r'"points":\[\[([-.\d]+),', text).group(1)
    for shift, code in ((0.5, 1), (0.001, 0)):
        moved = f'"points":[[{float(x) + shift},'
        path.write_text(text.replace(f'"points":[[{x},', moved, 1), encoding="utf-8")
        done = make("--check", name, folder=folder)
        assert done.returncode == code and name in done.stdout, done.stdout + done.stderr


def test_every_concept_page_has_its_figure_and_its_file(root):
    pages = [page for page in (root / "docs/concepts").glob("*.md") if page.name != "README.md"]
    assert len(pages) >= 8
    for page in pages:
        shown = re.findall(r"\]\(\.\./figures/([\w-]+)\.svg\)", page.read_text(encoding="utf-8"))
        assert page.stem in shown, page.name
        assert (root / f"docs/figures/{page.stem}.svg").is_file()
