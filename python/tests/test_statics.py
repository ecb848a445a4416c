"""Statics of scenes: verdicts, limits and refusals."""

import json
import subprocess
import sys
from pathlib import Path

import pytest
import tumble

EXAMPLES = Path(__file__).resolve().parents[1] / "examples"
GRAVITY = 9.81


def block(friction=0.5, **body):
    tall = {"name": "tall", "box": [0.2, 0.2, 0.6], "mass": 2.0, "position": [0, 0, 0.3], **body}
    return tumble.Scene([tall], ground={"friction": friction}, name="block")


def test_a_block_stands_and_tips_or_slides_at_its_limit():
    answer = block().stands(push=("tall", [1, 0, 0]), least_friction=True, move={"tall": [0, 1, 0]})
    assert (answer.verdict, answer.stands, answer.least_friction) == ("equilibrium", True, 0.0)
    assert answer.factor == pytest.approx(2 * GRAVITY / 3, rel=1e-6)
    limit = answer.report["limit"]
    assert limit["force_check"]["holds"] and limit["mechanism_check"]["holds"]
    assert limit["weak"][0]["between"] == ["tall", "the ground"]
    # It tips: friction does not matter, and each kilogram holds as much as the others.
    assert limit["friction_slopes"][0]["slope"] == pytest.approx(0, abs=1e-4)
    assert limit["mass_slopes"][0]["slope"] == pytest.approx(GRAVITY / 3, rel=1e-4)
    assert limit["slopes"][0]["slope"] == pytest.approx(0, abs=1e-4)
    assert answer.report["simulator"]["moves"] is False
    worst = block().stands(base=[1, 0, 0], friction=(0.2, 0.6))
    assert worst.factor == pytest.approx(0.2 * GRAVITY, rel=1e-6)
    assert worst.report["simulator"] is None


def test_a_block_in_the_air_has_a_mechanism():
    answer = block(position=[0, 0, 1.0]).stands()
    assert (answer.verdict, answer.stands, answer.factor) == ("none", False, None)
    assert answer.report["mechanism_check"]["holds"]
    assert answer.report["mechanism"][0]["velocity"][2] == pytest.approx(-1)
    assert answer.report["simulator"]["moves"] is True


def test_wrong_questions_are_refused():
    scene = block()
    for question, word in [
        ({"push": ("tal", [1, 0, 0])}, "tal"),
        ({"push": ("tall", [1, 0])}, "three"),
        ({"tilt": [0, 1, 0], "base": [1, 0, 0]}, "one load"),
        ({"tilt": [0, 0, 1]}, "horizontal"),
        ({"friction": (0.5, 0.3)}, "friction"),
        ({"move": {"tall": [1, 0, 0]}}, "load"),
    ]:
        with pytest.raises(tumble.TumbleError, match=word):
            scene.stands(**question)


def cube(low):
    """Block of COMPAS: a cube of 1 m, and its mesh."""
    vertices = [(x, y, z) for z in (low, low + 1.0) for y in (-0.5, 0.5) for x in (-0.5, 0.5)]
    return {"data": {"vertex": {str(k): dict(zip("xyz", at)) for k, at in enumerate(vertices)}, "face": {}}}


def test_an_assembly_of_compas_is_read(tmp_path):
    nodes = {str(k): {"block": cube(float(k)), "is_support": k == 0} for k in range(3)}
    edges = {"0": {"1": {"interfaces": [{}]}, "2": {"interfaces": [{}]}}, "1": {"2": {"interfaces": [{}]}}}
    graph = {"node": nodes, "edge": edges}
    file = tmp_path / "assembly.json"
    for form in ({"data": {"graph": {"data": graph}}}, {"value": {"data": graph}}):
        file.write_text(json.dumps(form))
        end = subprocess.run(
            [sys.executable, str(EXAMPLES / "compas_assembly.py"), str(file), "--friction", "0.3"],
            capture_output=True, text=True, timeout=600,
        )
        assert end.returncode == 0, end.stderr
        assert "2 blocks, 1 supports: equilibrium" in end.stdout
        assert "smallest friction  0.0000" in end.stdout
        # Two cubes tip at g/2 and slide at 0.3 g.
        assert "2.943 m/s²" in end.stdout
        assert "no contact at the interface of block-0 and block-2" in end.stdout
