"""Element tests: one particle of a medium driven through a known deformation by the solver's substep.

The particle is so heavy that its stress does not move it: it should deform with the velocity gradient prescribed before
each substep. That which it had is read after the substep, and a case fails where the two differ.
"""

import math

import numpy as np

from zoobench.arrays import Array
from zoobench.sim.model.laws.clay import ClayMaterial
from zoobench.sim.model.laws.medium import Medium
from zoobench.sim.model.laws.sand import SandMaterial
from zoobench.sim.model.laws.snow import SnowMaterial
from zoobench.sim.model.scene import Scene
from zoobench_verify.cases import CaseRecorder, case
from zoobench_verify.validate.rig import WEIGHTLESS, Rig, bed, dust

_KLAR = "Klar et al. 2016, Drucker-Prager elastoplasticity for sand animation; closed form of its cone in plane strain"

_SPACING = 0.1
_STEP = 1e-4  # [s]
_HEAVY = 1e15  # [kg/m^3]

_MU = 1e4 / 2.6  # of E = 1e4 Pa, nu = 0.3


class _Element:
    """One particle of a medium at principal Hencky strains, deformed by increments.

    Attributes:
        off: largest difference of an increment made from that prescribed, by its size [-].
    """

    def __init__(self, material: Medium, strains: tuple[float, float, float] = (0.0, 0.0, 0.0)) -> None:
        position = np.array([[0.5, 0.5, 0.5]])
        medium = bed(material, position, _SPACING**3, np.array([strains]))
        scene = Scene(dust((0.5, 0.5, 0.5), _SPACING), (0, 0, 0), (1, 1, 1), medium=medium, gravity=WEIGHTLESS)
        self._rig, self.off = Rig(scene, _SPACING, _STEP), 0.0

    def deform(self, increment: Array) -> Array:
        """Kirchhoff stress [Pa] (xx yy zz xy xz yz) after the deformation F = I + `increment` `[3, 3]`."""
        rig = self._rig
        rig.v[:] = 0.0
        rig.C[:] = increment / rig.dt
        rig.F[:] = np.eye(3)
        rig.advance(1)
        made = rig.C[rig.medium][0] * rig.dt
        self.off = max(self.off, float(np.abs(made - increment).max() / np.abs(increment).max()))
        stress: Array = rig.medium_stress[0].astype(float)
        return stress

    @property
    def history(self) -> float:
        """History variable of the law."""
        return float(self._rig.history[0])


def _check_driven(record: CaseRecorder, *elements: _Element) -> None:
    """Let the case fail unless its particles deformed as prescribed."""
    record.at_most("deformation off that prescribed, relative", max(element.off for element in elements), 1e-9)


@case("clay-shear", "closed form of von Mises with Hencky strain (Simo 1992)", "one particle")
def clay_shear(record: CaseRecorder) -> None:
    """Simple shear of von Mises clay: elastic up to gamma = y / (sqrt2 mu), then tau_xy = y / sqrt2 (1 - (y / 2 mu)^2).

    The elastic branch of the Hencky law in simple shear is 2 mu asinh(gamma / 2) / sqrt(1 + gamma^2 / 4).
    """
    ratio = 5e-2
    bound = 2 * _MU * ratio
    element = _Element(ClayMaterial(1e4, 0.3, _HEAVY, yield_stress=bound))
    count, begin = 300, math.sqrt(2) * ratio
    step = 12 * begin / count
    increment = np.zeros((3, 3))
    increment[0, 1] = step
    stress = np.array([element.deform(increment) for _ in range(count)])
    gamma = step * np.arange(1, count + 1)
    elastic = 2 * _MU * np.arcsinh(gamma / 2) / np.sqrt(1 + gamma**2 / 4)
    cap = bound / math.sqrt(2) * (1 - ratio**2)
    below = gamma < 0.999 * begin
    size = np.sqrt((stress[:, :3] ** 2).sum(1) + 2 * (stress[:, 3:] ** 2).sum(1))
    over = np.maximum(size / bound - 1, 0.0).max()
    _check_driven(record, element)
    record.at_most("cap of the shear stress, relative error", abs(stress[-1, 3] / cap - 1), 1e-3)
    record.at_most("elastic branch, relative error", np.abs(stress[below, 3] / elastic[below] - 1).max(), 1e-8)
    record.at_most("stress beyond the yield surface, relative", over, 1e-8)
    record.at_most("pressure from shearing, per yield stress", np.abs(stress[:, :3].sum(1)).max() / bound, 1e-8)
    figure = record.plot("Clay in simple shear", "shear strain [-]", "shear stress [Pa]")
    figure.computed("solver", gamma[::6], stress[::6, 3], points=True)
    figure.reference("elastic branch and cap", gamma, np.minimum(elastic, cap))


