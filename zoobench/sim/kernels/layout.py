"""How matter lies in the arrays that kernels take: every row is a vector of four lanes, the width of the registers.

    state      [slots, worlds, particles, 8 or 9] rows of a particle, below; the robot's particles come first
    window     [slots, worlds, 8] first and past-the-last grid node that any particle touches, where the nodes' momenta
               of the substep from this slot are kept in `grid`, and whether they are
    body       [worlds, particles, 2] (mass, volume, stiffness, tension) and (fibre, 0), or velocity where driven
    plan       [worlds, 4] first slot, number of substeps, and of particles awake, and whether a frame begins, with dt
               [worlds]: every world takes its own steps
    order      [worlds, particles] the particles awake, then those asleep; empty where none may sleep
    constants  of the scene, see `CONSTANTS`
    terrain    [nx, nz] height of the ground above the grid's first node [cells] and its normal; empty for a plane
    grid       [fields, nodes] fields of the nodes, below; a window's nodes follow each other without gaps, in two
               fields those of the medium behind those of the robot

The fourth lane of vectors is zero. A 3x3 matrix is three columns. A symmetric tensor is (xx yy zz xy xz yz).

Kernels for one thread are compiled without Taichi's scalarisation (`runtime.vector_lanes`): then a row is one register.
Compiled so, Taichi cannot cast or negate a vector (nor subtract in place), takes no array of vectors of three, and
adds to a single lane of an array's row wrongly and silently: add to the whole row.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from itertools import combinations
from typing import Any, TypeVar

import taichi as ti
from taichi.lang import impl

from zoobench.sim.kernels.boundary import TERRAIN
from zoobench.sim.kernels.columns import matrix
from zoobench.sim.kernels.laws.law import Law
from zoobench.sim.model.grid_water import GridWater
from zoobench.sim.model.surface_water import SurfaceWater

Given = TypeVar("Given")

X, V, C, F = 0, 1, 2, 5
"""Rows of a particle's state: place [m], velocity [m/s], columns of the APIC matrix [1/s], and of the robot's F."""

STRAIN, STRESS = 5, 7
"""Rows of a medium in place of F: elastic b and the scalar of history (xx yy zz xy | xz yz history 0), and Kirchhoff
stress (xx yy zz xy | xz yz 0 0) [Pa]. Water has its J in the place of history alone."""

HISTORY_LANE = 2
"""Lane of the second strain row that holds the history."""

MASS, VOLUME, STIFFNESS, TENSION = 0, 1, 2, 3
"""Lanes of a particle's first row of `body`; the second holds its fibre."""

MOMENTUM, VELOCITY, PUSH, BEFORE, RATIO, SURFACE = 0, 1, 2, 3, 4, 5
"""Fields of the grid: (momentum, mass), (velocity, mass), (impulse, 0) of the ground's skin, (momentum, mass) and then
(velocity, mass) of the motion before forces (AFLIP), and (mass times J, mass) of water or (mass times rate of volume
change, mass) of a solid medium, and of the ground's skin (size of the impulse times velocity relative to that of the
matter's surface, size of the impulse). Where a body rolls, the fourth lane of PUSH is the size of the impulse by the
place where the ground gives it. `grid_adjoint` has the same fields, its momenta and velocities in the place of
MOMENTUM."""

START, KEPT = 6, 7
"""Of a window: node in `grid` where the momenta of the slot's substep are kept, and 1 if they are."""

CONSTANTS = (
    "spacing", "mu", "lam", "eta", "g_x", "g_y", "g_z", "friction", "nodes_x", "nodes_y", "nodes_z", "robot",
    "skin_thickness", "skin_rate", "edge", "interface_friction", "robot_full", "medium_full",
)  # fmt: skip
"""Names of the constants in their order, by which the host lists them and the kernels know them; those of the medium
follow, as its law names them, and then those of objects. Grid spacing [m], Lame parameters and viscosity of the robot,
gravity [m/s^2], friction of the ground, counts of nodes and of elastic particles; of the ground's skin thickness [m],
gradient of the force per volume [N/m^4] and edge of the cubes of the robot's particles [m]; of two fields the friction
between robot and medium and the mass of a node in the midst of either [kg]."""

OBJECT_CONSTANTS = ("first", "object_mu", "object_lam", "object_eta", "object_full", "object_friction", "object_edge")
"""Names of the constants of a velocity field of objects: its first particle, Lame parameters and viscosity, mass of a
node in their midst [kg], friction on the ground, and edge of their particles' cubes [m]."""

_COUNTS = ("nodes_x", "nodes_y", "nodes_z", "robot")


