"""Certificates for the steps of other engines. Each module needs its engine, which stays optional.

``pybullet.step``, ``drake.step`` and ``newton.step`` take a step and return its certificate (docs/referee.md).
"""
