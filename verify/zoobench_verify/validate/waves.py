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
from zoobench.sim.model.laws.elastic import ElasticMaterial
from zoobench.sim.model.laws.water import WaterMaterial
from zoobench.sim.model.scene import Scene
from zoobench_verify.cases import CaseRecorder, case
from zoobench_verify.validate.rig import WEIGHTLESS, Rig, bed, dust, lattice, order_of_accuracy, passive_body, repeat

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
    accelerates it by (c k dt)^2 / 24. AFLIP avoids 19 of 20 parts of APIC's loss in a step without forces.
    """
    found = [free_bar(cells, transfer="apic") for cells in _CELLS]
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
    kept = free_bar(_CELLS[0])
    record.within("loss per substep at 8 cells with AFLIP over that law", kept.decay * kept.rig.dt / loss_law, 0.0, 0.4)
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
    """Frequency error of a standing wave between walls, and its order; the wall acts on nodes, as with APIC."""
    found = [walled_bar(cells, transfer="apic") for cells in _CELLS]
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

_PRESSED = 0.999
"""J of the water at rest. At J = 1 it would resist the compression in its noise but not the expansion, and gain energy
by that."""


def viscous_layer(cells: int, viscosity: float = _WATER.viscosity) -> tuple[float, Array, Array]:
    """Decay rate of a shear wave over nu k^2 of `_WATER`, nu k^2 t, and the amplitude over its first value.

    v_y = U cos(pi x / L) between slip walls decays with nu k^2, k = pi / L. The layer is endless along y: a piece of it
    has images above and below, which take the state of their originals after every substep.
    """
    h, k, images, rows = 1 / cells, math.pi, 3, 4
    rate = _WATER.viscosity / _WATER.density * k**2
    piece = lattice((0, (1 + rows) * h, 0), (1.0, (1 + 2 * rows) * h, h), (h / 2, h / 2, h))
    shifts = rows * h * np.array([0.0, -1.0, 1.0])
    shifts = shifts[:, None, None] * np.array([0.0, 1.0, 0.0])
    points, water = (piece + shifts).reshape(-1, 3), replace(_WATER, viscosity=viscosity)
    scene = Scene(
        dust((0.5, (1 + 1.5 * rows) * h, h / 2), h), (0, 0, 0), (1.0, (images * rows + 2) * h, h),
        medium=bed(water, points, h**3 / 4 / _PRESSED, np.full(points.shape, math.log(_PRESSED) / 3)),
        gravity=WEIGHTLESS,
    )  # fmt: skip
    rig = Rig(scene, h, 1 / rate, courant=0.5)
    pace = 1e-4 * math.sqrt(_WATER.bulk_modulus / _WATER.density)
    x = np.tile(piece[:, 0], images)
    shape, own = np.cos(k * piece[:, 0]), slice(rig.robot.stop, rig.robot.stop + len(piece))
    rig.v[rig.medium, 1], rig.C[rig.medium, 1, 0] = pace * np.cos(k * x), -pace * k * np.sin(k * x)
    amplitude = [1.0]
    for _ in range(rig.steps):
        rig.advance(1)
        repeat(images, rig.v[rig.medium], rig.C[rig.medium], rig.history)
        rig.place(rig.medium, (rig.positions[own] + shifts).reshape(-1, 3))
        amplitude.append(float(rig.v[own, 1] @ shape / (shape @ shape)) / pace)
    t = rig.times(rig.steps)
    fitted = -float(np.polyfit(t, np.log(amplitude), 1)[0])
    return fitted / rate, rate * t, np.array(amplitude)


@case("shear-wave", "closed form exp(-ν k² t) (Stokes 1851)", "8, 16, 32 cells between walls, and 3 to 6")
def shear_wave(record: CaseRecorder) -> None:
    """Decay of a shear wave in an endless viscous layer: error of its rate, and its order.

    The same without viscosity shows how much of the decay is the grid's.
    """
    found = [viscous_layer(cells) for cells in _CELLS]
    errors = np.array([row[0] - 1 for row in found])
    coarse = [abs(viscous_layer(cells)[0] - 1) for cells in (3, 4, 6)]
    inviscid = max(abs(viscous_layer(cells, viscosity=0.0)[0]) for cells in (3, 4, 6, 16))
    _, t, amplitude = found[-1]
    record.at_most("error of the decay rate at 32 cells", abs(errors[-1]), 2e-3)
    record.at_least("order of the error over 8, 16, 32 cells", order_of_accuracy(1 / np.array(_CELLS), errors), 1.8)
    record.at_most("error of the decay rate at 3, 4, 6 cells", max(coarse), 0.1)
    record.at_most("decay rate without viscosity at 3, 4, 6, 16 cells, over ν k²", inviscid, 0.05)
    figure = record.plot(
        "Viscous shear wave between slip walls, 32 cells", "ν k² t [-]", "amplitude over its first value [-]"
    )
    figure.computed("MPM", t[:: len(t) // 20], amplitude[:: len(t) // 20], points=True)
    figure.reference("exp(-ν k² t)", t, np.exp(-t))
