"""Small waves whose frequency and decay are known: the order of accuracy inside matter and at walls, and viscosity.

Bars have a Poisson's ratio of zero: without lateral stress the three-dimensional solver does one-dimensional mechanics
exactly, one cell wide, without walls at the sides.
"""

import math
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from zoobench.arrays import Array
from zoobench.sim.model.matter import ElasticMaterial, WaterMaterial
from zoobench.sim.model.scene import Scene
from zoobench.verify.validate.base import Case, Check, Figure, Outcome, Role, curve, order_of_accuracy
from zoobench.verify.validate.stage import WEIGHTLESS, Stage, bed, dust, lattice, passive_body

_BAR = ElasticMaterial(youngs_modulus=1e4, poissons_ratio=0.0, density=1000.0)
_BAR_SPEED = math.sqrt(_BAR.youngs_modulus / _BAR.density)
_CELLS = (8, 16, 32)


def fit_decay(t: Array, amplitude: Array, omega: float) -> tuple[float, float]:
    """Angular frequency and decay rate [1/s] of a e^(-g t) cos(w t + p), fitted from w = `omega` on."""
    from scipy.optimize import curve_fit

    def model(t: Array, a: float, g: float, w: float, p: float) -> Array:
        result: Array = a * np.exp(-g * t) * np.cos(w * t + p)
        return result

    (_, decay, frequency, _), _ = curve_fit(model, t, amplitude, p0=(amplitude[0], 0.0, omega, 0.0), xtol=1e-12)
    return float(frequency), float(decay)


@dataclass(frozen=True)
class Wave:
    """A small standing wave as it was simulated.

    Attributes:
        stage: what moved it on.
        omega: exact angular frequency [rad/s].
        frequency: the one found [rad/s].
        decay: rate of the amplitude's decay found [1/s]; the exact wave has none.
        t: times `[steps + 1]` [s].
        amplitude: of the mode over its first value `[steps + 1]`.
    """

    stage: Stage
    omega: float
    frequency: float
    decay: float
    t: Array
    amplitude: Array

    @property
    def frequency_error(self) -> float:
        """Relative."""
        return self.frequency / self.omega - 1

    @property
    def loss(self) -> float:
        """Share of the amplitude that is lost in one period."""
        return 1 - math.exp(-self.decay * 2 * math.pi / self.omega)


def _follow(stage: Stage, shape: Array, omega: float) -> Wave:
    """Move a mode of velocities along x of this shape and exact frequency on to the end."""
    t, amplitude = _record(stage, shape, 0)
    frequency, decay = fit_decay(t, amplitude, omega)
    return Wave(stage, omega, frequency, decay, t, amplitude / amplitude[0])


def free_bar(cells: int, pace: float = 1e-3, **settings: Any) -> Wave:
    """First longitudinal mode of a bar of length 1 m with free ends: v = v0 cos(pi x / L), omega = pi c / L.

    Args:
        cells: of the grid along the bar.
        pace: v0 / c, its strain. Matter is not linear: the harmonics take about a twentieth of the strain as a share
            of the amplitude per period, on every grid.
        settings: precision and further choices of the fidelity.
    """
    h, omega, periods = 1 / cells, math.pi * _BAR_SPEED, 3
    lower = (3 * h, h, h)
    points = lattice(lower, (lower[0] + 1.0, 2 * h, 2 * h), h / 2)
    phase = math.pi * (points[:, 0] - lower[0])
    along = np.array([1.0, 0.0, 0.0])
    speed = pace * _BAR_SPEED
    gradient = np.zeros((len(points), 3, 3))
    gradient[:, 0, 0] = -speed * math.pi * np.sin(phase)
    body = replace(
        passive_body(_BAR, points, h**3 / 8),
        velocities=speed * np.cos(phase)[:, None] * along,
        velocity_gradients=gradient,
    )
    scene = Scene(body, (0, 0, 0), (1 + 6 * h, 3 * h, 3 * h), gravity=WEIGHTLESS)
    stage = Stage(scene, h, periods * 2 * math.pi / omega, courant=0.45, **settings)
    return _follow(stage, np.cos(phase), omega)


