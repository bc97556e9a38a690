"""What the functions of a substep share, as one argument while a kernel is compiled; passing it costs nothing."""

from typing import Any, Self

import taichi as ti

from zoobench.sim.kernels.layout import Variant, while_compiling


@while_compiling
@ti.data_oriented
class Field:
    """A field of the nodes in a box, from their node `start` on: what a particle scatters into or gathers from.

    Attributes:
        grid: the array, or that of the adjoints.
        number: of the field in it.
        nodes: the box.
        start: first node of the box's nodes in the array, less those of the box itself.
        width: nodes of a stencil in each direction.
    """

    def __init__(self, grid: Any, number: int, nodes: Any, start: Any, width: int) -> None:
        self.grid, self.number, self.nodes, self.start, self.width = grid, number, nodes, start, width


@while_compiling
@ti.data_oriented
class Around:
    """The nodes around a particle, with the weights of its spline.

    Attributes:
        at: of `splines.stencil`.
        node, offset: of the same.
        w, dw: weights and, where they are needed, their derivatives by the offset.
    """

    def __init__(self, at: Any, w: Any, dw: Any = None) -> None:
        self.at, self.node, self.offset, self.w, self.dw = at, at.node, at.offset, w, dw


@while_compiling
@ti.data_oriented
class Context:
    """One substep of one world, `c` in what follows. A driver adds attributes that only its own functions use.

    Attributes:
        variant: what is compiled.
        state, window, body, plan, order, grid, terrain: the arrays of `layout`.
        adjoint, body_adjoint, grid_adjoint: those of the reverse.
        contributions: of the reverse for many threads, see `lane_scatter`; None where nodes are added to at once.
        scene: the constants by name.
        dt: the step [s].
        w: the world.
        s, t: the slot that is read and the one that is written.
        window_slot: that of the substep's window.
        nodes: the box of the window's nodes.
        start: first node of the momenta; velocities and adjoints begin with the grid.
    """

    contributions: Any = None
    grid: Any
    grid_adjoint: Any
    nodes: Any
    start: Any

    def __init__(self, variant: Variant, **given: Any) -> None:
        self.variant = variant
        vars(self).update(given)

    @while_compiling
    def but(self, **given: Any) -> Self:
        """The same with other attributes."""
        return type(self)(**vars(self) | given)

    @while_compiling
    def field(self, number: int, start: Any = 0) -> Field:
        """A field of the grid's nodes."""
        return Field(self.grid, number, self.nodes, start, self.variant.width)

    @while_compiling
    def adjoint_of(self, number: int) -> Field:
        """A field of the adjoints of the grid's nodes."""
        return Field(self.grid_adjoint, number, self.nodes, 0, self.variant.width)

    @while_compiling
    def added_to(self, number: int) -> Field | None:
        """The same where nodes are added to at once, else None."""
        return self.adjoint_of(number) if self.contributions is None else None


@while_compiling
def is_none(given: object) -> bool:
    """Whether there is none: for use where a kernel is compiled, as kernels have no `is`."""
    return given is None
