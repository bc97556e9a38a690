"""The parts of a policy's observations and actions, by name: which numbers they are, and in which unit."""

from math import prod
from typing import Literal, NamedTuple

from zoobench.cell.observation import Layout, layout_of
from zoobench.controllers.base import PHASE_COUNT
from zoobench.controllers.sine_basis import SineBasis
from zoobench.tasks.base import ObservedPart, Task

Action = Literal["waves", "muscles"]
"""The kind of action: weights of the waves of the sine basis, or the activity of every muscle."""

_AXES = "ahead, up, right"
_SPEED = "20 body lengths/s"


class VectorPart(NamedTuple):
    """A part of a flat vector.

    Attributes:
        start, stop: the first of its numbers, and the one after the last.
        shape: in which they are meant, row by row.
        unit: - for pure numbers, empty where a task of a package does not tell.
    """

    name: str
    start: int
    stop: int
    shape: tuple[int, ...]
    unit: str
    meaning: str

    @property
    def slice(self) -> slice:
        """Its place in the vector."""
        return slice(self.start, self.stop)


def observation_parts(muscle_count: int, task: Task) -> tuple[VectorPart, ...]:
    """The parts of a policy's observation of a robot with so many muscles at a task, the phase of the waves last."""
    told = getattr(task, "observed_parts", {})
    known = [(name, shape, *described) for name, shape, described in _own(muscle_count)]
    added: Layout = layout_of(muscle_count, task)[2:-1]  # the parts of neither body nor time
    known += [(name, (count,), *told.get(name, ObservedPart("", ""))) for name, count in added]
    known.append(("time_left", (1,), "-", "share of the episode that is left"))
    known.append(("phase", (PHASE_COUNT,), "-", "sine and cosine of 20 rad/s times the time of the waves"))
    return _in_turn(known)


def action_parts(muscle_count: int, action: Action) -> tuple[VectorPart, ...]:
    """The parts of a policy's action, all in [-1, 1]."""
    if action == "muscles":
        return _in_turn([("activity", (muscle_count,), "-", "of each muscle; positive contracts")])
    waves = SineBasis().wave_count
    return _in_turn(
        [
            ("weights", (muscle_count, waves), "-", "of each muscle's waves, slow ones first"),
            ("biases", (muscle_count,), "-", "of each muscle"),
        ]
    )


def _in_turn(parts: list[tuple[str, tuple[int, ...], str, str]]) -> tuple[VectorPart, ...]:
    """Parts one after the other, given by name, shape, unit and meaning."""
    found: list[VectorPart] = []
    for name, shape, unit, meaning in parts:
        start = found[-1].stop if found else 0
        found.append(VectorPart(name, start, start + prod(shape), shape, unit, meaning))
    return tuple(found)


def _own(muscle_count: int) -> list[tuple[str, tuple[int, ...], ObservedPart]]:
    """The parts of body and muscles, in the order of `ObservationModel`."""
    each = (muscle_count, 3)
    return [
        ("velocity", (3,), ObservedPart(_SPEED, f"of the centre of mass: {_AXES} of the present heading")),
        ("displacement", (3,), ObservedPart("body lengths", f"of the centre of mass since the start: {_AXES} at rest")),
        ("heading", (2,), ObservedPart("-", "cosine and sine of its horizontal angle from that at rest")),
        ("muscle_displacements", each, ObservedPart("body lengths", f"of each muscle's centre from rest: {_AXES}")),
        ("muscle_velocities", each, ObservedPart(_SPEED, f"of each muscle's centre, less the robot's: {_AXES}")),
    ]
