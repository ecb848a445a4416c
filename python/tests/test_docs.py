"""Runs the Python code in the documents from top to bottom."""

import re

import pytest

FENCE = re.compile(r"^```python\n(.*?)^```$", re.MULTILINE | re.DOTALL)


@pytest.mark.parametrize("name", ["README.md", "docs/python.md", "docs/robots.md", "docs/fit.md", "docs/referee.md", "python/README.md"])
def test_the_code_of_the_documents_runs(name, root, tmp_path, monkeypatch, capsys):
    pytest.importorskip("pandas")
    pytest.importorskip("scipy")
    pytest.importorskip("gymnasium")
    text = (root / name).read_text()
    blocks = list(FENCE.finditer(text))
    assert blocks, f"{name} has no Python"
    (tmp_path / "scenarios").symlink_to(root / "scenarios")
    (tmp_path / "data").symlink_to(root / "data")
    monkeypatch.chdir(tmp_path)
    names = {"__name__": "__main__"}
    for block in blocks:
        line = text[: block.start(1)].count("\n")
        # Error messages refer to the document and its line.
        exec(compile("\n" * line + block.group(1), str(root / name), "exec"), names)
    if name == "docs/python.md":
        shown = capsys.readouterr().out
        assert "mass is -1.0 kg" in shown and (tmp_path / "plot.svg").is_file()
