"""One name for one thing in scene files, tables, data frames, Python and Rust."""

import csv
import inspect
import re
import tomllib
from pathlib import Path

import pytest
import tumble

ROOT = Path(__file__).resolve().parents[2]

# Columns of data frames that the files do not have.
DERIVED = {"normal_force_N"}


@pytest.mark.parametrize("name", ["four-bar", "pile"])
def test_data_frames_have_the_columns_of_the_files(name, tmp_path):
    run = tumble.load(ROOT / f"scenarios/{name}.toml").run(3)
    run.to_csv(tmp_path)
    frames = {"states": run.to_pandas(), "contacts": run.contacts_to_pandas(), "steps": run.steps_to_pandas()}
    if name == "four-bar":
        frames["joints"] = run.joints_to_pandas()
    for table, frame in frames.items():
        with open(tmp_path / f"{table}.csv", newline="") as file:
            header = next(csv.reader(file))
        assert set(frame.columns) - DERIVED <= set(header), table


def test_motors_have_the_fields_of_scene_files():
    fields = {name for name in inspect.signature(tumble.Simulation.set_motor).parameters if name != "self"}
    text = (ROOT / "crates/scene/src/bodies/joints/motor.rs").read_text()
    entry = re.search(r"pub struct MotorEntry \{(.*?)\n\}", text, re.DOTALL)
    assert entry and fields == set(re.findall(r"(\w+):", entry[1]))


def test_scenes_have_the_tables_of_scene_files():
    names = inspect.signature(tumble.Scene).parameters
    used = {key for file in (ROOT / "scenarios").glob("*.toml") for key in tomllib.loads(file.read_text())}
    # The short form of one body, and an option of a run.
    assert used - {"body", "start", "load", "solver"} <= set(names)


def test_constants_have_their_names_of_rust():
    text = (ROOT / "crates/core/src/world/constants.rs").read_text()
    names = set(re.findall(r'Self::\w+ => "(\w+)"', text.split("fn name(")[1].split(" fn ")[0]))
    documented = set(re.findall(r"`(\w+)`", (ROOT / "docs/python.md").read_text()))
    assert names and names <= documented
