"""Warm starts: a run that begins with what another has found, known by that run's key: `run-1f3a0c5d7e9b2a46`.

A run is known by a key made of its settings, and a number in one database says nothing in another. So a setting names a
stored run by its key, which stands for all that the run depends on, and becomes part of the key of the run that begins
there.
"""

import re
from collections.abc import Iterable
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from zoobench.errors import UsageError
from zoobench.spec import Ref, RunSpec

if TYPE_CHECKING:
    from zoobench.robot import Robot

Array = NDArray[np.float64]

_MARK = "run-"
_DIGITS = 16  # 64 bits: enough to tell runs apart, short enough for a table
_NAME = re.compile(f"{_MARK}[0-9a-f]{{{_DIGITS}}}")


class StoredRun(str):
    """The type of a method's parameter that names a stored run, to annotate it with.

    It is empty by default, which is no part of a run's key. A method needs to do nothing with it: where it is given,
    `Problem.initial` begins there.
    """

    __slots__ = ()


FROM_NONE = StoredRun("")


@dataclass(frozen=True)
class Start:
    """What a stored run has found.

    Attributes:
        spec: of that run.
        params: its solution `[parameter_count]`.
    """

    spec: RunSpec
    params: tuple[float, ...]


def name_of(key: str) -> str:
    """The name of the run with this key, as a setting has it."""
    return f"{_MARK}{key[:_DIGITS]}"


def checked(name: str) -> str:
    """The name of a stored run as it is, or the empty one.

    Raises:
        UsageError: it is not of the form that `name_of` gives.
    """
    if name and not _NAME.fullmatch(name):
        raise UsageError(
            f"{name!r} names no stored run. A setting has {_MARK} and the first {_DIGITS} letters of the run's key; "
            "`zoobench run` makes it of a number."
        )
    return name


def key_named(method: Ref) -> str:
    """The beginning of the key of the run that a method is to start from; empty if from none."""
    names = (value for _, value in method.params if isinstance(value, str) and _NAME.fullmatch(value))
    return next(names, "").removeprefix(_MARK)


@dataclass(frozen=True)
class Overlay:
    """The parts of a start that fit another run: what is given there instead of drawn.

    Attributes:
        control, design: values of the controller's and the design space's part; None where that is drawn.
        words: what was taken and what was not.
    """

    control: Array | None
    design: Array | None
    words: str

    def over(self, draw: Array, control_count: int) -> Array:
        """A draw from the prior `[parameter_count]` with the parts of the start in it."""
        control = draw[:control_count] if self.control is None else self.control
        return np.concatenate([control, draw[control_count:] if self.design is None else self.design])


def overlay(start: Start, spec: RunSpec, robot: "Robot") -> Overlay:
    """What of a start fits a run with this robot.

    The controller's part fits the same controller with as many parameters, whatever the body; the design's fits the
    same design space with as many.

    Raises:
        UsageError: nothing does.
    """
    theirs = _robot(start.spec)
    values = np.array(start.params)
    parts = (
        ("controller", start.spec.controller, theirs.control_count, spec.controller, robot.control_count),
        ("design", start.spec.design, len(values) - theirs.control_count, spec.design,
         robot.parameter_count - robot.control_count),
    )  # fmt: skip
    taken = {part: ours == given and count == wanted > 0 for part, given, count, ours, wanted in parts}
    if not any(taken.values()):
        raise UsageError(
            f"The start does not fit: it has {_sizes((part, given, count) for part, given, count, _, _ in parts)}, and "
            f"{spec} takes {_sizes((part, ours, wanted) for part, _, _, ours, wanted in parts)}. Start from a run with "
            "the same controller for as many muscles, or with the same design space at the same fidelity."
        )
    words = [
        f"the {part}'s {wanted} parameters are {'those of the start' if taken[part] else 'drawn'}"
        for part, _, _, _, wanted in parts
        if wanted
    ]
    return Overlay(
        values[: theirs.control_count] if taken["controller"] else None,
        values[theirs.control_count :] if taken["design"] else None,
        " and ".join(words),
    )


def overlay_of(start: Start, spec: RunSpec) -> Overlay:
    """As `overlay`, for the robot of a spec."""
    return overlay(start, spec, _robot(spec))


def _sizes(parts: Iterable[tuple[str, Ref, int]]) -> str:
    """How many parameters there are, by part."""
    return " and ".join(f"{count} of the {part} {ref}" for part, ref, count in parts if count) or "no parameters"


def _robot(spec: RunSpec) -> "Robot":
    from zoobench import registry
    from zoobench.registry import Kind
    from zoobench.robot import Robot

    return Robot.of(spec.design, spec.controller, registry.create(Kind.FIDELITY, spec.fidelity))
