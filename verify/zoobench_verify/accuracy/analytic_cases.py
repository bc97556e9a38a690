"""Cases of `validate` with an exact answer, each on a ladder of grids with time steps proportional to the spacing.

Some of them have no order. The muscle is under uniform stress, which every grid represents exactly: the error is the
distance to rest. A block on the incline, damped or not, slides as Coulomb's law says within half a per cent on every
grid; what is left changes its sign from one to the next.
"""

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

from zoobench_verify.validate import friction, manufactured, statics, waves
from zoobench_verify.validate.rig import Rig


@dataclass(frozen=True)
class Solved:
    """The result of a case on one grid.

    Attributes:
        rig: that moved it on, in its final state.
        errors: by quantity, relative to the exact answer, or to the motion's amplitude where that is zero.
    """

    rig: Rig
    errors: dict[str, float]


@dataclass(frozen=True)
class AnalyticCase:
    """A case with a closed form.

    Attributes:
        name: as in `validate`, with a suffix for a variant.
        cells: its ladder, the coarsest grid first.
        solve: simulates it on a grid of a number of cells, with parameters of the fidelity.
        orders: interval of the observed order by quantity; empty where the theory gives none.
    """

    name: str
    cells: tuple[int, ...]
    solve: Callable[..., Solved]
    orders: dict[str, tuple[float, float | None]]


SECOND = (1.8, 2.2)
"""Order in the interior: that of the splines' interpolation."""
THIRD = (2.7, 3.3)
"""A step loses (k h)^4 / 80 of a wave (`validate.waves`), and a period has 1 / h steps."""
FIRST = (0.8, 1.3)
"""Order at walls, which act on single nodes, and for errors at the ends of a step."""

_SLOPE, _FRICTION = 23.5, 0.4  # friction is nine tenths of the downhill force, so that the distance is sensitive to it
_DAMPED = 300.0  # [Pa s]: of a block that cannot flutter, see `friction.slide`
_ACTIVATION = -1.0


def _manufactured(per_axis: int) -> Callable[..., Solved]:
    """With a number of particles per axis; with three their quadrature error shows from 64 cells on."""

    def solve(cells: int, **settings: Any) -> Solved:
        driven = manufactured.Driven(cells, per_axis, **settings)
        return Solved(driven.rig, {"displacement": float(driven.error().max())})

    return solve


def _bar(cells: int, **settings: Any) -> Solved:
    # the theory is that of a step with APIC
    wave = waves.free_bar(cells, pace=1e-4, **{"transfer": "apic", **settings})
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
    AnalyticCase("incline-damped", (4, 8, 16), _incline(_DAMPED), {}),
    AnalyticCase("incline", (4, 8, 16), _incline(0.0), {}),
    AnalyticCase("muscle-stretch", (2, 4, 8), _muscle, {}),
)