@dataclass(frozen=True)
class Variant:
    """What a kernel is compiled for; code that it does not call for does not exist in it.

    Attributes:
        muscle, damping: whether the robot has muscles, and viscosity.
        law: of the medium; None for none.
        water: of water on a grid, or by forces on the surface, its class, which names its constants; None for none.
        ground: see `boundary`.
        skin: whether the ground pushes on the robot by its skin, see `skin_contact`.
        width: nodes of a spline in each direction.
        transfer, medium_transfer: of the robot and of the medium, see `transfer`.
        sleep: whether matter may sleep, see `sleepers`.
        two_fields: whether the medium has nodes of its own, see `velocity_fields`.
        fbar: whether the medium's volume changes as that around it, see `fbar`.
        robot: whether a particle may be elastic: not where only the medium's are visited.
        objects: number of velocity fields of objects, each with nodes of its own; objects that share one follow each
            other, and kernels do not tell them apart.
        anchors: in how many boxes the robot, and each field of objects, is held; empty where none is.
        clamped: layers of objects that are held in part.
        driven: whether particles of the robot are, see `anchors`.
        rest_frame: whether the robot carries its grid with it, see `rest_frame`.
        at_once: whether each world has a thread of its own, where a kernel visits a world by one (`rest_frame`).
    """

    muscle: bool
    damping: bool
    law: Law | None
    ground: int
    skin: bool
    width: int
    transfer: int
    medium_transfer: int
    sleep: bool
    two_fields: bool
    fbar: bool
    robot: bool = True
    objects: int = 0
    anchors: tuple[int, ...] = ()
    clamped: tuple[int, ...] = ()
    driven: bool = False
    rest_frame: bool = False
    at_once: bool = False
    water: type[GridWater | SurfaceWater] | None = None

    def uses(self, transfer: int) -> bool:
        """Whether any matter that is visited has this transfer."""
        return (self.robot and self.transfer == transfer) or (self.has_medium and self.medium_transfer == transfer)

    @property
    def has_medium(self) -> bool:
        """Whether there is a medium."""
        return self.law is not None

    @property
    def liquid(self) -> bool:
        """Whether the medium is a liquid."""
        return self.law is not None and self.law.is_liquid

    @property
    def has_panels(self) -> bool:
        """Whether water acts by forces on the surface of the robot."""
        return self.water is SurfaceWater

    @property
    def decomposed(self) -> bool:
        """Whether the medium's law needs principal values far from rest: that of a solid."""
        return self.has_medium and not self.liquid

    @property
    def slides(self) -> bool:
        """Whether the ground holds the medium by no more than its shear strength."""
        return self.law is not None and self.law.slides

    def has_skin(self, layer: int) -> bool:
        """Whether the ground's skin pushes on this layer of nodes: not on the medium's own."""
        return self.skin and not self.is_medium(layer)

    def rolls(self, layer: int) -> bool:
        """Whether the ground's friction acts on this layer of nodes at the surface of the ground."""
        return self.skin and 0 < layer <= self.objects

    @property
    def rolling(self) -> bool:
        """Whether it does on any layer."""
        return self.skin and self.objects > 0

    @property
    def rolling_aslant(self) -> bool:
        """Whether the nodes at which it acts lie above and below the surface: those of a plane are on it."""
        return self.rolling and self.ground == TERRAIN

    def is_anchored(self, layer: int) -> bool:
        """Whether nodes of this layer are held."""
        return bool(self.anchors_of(layer))

    def anchors_of(self, layer: int) -> range:
        """Which of the anchors' boxes are those of this layer."""
        first = sum(self.anchors[:layer])
        return range(first, sum(self.anchors[: layer + 1]))

    def is_tight(self, layer: int) -> bool:
        """Whether walls press on this layer of nodes."""
        return self.liquid and layer == self.layers - 1

    @property
    def layers(self) -> int:
        """How often every node is there: for the robot, for each field of objects, and for a medium with nodes of its
        own; in water on a grid once for all bodies."""
        return 1 if self.water else 1 + self.objects + self.two_fields

    @property
    def pairs(self) -> tuple[tuple[int, int], ...]:
        """Pairs of layers that meet, in the order in which they do."""
        return tuple(combinations(range(self.layers), 2))

    def is_medium(self, layer: int) -> bool:
        """Whether this layer of nodes is the medium's own."""
        return self.two_fields and layer == self.layers - 1

    @property
    def ratio(self) -> bool:
        """Whether the medium has the field RATIO."""
        return self.fbar or self.liquid

    @property
    def surveyed(self) -> "Surveyed":
        """What of it makes a difference to the survey after a frame."""
        water, ground = self.water if self.objects else None, self.ground if self.rest_frame else None
        return Surveyed(self.law, self.skin, self.objects, water, self.rest_frame, ground, self.at_once)

    @property
    def of_medium(self) -> "Variant":
        """The same where only the medium's particles are visited."""
        return replace(self, robot=False)


@dataclass(frozen=True)
class Surveyed:
    """What of a variant makes a difference to the survey, so that scenes which differ in other things share its kernel.

    Attributes:
        law, skin, objects, rest_frame, at_once: of the variant.
        water: of the variant, where the constants of objects follow on those of water.
        ground: of the variant, of a robot in its rest frame.
    """

    law: Law | None
    skin: bool
    objects: int
    water: type[GridWater | SurfaceWater] | None
    rest_frame: bool
    ground: int | None
    at_once: bool


def while_compiling(given: Given) -> Given:
    """Mark a Python function or class that kernels call while they are compiled, of which Taichi would warn."""
    given._is_taichi_function = False  # type: ignore[attr-defined]
    return given


