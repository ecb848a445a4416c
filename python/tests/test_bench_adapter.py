"""Engines outside the package, and result files that are judged again from their motions."""

import json
import subprocess
import sys
import zipfile

import numpy as np
import pytest
from tumble.bench import __main__, _runner, all_cases, check

CASES = "projectile,incline-slips,grad-slide,ramp-20-holds"


def bench(*arguments):
    command = [sys.executable, "-m", "tumble.bench", "--quiet", *map(str, arguments)]
    return subprocess.run(command, capture_output=True, text=True, check=False)


@pytest.fixture(scope="module", autouse=True)
def cases_read_once():
    cases = all_cases()
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(check, "all_cases", lambda folder: cases)
        yield


@pytest.fixture(scope="module")
def template(tmp_path_factory):
    """The template as a file, and the result file of its engine."""
    folder = tmp_path_factory.mktemp("template")
    adapter = folder / "my_engine.py"
    adapter.write_text(bench("--template").stdout)
    done = bench("--adapter", adapter, "--engines", "my-engine", "--cases", CASES, "--submit", folder)
    assert done.returncode == 0, done.stderr
    return adapter, folder / "my-engine.zip"


def stated(result):
    with zipfile.ZipFile(result) as archive:
        return json.loads(archive.read("result.json"))


def changed(result, path, change):
    """Copy of a result file in which ``change`` has replaced the content of each member."""
    with zipfile.ZipFile(result) as archive, zipfile.ZipFile(path, "w") as copy:
        for name in archive.namelist():
            copy.writestr(name, change(name, archive.read(name)))
    return path


def judged(path, capsys):
    code = check.main([str(path)])
    return code, capsys.readouterr().out


def test_the_template_is_an_engine_that_lets_bodies_fly(template, capsys):
    adapter, result = template
    found = stated(result)
    assert found["engine"]["name"] == "my-engine" and found["engine"]["version"] == "0.1"
    verdicts = {name: case["verdict"] for name, case in found["cases"].items()}
    assert verdicts == {
        "projectile": "right",
        "incline-slips": "wrong",
        "grad-slide": "wrong",
        "ramp-20-holds": "not modelled",
    }
    with zipfile.ZipFile(result) as archive:
        assert archive.read("adapter.py") == adapter.read_bytes()
    code, said = judged(result, capsys)
    assert code == 0 and "all statements agree with their motions" in said


def test_tumble_itself_submits_a_result(tmp_path, capsys):
    # tumble removes the overlap of the flush boxes before its first step.
    done = bench("--engines", "tumble", "--cases", f"{CASES},flush-boxes", "--submit", tmp_path)
    assert done.returncode == 0, done.stderr
    cases = stated(tmp_path / "tumble.zip")["cases"]
    assert {case["verdict"] for case in cases.values()} == {"right"}
    # The limit of processor time leaves the stopwatch finer than the ticks of the system.
    assert cases["projectile"]["seconds"] > 0.0 and round(cases["projectile"]["seconds"], 3) != cases["projectile"]["seconds"]
    page = tmp_path / "page"
    assert check.main([str(tmp_path / "tumble.zip"), "--out", str(page)]) == 0
    capsys.readouterr()
    rows = (page / "bench.md").read_text()
    assert "| incline-slips | ✓ |" in rows and "judged again in" in rows
    # Cases that a result leaves out count against it.
    assert "| incline-holds | · |" in rows


def test_a_stated_value_that_the_motion_does_not_have_is_named(template, tmp_path, capsys):
    def flatter(name, content):
        if name != "result.json":
            return content
        found = json.loads(content)
        case = found["cases"]["incline-slips"]
        case["values"][0], case["verdict"] = case["values"][0] + 1e-6, "right"
        found["cases"]["grad-slide"]["values"][0] += 1e-3
        return json.dumps(found)

    code, said = judged(changed(template[1], tmp_path / "flattered.zip", flatter), capsys)
    assert code == 1
    assert "incline-slips: acceleration is" in said and "incline-slips: it is wrong, not right as stated" in said
    assert "grad-slide:" in said and "3 statements do not agree" in said


def test_a_motion_that_was_changed_is_named(template, tmp_path, capsys):
    def move(name, content):
        if name != "projectile.npz":
            return content
        path = tmp_path / name
        path.write_bytes(content)
        states = np.load(path)["states"]
        states[:, 0, 0] += 1.0
        np.savez_compressed(path, states=states)
        return path.read_bytes()

    code, said = judged(changed(template[1], tmp_path / "moved.zip", move), capsys)
    assert code == 1
    assert "projectile: states of its motion have another hash than stated" in said
    assert "projectile: its motion does not begin at the start of the case" in said


