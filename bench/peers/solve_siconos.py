"""Siconos on local problems, in Debian's Python: solve_siconos.py FILE > ANSWERS."""

import common
import numpy as np
import siconos.numerics as sn

TOLERANCE = 1e-10
MOST_ITERATIONS = 300


def solver(identity: int):
    """Creates a solve function for one of Siconos' solvers of FrictionContactProblem."""

    def solve(problem: common.Problem, start: np.ndarray):
        n = problem.contacts
        posed = sn.FrictionContactProblem(3, n, problem.w, problem.q, problem.mu)
        options = sn.SolverOptions(identity)
        options.dparam[sn.SICONOS_DPARAM_TOL] = TOLERANCE
        options.iparam[sn.SICONOS_IPARAM_MAX_ITER] = MOST_ITERATIONS
        impulses, velocities = start.copy(), problem.w @ start + problem.q
        return (
            lambda: sn.fc3d_driver(posed, impulses, velocities, options),
            lambda _: impulses,
        )

    return solve


if __name__ == "__main__":
    sn.numerics_set_verbose(0)
    common.main(
        {
            "Siconos PROX": solver(sn.SICONOS_FRICTION_3D_PROX),
            "Siconos NSGS": solver(sn.SICONOS_FRICTION_3D_NSGS),
        }
    )
