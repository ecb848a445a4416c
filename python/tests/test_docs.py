"""Runs the Python code in the documents from top to bottom."""

import re
import warnings

import pytest
from conftest import ROOT

FENCE = re.compile(r"^```(python|toml)\n(.*?)^```$", re.MULTILINE | re.DOTALL)
SCENE = re.compile(r"# (\S+\.toml)\b")
FOLDERS = ["docs/howto", "docs/concepts"]
PAGES = ["README.md", "docs/start.md", "docs/python.md", "docs/robots.md", "docs/fit.md", "python/README.md"]


def pages():
    """All pages with Python."""
    found = [page.relative_to(ROOT) for folder in FOLDERS for page in sorted((ROOT / folder).glob("*.md"))]
    return PAGES + [str(page) for page in found if "\n```python\n" in (ROOT / page).read_text()]


@pytest.mark.parametrize("name", pages())
def test_the_code_of_the_documents_runs(name, root, tmp_path, monkeypatch, capsys):
    for module in ("pandas", "scipy", "gymnasium", "distributed", "mujoco"):
        pytest.importorskip(module)
    text = (root / name).read_text()
    blocks = list(FENCE.finditer(text))
    assert any(block[1] == "python" for block in blocks), f"{name} has no Python"
    for folder in ("scenarios", "data"):
        (tmp_path / folder).symlink_to(root / folder)
    monkeypatch.chdir(tmp_path)
    names = {"__name__": "__main__"}
    for block in blocks:
        language, code = block.groups()
        if language == "toml":
            # A scene that later code loads. Other blocks show a part of a file.
            if scene := SCENE.match(code):
                (tmp_path / scene[1]).write_text(code)
            continue
        line = text[: block.start(2)].count("\n")
        # Error messages refer to the document and its line.
        if name == "README.md":
            # Its first steps show no warning.
            warnings.simplefilter("error")
        exec(compile("\n" * line + code, str(root / name), "exec"), names)
    if name == "docs/python.md":
        shown = capsys.readouterr().out
        assert "mass is -1.0 kg" in shown and (tmp_path / "plot.svg").is_file()


def test_every_how_to_page_has_code_and_is_listed():
    folder = ROOT / "docs/howto"
    index = (folder / "README.md").read_text()
    listed = [page for page in sorted(folder.glob("*.md")) if page.name != "README.md"]
    assert len(listed) >= 20
    for page in listed:
        assert f"]({page.name})" in index, page.name
        assert re.search(r"^```(python|sh)$", page.read_text(), re.MULTILINE), page.name