def by_name(constants: Any, names: Sequence[str]) -> dict[str, Any]:
    """The first numbers of an array under these names, while a kernel is compiled."""
    builder = impl.get_runtime().compiling_callable.ast_builder()
    return {name: impl.subscript(builder, constants, place) for place, name in enumerate(names)}


@while_compiling
def object_constants(objects: int, pairs: int = 0, anchors: int = 0) -> tuple[str, ...]:
    """Names of the constants that follow where there are objects or anchors: those of each field of objects, the
    friction of each pair, and the first and the last node along x, y and z that each anchor holds."""
    own = tuple(f"{name}.{k}" for k in range(objects) for name in OBJECT_CONSTANTS)
    frictions = tuple(f"pair_friction.{pair}" for pair in range(pairs if objects else 0))
    return own + frictions + tuple(f"anchor.{place}" for place in range(6 * anchors))


@while_compiling
def scene_constants(constants: Any, medium: Any = None, more: Sequence[str] = ()) -> ti.Struct:
    """The constants by name while a kernel is compiled, with `inverse` of the spacing, and the medium's in `medium`.

    `medium` names these in its `constants`: a law, or water on a grid; `more` are those that follow, see
    `object_constants`: a vector under each name, a number for each field of objects.
    """
    own = tuple(f"medium.{name}" for name in medium.constants) if medium else ()
    named = by_name(constants, (*CONSTANTS, *own, *more))
    bed = {name.removeprefix("medium."): named.pop(name) for name in own}
    named |= {name: ti.cast(named[name], ti.i32) for name in _COUNTS}
    named |= {"medium": ti.Struct(**bed)} if bed else {}
    for name in dict.fromkeys(key.partition(".")[0] for key in more):
        named[name] = ti.Vector([named.pop(key) for key in more if key.partition(".")[0] == name])
    return ti.Struct(**named, inverse=1.0 / named["spacing"])


@while_compiling
def constants_of(constants: Any, variant: Variant) -> ti.Struct:
    """`scene_constants` of a variant."""
    more = object_constants(variant.objects, len(variant.pairs), sum(variant.anchors))
    return scene_constants(constants, variant.water or variant.law, more)


@ti.func
def box(window: ti.template(), s, w):
    """The nodes in the window of world w at slot s: strides, flat index of the grid's first node, and their number."""
    sy = window[s, w, 5] - window[s, w, 2]
    sx = sy * (window[s, w, 4] - window[s, w, 1])
    origin = -(window[s, w, 0] * sx + window[s, w, 1] * sy + window[s, w, 2])
    return ti.Struct(sx=sx, sy=sy, origin=origin, size=sx * (window[s, w, 3] - window[s, w, 0]))


@ti.func
def layer(c: ti.template(), p):
    """The nodes of a particle's own body in a box of nodes."""
    origin = c.nodes.origin
    if ti.static(c.variant.robot):
        for k in ti.static(range(c.variant.objects)):
            if p >= c.scene.first[k]:
                origin += c.nodes.size
    if ti.static(c.variant.two_fields and c.variant.robot):
        if p >= c.scene.robot:
            origin += c.nodes.size
    elif ti.static(c.variant.two_fields):
        origin += medium_layer(c)
    return ti.Struct(sx=c.nodes.sx, sy=c.nodes.sy, origin=origin, size=c.nodes.size)


@ti.func
def medium_layer(c: ti.template()):
    """How many nodes further the medium's are."""
    return c.nodes.size * (c.variant.layers - 1)


@ti.func
def columns(rows: ti.template(), s, w, p, row: ti.template()):
    """The matrix stored from a row on."""
    return matrix(rows[s, w, p, row], rows[s, w, p, row + 1], rows[s, w, p, row + 2])


@ti.func
def put_columns(rows: ti.template(), s, w, p, row: ti.template(), a: ti.template()):
    """Store a matrix from a row on."""
    rows[s, w, p, row] = a.x
    rows[s, w, p, row + 1] = a.y
    rows[s, w, p, row + 2] = a.z


@ti.func
def add_columns(rows: ti.template(), s, w, p, row: ti.template(), a: ti.template()):
    """Add to the matrix stored from a row on."""
    rows[s, w, p, row] += a.x
    rows[s, w, p, row + 1] += a.y
    rows[s, w, p, row + 2] += a.z


@ti.func
def symmetric(rows: ti.template(), s, w, p, row: ti.template()):
    """The symmetric tensor (xx yy zz xy xz yz) stored from a row on."""
    one, two = rows[s, w, p, row], rows[s, w, p, row + 1]
    return ti.Vector([one[0], one[1], one[2], one[3], two[0], two[1]])


@ti.func
def history(rows: ti.template(), s, w, p):
    """The history of a medium's particle, of water its J."""
    return rows[s, w, p, STRAIN + 1][HISTORY_LANE]


@ti.func
def add_history(rows: ti.template(), s, w, p, more):
    """Add to the history of a medium's particle."""
    rows[s, w, p, STRAIN + 1] += ti.Vector([0.0, 0.0, more, 0.0])
