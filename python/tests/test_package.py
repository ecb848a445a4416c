"""Package: stubs, types, documentation and the cost of import and of a step."""

import ast
import inspect
import re
import subprocess
import sys
import tracemalloc
from pathlib import Path

import pytest
import tumble
from tumble import _tumble

PACKAGE = Path(tumble.__file__).parent


def parameters(function):
    return [name for name in inspect.signature(function).parameters if name not in ("self", "cls")]


def stubbed(node):
    arguments = node.args
    every = [*arguments.posonlyargs, *arguments.args, *arguments.kwonlyargs]
    return [argument.arg for argument in every if argument.arg not in ("self", "cls")]


def test_the_stubs_are_those_of_the_module():
    tree = ast.parse((PACKAGE / "_tumble.pyi").read_text())
    found = set()
    for node in tree.body:
        if isinstance(node, ast.ClassDef):
            found.add(node.name)
            has = getattr(_tumble, node.name)
            members = {n.name: n for n in node.body if isinstance(n, ast.FunctionDef)}
            own = {name for name in vars(has) if not name.startswith("__")}
            own |= {name for name in members if name.startswith("__") and name in vars(has)}
            own |= {"__len__"} & set(vars(has))
            if node.name == "TumbleError":
                continue
            assert set(members) == own, node.name
            for name, member in members.items():
                decorators = {d.id for d in member.decorator_list if isinstance(d, ast.Name)}
                if "property" in decorators:
                    assert inspect.isgetsetdescriptor(vars(has)[name]), name
                elif name == "__new__":
                    assert stubbed(member) == parameters(has), node.name
                elif not name.startswith("__"):
                    assert stubbed(member) == parameters(getattr(has, name)), name
        elif isinstance(node, ast.FunctionDef):
            found.add(node.name)
            assert stubbed(node) == parameters(getattr(_tumble, node.name)), node.name
        elif isinstance(node, ast.AnnAssign):
            found.add(node.target.id)
    has = {name for name in dir(_tumble) if not name.startswith("__")} | {"__version__"}
    assert found == has


def test_everything_public_is_documented():
    for name in tumble.__all__:
        value = getattr(tumble, name)
        if inspect.isclass(value) or inspect.isfunction(value):
            assert value.__doc__, name
            for member, function in vars(value).items():
                if inspect.isfunction(function) and not member.startswith("_"):
                    assert function.__doc__, f"{name}.{member}"
    for value in (_tumble.CoreScene, _tumble.CoreSimulation, _tumble.Recording):
        for member, function in vars(value).items():
            if not member.startswith("_"):
                assert function.__doc__, member
    assert (PACKAGE / "py.typed").is_file()


def test_every_public_name_is_in_a_document(root):
    pages = [*(root / "docs").glob("**/*.md"), root / "README.md", root / "python/README.md"]
    code = re.findall(r"```.*?```|`[^`\n]+`", "\n".join(page.read_text() for page in pages), re.DOTALL)
    known = set(re.findall(r"\w+", " ".join(code)))
    usual = {name for kind in (dict, tuple, int, TypeError) for name in dir(kind)}
    for name in tumble.__all__:
        value = getattr(tumble, name)
        if inspect.isclass(value):
            public = {member for member in dir(value) if not member.startswith("_")} - usual
            public |= set(getattr(value, "__annotations__", {}))
            public = {member for member in public if not member.startswith("_")}
            assert not public - known, f"{name}: {sorted(public - known)}"
            # Methods of compiled classes are private.
            compiled = [kind for kind in value.__mro__ if vars(_tumble).get(kind.__name__) is kind]
            assert compiled in ([], [tumble.TumbleError]), name


def test_optional_packages_are_imported_when_they_are_used():
    optional = {"scipy", "matplotlib", "pandas", "h5py", "mujoco", "torch", "jax", "gymnasium", "dask", "rerun", "viser"}
    code = "import sys, tumble; print(*sys.modules)"
    found = subprocess.check_output([sys.executable, "-c", code], text=True).split()
    assert "tumble" in found and not optional & {name.split(".")[0] for name in found}


def test_the_types_hold():
    mypy = pytest.importorskip("mypy.api")
    root = Path(__file__).resolve().parents[1]
    files = [str(root / "python" / "tumble"), str(root / "examples")]
    out, errors, code = mypy.run(["--config-file", str(root / "pyproject.toml"), *files])
    assert code == 0, out + errors


def test_ruff_finds_nothing():
    pytest.importorskip("ruff")
    root = Path(__file__).resolve().parents[1]
    found = subprocess.run(
        [sys.executable, "-m", "ruff", "check", "--no-cache", str(root)], capture_output=True, text=True, check=False
    )
    assert found.returncode == 0, found.stdout + found.stderr


def test_a_step_from_python_costs_little():
    """A single step adds a handful of calls to that of the library and keeps no memory."""
    simulation = tumble.drop().simulate()
    simulation.step()
    calls = []
    sys.setprofile(lambda frame, event, function: calls.append(event) if event in ("call", "c_call") else None)
    simulation.step()
    sys.setprofile(None)
    # The methods step and advance, the named tuple and its base; and the end of the profile.
    assert len(calls) <= 5, calls
    tracemalloc.start()
    for _ in range(1000):
        simulation.step()
    kept, most = tracemalloc.get_traced_memory()
    tracemalloc.stop()
    assert kept < 2000 and most < 20_000, (kept, most)


def test_the_package_has_the_command_line(tmp_path):
    def command(*arguments):
        words = [sys.executable, "-m", "tumble", *arguments]
        return subprocess.run(words, cwd=tmp_path, capture_output=True, text=True, encoding="utf-8")

    assert command("--version").stdout.startswith(f"tumble {tumble.__version__}")
    assert command("new", "tower").returncode == 0
    assert command("run", "tower.toml", "--steps", "20", "--quiet").returncode == 0
    assert command("verify", "out").returncode == 0
    wrong = command("run", "twer.toml")
    assert wrong.returncode == 2 and wrong.stderr.startswith("error: twer.toml")


def test_unsolved_steps_are_logged(caplog):
    """A rod above the ground turns by two radians in a step."""
    rod = {"box": [2.0, 0.02, 0.02], "mass": 0.8, "position": [0, 0, 0.5], "spin": [0, 400, 0]}
    scene = tumble.Scene([rod], ground={"friction": 0.3}, time_step=0.005, integrator="euler")
    run = scene.run(1)
    assert [status.name for _, status in run.unsolved] == ["WILD"] and len(caplog.records) == 1
    said = "1 of 1 step is failed or wild; the trajectory's attribute unsolved lists them"
    assert (caplog.records[0].name, caplog.messages[0]) == ("tumble", said)
    tumble.rollout(scene, steps=1)
    assert len(caplog.records) == 2
