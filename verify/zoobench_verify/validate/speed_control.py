"""A body that is led at a wished speed, with the motion that it makes read from its particles."""

import numpy as np

from zoobench.arrays import Array
from zoobench_verify.cases import CaseRecorder
from zoobench_verify.validate.rig import Reals, Rig

_PROPORTIONAL = 0.3
"""Share of the difference in speed that the force makes up for in a substep [-]."""
_INTEGRAL = 600.0
"""Rate at which the force grows to the resistance [1/s]; without it the body falls behind."""

TOLERANCE = 0.05
"""Share by which a rig's motion may differ from the wished one."""


class SpeedControl:
    """Leads the robot of a rig along one axis by a uniform body force, under proportional and integral control.

    Setting the velocity between substeps does not lead a body: its particles move with the velocity that resistance
    leaves of it, which may be a half. So the speed that is controlled is that of the last substep's motion.

    Args:
        rig: whose robot is led, from the speed that it has.
        axis: of the motion.

    Attributes:
        moved: by the mean place of the robot's particles, weighted by mass [m].
        speed: that of `moved` in the last substep [m/s].
        force: on the robot in the last substep [N]; at constant speed the resistance.
    """

    def __init__(self, rig: Rig, axis: int) -> None:
        self._rig, self._axis = rig, axis
        self._mass = float(rig.mass[rig.robot].sum(dtype=float))
        self._weights: Reals = rig.mass[rig.robot] / self._mass
        self._places: Reals = rig.solver.matter.x[0, 0].numpy()[rig.robot, axis]
        self._start = float(self._weights @ self._places)
        self.moved, self.force, self._held = 0.0, 0.0, 0.0
        self.speed = float(self._weights @ rig.v[rig.robot, axis])

    def advance(self, speed: float) -> None:
        """One substep, in which the robot should move at a speed [m/s]."""
        self.push(speed)
        self._rig.advance(1)
        self.read()

    def push(self, speed: float) -> None:
        """Before a substep: apply the force for a speed [m/s]."""
        rig, behind = self._rig, speed - self.speed
        self._held += _INTEGRAL * behind * _PROPORTIONAL
        acceleration = _PROPORTIONAL * behind / rig.dt + self._held
        rig.v[rig.robot, self._axis] += rig.dt * acceleration
        self.force = self._mass * acceleration

    def read(self) -> None:
        """After a substep: read the motion that was made."""
        before, self.moved = self.moved, float(self._weights @ self._places) - self._start
        self.speed = (self.moved - before) / self._rig.dt


def check_motion(record: CaseRecorder, what: str, reached: float, speeds: Array) -> None:
    """Let the case fail if its rig did not move as it should.

    Args:
        reached: way that the driven body made by that which it should have made [-].
        speeds: its speeds by the wished one, once it had gained it `[count]` [-].
    """
    record.within(f"way made by that wished, {what}", reached, 1 - TOLERANCE, 1 + TOLERANCE)
    record.at_most(f"speed off that wished, {what}", np.abs(speeds - 1).max(), TOLERANCE)
