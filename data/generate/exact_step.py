"""One time step of a rigid body with corner contacts, solved to rounding.

The step (semi-implicit Euler, hard contact, Coulomb friction with maximum dissipation) is the
problem in V = (v+, w+) and one impulse p_i per corner

    m (v+ - v) + m g h e_z                    = sum_i p_i
    J (w+ - w) + h w+ x J w+                  = sum_i c_i x R(q)^T p_i
    r+ = r + h v+,   q+ = normalise(q + h/2 q (0, w+))
    u_i = ( (C+ - C)_xy / h , C+_z / h )      corner i, world
    0 <= p_z  perpendicular to  u_z >= 0
    p_xy = argmin over |b| <= mu p_z of  u_xy . b

The contact law may not determine the forces, for example with three or more corners of a face or a
sticking edge. The solution is then the limit for e -> 0 of the same law with equal compliance at
every corner, u_i + e p_i / m instead of u_i.

The method differs from a production solver on purpose:

1. *Smoothing Newton*: the natural map with both projections smoothed by a width kappa. kappa goes
   to nearly zero together with the residual. The Jacobians come from CasADi's automatic
   differentiation.
2. *Modes*: every corner is classified as open, sticking or sliding. For fixed modes the step is a
   smooth square system. The unknowns of a sliding corner are normal impulse, direction angle and
   slip speed. Plain Newton solves the system with compliance.
3. *Limit*: the first-order condition of e -> 0 is solved together with the law at e = 0
   (minimum-norm Newton steps, SVD). No compliance remains in the solution. `residual`, which is
   independent of modes and compliance, then measures the step. It must be at rounding level.

If the modes are wrong, the natural map at the current point proposes new ones. After that,
neighbouring modes are tried.
"""

from __future__ import annotations

import itertools
from dataclasses import dataclass

import casadi as cs
import numpy as np

OPEN, STICK, SLIP = 0, 1, 2


@dataclass(frozen=True)
class Params:
    """Constants of a scene. `inertia` is 3x3 in the body frame about the centre of mass."""

    inertia: tuple
    mass: float = 10.0
    mu: float = 0.3
    gravity: float = 9.81
    h: float = 0.002
    corners: tuple = tuple((x, y, z) for z in (-1.0, 1.0) for y in (-1.0, 1.0) for x in (-1.0, 1.0))


# ---------------------------------------------------------------- geometry


def _rot(q):
    """Rotation matrix from body to world as nested lists. q has the scalar first."""
    w, x, y, z = q[0], q[1], q[2], q[3]
    return [
        [1 - 2 * (y * y + z * z), 2 * (x * y - w * z), 2 * (x * z + w * y)],
        [2 * (x * y + w * z), 1 - 2 * (x * x + z * z), 2 * (y * z - w * x)],
        [2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x * x + y * y)],
    ]


def rotation(q):
    return np.array(_rot(q))


def turned(q, w, h):
    """normalise(q + h/2 q (0, w)) in numpy."""
    a, x, y, z = q
    d = np.array(
        [
            -x * w[0] - y * w[1] - z * w[2],
            a * w[0] + y * w[2] - z * w[1],
            a * w[1] + z * w[0] - x * w[2],
            a * w[2] + x * w[1] - y * w[0],
        ]
    )
    s = q + 0.5 * h * d
    return s / np.sqrt(s @ s)


def advance(par, X, V):
    """State after the step with the new velocities V."""
    r = X[0:3] + par.h * V[0:3]
    return np.concatenate([r, turned(X[3:7], V[3:6], par.h), V])


# ------------------------------------------------------------- certificate


