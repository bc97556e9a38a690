"""Small waves of known frequency and decay: the order of accuracy inside matter and at walls, and viscosity.

Bars have a Poisson's ratio of zero: without lateral stress the three-dimensional solver does one-dimensional mechanics
exactly, one cell wide, without walls at the sides.
"""

import math
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from scipy.optimize import curve_fit

from zoobench.arrays import Array
from zoobench.sim.model.matter import ElasticMaterial, WaterMaterial
from zoobench.sim.model.scene import Scene
from zoobench.verify.cases import CaseRecorder, case
from zoobench.verify.validate.rig import WEIGHTLESS, Rig, bed, dust, lattice, order_of_accuracy, passive_body

_BAR = ElasticMaterial(youngs_modulus=1e4, poissons_ratio=0.0, density=1000.0)
_BAR_SPEED = math.sqrt(_BAR.youngs_modulus / _BAR.density)
_CELLS = (8, 16, 32)


def fit_decay(t: Array, amplitude: Array, omega: float) -> tuple[float, float]:
    """Angular frequency and decay rate [1/s] of a e^(-g t) cos(w t + p), fitted from w = `omega` on."""

    def model(t: Array, a: float, g: float, w: float, p: float) -> Array:
        return a * np.exp(-g * t) * np.cos(w * t + p)

    (_, decay, frequency, _), _ = curve_fit(model, t, amplitude, p0=(amplitude[0], 0.0, omega, 0.0), xtol=1e-12)
    return float(frequency), float(decay)


@dataclass(frozen=True)
class Wave:
    """A simulated small standing wave.

    Attributes:
        rig: in its final state.
        omega: exact angular frequency [rad/s].
        frequency: fitted angular frequency [rad/s].
        decay: fitted decay rate of the amplitude [1/s]; zero for the exact wave.
        t, amplitude: times [s], and the mode's amplitude over its first value, `[steps + 1]`.
    """

    rig: Rig
    omega: float
    frequency: float
    decay: float
    t: Array
    amplitude: Array

    @property
    def frequency_error(self) -> float:
        """Relative error of the frequency."""
        return self.frequency / self.omega - 1

    @property
    def loss(self) -> float:
        """Share of the amplitude lost in one period."""
        return 1 - math.exp(-self.decay * 2 * math.pi / self.omega)


def _follow(rig: Rig, shape: Array, omega: float) -> Wave:
    """Simulate a mode of velocities along x with this shape and exact frequency."""
    found = [float(rig.v[:, 0] @ shape)]
    for _ in range(rig.steps):
        rig.advance(1)
        found.append(float(rig.v[:, 0] @ shape))
    t, amplitude = rig.times(rig.steps), np.array(found)
    frequency, decay = fit_decay(t, amplitude, omega)
    return Wave(rig, omega, frequency, decay, t, amplitude / amplitude[0])


