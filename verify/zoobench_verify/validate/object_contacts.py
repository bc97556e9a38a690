"""Objects: what slips on a moving back, and what rolls down a slope."""

import math
from collections.abc import Mapping
from dataclasses import replace

import numpy as np

from zoobench.arrays import Array
from zoobench.designs.sampling import Shape
from zoobench.sim.model.elastic_bodies import SceneObject
from zoobench.sim.model.fidelity import Fidelity, Robot
from zoobench.sim.model.laws.elastic import ElasticMaterial
from zoobench.sim.model.scene import Ground, Scene
from zoobench.sim.model.standing import standing
from zoobench_verify.cases import CaseRecorder, Shortfall, case
from zoobench_verify.validate.rig import GRAVITY, NAMES, Rig, Vector, lattice, passive_body, solid_body

_MATTER = ElasticMaterial(youngs_modulus=1e5, poissons_ratio=0.3, density=600.0)
_EDGE = 0.05
"""Of the box, and diameter of the ball [m]."""
FRICTIONS = (0.1, 0.2, 0.5, 1.0)
"""Coefficients under which a ball rolls: from 2/7 tan θ on it does not slide."""
_HIGH = 0.0625
"""Of the back [m]."""


def on_a_back(cells: int, acceleration: float, friction: float, seconds: float = 0.12) -> tuple[Array, Array]:
    """A box on the back of a long soft body, whose particles are all given the speed of a constant acceleration.

    Args:
        cells: across the box.
        acceleration: of the back [g].
        friction: Coulomb's coefficient between both.

    Returns:
        Times [s], and the speed of the box in the arena [m/s].
    """
    h = _EDGE / cells
    high = round(_HIGH / h) * h
    back = passive_body(replace(_MATTER, density=1000.0), lattice((0.1, 0, 0.1), (0.5, high, 0.2), h / 2), (h / 2) ** 3)
    low, middle = high + 0.25 * h, 0.15
    corner = (0.25, low, middle - _EDGE / 2), (0.25 + _EDGE, low + _EDGE, middle + _EDGE / 2)
    box = SceneObject("box", passive_body(_MATTER, lattice(*corner, h / 2), (h / 2) ** 3), friction=friction)
    scene = Scene(back, (0, 0, 0), (1.2, 0.25, 0.3), ground=Ground(0.0), objects=(box,))
    rig = Rig(scene, h, 0.008, precision=32, courant=0.8)
    rig.equilibrate(150.0, round(0.25 / rig.dt))
    times = rig.times(round(seconds / rig.dt))
    speeds = [0.0]
    for time in times[:-1]:
        rig.v[rig.robot, 0] = acceleration * GRAVITY * time
        rig.C[rig.robot, 0] = 0.0
        rig.advance(1)
        speeds.append(float(rig.v[scene.slice_of("box"), 0].mean()))
    return times, np.array(speeds)


def speeds_of(rig: Rig, index: slice, count: int, every: int = 1) -> tuple[Array, Array]:
    """Times [s], and mean speeds along x [m/s] of these particles, at so many intervals of `every` substeps."""
    times, speeds = rig.times(count, every), [float(rig.v[index, 0].mean())]
    for _ in times[1:]:
        rig.advance(every)
        speeds.append(float(rig.v[index, 0].mean()))
    return times, np.array(speeds)


def late_rate(times: Array, values: Array) -> float:
    """Rate of change after the first third, by which a motion has settled."""
    late = times > 0.3 * times[-1]
    return float(np.polyfit(times[late], values[late], 1)[0])