@case("snow-press", "Stomakhin et al. 2013, A material point method for snow simulation", "one particle")
def snow_press(record: CaseRecorder) -> None:
    """Confined compression of snow with the paper's constants: elastic to J = 0.975, then hardening.

    From there on J_P = J / 0.975 and tau = exp(xi (1 - J_P)) (2 mu + lambda) (s^2 - s) at s = 0.975.
    """
    material = SnowMaterial(1.4e5, 0.2, _HEAVY, critical_compression=2.5e-2, critical_stretch=7.5e-3, hardening=10.0)
    element = _Element(material)
    mu, lam = material.lame
    critical, J = 1 - material.critical_compression, np.linspace(0.9975, 0.79, 84)
    found, plastic, before = [], [], 1.0
    for value in J:
        found.append(element.deform(np.diag([value / before - 1, 0.0, 0.0]))[0])
        plastic.append(element.history)
        before = value
    stretch = np.maximum(J, critical)
    ratio = np.minimum(J / critical, 1.0)
    exact = np.exp(material.hardening * (1 - ratio)) * (2 * mu + lam) * (stretch**2 - stretch)
    _check_driven(record, element)
    record.at_most("axial stress, relative error", np.abs(np.array(found) / exact - 1).max(), 1e-6)
    record.at_most("plastic volume ratio, relative error", np.abs(np.array(plastic) / ratio - 1).max(), 1e-6)
    figure = record.plot("Snow in confined compression", "volume ratio J [-]", "axial Kirchhoff stress [kPa]")
    figure.computed("solver", J[::3], np.array(found)[::3] / 1e3, points=True)
    figure.reference("closed form", J, exact / 1e3)


@case("sand-shear", _KLAR, "one particle")
def sand_shear(record: CaseRecorder) -> None:
    """Simple shear of sand at constant volume: tau_xy / -tau_yy tends to 3 alpha / sqrt2 of the cone's slope alpha.

    That is the tangent of the plane-strain friction angle. The elastic strain, of the order of the pressure's, turns
    the stress out of the direction of shear and limits the accuracy.
    """
    pressed, count = 1e-4, 200
    angles, found, paths = (20.0, 30.0, 45.0), [], []
    elements = [_Element(SandMaterial(1e4, 0.3, _HEAVY, friction_angle=angle), (-pressed,) * 3) for angle in angles]
    for element in elements:
        increment = np.zeros((3, 3))
        increment[0, 1] = 50 * pressed / count
        stress = np.array([element.deform(increment) for _ in range(count)])
        paths.append(-stress[:, 3] / stress[:, 1])
        found.append(paths[-1][-1])
    exact = [3 / math.sqrt(2) * SandMaterial(1e4, 0.3, 1.0, angle).cone_slope for angle in angles]
    gamma = 50 * pressed * np.arange(1, count + 1) / count
    _check_driven(record, *elements)
    record.at_most("ratio of shear to normal stress, relative error", np.abs(np.array(found) / exact - 1).max(), 1e-3)
    figure = record.plot("Sand in simple shear, by friction angle", "shear strain [-]", "shear over normal stress [-]")
    for angle, path, value in zip(angles, paths, exact, strict=True):
        figure.computed(f"solver, {angle:.0f}°", gamma[::8], path[::8], points=True)
        figure.level(f"3 α / √2, {angle:.0f}°", gamma, value)
