from __future__ import annotations

import gc
import http.client
import json
import os
import shutil
import signal
import socket
import struct
import subprocess
import sys
import threading
from pathlib import Path
from typing import Any
from urllib.parse import urlsplit

import numpy as np
import pytest
import tumble

SCENE = """
name = "tower"
[ground]
friction = 0.5
[[bodies]]
box = 0.2
mass = 1.0
position = [0.0, 0.0, 0.1]
copies = { count = [1, 1, 3], step = [0.0, 0.0, 0.2] }
"""
HEAD, OF_BODY = 20, 7


@pytest.fixture
def scene() -> tumble.Scene:
    return tumble.Scene.from_text(SCENE)


def page(url: str) -> tuple[int, str]:
    address = urlsplit(url)
    connection = http.client.HTTPConnection(address.netloc, timeout=600)
    connection.request("GET", address.path)
    answer = connection.getresponse()
    return answer.status, answer.read().decode()


class Window:
    """The WebSocket of a page, with the little of the protocol that a test needs."""

    def __init__(self, url: str) -> None:
        address = urlsplit(url)
        assert address.port is not None
        self.stream = socket.create_connection(("127.0.0.1", address.port), timeout=600)
        fields = [
            f"GET {address.path}live HTTP/1.1",
            f"Host: {address.netloc}",
            f"Origin: http://{address.netloc}",
            "Upgrade: websocket",
            "Connection: Upgrade",
            "Sec-WebSocket-Version: 13",
            "Sec-WebSocket-Key: dGhlIHNhbXBsZSBub25jZQ==",
        ]
        self.stream.sendall(("\r\n".join(fields) + "\r\n\r\n").encode())
        self.rest = b""
        head = b""
        while not head.endswith(b"\r\n\r\n"):
            head += self.stream.recv(1)
        self.status = int(head.split()[1])

    def _bytes(self, count: int) -> bytes:
        parts = b""
        while len(parts) < count:
            part = self.stream.recv(count - len(parts))
            assert part, "the socket was closed"
            parts += part
        return parts

    def asked(self, **request: Any) -> tuple[dict[str, Any], np.ndarray[Any, Any]]:
        text = json.dumps(request).encode()
        assert len(text) < 126
        # The mask of zeros leaves the text as it is.
        self.stream.sendall(bytes([0x81, 0x80 | len(text), 0, 0, 0, 0]) + text)
        kind, length = self._bytes(2)
        assert kind == 0x82, "a binary message"
        if length >= 126:
            size, form = {126: (2, ">H"), 127: (8, ">Q")}[length]
            (length,) = struct.unpack(form, self._bytes(size))
        message = self._bytes(length)
        (end,) = struct.unpack("<I", message[:4])
        numbers = message[-(-(4 + end) // 8) * 8 :]
        return json.loads(message[4 : 4 + end]), np.frombuffer(numbers, dtype="<f8")


def is_free(url: str) -> bool:
    port = urlsplit(url).port
    with socket.socket() as probe:
        probe.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
        try:
            probe.bind(("127.0.0.1", port))
        except OSError:
            return False
    return True


def test_the_server_answers_the_page_and_the_socket_and_frees_its_port(
    scene: tumble.Scene,
) -> None:
    with scene.live() as live:
        assert live.is_running and live.url.startswith("http://127.0.0.1:")
        status, text = page(live.url)
        assert status == 200 and "<title>tumble playground</title>" in text
        window = Window(live.url)
        look, _ = window.asked(do="look")
        assert len(look["film"]["bodies"]) == 3
        _, frame = window.asked(do="step", count=7, contacts=False)
        assert frame[0] == 7 and len(frame) == HEAD + 3 * OF_BODY
        assert live.url in live._repr_html_()
        assert not is_free(live.url)
    assert not live.is_running and is_free(live.url)
    assert live.url not in live._repr_html_()
    live.stop()


def test_a_wrong_token_is_refused(scene: tumble.Scene) -> None:
    with scene.live() as live:
        address = urlsplit(live.url)
        for path in ("/", f"/{'0' * 32}/"):
            wrong = f"http://{address.netloc}{path}"
            assert page(wrong)[0] == 403
            assert Window(wrong).status == 403
        assert page(live.url)[0] == 200


def verified(states: Path) -> None:
    program = os.environ.get("TUMBLE") or shutil.which("tumble")
    if program is None:
        pytest.skip("TUMBLE does not name the program of the command line")
    done = subprocess.run([program, "verify", str(states)], capture_output=True, text=True)
    assert done.returncode == 0, done.stdout + done.stderr


def test_the_record_has_the_pull_and_is_verified(scene: tumble.Scene, tmp_path: Path) -> None:
    folder = tmp_path / "touched"
    with scene.live(folder) as live:
        window = Window(live.url)
        window.asked(do="step", count=10, contacts=False)
        window.asked(do="change", change={"friction": 0.2})
        assert window.asked(do="hold", body=2)[0]["body"] == 2
        window.asked(do="pull", target=[0.5, 0.0, 1.0])
        window.asked(do="step", count=50, contacts=False)
        window.asked(do="release")
        _, frame = window.asked(do="step", count=20, contacts=False)
    names = {path.name for path in folder.iterdir()}
    assert names == {"states.csv", "contacts.csv", "steps.csv", "run.json", "part-1.toml"}
    first, last = live.scenes()
    assert (first.steps, last.steps, last.friction) == (10, 70, 0.2)
    run = tumble.Trajectory.from_csv(last, folder)
    shown = frame[HEAD:].reshape(3, OF_BODY)
    np.testing.assert_array_equal(run.positions[-1], shown[:, :3])
    assert run.positions[-1][2][0] > 0.1, "the body was pulled"
    part = tumble.load(folder / "part-1.toml").run()
    np.testing.assert_array_equal(part.states[-1], run.states[0])
    verified(folder / "states.csv")
    # The next run replaces the files of this one.
    scene.live(folder).stop()
    assert "part-1.toml" not in {path.name for path in folder.iterdir()}
    verified(folder / "states.csv")


def test_a_foreign_file_is_refused_before_the_run(scene: tumble.Scene, tmp_path: Path) -> None:
    for name in ("states.csv", "part-3.toml"):
        folder = tmp_path / name.split(".")[0]
        folder.mkdir()
        (folder / name).write_text("mine")
        with pytest.raises(tumble.TumbleError, match=name):
            scene.live(folder)
        assert (folder / name).read_text() == "mine"


def test_the_residual_of_a_file_stays(scene: tumble.Scene) -> None:
    text = f'{SCENE}[solver]\nname = "native"\nresidual = 1e-6\n'
    live = tumble.Scene.from_text(text).live()
    window = Window(live.url)
    _, frame = window.asked(do="step", count=3, contacts=False)
    (repeated,) = live.scenes()
    run = tumble.Scene.from_text(text).run(3)
    np.testing.assert_array_equal(run.positions[-1], frame[HEAD:].reshape(3, OF_BODY)[:, :3])
    np.testing.assert_array_equal(repeated.run().states, run.states)


def test_the_server_ends_with_its_object(scene: tumble.Scene) -> None:
    live = scene.live()
    url = live.url
    del live
    gc.collect()
    assert is_free(url)


def test_ctrl_c_ends_the_waiting(scene: tumble.Scene, tmp_path: Path) -> None:
    with scene.live(tmp_path / "run") as live:
        timer = threading.Timer(0.5, lambda: os.kill(os.getpid(), signal.SIGINT))
        timer.start()
        live.wait()
        assert not live.is_running
    assert (tmp_path / "run" / "run.json").exists()


def test_the_end_of_the_program_writes_the_record(tmp_path: Path) -> None:
    program = (
        "import sys, tumble\n"
        "live = tumble.drop(seed=1).live(sys.argv[1])\n"
        "print(live.url)\n"
    )
    folder = tmp_path / "run"
    command: list[str] = [sys.executable, "-c", program, str(folder)]
    done = subprocess.run(command, capture_output=True, text=True, timeout=600)
    assert done.returncode == 0 and done.stderr == "", done.stderr
    assert (folder / "run.json").exists() and is_free(done.stdout.strip())


def test_a_used_port_is_refused() -> None:
    with tumble.drop(seed=1).live() as live:
        port = urlsplit(live.url).port
        assert port is not None
        with pytest.raises(tumble.TumbleError, match="cannot be served"):
            tumble.drop(seed=1).live(port=port)


def test_terrain_is_live(scenarios: Path) -> None:
    with tumble.load(scenarios / "hill.toml").live() as live:
        window = Window(live.url)
        look, _ = window.asked(do="look")
        (hill,) = look["film"]["fixed"]
        assert hill["name"] == "hill" and "mesh" in hill["pieces"][0]
        _, frame = window.asked(do="step", count=20, contacts=False)
        assert frame[0] == 20
