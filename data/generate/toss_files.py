"""Makes data/tosses: one invented toss as a table and as tensors in the layout of torch.save.

The motion is free flight with a constant spin, from a formula: no recorded number is in it. The
archives are written with zipfile and pickle opcodes, so that torch is not needed; their layout is
that of torch.save since version 1.6 (archive/data.pkl, archive/data/0, archive/version).

    python3 data/generate/toss_files.py
"""

import math
import struct
import zipfile
from pathlib import Path

FOLDER = Path(__file__).resolve().parent.parent / "tosses"
RATE, FRAMES, G = 148.0, 12, 9.81
SPIN = (3.0, -1.5, 2.0)  # rad/s, body


def frame(k):
    """Position, attitude (w, x, y, z), velocity (world) and spin (body) of frame k."""
    t = k / RATE
    position = (0.1 + 1.2 * t, -0.05 + 0.4 * t, 0.095 - 0.3 * t - 0.5 * G * t * t)
    rate = math.sqrt(sum(w * w for w in SPIN))
    half = 0.5 * rate * t
    attitude = (math.cos(half), *(w / rate * math.sin(half) for w in SPIN))
    return position, attitude, (1.2, 0.4, -0.3 - G * t), SPIN


def table():
    head = "toss_id,step,t_s,x_m,y_m,z_m,qw,qx,qy,qz,vx_m_s,vy_m_s,vz_m_s,wx_rad_s,wy_rad_s,wz_rad_s"
    rows = [head]
    for k in range(FRAMES):
        numbers = [x for part in frame(k) for x in part]
        rows.append(",".join(["bounce", str(k), f"{k / RATE:.8f}", *map(repr, numbers)]))
    return "\n".join(rows) + "\n"


def text(string):
    data = string.encode()
    return b"X" + struct.pack("<I", len(data)) + data


def pickle(storage, count, offset, strides):
    """The opcodes that torch.save writes for one tensor."""
    two = lambda a, b: b"".join(b"M" + struct.pack("<H", n) for n in (a, b)) + b"\x86"
    return (
        b"\x80\x02ctorch._utils\n_rebuild_tensor_v2\nq\x00("
        + b"(" + text("storage") + b"q\x01ctorch\n" + storage.encode() + b"\nq\x02"
        + text("0") + b"q\x03" + text("cpu") + b"q\x04M" + struct.pack("<H", count) + b"tq\x05Q"
        + b"M" + struct.pack("<H", offset) + two(FRAMES, 13) + b"q\x06" + two(*strides)
        + b"q\x07\x89ccollections\nOrderedDict\nq\x08)Rq\ttq\nRq\x0b."
    )


def archive(name, storage, code, offset, strides):
    numbers = [0.0] * (offset + FRAMES * 13)
    for k in range(FRAMES):
        position, attitude, velocity, spin = frame(k)
        for column, value in enumerate((*attitude, *position, *spin, *velocity)):
            numbers[offset + k * strides[0] + column * strides[1]] = value
    with zipfile.ZipFile(FOLDER / name, "w", zipfile.ZIP_STORED) as file:
        entries = [
            ("archive/data.pkl", pickle(storage, len(numbers), offset, strides)),
            ("archive/data/0", struct.pack(f"<{len(numbers)}{code}", *numbers)),
            ("archive/version", b"3\n"),
        ]
        for entry, data in entries:
            file.writestr(zipfile.ZipInfo(entry, (1980, 1, 1, 0, 0, 0)), data)


FOLDER.mkdir(exist_ok=True)
(FOLDER / "bounce.csv").write_text(table())
archive("bounce.pt", "DoubleStorage", "d", 0, (13, 1))
archive("bounce-f32.pt", "FloatStorage", "f", 13, (1, FRAMES))  # by columns, after a gap
