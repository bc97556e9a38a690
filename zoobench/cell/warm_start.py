"""Warm starts: parameters of a stored solution in place of those drawn from the prior."""

from collections.abc import Iterable
from dataclasses import dataclass

import numpy as np

from zoobench.arrays import Array
from zoobench.cell.robot import Robot
from zoobench.errors import UsageError
from zoobench.inputs import Start
from zoobench.spec import Ref, RunSpec


@dataclass(frozen=True)
class Overlay:
    """The parts of a stored solution that fit another run.

    Attributes:
        control, design: parameters of the controller and of the design space; None if they are drawn.
        words: a sentence on which parts were taken.
    """

    control: Array | None
    design: Array | None
    words: str

    def over(self, draw: Array, control_count: int) -> Array:
        """A draw from the prior `[parameter_count]` with its parts replaced."""
        control = draw[:control_count] if self.control is None else self.control
        return np.concatenate([control, draw[control_count:] if self.design is None else self.design])


def overlay(start: Start, spec: RunSpec, robot: Robot) -> Overlay:
    """The parts of a stored solution that fit a run with this robot.

    The controller's part fits the same controller with as many parameters, whatever the body; a closed loop must
    observe the same as well. The design's part fits the same design space with as many parameters.

    Raises:
        UsageError: no part fits.
    """
    theirs = Robot.of_run(start.spec)
    values = np.array(start.params)
    parts = (
        ("controller", start.spec.controller, theirs.control_count, spec.controller, robot.control_count),
        ("design", start.spec.design, len(values) - theirs.control_count, spec.design,
         robot.parameter_count - robot.control_count),
    )  # fmt: skip
    taken = {part: ours == given and count == wanted > 0 for part, given, count, ours, wanted in parts}
    taken["controller"] &= theirs.layout == robot.layout
    if not any(taken.values()):
        if theirs.layout != robot.layout and start.spec.controller == spec.controller:
            raise UsageError(
                f"The start does not fit: its controller {start.spec.controller} observes {theirs.senses}, and {spec} "
                f"is given {robot.senses}. Start from a run of the same body at the task {spec.task.name}."
            )
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
    """`overlay` for the robot of a spec."""
    return overlay(start, spec, Robot.of_run(spec))


def _sizes(parts: Iterable[tuple[str, Ref, int]]) -> str:
    """Parameter counts by part, as text."""
    return " and ".join(f"{count} of the {part} {ref}" for part, ref, count in parts if count) or "no parameters"
