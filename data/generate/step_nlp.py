"""Contact step of one rigid body as a nonlinear program in CasADi SX.

Symbols: position r (world), attitude quaternion q = (w, x, y, z) (body to world, scalar first,
Hamilton), velocity v (world), angular velocity ω (body). Corner i is at c_i (body), and the ground
acts on it with the force f_i (world). A superscript + marks the end of the step.

    variables x    r⁺ q⁺ v⁺ ω⁺  fx fy fz  s1 s2 λ         13 + 6·8 = 61
    parameters p   r  q  v  ω   α                         13 + 8   = 21
    rows g         dynamics, unit quaternion, dissipation,
                   heights, cone, two complementarities    62 (`ROWS`)

The quaternion maps L, R, H and A follow B. E. Jackson, K. Tracy and Z. Manchester, "Planning with
Attitude", IEEE Robotics and Automation Letters 6(3), 2021.
"""

from dataclasses import dataclass
from typing import Any

import casadi as cs
import numpy as np

STATE = 13
CORNERS = 8
VARIABLES = STATE + 6 * CORNERS

# Slices of the variables.
POSITION, ATTITUDE, VELOCITY, SPIN = slice(0, 3), slice(3, 7), slice(7, 10), slice(10, 13)
FX, FY, FZ, S1, S2, LAMBDA = (slice(start, start + CORNERS) for start in range(STATE, VARIABLES, CORNERS))

# Slices of the rows. The dissipation rows have the order x_0, y_0, x_1, y_1, ...
ROWS = {
    "dynamics": slice(0, 13),
    "unit_quaternion": slice(13, 14),
    "dissipation": slice(14, 30),
    "height": slice(30, 38),
    "cone": slice(38, 46),
    "normal_complementarity": slice(46, 54),
    "friction_complementarity": slice(54, 62),
}


def cube_corners(half_side: float) -> np.ndarray:
    """Corners of a cube, 8×3. x changes fastest, then y, then z."""
    signs = (-1.0, 1.0)
    return half_side * np.array([(x, y, z) for z in signs for y in signs for x in signs])


@dataclass(frozen=True)
class Constants:
    """Constants of all steps. Each field may be a number (or array) or an SX.

    The defaults are the tutorial's values in SI units. `epsilon` (N) smooths the norm of a friction
    force.
    """

    dt: Any = 0.002
    mu: Any = 0.3
    mass: Any = 10.0
    inertia: Any = ((0.01, 0.0, 0.0), (0.0, 0.01, 0.0), (0.0, 0.0, 0.01))
    gravity: Any = (0.0, 0.0, -9.81)
    epsilon: Any = 1e-6
    corners: Any = tuple(map(tuple, cube_corners(1.0)))


def as_sx(value: Any) -> cs.SX:
    """Number, nested tuple, array or SX as SX."""
    return value if isinstance(value, cs.SX) else cs.SX(cs.DM(np.asarray(value)))


# H ω = (0, ω), 4×3.
H = cs.vertcat(cs.DM.zeros(1, 3), cs.DM.eye(3))


def left(q: cs.SX) -> cs.SX:
    """L(q) p = q ⊗ p, 4×4:  [w  −uᵀ; u  wE + [u]×]  with q = (w, u)."""
    w, u = q[0], q[1:4]
    return cs.blockcat([[w, -u.T], [u, w * cs.DM.eye(3) + cs.skew(u)]])


def right(q: cs.SX) -> cs.SX:
    """R(q) p = p ⊗ q, 4×4:  [w  −uᵀ; u  wE − [u]×]  with q = (w, u)."""
    w, u = q[0], q[1:4]
    return cs.blockcat([[w, -u.T], [u, w * cs.DM.eye(3) - cs.skew(u)]])


def rotation(q: cs.SX) -> cs.SX:
    """A(q) = Hᵀ L(q) R(q)ᵀ H, 3×3. It is ‖q‖² times a rotation for any q."""
    return H.T @ left(q) @ right(q).T @ H


def corner_positions(state: cs.SX, corners: Any) -> cs.SX:
    """Corner positions r + A(q) c_i in row i, 8×3, world."""
    turned = as_sx(corners) @ rotation(state[ATTITUDE]).T
    return turned + cs.repmat(state[POSITION].T, CORNERS, 1)