def _record(stage: Stage, shape: Array, axis: int) -> tuple[Array, Array]:
    """Times and the projection of the velocities along an axis on a mode's shape, over all of the stage's steps."""
    amplitude = []
    for n in range(stage.steps + 1):
        if n:
            stage.advance(1)
        amplitude.append(float(stage.v[:, axis] @ shape))
    return stage.times(stage.steps), np.array(amplitude)


def _bar_mode() -> Outcome:
    """Frequency and loss against the von Neumann analysis of one APIC step with quadratic splines.

    With S = sinc(k h / 2)^3, the spline's transform, a step passes on S^2 + (2 S' / h)^2 = 1 - (k h)^4 / 40 of a plane
    wave's velocity, and so loses half of that of a wave, whose energy is kinetic half of the time. The stress acts with
    (4 S' / (k h^2))^2 = 1 - 13 (k h)^2 / 60 of the modulus, which slows the wave by 13 (k h)^2 / 120; symplectic Euler
    speeds it up by (c k dt)^2 / 24.
    """
    found = [free_bar(cells) for cells in _CELLS]
    errors = np.array([wave.frequency_error for wave in found])
    spacings = 1 / np.array(_CELLS)
    coarsest, finest = found[0], found[-1]
    loss = coarsest.decay * coarsest.stage.dt  # on the finer grids it is no longer the largest loss
    courant = _BAR_SPEED * finest.stage.dt / spacings[-1]
    phase_law = -((math.pi * spacings[-1]) ** 2) * (13 / 120 - courant**2 / 24)
    loss_law = (math.pi * spacings[0]) ** 4 / 80
    return Outcome(
        (
            Check("order of the frequency error over 8, 16, 32 cells", order_of_accuracy(spacings, errors),
                  at_least=1.8, at_most=2.2),
            Check("frequency error at 32 cells", abs(errors[-1]), at_most=1.2e-3),
            Check("the same over its law -(k h)² (13/120 - CFL²/24)", errors[-1] / phase_law,
                  at_least=0.8, at_most=1.2),
            Check("loss per substep at 8 cells over its law (k h)^4 / 80", loss / loss_law,
                  at_least=0.8, at_most=1.2),
        ),
        Figure(
            "Longitudinal mode of a free bar, 32 cells", "time [s]", "modal velocity over its first value [-]",
            (curve("MPM", Role.COMPUTED, finest.t[::8], finest.amplitude[::8], points=True),
             curve("cos(π c t / L)", Role.REFERENCE, finest.t, np.cos(math.pi * _BAR_SPEED * finest.t))),
        ),
    )  # fmt: skip


def walled_bar(cells: int, **settings: Any) -> Wave:
    """First longitudinal mode of a bar of length 1 m between slip walls.

    The walls let go freely, so the bar is pressed between them by more than the wave relieves. About the pressed state
    F0 small waves run with c² = (dP/dF) / rho0 in the rest length L0 = L / F0, P being the nominal stress mu (F - 1/F).

    Args:
        cells: of the grid from wall to wall.
        settings: precision and further choices of the fidelity.
    """
    h, stretch, periods = 1 / cells, 0.99, 3
    mu = _BAR.youngs_modulus / 2
    speed = math.sqrt(mu * (1 + stretch**-2) / _BAR.density)
    omega = math.pi * speed * stretch
    points = lattice((0, 0, 0), (1.0, h, h), h / 2)
    shape = np.sin(math.pi * points[:, 0])
    pace = 1e-3 * speed
    gradient = np.zeros((len(points), 3, 3))
    gradient[:, 0, 0] = pace * math.pi * np.cos(math.pi * points[:, 0])
    body = replace(
        passive_body(_BAR, points, h**3 / 8 / stretch),
        velocities=pace * shape[:, None] * np.array([1.0, 0.0, 0.0]),
        velocity_gradients=gradient,
    )
    scene = Scene(body, (0, 0, 0), (1.0, h, h), gravity=WEIGHTLESS)
    stage = Stage(scene, h, periods * 2 * math.pi / omega, courant=0.45, **settings)
    stage.F[:, 0, 0] = stretch
    return _follow(stage, shape, omega)