@case(
    "slip-on-back",
    "Coulomb 1785: a = μ g, of what slips on a faster one",
    "box of 4, 6 and 8 cells",
    precision=32,
    is_fast=False,
)
def slip_on_back(record: CaseRecorder) -> None:
    """A box slips on a soft back that accelerates at 1 g, with the acceleration that friction gives it."""
    digs = Shortfall("normals are tilted at the edges of a box, which dig into the back", 0.1)
    figure = record.plot("Box on a back that accelerates at 1 g, μ = 0.5", "time [s]", "speed of the box [m/s]")
    for cells in (4, 6, 8):
        for friction in (0.5, 0.0):
            times, speeds = on_a_back(cells, 1.0, friction)
            excess = late_rate(times, speeds) / GRAVITY - friction
            bound, known = (0.06, None) if friction else (0.02, digs)
            what = f"acceleration beyond μ g, box of {cells} cells, μ = {friction:g}"
            record.within(what, excess, -bound, bound, "g", shortfall=known)
            if friction:
                every = len(times) // 15
                figure.computed(f"MPM, {cells} cells", times[::every], speeds[::every], points=True)
    figure.reference("Coulomb", times, 0.5 * GRAVITY * times)


def _down(degrees: float) -> Vector:
    """Gravity on a slope of so many degrees along x."""
    slope = math.radians(degrees)
    return GRAVITY * math.sin(slope), -GRAVITY * math.cos(slope), 0.0


def rolling(
    cells: float, friction: float, degrees: float = 10.0, seconds: float = 0.4, robot: Robot = "mpm"
) -> tuple[Array, Array]:
    """A ball, set down on a slope with so many cells across it: times [s], and its speed down the slope [m/s].

    In its rest frame it is the robot, otherwise an object.
    """
    grid = Fidelity(_EDGE / cells, precision=32, robot=robot)
    down, edges = _down(degrees), (_EDGE, _EDGE, _EDGE)
    centre = np.array([0.0, _EDGE / 2, 0.0])
    solid = Shape.standing(lambda x: np.linalg.norm(x - centre, axis=-1) <= _EDGE / 2, *edges).sample(grid)
    ball = solid_body(_MATTER, solid, np.array([0.1, 0.0, 0.1]))
    ground, size = Ground(friction), (0.6, 0.1, 0.2)
    ball = standing(Scene(ball, (0, 0, 0), size, ground=ground, gravity=(0.0, down[1], 0.0)), grid.particle_edge).robot
    grain = passive_body(_MATTER, np.array([[0.02, 0.02, 0.02]]), grid.particle_edge**3)
    rolls = SceneObject("ball", ball, ground_friction=friction)
    scene = Scene(grain, (0, 0, 0), size, ground=ground, gravity=down, objects=(rolls,))
    index = scene.slice_of("ball")
    if robot == "lagrangian":
        scene, index = Scene(ball, (0, 0, 0), size, ground=ground, gravity=down), slice(0, ball.particle_count)
    rig = Rig(scene, grid.grid_spacing, 0.008, precision=32, robot=robot)
    return speeds_of(rig, index, round(seconds / rig.dt / rig.steps), rig.steps)


@case("rolling-ball", "a = 5/7 g sin θ of a ball that rolls down a slope", "ball of 4, 6 and 8 cells", precision=32)
def rolling_ball(record: CaseRecorder) -> None:
    """A ball rolls down a slope of 10°, whatever the friction that keeps it from sliding."""
    check_rolling(record, {})


def check_rolling(
    record: CaseRecorder, shortfalls: Mapping[tuple[int, float], Shortfall], robot: Robot = "mpm"
) -> None:
    """Check balls of 4, 6 and 8 cells under `FRICTIONS`; what falls short is by cells and friction."""
    exact = 5 / 7 * _down(10.0)[0]
    figure = record.plot("Ball on a slope of 10°, 6 cells across", "time [s]", "speed [m/s]")
    for cells in (4, 6, 8):
        for friction in FRICTIONS:
            times, speeds = rolling(cells, friction, robot=robot)
            ratio = late_rate(times, speeds) / exact
            what = f"acceleration over 5/7 g sin θ, {cells} cells, μ = {friction:g}"
            record.within(what, ratio, 0.95, 1.05, shortfall=shortfalls.get((cells, friction)))
            if cells == 6:
                figure.computed(f"{NAMES[robot]}, μ = {friction:g}", times[::5], speeds[::5], points=True)
    figure.reference("5/7 g sin θ", times, exact * times)
