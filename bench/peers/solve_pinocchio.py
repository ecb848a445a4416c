"""Pinocchio on local problems: solve_pinocchio.py FILE > ANSWERS."""

import common
import numpy as np
import pinocchio as pin

TOLERANCE = 1e-10
MOST_ITERATIONS = 1000


def solver(make, make_settings, make_result):
    """Creates a solve function for one of Pinocchio's solvers, whose normal comes last."""

    def solve(problem: common.Problem, start: np.ndarray):
        n = problem.contacts
        order = np.arange(3 * n).reshape(n, 3)[:, [1, 2, 0]].ravel()
        back = np.argsort(order)
        model = pin.Model()
        models, datas = pin.StdVec_ConstraintModel(), pin.StdVec_ConstraintData()
        for mu in problem.mu:
            contact = pin.PointContactConstraintModel(model, 0)
            contact.setFriction(float(mu))
            constraint = pin.ConstraintModel(contact)
            models.append(constraint)
            datas.append(constraint.createData())
        delassus = pin.DelassusOperatorDense(problem.w[np.ix_(order, order)])
        settings, result = make_settings(), make_result()
        settings.absolute_feasibility_tol = settings.absolute_complementarity_tol = TOLERANCE
        # Disables the additional criterion of small relative progress.
        settings.relative_feasibility_tol = settings.relative_complementarity_tol = 0.0
        settings.max_iterations = MOST_ITERATIONS
        settings.solve_ncp = True
        result.setConstraintImpulseGuess(start[order])
        chosen, drift = make(3 * n), problem.q[order]
        return (
            lambda: chosen.solve(delassus, drift, models, datas, settings, result),
            lambda _: np.asarray(result.retrieveConstraintImpulses()).ravel()[back],
        )

    return solve


def linear_settings() -> pin.ADMMSolverSettings:
    """Settings with the best update rule for such problems."""
    settings = pin.ADMMSolverSettings()
    settings.admm_update_rule = pin.ADMMUpdateRule.LINEAR
    return settings


if __name__ == "__main__":
    common.main(
        {
            "Pinocchio ADMM": solver(
                pin.ADMMConstraintSolver, linear_settings, pin.ADMMSolverResult
            ),
            "Pinocchio PGS": solver(
                pin.PGSConstraintSolver, pin.PGSSolverSettings, pin.PGSSolverResult
            ),
        }
    )