def _wall_mode() -> Outcome:
    found = [walled_bar(cells) for cells in _CELLS]
    errors = np.array([wave.frequency_error for wave in found])
    spacings = 1 / np.array(_CELLS)
    phase, amplitude = found[-1].omega * found[-1].t, found[-1].amplitude
    return Outcome(
        (
            Check("largest frequency error, over h / L", float((np.abs(errors) / spacings).max()), at_most=0.45),
            Check("order of the frequency error over 8, 16, 32 cells", order_of_accuracy(spacings, errors),
                  at_least=0.8, at_most=1.3),
        ),
        Figure(
            "Standing wave between slip walls, 32 cells", "ω t [rad]", "modal velocity over its first value [-]",
            (curve("MPM", Role.COMPUTED, phase[::8], amplitude[::8], points=True),
             curve("cos(ω t)", Role.REFERENCE, phase, np.cos(phase))),
        ),
    )  # fmt: skip


_WATER = WaterMaterial(bulk_modulus=1e3, density=1000.0, viscosity=20.0)


def _viscous_layer(cells: int) -> tuple[float, Array, Array]:
    """Relative error of the decay rate, and the amplitude of a shear wave over rate times time.

    v_y = U cos(pi x / L) between slip walls decays with nu (pi / L)²; above and below, three cells of the exact flow
    stand for a layer without end.
    """
    h, k = 1 / cells, math.pi
    rate = _WATER.viscosity / _WATER.density * k**2
    height = 12
    points = lattice((0, h, 0), (1.0, (1 + height) * h, h), (h / 2, h / 2, h))
    scene = Scene(
        dust((0.5, (1 + height / 2) * h, h / 2), h), (0, 0, 0), (1.0, (height + 2) * h, h),
        medium=bed(_WATER, points, h**3 / 4), gravity=WEIGHTLESS,
    )  # fmt: skip
    stage = Stage(scene, h, 1 / rate, courant=0.5)
    held = stage.robot.stop + np.flatnonzero(np.abs(points[:, 1] - (1 + height / 2) * h) > (height / 2 - 3) * h)
    pace = 1e-4 * math.sqrt(_WATER.bulk_modulus / _WATER.density)
    shape, slope = np.cos(k * points[:, 0]), -k * np.sin(k * points[:, 0])
    free = np.setdiff1d(np.arange(len(points)), held - stage.robot.stop)
    stage.v[stage.medium, 1], stage.C[stage.medium, 1, 0] = pace * shape, pace * slope
    inside = held - stage.robot.stop
    amplitude = [1.0]
    for n in range(1, stage.steps + 1):
        stage.advance(1)
        left = pace * math.exp(-rate * n * stage.dt)
        stage.place(held, points[inside])
        stage.v[held], stage.C[held], stage.history[inside] = 0.0, 0.0, 1.0
        stage.v[held, 1], stage.C[held, 1, 0] = left * shape[inside], left * slope[inside]
        v = stage.v[stage.medium, 1]
        amplitude.append(float(v[free] @ shape[free] / (shape[free] @ shape[free])) / pace)
    t = stage.times(stage.steps)
    fitted = -float(np.polyfit(t, np.log(amplitude), 1)[0])
    return fitted / rate - 1, rate * t, np.array(amplitude)


def _shear_wave() -> Outcome:
    found = [_viscous_layer(cells) for cells in _CELLS]
    errors = np.array([row[0] for row in found])
    _, t, amplitude = found[-1]
    return Outcome(
        (
            Check("error of the decay rate at 32 cells", abs(errors[-1]), at_most=1e-3),
            Check("order of the error over 8, 16, 32 cells", order_of_accuracy(1 / np.array(_CELLS), errors),
                  at_least=1.8),
        ),
        Figure(
            "Viscous shear wave between slip walls, 32 cells", "ν k² t [-]", "amplitude over its first value [-]",
            (curve("MPM", Role.COMPUTED, t[:: len(t) // 20], amplitude[:: len(t) // 20], points=True),
             curve("exp(-ν k² t)", Role.REFERENCE, t, np.exp(-t))),
        ),
    )  # fmt: skip


CASES = [
    Case("bar-mode", "closed form ω = π c / L (d'Alembert)", "8, 16, 32 cells per length, CFL 0.3", _bar_mode),
    Case("wall-mode", "closed form ω = π c / L (d'Alembert)", "8, 16, 32 cells between walls, CFL 0.3", _wall_mode),
    Case("shear-wave", "closed form exp(-ν k² t) (Stokes 1851)", "8, 16, 32 cells between walls", _shear_wave),
]
