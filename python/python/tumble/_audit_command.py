"""The command ``tumble audit``: a judgement of recorded steps, with an exit code for CI jobs."""

from __future__ import annotations

import argparse
import sys
from collections.abc import Sequence
from zipfile import BadZipFile

import numpy as np

from . import certificate_check, referee
from ._tumble import TumbleError

ABOUT = """Judges recorded steps of an engine against Newton's law, hard contact and Coulomb's law.

FILE.npz is a run of MuJoCo: arrays qpos (K, nq), qvel (K, nv) and, if the model has them, ctrl, act and time, as
numpy.savez writes them. It needs --model. Any other FILE has step certificates, see
docs/reference/certificate-format.md. The exit code is 0 if every step meets the laws, 1 if one does not, and 2 if
a file cannot be read."""


def main(arguments: Sequence[str]) -> int:
    """Runs the command and returns its exit code."""
    parser = argparse.ArgumentParser(
        prog="tumble audit", description=ABOUT, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("file", metavar="FILE")
    parser.add_argument("--model", metavar="MODEL.xml", help="MuJoCo model of the run")
    parser.add_argument("--tolerance", type=float, default=1e-6, metavar="V", help="residual that is met, m/s (1e-6)")
    parser.add_argument("--every", type=int, default=1, metavar="N", help="only each N-th step of a run of MuJoCo")
    parser.add_argument("--page", metavar="PAGE.html", help="page with charts of a run of MuJoCo")
    options = parser.parse_args(arguments)
    is_run = options.file.endswith(".npz")
    if is_run != bool(options.model):
        parser.error("a run FILE.npz and --model MODEL.xml belong together")
    if not is_run:
        if options.page or options.every != 1:
            parser.error("--page and --every are for runs of MuJoCo")
        return certificate_check.main([options.file, "--tolerance", str(options.tolerance)])
    try:
        return _audit_run(options)
    except (OSError, ValueError, BadZipFile, ImportError, TumbleError) as error:
        print(f"{options.file}: {error}", file=sys.stderr)
        return 2


def _audit_run(options: argparse.Namespace) -> int:
    import mujoco

    with np.load(options.file) as arrays:
        states = dict(arrays)
    model = mujoco.MjModel.from_xml_path(options.model)
    audit = referee.audit(
        states, model=model, every=options.every, tolerance=options.tolerance, title=f"Audit of {options.file}"
    )
    print(audit.table())
    if options.page:
        audit.save(options.page)
    return 0 if audit.is_clean else 1