def test_results_of_other_cases_and_damaged_ones_are_named(template, tmp_path, capsys):
    def rename(name, content):
        return content.replace(b'"projectile"', b'"my-case"') if name == "result.json" else content

    code, said = judged(changed(template[1], tmp_path / "other.zip", rename), capsys)
    assert code == 1 and "my-case: there is no such case here" in said

    def cut(name, content):
        return content[:100] if name == "projectile.npz" else content

    code, said = judged(changed(template[1], tmp_path / "cut.zip", cut), capsys)
    assert code == 1 and "projectile: the file has no readable result" in said

    def other_format(name, content):
        return content.replace(b"result 1", b"result 9") if name == "result.json" else content

    for path in (changed(template[1], tmp_path / "format.zip", other_format), template[0]):
        assert check.main([str(path)]) == 2
        assert "is not a result of tumble.bench" in capsys.readouterr().err
    assert check.main([str(template[1]), str(template[1])]) == 2
    assert "two results have the same engine and version" in capsys.readouterr().err


def edited(result, path, change):
    """Copy of a result file with another ``result.json``."""

    def edit(name, content):
        if name != "result.json":
            return content
        found = json.loads(content)
        change(found)
        return json.dumps(found)

    return changed(result, path, edit)


def test_two_versions_of_an_engine_are_two_rows(template, tmp_path, capsys):
    other = edited(template[1], tmp_path / "other.zip", lambda found: found["engine"].update(version="0.2"))
    assert check.main([str(template[1]), str(other)]) == 0
    said = capsys.readouterr().out
    assert "my-engine 0.1" in said and "my-engine 0.2" in said


@pytest.mark.parametrize(
    "change, said",
    [
        (lambda case: case.update(values=[], verdict="right"), "0 values instead of 1"),
        (lambda case: case["values"].append(0.0), "2 values instead of 1"),
        (lambda case: case.update(values=None), "has no field values of the right type"),
        (lambda case: case.update(seconds="1"), "has no field seconds of the right type"),
        (lambda case: case.update(reason=5), "has no field reason of the right type"),
        (lambda case: case.update(motion_sha256={}), "has no readable result"),
        (lambda case: case.clear(), "has no field case_sha256 of the right type"),
    ],
)
def test_a_case_that_states_no_more_than_a_verdict_is_named(template, tmp_path, capsys, change, said):
    path = edited(template[1], tmp_path / "short.zip", lambda found: change(found["cases"]["incline-slips"]))
    code, printed = judged(path, capsys)
    assert code == 1 and "incline-slips: the file has no readable result" in printed and said in printed


@pytest.mark.parametrize("field, value", [("settings", 5), ("version", None), ("name", []), ("compliant", "no")])
def test_an_engine_without_its_facts_is_refused(template, tmp_path, capsys, field, value):
    path = edited(template[1], tmp_path / "facts.zip", lambda found: found["engine"].update({field: value}))
    assert check.main([str(path)]) == 2
    assert f"engine has no field {field} of the right type" in capsys.readouterr().err


def test_a_folder_that_cannot_be_written_is_refused_before_the_run(tmp_path, capsys):
    (tmp_path / "file").write_text("")
    for option in ("--out", "--submit"):
        assert __main__.main(["--engines", "tumble", option, str(tmp_path / "file")]) == 2
        assert "file" in capsys.readouterr().err


def test_a_run_that_is_stopped_keeps_the_results_of_engines_that_have_ended(template, tmp_path, monkeypatch):
    def stop(outcome):
        if outcome.engine == "my-engine":
            raise KeyboardInterrupt
        return ""

    monkeypatch.setattr(__main__, "_said", stop)
    options = ["--engines", "tumble,my-engine", "--cases", "incline-slips", "--jobs", "1"]
    with pytest.raises(KeyboardInterrupt):
        __main__.main([*options, "--adapter", str(template[0]), "--submit", str(tmp_path)])
    assert [path.name for path in tmp_path.iterdir()] == ["tumble.zip"]


@pytest.mark.parametrize(
    "text, said",
    [
        ("", "has no list of engines; end it with ENGINES = [MyEngine()]"),
        ("import nowhere", "No module named 'nowhere'"),
        ("raise SystemExit(3)", "exit code 3"),
        (
            "from tumble.bench.engines import Engine\n"
            "class Mine(Engine):\n  name = 'mine'\n  version = run = None\nENGINES = [Mine()]",
            "Mine has no settings; add it to the class",
        ),
        (
            "from tumble.bench.engines import Engine\n"
            "class Mine(Engine):\n  name, settings, compliant = '../mine', '', False\n  version = run = None\nENGINES = [Mine()]",
            "the name '../mine' names a file",
        ),
    ],
)
def test_adapters_that_are_refused(tmp_path, capsys, text, said):
    path = tmp_path / "adapter.py"
    path.write_text(text)
    assert __main__.main(["--adapter", str(path), "--list"]) == 2
    error = capsys.readouterr().err
    assert f"--adapter {path} does not load" in error and said in error