def free_bar(cells: int, pace: float = 1e-3, **settings: Any) -> Wave:
    """First longitudinal mode of a bar of length 1 m with free ends: v = v0 cos(pi x / L), omega = pi c / L.

    Args:
        cells: of the grid along the bar.
        pace: v0 / c, its strain. Nonlinearity transfers about a twentieth of the strain, as a share of the amplitude,
            to harmonics per period, on every grid.
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
    rig = Rig(scene, h, periods * 2 * math.pi / omega, courant=0.45, **settings)
    return _follow(rig, np.cos(phase), omega)


@case("bar-mode", "closed form ω = π c / L (d'Alembert)", "8, 16, 32 cells per length, CFL 0.3")
def bar_mode(record: CaseRecorder) -> None:
    """Frequency and loss against the von Neumann analysis of one APIC step with quadratic splines.

    With S = sinc(k h / 2)^3, the transform of the spline, a step transmits S^2 + (2 S' / h)^2 = 1 - (k h)^4 / 40 of a
    plane wave's velocity, and so loses half of that of a wave, half of whose energy is kinetic. The stress acts with
    (4 S' / (k h^2))^2 = 1 - 13 (k h)^2 / 60 of the modulus, which slows the wave by 13 (k h)^2 / 120; symplectic Euler
    accelerates it by (c k dt)^2 / 24.
    """
    found = [free_bar(cells) for cells in _CELLS]
    errors = np.array([wave.frequency_error for wave in found])
    spacings = 1 / np.array(_CELLS)
    coarsest, finest = found[0], found[-1]
    loss = coarsest.decay * coarsest.rig.dt  # on finer grids other losses are larger
    courant = _BAR_SPEED * finest.rig.dt / spacings[-1]
    phase_law = -((math.pi * spacings[-1]) ** 2) * (13 / 120 - courant**2 / 24)
    loss_law = (math.pi * spacings[0]) ** 4 / 80
    record.within("order of the frequency error over 8, 16, 32 cells", order_of_accuracy(spacings, errors), 1.8, 2.2)
    record.at_most("frequency error at 32 cells", abs(errors[-1]), 1.2e-3)
    record.within("the same over its law -(k h)² (13/120 - CFL²/24)", errors[-1] / phase_law, 0.8, 1.2)
    record.within("loss per substep at 8 cells over its law (k h)^4 / 80", loss / loss_law, 0.8, 1.2)
    figure = record.plot(
        "Longitudinal mode of a free bar, 32 cells", "time [s]", "modal velocity over its first value [-]"
    )
    figure.computed("MPM", finest.t[::8], finest.amplitude[::8], points=True)
    figure.reference("cos(π c t / L)", finest.t, np.cos(math.pi * _BAR_SPEED * finest.t))


def walled_bar(cells: int, **settings: Any) -> Wave:
    """First longitudinal mode of a bar of length 1 m between slip walls.

    The walls resist no tension, so the bar is compressed by more than the amplitude. About the compressed state F0,
    small waves run with c² = (dP/dF) / rho0 in the rest length L0 = L / F0, P being the nominal stress mu (F - 1/F).
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
    rig = Rig(scene, h, periods * 2 * math.pi / omega, courant=0.45, **settings)
    rig.F[:, 0, 0] = stretch
    return _follow(rig, shape, omega)


@case("wall-mode", "closed form ω = π c / L (d'Alembert)", "8, 16, 32 cells between walls, CFL 0.3")
def wall_mode(record: CaseRecorder) -> None:
    """Frequency error of a standing wave between walls, and its order."""
    found = [walled_bar(cells) for cells in _CELLS]
    errors = np.array([wave.frequency_error for wave in found])
    spacings = 1 / np.array(_CELLS)
    phase, amplitude = found[-1].omega * found[-1].t, found[-1].amplitude
    record.at_most("largest frequency error, over h / L", (np.abs(errors) / spacings).max(), 0.45)
    record.within("order of the frequency error over 8, 16, 32 cells", order_of_accuracy(spacings, errors), 0.8, 1.3)
    figure = record.plot(
        "Standing wave between slip walls, 32 cells", "ω t [rad]", "modal velocity over its first value [-]"
    )
    figure.computed("MPM", phase[::8], amplitude[::8], points=True)
    figure.reference("cos(ω t)", phase, np.cos(phase))


_WATER = WaterMaterial(bulk_modulus=1e3, density=1000.0, viscosity=20.0)


def _viscous_layer(cells: int) -> tuple[float, Array, Array]:
    """Relative error of the decay rate, and the amplitude of a shear wave over rate times time.

    v_y = U cos(pi x / L) between slip walls decays with nu (pi / L)²; three cells of the exact flow above and below
    replace an infinite layer.
    """
    h, k = 1 / cells, math.pi
    rate = _WATER.viscosity / _WATER.density * k**2
    height = 12
    points = lattice((0, h, 0), (1.0, (1 + height) * h, h), (h / 2, h / 2, h))
    scene = Scene(
        dust((0.5, (1 + height / 2) * h, h / 2), h), (0, 0, 0), (1.0, (height + 2) * h, h),
        medium=bed(_WATER, points, h**3 / 4), gravity=WEIGHTLESS,
    )  # fmt: skip
    rig = Rig(scene, h, 1 / rate, courant=0.5)
    inside = np.flatnonzero(np.abs(points[:, 1] - (1 + height / 2) * h) > (height / 2 - 3) * h)
    held = rig.robot.stop + inside
    pace = 1e-4 * math.sqrt(_WATER.bulk_modulus / _WATER.density)
    shape, slope = np.cos(k * points[:, 0]), -k * np.sin(k * points[:, 0])
    free = np.setdiff1d(np.arange(len(points)), inside)
    rig.v[rig.medium, 1], rig.C[rig.medium, 1, 0] = pace * shape, pace * slope
    amplitude = [1.0]
    for n in range(1, rig.steps + 1):
        rig.advance(1)
        left = pace * math.exp(-rate * n * rig.dt)
        rig.place(held, points[inside])
        rig.v[held], rig.C[held], rig.history[inside] = 0.0, 0.0, 1.0
        rig.v[held, 1], rig.C[held, 1, 0] = left * shape[inside], left * slope[inside]
        v = rig.v[rig.medium, 1]
        amplitude.append(float(v[free] @ shape[free] / (shape[free] @ shape[free])) / pace)
    t = rig.times(rig.steps)
    fitted = -float(np.polyfit(t, np.log(amplitude), 1)[0])
    return fitted / rate - 1, rate * t, np.array(amplitude)


@case("shear-wave", "closed form exp(-ν k² t) (Stokes 1851)", "8, 16, 32 cells between walls")
def shear_wave(record: CaseRecorder) -> None:
    """Error of the decay rate of a viscous shear wave, and its order."""
    found = [_viscous_layer(cells) for cells in _CELLS]
    errors = np.array([row[0] for row in found])
    _, t, amplitude = found[-1]
    record.at_most("error of the decay rate at 32 cells", abs(errors[-1]), 1e-3)
    record.at_least("order of the error over 8, 16, 32 cells", order_of_accuracy(1 / np.array(_CELLS), errors), 1.8)
    figure = record.plot(
        "Viscous shear wave between slip walls, 32 cells", "ν k² t [-]", "amplitude over its first value [-]"
    )
    figure.computed("MPM", t[:: len(t) // 20], amplitude[:: len(t) // 20], points=True)
    figure.reference("exp(-ν k² t)", t, np.exp(-t))
