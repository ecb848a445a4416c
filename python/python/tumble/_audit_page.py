"""Page of an audit, which needs no network."""

from __future__ import annotations

from html import escape
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from ._audit import KINDS
from ._files import replaced
from ._html import chart, document, legend, strips, table
from ._types import Floats, Location

if TYPE_CHECKING:
    from ._audit import Audit, Finding

_FINDINGS = 60
"""Most findings in the table."""
_SHOWN_STEPS = 12
"""Most steps whose velocities are shown."""
_VELOCITIES = 12
"""Most velocities of a step."""
_STRIPS = 40
"""Most contacts in the chart of residuals."""
_LEAST = 1e-12
"""Least value of logarithmic charts."""
_DARKEST = 1.0
"""Residual with the darkest colour, m/s."""


def write_page(audit: Audit, path: Location) -> None:
    """Writes the page of an audit."""
    steps = audit.steps
    times = steps["time_s"]
    count = len(times)
    span = f"{times[0]:.4g} s to {times[-1]:.4g} s" if count else "no time"
    verdict = "✓ no findings" if audit.is_clean else f"✗ {len(audit.findings)} findings"
    body = [
        f"<p>{count} steps, {span}. Laws count as met up to {audit.tolerance:.0e} m/s. {verdict}.</p>",
        table([["measure", "largest", "where"], *([name, value, where] for name, value, where in audit.largest())]),
    ]
    body += ["<ul>", *(f"<li>{escape(note)}</li>" for note in audit.notes), "</ul>"] if audit.notes else []
    body += ["<h2>Laws</h2>", table(_laws(audit))]
    if audit.findings:
        body += ["<h2>Findings</h2>", table(_findings(audit.findings))]
    if count:
        body += ["<h2>Over time</h2>", *_charts(audit)]
    body += _contacts(audit)
    if audit.look_at:
        body += ["<h2>Steps to look at</h2>", _STEPS_TEXT, *(_beside(audit, k) for k in audit.look_at[:_SHOWN_STEPS])]
    replaced(Path(path), document(audit.title, body).encode("utf-8"))


_STEPS_TEXT = (
    "<p>The exact step begins at the same state, with the same forces and contacts. It has hard contact and Coulomb's "
    "law. Overlaps of the start stay, because earlier steps made them.</p>"
)


def _laws(audit: Audit) -> list[list[str]]:
    rows = [["kind", "verdict", "steps at the worst row", "largest"]]
    for kind, unit in KINDS.items():
        own = [finding for finding in audit.findings if finding.kind == kind]
        if own:
            most = max(finding.value for finding in own)
            rows.append([kind, "✗", str(max(finding.steps for finding in own)), f"{most:.2e} {unit}"])
        else:
            rows.append([kind, "✓ met", "", ""])
    return rows


def _findings(findings: tuple[Finding, ...]) -> list[list[str]]:
    rows = [["kind", "row", "steps", "first", "worst", "value", "worst step"]]
    for each in findings[:_FINDINGS]:
        value = f"{each.value:.2e} {each.unit}"
        rows.append([each.kind, each.row, str(each.steps), str(each.first), str(each.worst), value, each.sentence])
    if len(findings) > _FINDINGS:
        rows.append([f"and {len(findings) - _FINDINGS} more", *[""] * 6])
    return rows


def _charts(audit: Audit) -> list[str]:
    steps, times = audit.steps, audit.steps["time_s"]
    both = np.maximum(np.column_stack([steps["residual_m_s"], steps["exact_residual_m_s"]]), _LEAST)
    slips = np.maximum(np.column_stack([steps["cone_slip_m_s"], steps["creep_m_s"]]), _LEAST)
    return [
        legend("engine", "exact step from the same state"),
        chart("residual, m/s", times, both, logarithmic=True),
        chart("engine's velocity from the exact one, m/s", times, steps["apart_m_s"][:, None], logarithmic=True),
        chart("overlap, m", times, steps["overlap_m"][:, None], logarithmic=True),
        chart("slip inside the cone (red), creep (blue), m/s", times, slips, logarithmic=True),
        chart("energy that contacts and errors add in a step, J", times, steps["energy_J"][:, None]),
    ]


def _contacts(audit: Audit) -> list[str]:
    """Table of all contacts and the chart of their residuals."""
    found = audit.contacts
    if not len(found["k"]):
        return []
    names = sorted(set(found["contact"]))
    columns = ["force_N", "slip_m_s", "residual_m_s"]
    worst = {name: float(found["residual_m_s"][found["contact"] == name].max()) for name in names}
    names.sort(key=lambda name: -worst[name])
    rows = [["contact", "steps with force", "largest force, N", "fastest slip, m/s", "largest residual, m/s", "step"]]
    for name in names[:_FINDINGS]:
        own = found["contact"] == name
        force, slip, residual = (found[column][own] for column in columns)
        at = int(found["k"][own][int(np.argmax(residual))])
        touched = len(np.unique(found["k"][own][force > 0.0]))
        slips = f"{slip[force > 0.0].max(initial=0.0):.2e}"
        rows.append([name, str(touched), f"{force.max():.3g}", slips, f"{residual.max():.2e}", str(at)])
    values: Floats = np.full((min(len(names), _STRIPS), len(audit.steps["k"])), -np.inf)
    place = {name: at for at, name in enumerate(names[:_STRIPS])}
    step = {int(k): at for at, k in enumerate(audit.steps["k"])}
    for name, k, residual in zip(found["contact"], found["k"], found["residual_m_s"]):
        if name in place:
            cell = place[name], step[int(k)]
            values[cell] = max(values[cell], residual)
    chart_of = strips(names[:_STRIPS], audit.steps["time_s"], values, audit.tolerance, _DARKEST)
    scale = f"Faint: at most {audit.tolerance:.0e} m/s. Strongest: about {_DARKEST:g} m/s and more. Empty: no contact."
    return [
        "<h2>Contacts</h2>",
        table(rows),
        "<h3>residual of each contact over time</h3>",
        f"<p>{scale}</p>",
        chart_of,
    ]


def _beside(audit: Audit, k: int) -> str:
    place = audit.place(k)
    engine, exact = audit.steps["residual_m_s"][place], audit.steps["exact_residual_m_s"][place]
    said = [f"<li>{escape(each.sentence)}</li>" for each in audit.findings if each.worst == k]
    time = audit.steps["time_s"][place]
    head = f"<summary><b>Step {k}</b>, to {time:.6g} s: residual {engine:.1e} m/s, of the exact step {exact:.1e} m/s</summary>"
    return f"<details open>{head}<ul>{''.join(said)}</ul><pre tabindex='0'>{escape(audit.beside(k, _VELOCITIES))}</pre></details>"