def residual(par, X, Xn, P, parts=False):
    """Natural-map residual of a step (m/s) from states and impulses (8, 3).

    It is zero exactly if the step satisfies the law with hard contact and no compliance.
    """
    h, m, mu = par.h, par.mass, par.mu
    C = np.array(par.corners)
    J = np.array(par.inertia)
    ell = np.abs(C).max()
    R, Rn = rotation(X[3:7]), rotation(Xn[3:7])
    v, w, vn, wn = X[7:10], X[10:13], Xn[7:10], Xn[10:13]
    torque = np.cross(C, P @ R).sum(0)
    dyn = max(
        np.abs((Xn[0:3] - X[0:3]) / h - vn).max(),
        np.abs(Xn[3:7] - turned(X[3:7], wn, h)).max() * ell / h,
        np.abs(vn - v - P.sum(0) / m + np.array([0, 0, par.gravity * h])).max(),
        np.abs(wn - w - np.linalg.solve(J, torque - h * np.cross(wn, J @ wn))).max() * ell,
    )
    uz = (Xn[2] + C @ Rn[2]) / h
    ut = vn[:2] + (C @ (Rn - R)[:2].T) / h
    pz, pt = P[:, 2], P[:, :2]
    depth = np.maximum(0, -uz).max()
    normal = np.abs(np.minimum(pz / m, uz)).max()
    rad = mu * np.maximum(pz, 0)
    t = pt - m * ut
    nt = np.sqrt((t * t).sum(1))
    proj = t * np.where(nt > rad, rad / np.maximum(nt, 1e-300), 1.0)[:, None]
    friction = np.sqrt(((pt - proj) ** 2).sum(1)).max() / m
    cone = np.maximum(0, np.sqrt((pt * pt).sum(1)) - mu * pz).max() / m
    if parts:
        return dict(dynamics=dyn, depth=depth, normal=normal, friction=friction, cone=cone)
    return max(dyn, depth, normal, friction, cone)


# --------------------------------------------------- symbolic step and its AD


class _Fast:
    """CasADi function with fixed buffers: numpy in and out without copies."""

    def __init__(self, f):
        self.f = f
        self.buf, self.call = f.buffer()
        self.arg = [np.zeros(f.nnz_in(i)) for i in range(f.n_in())]
        self.res = [np.zeros(f.size_out(i), order="F") for i in range(f.n_out())]
        for i, a in enumerate(self.arg):
            self.buf.set_arg(i, memoryview(a))
        for i, a in enumerate(self.res):
            self.buf.set_res(i, memoryview(a.reshape(-1, order="F")))

    def __call__(self, *args):
        for a, b in zip(self.arg, args):
            a[:] = b
        self.call()
        return [r.copy() for r in self.res]


