"""The closed forms of the cases, each against its differential equation."""

from dataclasses import replace

import numpy as np
import pytest

from zoobench.sim.model.laws.elastic import fibre_stress, lame_parameters, neo_hookean
from zoobench_verify.validate import hertz, manufactured, modes, mud, rest_frame_statics, statics
from zoobench_verify.validate.rig import GRAVITY, order_of_accuracy


def test_manufactured_body_force_balances_inertia_and_stress() -> None:
    """rho u_tt = div P + rho b, with u_tt and div P by central differences of displacement and stress."""
    material = manufactured.MATERIAL
    mu, lam = lame_parameters(material.youngs_modulus, material.poissons_ratio)
    X, t, step = np.random.default_rng(1).uniform(0, 1, (50, 2)), 0.17, 1e-4

    def nominal(X: np.ndarray) -> np.ndarray:
        """P_xx and P_yy of the motion, from the law in NumPy."""
        stretch = manufactured.stretches(X, t)
        F = np.eye(3) + np.zeros((len(X), 3, 3))
        F[:, [0, 1], [0, 1]] = stretch
        tau = neo_hookean(F, mu, lam)
        return tau[:, [0, 1], [0, 1]] / stretch

    divergence = np.empty_like(X)
    for d in range(2):
        way = step * np.eye(2)[d]
        divergence[:, d] = (nominal(X + way) - nominal(X - way))[:, d] / (2 * step)
    u = manufactured.displacement
    inertia = (u(X, t + step) - 2 * u(X, t) + u(X, t - step)) / step**2
    expected = inertia - divergence / material.density
    assert manufactured.body_force(X, t) == pytest.approx(expected, rel=1e-5, abs=1e-5 * np.abs(expected).max())


def test_manufactured_stretches_are_derivatives_of_the_displacement() -> None:
    """F = 1 + du/dX, by central differences."""
    X, t, step = np.random.default_rng(2).uniform(0, 1, (50, 2)), 0.17, 1e-5
    u = manufactured.displacement
    derivative = (u(X + step, t) - u(X - step, t)) / (2 * step)
    assert manufactured.stretches(X, t) == pytest.approx(1 + derivative, rel=1e-8)
    assert np.abs(derivative).max() > 0.2


def test_column_settles_by_half_its_load_in_the_limit_of_small_strain() -> None:
    """A stiff column sinks by rho g H^2 / (2 M); the soft one by more than that."""
    soft = statics._column_material()
    mu, lam = lame_parameters(soft.youngs_modulus, soft.poissons_ratio)
    linear = soft.density * GRAVITY / (2 * (lam + 2 * mu))
    top = float(statics.column_settlement(soft, np.array([1.0]))[0])
    assert linear == pytest.approx(statics._LOAD / 2, rel=1e-12)
    assert top == pytest.approx(linear, rel=0.05)
    assert abs(top / linear - 1) > 0.005


@pytest.mark.parametrize("activation", [-1.0, 0.4, 1.0])
def test_muscle_at_its_equilibrium_stretch_is_free_of_stress(activation: float) -> None:
    """Passive and active stress cancel in every direction."""
    along, across = statics.muscle_stretch(activation)
    mu, lam = lame_parameters(statics.MUSCLE.youngs_modulus, statics.MUSCLE.poissons_ratio)
    F = np.diag([along, across, across])
    active = fibre_stress(F, activation * statics.MUSCLE.muscle_strength, np.array([1.0, 0.0, 0.0]))
    assert np.abs(neo_hookean(F, mu, lam) + active).max() <= 1e-9 * statics.MUSCLE.muscle_strength


def test_beam_deflection_satisfies_its_equations() -> None:
    """Clamped at the root; far away from shear its fourth derivative is the load over the stiffness."""
    x = np.linspace(1.0, 9.0, 9)
    step = 0.5
    deflect = statics.timoshenko_deflection
    fourth = sum(c * deflect(x + n * step) for n, c in zip(range(-2, 3), (1, -4, 6, -4, 1), strict=True)) / step**4
    load = statics._BEAM.density * statics._gentle_gravity() * statics._DEPTH
    assert fourth == pytest.approx(load / (statics._BEAM.youngs_modulus * statics._DEPTH**3 / 12), rel=1e-6)
    assert not deflect(np.array([0.0, -1.0])).any()


def test_sag_of_a_square_rod_is_that_of_the_beam() -> None:
    """Without Poisson's ratio, the parts by bending and by shear are those of `timoshenko_deflection`, scaled."""
    rod = replace(statics._BEAM, density=1.0)
    length, thick = rest_frame_statics._SLENDER * rest_frame_statics._THICK, rest_frame_statics._THICK
    places = np.linspace(0.1, 1.0, 5)
    slender = np.array([rest_frame_statics.timoshenko_sag(rod, 1.0, place * length) for place in places])
    load, modulus = statics._BEAM.density * statics._gentle_gravity(), statics._BEAM.youngs_modulus
    shear = (places - places**2 / 2) / (5 / 12)
    beam = statics.timoshenko_deflection(places * statics._LENGTH) * modulus / load
    bending = (beam - shear * statics._LENGTH**2) * statics._DEPTH**2 / statics._LENGTH**4
    assert slender * modulus == pytest.approx(bending * length**4 / thick**2 + shear * length**2, rel=1e-9)