def smooth_norm(u: cs.SX, epsilon: Any) -> cs.SX:
    """Smoothed norm ‖u‖_ε = √(uᵀu + ε²) − ε."""
    return cs.sqrt(cs.sumsqr(u) + epsilon * epsilon) - epsilon


def dynamics_rows(constants: Constants, state: cs.SX, end: cs.SX, forces: cs.SX) -> cs.SX:
    """Prediction of the four equations of motion minus X⁺, 13 rows.

        r + h v⁺                               − r⁺
        d / ‖d‖,  d = q + ½ h L(q) H ω⁺        − q⁺
        v + h (Σ f_i / m + g)                  − v⁺
        ω + h I⁻¹ (τ − ω⁺ × I ω⁺)              − ω⁺,   τ = Σ c_i × A(q)ᵀ f_i

    The velocities are implicit. The attitude in τ is taken at the start of the step.
    """
    h, inertia = constants.dt, as_sx(constants.inertia)
    q, v_end, spin_end = state[ATTITUDE], end[VELOCITY], end[SPIN]

    body_forces = forces @ rotation(q)  # row i is (A(q)ᵀ f_i)ᵀ
    corners = as_sx(constants.corners)
    torque = sum(cs.cross(corners[i, :].T, body_forces[i, :].T) for i in range(CORNERS))
    acceleration = cs.sum1(forces).T / constants.mass + as_sx(constants.gravity)
    spin_rate = cs.inv(inertia) @ (torque - cs.cross(spin_end, inertia @ spin_end))

    turned = q + h / 2 * (left(q) @ H @ spin_end)
    predicted = cs.vertcat(
        state[POSITION] + h * v_end,
        turned / cs.sqrt(cs.sumsqr(turned)),
        state[VELOCITY] + h * acceleration,
        state[SPIN] + h * spin_rate,
    )
    return predicted - end


def contact_rows(constants: Constants, slip: cs.SX, heights: cs.SX, x: cs.SX, alpha: cs.SX) -> cs.SX:
    """Five families of contact rows, each ordered by corner.

        dissipation       α_i (c_xy,i + λ_i f_xy,i / (‖f_xy,i‖_ε + ε)) = 0
        height            z⁺_i ≥ 0
        cone              μ f_z,i − ‖f_xy,i‖_ε ≥ 0
        complementarity   s1_i − f_z,i z⁺_i ≥ 0
                          s2_i − λ_i (μ f_z,i − ‖f_xy,i‖_ε) ≥ 0

    `slip` holds c_xy, the mean horizontal velocity of each corner over the step, 8×2.
    """
    eps = constants.epsilon
    f_xy, f_z, lam = cs.horzcat(x[FX], x[FY]), x[FZ], x[LAMBDA]
    norms = [smooth_norm(f_xy[i, :].T, eps) for i in range(CORNERS)]
    dissipation = [alpha[i] * (slip[i, :] + lam[i] * f_xy[i, :] / (norms[i] + eps)).T for i in range(CORNERS)]
    cone = constants.mu * f_z - cs.vertcat(*norms)
    return cs.vertcat(*dissipation, heights, cone, x[S1] - f_z * heights, x[S2] - lam * cone)


def step_nlp(constants: Constants) -> dict[str, cs.SX]:
    """Step in the form of CasADi's nlpsol: variables x, parameters p, objective f, rows g.

    The objective is s1ᵀs1 + s2ᵀs2. The functions of the rows state the bounds.
    """
    x, p = cs.SX.sym("x", VARIABLES), cs.SX.sym("p", STATE + CORNERS)
    state, alpha, end = p[:STATE], p[STATE:], x[:STATE]
    before = corner_positions(state, constants.corners)
    after = corner_positions(end, constants.corners)
    slip = ((after - before) / constants.dt)[:, :2]
    rows = cs.vertcat(
        dynamics_rows(constants, state, end, cs.horzcat(x[FX], x[FY], x[FZ])),
        cs.sumsqr(end[ATTITUDE]) - 1,
        contact_rows(constants, slip, after[:, 2], x, alpha),
    )
    return {"x": x, "p": p, "f": cs.sumsqr(x[S1]) + cs.sumsqr(x[S2]), "g": rows}
