"""Rigid bodies in hard frictional contact, solved exactly, with numpy arrays.

    >>> import tumble
    >>> run = tumble.drop(seed=42).run(200)
    >>> run.positions.shape
    (201, 1, 3)

A scene comes from a file (``load``), from code (``Scene``) or from the tutorial (``drop``). A
``Simulation`` steps it, and ``rollout`` simulates it many times in parallel. All units are SI.
Invalid input raises ``TumbleError``, a ValueError. A step that did not converge is still taken,
and ``unsolved`` lists it.
"""

from ._contacts import Contacts
from ._gradients import Derivatives, RolloutDerivatives
from ._live import Live
from ._plan import Miss, Plan, plan
from ._problem import ContactProblem, ContactSolution
from ._query import Distance, PairDistance, Queries, RayHit, RayHits
from ._robot import Inertial, Links, Robot, RobotJoint, Site
from ._rollout import Rollouts, Unsolved, rollout
from ._scene import Scene, drop, floating, load
from ._simulation import Simulation, Step
from ._statics import Statics
from ._status import Status
from ._trajectory import STATE_COLUMNS, Page, Picture, Trajectory
from ._tumble import PARAMETERS, TumbleError, __version__, has_ipopt

__all__ = [
    "PARAMETERS",
    "STATE_COLUMNS",
    "ContactProblem",
    "ContactSolution",
    "Contacts",
    "Derivatives",
    "Distance",
    "Inertial",
    "Links",
    "Live",
    "Miss",
    "Page",
    "PairDistance",
    "Picture",
    "Plan",
    "Queries",
    "RayHit",
    "RayHits",
    "Robot",
    "RobotJoint",
    "RolloutDerivatives",
    "Rollouts",
    "Scene",
    "Simulation",
    "Site",
    "Statics",
    "Status",
    "Step",
    "Trajectory",
    "TumbleError",
    "Unsolved",
    "__version__",
    "drop",
    "floating",
    "has_ipopt",
    "load",
    "plan",
    "rollout",
]
