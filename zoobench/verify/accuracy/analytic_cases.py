"""What has an exact answer: cases of `validate`, each on a ladder of grids with the step in proportion to the spacing.

Two of them do not converge to their closed forms, for reasons that are not the simulator's. The muscle is under uniform
stress, which every grid holds exactly: what is left is how far it has come to rest. The undamped block on the incline
flutters (`friction.slide`), the more the finer the grid. The damped one slides as Coulomb says; most of its error is
the half of a substep by which symplectic Euler's velocities lag behind its positions.
"""

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

from zoobench.verify.validate import friction, manufactured, statics, waves
from zoobench.verify.validate.rig import Rig


@dataclass(frozen=True)
class Solved:
    """A case as it was simulated on one grid.

    Attributes:
        rig: what moved it on, in its final state.
        errors: by quantity, relative to the exact answer, or to the motion's amplitude where that is zero.
    """

    rig: Rig
    errors: dict[str, float]


@dataclass(frozen=True)
class AnalyticCase:
    """A case that is judged by a closed form.

    Attributes:
        name: as in `validate`, and what differs from it.
        cells: its ladder, the coarsest grid first.
        solve: simulates it on a grid of so many cells with further choices of the fidelity.
        orders: the interval that the observed order must lie in, by quantity; none for a quantity that the theory
            gives no order.
    """

    name: str
    cells: tuple[int, ...]
    solve: Callable[..., Solved]
    orders: dict[str, tuple[float, float | None]]


SECOND = (1.8, 2.2)
"""The interior's order: the splines' interpolation."""
THIRD = (2.7, 3.3)
"""A step loses (k h)^4 / 80 of a wave (`validate.waves`), and a period has 1 / h steps."""
FIRST = (0.8, 1.3)
"""Where something acts on single nodes, or at the ends of a step."""

_SLOPE, _FRICTION = 23.5, 0.4  # friction holds nine tenths of the pull: the path is sensitive to it
_DAMPED = 300.0  # [Pa s]: the block does not flutter, see `friction.slide`
_ACTIVATION = -1.0


def _manufactured(per_axis: int) -> Callable[..., Solved]:
    """With so many particles per axis: with three their quadrature shows from 64 cells on."""

    def solve(cells: int, **settings: Any) -> Solved:
        driven = manufactured.Driven(cells, per_axis, **settings)
        return Solved(driven.rig, {"displacement": float(driven.error().max())})

    return solve


def _bar(cells: int, **settings: Any) -> Solved:
    wave = waves.free_bar(cells, pace=1e-4, **settings)
    return Solved(wave.rig, {"frequency": abs(wave.frequency_error), "loss per period": abs(wave.loss)})


def _wall(cells: int, **settings: Any) -> Solved:
    wave = waves.walled_bar(cells, **settings)
    return Solved(wave.rig, {"frequency": abs(wave.frequency_error)})


def _column(cells: int, **settings: Any) -> Solved:
    column = statics.column(cells, **settings)
    return Solved(column.rig, {"settlement": abs(column.error)})


def _incline(viscosity: float) -> Callable[..., Solved]:
    def solve(cells: int, **settings: Any) -> Solved:
        slide = friction.slide(_SLOPE, _FRICTION, cells=cells, viscosity=viscosity, **settings)
        return Solved(slide.rig, {"distance": abs(slide.error)})

    return solve


def _muscle(cells: int, **settings: Any) -> Solved:
    rig, *stretches = statics.contract(_ACTIVATION, cells, **settings)
    along, across = (
        abs(found / exact - 1) for found, exact in zip(stretches, statics.muscle_stretch(_ACTIVATION), strict=True)
    )
    return Solved(rig, {"stretch along": along, "stretch across": across})


CASES = (
    AnalyticCase("manufactured-solution", (8, 16, 32, 64), _manufactured(3), {"displacement": (1.8, None)}),
    AnalyticCase("manufactured-solution-dense", (8, 16, 32, 64), _manufactured(4), {"displacement": (1.8, None)}),
    AnalyticCase("bar-mode", (8, 16, 32, 64), _bar, {"frequency": SECOND, "loss per period": THIRD}),
    AnalyticCase("wall-mode", (8, 16, 32, 64), _wall, {"frequency": FIRST}),
    AnalyticCase("gravity-column", (8, 16, 32, 64), _column, {"settlement": FIRST}),
    AnalyticCase("incline-damped", (4, 8, 16), _incline(_DAMPED), {"distance": FIRST}),
    AnalyticCase("incline", (4, 8, 16), _incline(0.0), {}),
    AnalyticCase("muscle-stretch", (2, 4, 8), _muscle, {}),
)