class Model:
    """CasADi functions for one set of constants, built on demand."""

    def __init__(self, par: Params):
        self.par = par
        self.C = np.array(par.corners)
        self.J = np.array(par.inertia)
        self._smooth, self._mode = {}, {}
        V, X = cs.SX.sym("V", 6), cs.SX.sym("X", 13)
        d = self._dynamics(V, X, [], [])
        self._free = _Fast(cs.Function("f", [V, X], [d, cs.densify(cs.jacobian(d, V))]))
        c, p = cs.SX.sym("c", 3), cs.SX.sym("p", 3)
        # Response of one corner to its own impulse, only for scaling.
        u = self._gap(V, X, c)
        D = self._dynamics(V, X, [c], [p])
        W = -cs.jacobian(u, V) @ cs.solve(cs.jacobian(D, V), cs.jacobian(D, p))
        self._own = _Fast(cs.Function("w", [V, X, c], [cs.densify(cs.substitute(W, p, cs.SX.zeros(3)))]))

    # Dynamics residual in velocity units.
    def _dynamics(self, V, X, cs_, ps):
        par = self.par
        J = cs.SX(cs.DM(self.J))
        R = cs.vertcat(*[cs.horzcat(*row) for row in _rot([X[3], X[4], X[5], X[6]])])
        lin = cs.SX.zeros(3)
        ang = cs.SX.zeros(3)
        for c, p in zip(cs_, ps):
            lin += p
            ang += cs.cross(c, R.T @ p)
        w = V[3:6]
        dv = V[0:3] - X[7:10] - lin / par.mass
        dv[2] += par.gravity * par.h
        Ji = cs.SX(cs.DM(np.linalg.inv(self.J)))
        dw = w - X[10:13] + Ji @ (par.h * cs.cross(w, J @ w) - ang)
        return cs.vertcat(dv, dw)

    def _gap(self, V, X, c):
        h = self.par.h
        q, w = X[3:7], V[3:6]
        s = q + 0.5 * h * cs.vertcat(-cs.dot(q[1:4], w), q[0] * w + cs.cross(q[1:4], w))
        s = s / cs.sqrt(cs.dot(s, s))
        R, Rn = _rot([q[i] for i in range(4)]), _rot([s[i] for i in range(4)])
        row = lambda A, i: sum(A[i][j] * c[j] for j in range(3))
        return cs.vertcat(
            V[0] + (row(Rn, 0) - row(R, 0)) / h, V[1] + (row(Rn, 1) - row(R, 1)) / h, (X[2] + h * V[2] + row(Rn, 2)) / h
        )

    def smooth(self, n):
        """Smoothed natural map for n corners with unknowns (V, p_1 .. p_n)."""
        if n in self._smooth:
            return self._smooth[n]
        m, mu = self.par.mass, self.par.mu
        V, X, P = cs.SX.sym("V", 6), cs.SX.sym("X", 13), cs.SX.sym("P", 3 * n)
        C, rho = cs.SX.sym("C", 3 * n), cs.SX.sym("rho", 2 * n)
        eps, kap = cs.SX.sym("e"), cs.SX.sym("k")
        c = [C[3 * i : 3 * i + 3] for i in range(n)]
        p = [P[3 * i : 3 * i + 3] for i in range(n)]
        plus = lambda t: 0.5 * (t + cs.sqrt(t * t + 4 * kap * kap))
        rows = [self._dynamics(V, X, c, p)]
        for i in range(n):
            u = self._gap(V, X, c[i]) + eps * p[i] / m
            g = p[i] / m
            rn, rt = rho[2 * i] / m, rho[2 * i + 1] / m
            top = plus(g[2] - rn * u[2])
            t = g[0:2] - rt * u[0:2]
            nt = cs.sqrt(cs.dot(t, t) + kap * kap + 1e-40)
            rows.append(g[0:2] - t * (1 - plus(nt - mu * top) / nt))
            rows.append(g[2] - top)
        G = cs.vertcat(*rows)
        x = cs.vertcat(V, P)
        f = cs.Function("s", [V, P, X, C, rho, eps, kap], [G, cs.densify(cs.jacobian(G, x))])
        self._smooth[n] = _Fast(f)
        return self._smooth[n]

    def mode(self, ns, nl):
        """Square system for ns sticking and nl sliding corners.

        The unknowns are V, the impulses p of sticking corners and (normal, angle, speed) of sliding
        corners. The function also returns the impulses.
        """
        if (ns, nl) in self._mode:
            return self._mode[ns, nl]
        m, mu, n = self.par.mass, self.par.mu, ns + nl
        X, C = cs.SX.sym("X", 13), cs.SX.sym("C", 3 * n)
        eps = cs.SX.sym("e")
        y = cs.SX.sym("y", 6 + 3 * n)
        V = y[0:6]
        c, p, rows = [], [], []
        for i in range(n):
            ci, z = C[3 * i : 3 * i + 3], y[6 + 3 * i : 9 + 3 * i]
            u = self._gap(V, X, ci)
            if i < ns:
                pi = z
                rows.append(u + eps * pi / m)
            else:
                d = cs.vertcat(cs.cos(z[1]), cs.sin(z[1]))
                pi = cs.vertcat(-mu * z[0] * d, z[0])
                rows.append((u + eps * pi / m) - cs.vertcat(z[2] * d, 0))
            c.append(ci)
            p.append(pi)
        G = cs.vertcat(self._dynamics(V, X, c, p), *rows)
        P = cs.vertcat(*p) if p else cs.SX.zeros(0)
        out = [G, cs.densify(cs.jacobian(G, y)), P, cs.densify(cs.jacobian(G, eps))]
        f = cs.Function("m", [y, X, C, eps], out)
        self._mode[ns, nl] = _Fast(f)
        return self._mode[ns, nl]

    # ------------------------------------------------------------- pieces

    def free(self, X):
        """Velocities after the step without contact."""
        V = X[7:13].copy()
        for _ in range(30):
            G, A = self._free(V, X)
            d = np.linalg.solve(A, G.ravel())
            V = V - d
            if np.abs(d).max() < 1e-15 * (1 + np.abs(V).max()):
                break
        return V

    def heights(self, X):
        return X[2] + self.C @ rotation(X[3:7])[2]

    def gaps(self, X, V):
        """Gap velocities u_i of all corners in numpy."""
        Xn = advance(self.par, X, V)
        R, Rn = rotation(X[3:7]), rotation(Xn[3:7])
        ut = V[:2] + self.C @ (Rn - R)[:2].T / self.par.h
        return np.column_stack([ut, (Xn[2] + self.C @ Rn[2]) / self.par.h])

    def rho(self, X, V, idx):
        out = []
        for i in idx:
            W = self._own(V, X, self.C[i])[0]
            out += [1 / max(abs(W[2, 2]), 1e-9), 3 / max(abs(np.trace(W)), 1e-9)]
        return np.array(out)

    def velocities(self, X, V0, P, idx):
        """Velocities caused by the impulses P (len(idx), 3), by Newton."""
        par = self.par
        R = rotation(X[3:7])
        lin = P.sum(0) / par.mass
        ang = np.linalg.solve(self.J, np.cross(self.C[list(idx)], P @ R).sum(0))
        Y = X.copy()
        Y[7:10] += lin
        Y[10:13] += ang
        return self.free(Y)


