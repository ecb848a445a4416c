"""Adapter of an engine for the contact benchmark: change the four marked places.

    python -m tumble.bench --adapter THIS_FILE --engines my-engine --cases projectile
    python -m tumble.bench --adapter THIS_FILE --engines my-engine --submit .

The page docs/howto/bench-adapter.md describes all fields of a scene. This file runs as it is: it lets bodies fly.
"""

import numpy as np

from tumble.bench.engines import Engine, Motion, Scene, Stopwatch, Unsupported, rows, world_spin


class MyEngine(Engine):
    # 1: name of the row, settings in a line, and whether contacts yield by design.
    name = "my-engine"
    settings = "free flight alone"
    compliant = False

    def version(self) -> str:
        return "0.1"

    def run(self, scene: Scene) -> Motion:
        # 2: refuse what the engine cannot do. Shapes are box, sphere, capsule and hull.
        for body in scene.bodies:
            if body.kind not in ("box", "sphere"):
                raise Unsupported(f"no shape {body.kind}")
        if scene.restitution > 0.0:
            raise Unsupported("no restitution")

        # 3: make the bodies from position, attitude (w, x, y, z), velocity and the spin in the world's frame.
        h, free = scene.time_step, scene.free
        masses = np.array([[body.mass] for body in free])
        places = np.array([body.position for body in free])
        turns = np.array([body.attitude for body in free])
        speeds = np.array([body.velocity for body in free])
        spins = world_spin(scene.states)

        states = np.empty((scene.steps + 1, len(free), 13))
        states[0] = scene.states
        stopwatch = Stopwatch()
        for step in range(scene.steps):
            wrenches = scene.wrenches(step, states[step])  # force and torque on each free body, world's frame
            with stopwatch:
                # 4: take a step of h.
                speeds = speeds + h * (wrenches[:, :3] / masses + scene.gravity)
                places = places + h * speeds
            states[step + 1] = rows(places, turns, speeds, spins)
        return Motion(states, stopwatch.seconds)


ENGINES = [MyEngine()]