def test_two_layers_curve_as_costs_least_energy() -> None:
    """Strain c - k y, less that to which the upper half would contract, is least in the mean square."""
    y = (np.arange(2000) + 0.5) / 2000 - 0.5  # over the thickness
    wished = np.where(y > 0.0, -rest_frame_statics._STRAIN, 0.0)
    slope = np.polyfit(y, wished, 1)[0]
    assert -slope / rest_frame_statics._THICK == pytest.approx(rest_frame_statics.timoshenko_curvature(), rel=1e-6)


def test_laws_of_a_transfer_step_follow_from_the_spline() -> None:
    """With S = sinc^3: S^2 + (2 S'/h)^2 = 1 - (k h)^4 / 40 and (4 S' / (k h^2))^2 = 1 - 13 (k h)^2 / 60.

    S is the transform of the quadratic spline, taken from the spline itself.
    """
    x = np.linspace(-1.5, 1.5, 30001)
    spline = np.where(np.abs(x) < 0.5, 0.75 - x**2, 0.5 * (1.5 - np.abs(x)) ** 2)
    for wave in (0.1, 0.2):  # k h
        S = float(np.trapezoid(spline * np.cos(wave * x), x))
        slope = -np.trapezoid(spline * x * np.sin(wave * x), x)  # S' / h
        assert abs(S / np.sinc(wave / 2 / np.pi) ** 3 - 1) < 1e-7
        assert 1 - S**2 - (2 * slope) ** 2 == pytest.approx(wave**4 / 40, rel=0.02)
        assert 1 - (4 * slope / wave) ** 2 == pytest.approx(13 * wave**2 / 60, rel=0.01)


def test_order_of_accuracy_is_the_slope_in_logarithms() -> None:
    """Errors that shrink with the square of the spacing have order two, whatever their sign."""
    spacings = np.array([0.1, 0.05, 0.02])
    assert order_of_accuracy(spacings, -3 * spacings**2) == pytest.approx(2.0, rel=1e-12)


def test_modes_of_a_block_agree_with_finite_elements() -> None:
    """Frequencies of scikit-fem 12.0.2 on 16 x 4 x 4 triquadratic hexahedra; its error shrinks to the fourth order.

    On 12 x 3 x 3 elements it gives 1.07323, 1.41683, 2.39206 and 2.47175 rad/s.
    """
    elements = np.array([1.07308, 1.07308, 1.41520, 2.39076, 2.39076, 2.47174])
    found = modes.block_modes(modes.MATERIAL, modes.SIZE, 6).omega
    assert found == pytest.approx(elements, rel=1e-3)


def test_mode_gradients_are_derivatives_of_the_shapes() -> None:
    """By central differences."""
    found = modes.block_modes(modes.MATERIAL, modes.SIZE, 1, degree=4)
    points, step = np.random.default_rng(3).uniform(-0.5, 0.5, (20, 3)), 1e-5
    _, gradients = found.shape(0, points)
    for d in range(3):
        way = step * np.eye(3)[d]
        change = (found.shape(0, points + way)[0] - found.shape(0, points - way)[0]) / (2 * step)
        assert gradients[:, :, d] == pytest.approx(change, rel=1e-6, abs=1e-8 * np.abs(change).max())


def test_impact_of_hertz_obeys_its_equation_of_motion() -> None:
    """m d'' = -k d^(3/2), integrated step by step, gives duration, force and depth."""
    radius, speed = 0.5, 0.1
    exact = hertz.Hertz.of(hertz._BALL, radius, speed)
    mass = hertz._BALL.density * 4 / 3 * np.pi * radius**3
    k = 4 / 3 * hertz._BALL.youngs_modulus / (1 - hertz._BALL.poissons_ratio**2) * np.sqrt(radius)
    depth, rate, step, deepest, time = 0.0, speed, exact.duration / 20000, 0.0, 0.0
    while depth >= 0:
        rate -= step * k * max(depth, 0.0) ** 1.5 / mass
        depth += step * rate
        deepest, time = max(deepest, depth), time + step
    assert (time, k * deepest**1.5, deepest) == pytest.approx(exact, rel=1e-3)


def test_film_of_mud_is_in_equilibrium() -> None:
    """The sheared part carries the weight above: yield stress and eta du/dy; the plug is not sheared."""
    depth, step = 0.1, 1e-6
    y = np.array([0.01, 0.03, 0.049])
    slope = (mud.bingham_film(y + step, depth) - mud.bingham_film(y - step, depth)) / (2 * step)
    weight = mud._DENSITY * GRAVITY * np.sin(mud._SLOPE) * (depth - y)
    assert mud._mud(depth).yield_stress / np.sqrt(2) + mud._VISCOSITY * slope == pytest.approx(weight, rel=1e-6)
    assert np.ptp(mud.bingham_film(np.array([0.06, 0.1]), depth)) == 0