# ------------------------------------------------------------------ solver


@dataclass
class Found:
    V: np.ndarray
    P: np.ndarray  # (8, 3) impulses
    modes: tuple  # 8 entries
    residual: float
    free: int  # missing rank of the contact system at zero compliance
    choice: float = 0.0  # residual of the condition that selects among them
    moved: float = 0.0  # how far the compliant solution was


class Step:
    """Solver of the step that starts at X."""

    # Compliance for the search of modes. Rounding of gaps near 1e-13 m/s causes a force error of
    # 1e-13 / EPS, so EPS must not be smaller.
    EPS = 1e-6
    RANK = 1e-9  # singular values below this share of the largest are zero

    def __init__(self, model: Model, X):
        self.M, self.X, self.par = model, X, model.par
        self.Vf = model.free(X)
        self.scale = max(1.0, float(np.abs(X[7:10]).max()))

    # -- smoothing Newton

    def smoothing(self, idx, P0, kappa, eps, floor=1e-11, shrink=0.2, iters=80):
        """Reduces kappa to `floor`. Returns (V, P, residual norm)."""
        n = len(idx)
        M, X = self.M, self.X
        f = M.smooth(n)
        C = M.C[list(idx)].ravel()
        V = M.velocities(X, self.Vf, P0, idx)
        rho = M.rho(X, self.Vf, idx)
        P = P0.ravel().copy()
        G, A = f(V, P, X, C, rho, eps, kappa)
        G = G.ravel()
        g = np.abs(G).max()
        for _ in range(iters):
            if g <= max(kappa, floor):
                if kappa <= floor:
                    break
                kappa = max(min(shrink * kappa, g), floor) if g > 0 else floor
                kappa = max(kappa, floor)
                G, A = f(V, P, X, C, rho, eps, kappa)
                G = G.ravel()
                g = np.abs(G).max()
            try:
                d = np.linalg.solve(A, G)
            except np.linalg.LinAlgError:
                d = np.linalg.lstsq(A, G, rcond=1e-13)[0]
            if not np.isfinite(d).all():
                break
            t, best = 1.0, None
            n0 = np.linalg.norm(G)
            while t > 1e-4:
                Vt, Pt = V - t * d[:6], P - t * d[6:]
                Gt, At = f(Vt, Pt, X, C, rho, eps, kappa)
                nt = np.linalg.norm(Gt)
                if np.isfinite(nt) and nt < (1 - 1e-4 * t) * n0:
                    best = (Vt, Pt, Gt.ravel(), At)
                    break
                t *= 0.5
            if best is None:
                if kappa > floor and g < 1e3 * kappa:  # stalled: go on with less
                    kappa = max(kappa * shrink, floor)
                    G, A = f(V, P, X, C, rho, eps, kappa)
                    G = G.ravel()
                    g = np.abs(G).max()
                    continue
                break
            V, P, G, A = best
            g = np.abs(G).max()
        return V, P.reshape(n, 3), g

    # -- modes

    def read_modes(self, idx, V, P, eps):
        """Modes from the natural map at (V, P)."""
        m, mu = self.par.mass, self.par.mu
        u = self.M.gaps(self.X, V)[list(idx)] + eps * P / m
        rho = self.M.rho(self.X, self.Vf, idx).reshape(-1, 2)
        out = []
        for i in range(len(idx)):
            top = P[i, 2] / m - rho[i, 0] / m * u[i, 2]
            t = P[i, :2] / m - rho[i, 1] / m * u[i, :2]
            if top <= 0:
                out.append(OPEN)
            elif np.hypot(*t) <= mu * top:
                out.append(STICK)
            else:
                out.append(SLIP)
        return tuple(out)

    def _pack(self, idx, modes, V, P):
        st = [i for i, o in zip(idx, modes) if o == STICK]
        sl = [i for i, o in zip(idx, modes) if o == SLIP]
        at = {i: k for k, i in enumerate(idx)}
        u = self.M.gaps(self.X, V)
        rho = dict(zip(idx, self.M.rho(self.X, self.Vf, idx).reshape(-1, 2)[:, 1]))
        y = [V]
        for i in st:
            y.append(P[at[i]])
        for i in sl:
            p = P[at[i]]
            t = rho[i] * u[i, :2] - p[:2]
            th = np.arctan2(t[1], t[0])
            y.append([p[2], th, np.cos(th) * u[i, 0] + np.sin(th) * u[i, 1]])
        return st, sl, np.concatenate(y)

    def newton(self, st, sl, y, eps, iters=30, tol=2e-14):
        """Newton on the smooth square system of the modes if it is regular."""
        f = self.M.mode(len(st), len(sl))
        C = self.M.C[st + sl].ravel()
        G, A, P, _ = f(y, self.X, C, eps)
        g = np.linalg.norm(G)
        for _ in range(iters):
            try:
                d = np.linalg.solve(A, G.ravel())
            except np.linalg.LinAlgError:
                return y, P, np.inf
            if not np.isfinite(d).all():
                return y, P, np.inf
            t = 1.0
            while True:
                Gt, At, Pt, _ = f(y - t * d, self.X, C, eps)
                gt = np.linalg.norm(Gt)
                if gt < g or t < 1e-3:
                    break
                t *= 0.5
            if not gt < g:
                break
            slow = gt > 0.5 * g and gt < 1e-12
            y, G, A, P, g = y - t * d, Gt, At, Pt, gt
            if g <= tol or slow:
                break
        return y, P, g

    def onto(self, st, sl, y, iters=12):
        """Minimum-norm Newton to zero compliance, where the system may be singular.

        Returns (y, P, norm, Y, Z, e). Y and Z span the left and right null spaces of the Jacobian
        there, and e is the compliance term. Impulses and angles are measured in m/s.
        """
        f = self.M.mode(len(st), len(sl))
        C = self.M.C[st + sl].ravel()
        w = np.ones(len(y))
        w[6 : 6 + 3 * len(st)] = self.par.mass
        w[6 + 3 * len(st) :: 3] = self.par.mass
        G, A, P, e = f(y, self.X, C, 0.0)
        g = np.linalg.norm(G)
        for _ in range(iters):
            U, s, Vt = np.linalg.svd(A * w)
            keep = s > self.RANK * s[0]
            d = w * (Vt[keep].T @ ((U.T[keep] @ G.ravel()) / s[keep]))
            Gt, At, Pt, et = f(y - d, self.X, C, 0.0)
            gt = np.linalg.norm(Gt)
            if not gt < g:
                break
            y, G, A, P, e, g = y - d, Gt, At, Pt, et, gt
        return y, P, g, U[:, ~keep], w[:, None] * Vt[~keep].T, e.ravel()

    def spread(self, idx, P):
        out = np.zeros((len(self.M.C), 3))
        out[list(idx)] = P.reshape(-1, 3)
        return out

    def law(self, V, P, eps):
        """Natural-map residual of the contact law with compliance for all corners."""
        m, mu = self.par.mass, self.par.mu
        u = self.M.gaps(self.X, V) + eps * P / m
        g = P / m
        top = np.maximum(0, g[:, 2] - u[:, 2])
        t = g[:, :2] - u[:, :2]
        nt = np.hypot(t[:, 0], t[:, 1])
        rad = mu * np.maximum(g[:, 2], 0)
        pr = t * np.where(nt > rad, rad / np.maximum(nt, 1e-300), 1)[:, None]
        return max(np.abs(g[:, 2] - top).max(), np.hypot(*(g[:, :2] - pr).T).max())

    def settle(self, idx, modes, V, P, rounds=8):
        """Solves with compliance from given modes and a point, then takes the limit."""
        eps, seen = self.EPS, set()
        for _ in range(rounds):
            if modes in seen:
                return None
            seen.add(modes)
            st, sl, y = self._pack(idx, modes, V, P)
            y, p, g = self.newton(st, sl, y, eps)
            if not g < 1e-9:
                return None
            full = self.spread(st + sl, p)
            if self.law(y[:6], full, eps) < 1e-11:
                got = self.limit(st, sl, y)
                if got is not None:
                    return got
            V, P = y[:6], full[list(idx)]
            modes = self.read_modes(idx, V, P, eps)
        return None

    def found(self, st, sl, y, P, lost):
        full = self.spread(st + sl, P)
        modes = [OPEN] * len(self.M.C)
        for i in st:
            modes[i] = STICK
        for i in sl:
            modes[i] = SLIP
        Xn = advance(self.par, self.X, y[:6])
        return Found(y[:6], full, tuple(modes), residual(self.par, self.X, Xn, full), lost)

    def limit(self, st, sl, y):
        """Limit of vanishing compliance, starting at a solution with compliance.

        With G(y) + e E(y) = 0 and e -> 0, the limit satisfies G(y) = 0. If the Jacobian of G is
        singular with left null space Y, it also satisfies Y(y)^T E(y) = 0. The second condition
        moves along the solutions of the first. Finite differences supply its derivative.
        """
        y0 = y
        y, P, g, Y, Z, e = self.onto(st, sl, y)
        n = Z.shape[1]
        last = 0.0
        if n:
            c = Y.T @ e
            last = np.abs(c).max()
            for _ in range(8):
                if last < 1e-15 * self.scale:
                    break
                D = np.zeros((n, n))
                for k in range(n):
                    dz = 1e-6 * Z[:, k] / np.linalg.norm(Z[:, k] / self.par.mass)
                    yk, _, gk, Yk, Zk, ek = self.onto(st, sl, y + dz, iters=4)
                    if Zk.shape[1] != n:
                        return None
                    ck = (Yk @ np.linalg.solve(Y.T @ Yk, np.eye(n))).T @ ek
                    D[:, k] = (ck - c) / 1e-6
                t = np.linalg.lstsq(D, -c, rcond=1e-12)[0]
                move = sum(t[k] * Z[:, k] / np.linalg.norm(Z[:, k] / self.par.mass) for k in range(n))
                yn, Pn, gn, Yn, Zn, en = self.onto(st, sl, y + move)
                if Zn.shape[1] != n:
                    return None
                cn = Yn.T @ en
                if not np.abs(cn).max() < np.abs(c).max():
                    break
                y, P, g, Y, Z, e, c = yn, Pn, gn, Yn, Zn, en, cn
                last = np.abs(c).max()
        got = self.found(st, sl, y, P, n)
        got.choice = last
        got.moved = np.abs(y[:6] - y0[:6]).max()
        return got if got.residual < 1e-10 else None

    # -- whole

    def attempt(self, idx, P0, kappa):
        """Solves from one start. Corners that end below ground are added, and the solve is
        repeated."""
        idx = list(idx)
        for _ in range(4):
            V, P, g = self.smoothing(idx, P0, kappa, self.EPS)
            got = None
            if g < 1e-2:
                got = self.settle(idx, self.read_modes(idx, V, P, self.EPS), V, P)
            if got is not None:
                return got
            if not g < 1e-6:
                return None
            u = self.M.gaps(self.X, V)[:, 2]
            more = [i for i in range(len(u)) if i not in idx and u[i] < 0]
            if not more:
                return None
            Pn = np.zeros((len(idx) + len(more), 3))
            Pn[: len(idx)] = P
            idx, P0 = idx + more, Pn
        return None

    def neighbours(self, idx, V, P):
        """Tries modes around a point, nearest first."""
        base = self.read_modes(idx, V, P, self.EPS)
        n = len(idx)
        for flips in range(0, min(n, 3) + 1):
            for which in itertools.combinations(range(n), flips):
                for new in itertools.product((OPEN, STICK, SLIP), repeat=flips):
                    modes = list(base)
                    if any(modes[i] == o for i, o in zip(which, new)):
                        continue
                    for i, o in zip(which, new):
                        modes[i] = o
                    got = self.settle(idx, tuple(modes), V, P, rounds=1)
                    if got is not None:
                        return got
        return None

    def candidates(self):
        u = self.M.gaps(self.X, self.Vf)[:, 2]
        z = self.M.heights(self.X)
        return [i for i in range(len(u)) if u[i] < 0 or z[i] <= 0.005]

    def starts(self, idx, Pold):
        """Named starts (name, impulses, kappa) in order of preference."""
        n, m = len(idx), self.par.mass
        size = m * np.linalg.norm(self.Vf[:3])
        zero = np.zeros((n, 3))
        up = np.zeros((n, 3))
        up[:, 2] = size / n
        yield "warm", Pold[idx], 1e-3
        yield "zero", zero, 1e-2
        yield "smooth", up * 0.1, 0.3 * size / m
        yield "jam", up, 0.1
        for k in range(n):
            one = np.zeros((n, 3))
            one[k, 2] = size
            yield f"jam on {idx[k]}", one, 0.1

    def solve(self, Pold, tol=1e-12, search=True, rng=None, extra=0):
        """Returns (chosen Found, name of its start, list of other Founds).

        Free flight is chosen if it keeps every corner above ground. Otherwise the first start that
        reaches a solution is chosen. `search` continues with all other starts and `extra` random
        ones to find further solutions of the law with its rule.
        """
        none = np.zeros((len(self.M.C), 3))
        first, name, others = None, None, []

        def take(got, label):
            nonlocal first, name
            if got is None:
                return
            if first is None:
                first, name = got, label
            elif np.abs(got.V - first.V).max() > 1e-6 * self.scale:
                if all(np.abs(got.V - o.V).max() > 1e-6 * self.scale for _, o in others):
                    others.append((label, got))

        idx = self.candidates()
        if self.M.gaps(self.X, self.Vf)[:, 2].min() >= 0:
            take(self.found([], [], self.Vf, np.zeros(0), 0), "free")
            if not idx or not search:
                return first, name, others
        idx = sorted(set(idx) | {i for i in range(len(none)) if Pold[i].any()})
        for label, P0, kappa in self.starts(idx, Pold):
            take(self.attempt(idx, P0, kappa), label)
            if first is not None and first.residual <= tol and not search:
                break
        if first is None:
            for label, P0, kappa in self.starts(idx, Pold):
                V, P, g = self.smoothing(idx, P0, kappa, self.EPS)
                take(self.neighbours(idx, V, P), label + ", neighbouring modes")
                if first is not None:
                    break
        if rng is not None:
            size = self.par.mass * np.linalg.norm(self.Vf[:3])
            for _ in range(extra):
                P0 = rng.standard_normal((len(idx), 3)) * size * 10 ** rng.uniform(-3, 0)
                P0[:, 2] = np.abs(P0[:, 2])
                P0[:, :2] *= self.par.mu
                take(self.attempt(idx, P0, 10 ** rng.uniform(-3, 0)), "random")
        return first, name, others