@pytest.mark.parametrize(
    "line, limit, verdict",
    [
        ("import time; time.sleep(1.0)", 0.8, "right"),
        ("import time; time.sleep(60.0)", 0.2, "time limit"),
        ("while True: pass", 0.8, "time limit"),
    ],
)
def test_a_case_is_stopped_by_its_processor_time_or_a_long_wait(template, tmp_path, line, limit, verdict):
    path = tmp_path / "mine.py"
    path.write_text(template[0].read_text().replace("        return Motion(", f"        {line}\n        return Motion("))
    options = ["--engines", "my-engine", "--cases", "projectile", "--limit", limit, "--out", tmp_path]
    done = bench("--adapter", path, *options)
    assert done.returncode == 0, done.stderr
    (outcome,) = json.loads((tmp_path / "bench.json").read_text())["accuracy"]["my-engine"].values()
    assert outcome["verdict"] == verdict


@pytest.mark.parametrize(
    "line, verdict, reason",
    [
        ("if '--names' not in sys.argv: time.sleep(60)", "time limit", "it did not load in 2 s"),
        ("if '--names' not in sys.argv: os._exit(7)", "crash", "exit code 7"),
        # Engines may print bytes of another encoding, and lines without an end.
        ("os.write(1, b'\\xff')", "right", ""),
    ],
)
def test_an_engine_that_does_not_load_stops_no_other(template, tmp_path, monkeypatch, line, verdict, reason):
    path = tmp_path / "mine.py"
    path.write_text(f"import os, sys, time\n{template[0].read_text()}\n{line}\n")
    if verdict == "time limit":
        monkeypatch.setattr(__main__, "adapter_names", lambda *_: ["my-engine"])
        monkeypatch.setattr(_runner, "LOADING", 2.0)
    options = ["--engines", "my-engine,jolt", "--cases", "projectile", "--quiet", "--out", str(tmp_path)]
    assert __main__.main(["--adapter", str(path), *options]) == 0
    found = json.loads((tmp_path / "bench.json").read_text())["accuracy"]
    assert found["my-engine"]["projectile"]["verdict"] == verdict
    assert found["my-engine"]["projectile"]["reason"] == reason
    assert "projectile" in found["jolt"]


def test_cases_after_the_time_of_an_engine_are_not_run(template, tmp_path, capsys):
    path = tmp_path / "mine.py"
    text = template[0].read_text().replace("        return Motion(", "        while time.process_time() < 4: pass\n        return Motion(")
    path.write_text(f"import time\n{text}")
    options = ["--cases", "projectile,incline-slips", "--total", 4, "--submit", tmp_path]
    done = bench("--adapter", path, "--engines", "my-engine", *options)
    assert done.returncode == 0, done.stderr
    assert list(stated(tmp_path / "my-engine.zip")["cases"]) == ["incline-slips"]
    code, printed = judged(tmp_path / "my-engine.zip", capsys)
    assert code == 0 and "all statements agree" in printed


def test_an_adapter_that_hangs_is_refused(tmp_path, monkeypatch, capsys):
    monkeypatch.setattr(_runner, "LOADING", 0.5)
    path = tmp_path / "mine.py"
    path.write_text("import time; time.sleep(60)")
    assert __main__.main(["--adapter", str(path), "--list"]) == 2
    assert f"--adapter {path} does not load in 0.5 s" in capsys.readouterr().err


def test_an_adapter_cannot_take_the_name_of_another_engine(template, tmp_path, capsys):
    path = tmp_path / "mine.py"
    path.write_text(template[0].read_text().replace('"my-engine"', '"tumble"'))
    assert __main__.main(["--adapter", str(path), "--list"]) == 2
    assert "there is already an engine tumble; change its name" in capsys.readouterr().err


def test_a_motion_of_the_wrong_shape_is_an_error_that_names_both(template, tmp_path):
    path = tmp_path / "short.py"
    path.write_text(template[0].read_text().replace("Motion(states,", "Motion(states[1:],"))
    done = bench("--adapter", path, "--engines", "my-engine", "--cases", "projectile", "--out", tmp_path)
    assert done.returncode == 0, done.stderr
    (outcome,) = json.loads((tmp_path / "bench.json").read_text())["accuracy"]["my-engine"].values()
    assert outcome["verdict"] == "error" and "(1001, 1, 13) is needed" in outcome["reason"]


def test_a_penalty_engine_is_an_adapter_of_less_than_80_lines(root, tmp_path):
    path = root / "python" / "examples" / "penalty_adapter.py"
    assert len(path.read_text().splitlines()) < 80
    cases = "incline-slips,projectile,rolling-down,stack"
    done = bench("--adapter", path, "--engines", "penalty", "--cases", cases, "--out", tmp_path)
    assert done.returncode == 0, done.stderr
    found = json.loads((tmp_path / "bench.json").read_text())["accuracy"]["penalty"]
    verdicts = {name: outcome["verdict"] for name, outcome in found.items()}
    assert verdicts == {
        "incline-slips": "right",
        "projectile": "right",
        "rolling-down": "right",
        "stack": "not modelled",
    }
