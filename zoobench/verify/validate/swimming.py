"""Water on a grid: vortices, bodies that coast and sink, and a plate that swims by a wave from head to tail.

The bounds are those that a robot needs to swim; real water would be at 1 where a share is left.
"""

import math
from dataclasses import replace

import numpy as np

from zoobench.arrays import Array
from zoobench.sim.model.grid_water import GridWater
from zoobench.sim.model.matter import ElasticMaterial
from zoobench.sim.model.scene import ElasticBody, Scene
from zoobench.verify.cases import CaseRecorder, case
from zoobench.verify.validate.rig import GRAVITY, WEIGHTLESS, Rig, Vector, dust, lattice, passive_body

_SPACING = 1 / 64
_RUBBER = ElasticMaterial(youngs_modulus=1e5, poissons_ratio=0.2, density=1000.0, viscosity=20.0)
_WATER = GridWater()


def _tank(
    body: ElasticBody, cells: tuple[int, int, int], gravity: Vector = WEIGHTLESS, water: GridWater = _WATER,
    spacing: float = _SPACING,
) -> Scene:  # fmt: skip
    """A body in a closed box of water of so many cells."""
    x, y, z = (spacing * count for count in cells)
    return Scene(body, (0.0, 0.0, 0.0), (x, y, z), gravity=gravity, water=water)


def _vortex(speed: float, cells: int, spacing: float = _SPACING) -> tuple[Array, Array]:
    """Times [s] over 0.25 s, and the share of its speed that a Taylor-Green vortex with 2 `cells` a wave has left."""
    k, wide = math.pi / (cells * spacing), cells * spacing
    face, centre = np.arange(cells) * spacing, (np.arange(cells) + 0.5) * spacing
    given = np.zeros((cells, cells, 4, 3))
    given[..., 0] = speed * np.outer(np.sin(k * face), np.cos(k * centre))[:, :, None]
    given[..., 1] = -speed * np.outer(np.cos(k * centre), np.sin(k * face))[:, :, None]
    speck, water = dust((wide / 2, wide / 2, 2 * spacing), spacing), GridWater(velocities=given)
    rig = Rig(_tank(speck, (cells, cells, 4), water=water, spacing=spacing), spacing, 0.25, courant=1e-3)
    flow, shares = rig.solver.matter.flow[0, 0, :, :3].numpy(), [1.0]
    for _ in range(rig.steps):
        rig.advance(1)
        shares.append(math.sqrt(np.square(flow).sum() / np.square(given).sum()))
    return rig.times(rig.steps), np.array(shares)


@case("taylor-green-vortex", "Taylor & Green 1937, without viscosity", "16 cells a wavelength, 20 and 200 mm/s")
def taylor_green_vortex(record: CaseRecorder) -> None:
    """The vortex is at rest in the frame of its walls, so that all of its loss is numerical."""
    figure = record.plot("Taylor-Green vortex without viscosity", "time [s]", "speed left [-]")
    for speed in (0.02, 0.2):
        times, shares = _vortex(speed, 8)
        record.at_least(f"speed left after 0.25 s of {1e3 * speed:g} mm/s", shares[-1], 0.97)
        figure.computed(f"{1e3 * speed:g} mm/s", times, shares)
    figure.reference("no viscosity", times, np.ones_like(times))


@case("vortices-of-a-body", "Taylor & Green 1937: the speed decays with 2 nu k^2", "3 and 5 cells a vortex, 50 mm/s")
def vortices_of_a_body(record: CaseRecorder) -> None:
    """Vortices of 0.05 m, which a body of 0.1 m sheds, lose speed as in water of this Reynolds number; real: 5,000."""
    figure = record.plot("Vortices of 50 mm across", "time [s]", "speed left [-]")
    for name, spacing, cells, bound in (("draft", 1 / 64, 3, 200.0), ("standard", 1 / 96, 5, 600.0)):
        times, shares = _vortex(0.05, cells, spacing)
        viscosity = -math.log(shares[-1]) / (2 * (math.pi / (cells * spacing)) ** 2 * times[-1])
        record.at_least(f"Reynolds number of 0.1 m at 50 mm/s at {name}", 0.1 * 0.05 / viscosity, bound)
        figure.computed(name, times, shares)


def _ball(cells: int, density: float, speed: float, place: Vector) -> ElasticBody:
    """A ball, `cells` across, about a place [m], moving along x [m/s]."""
    radius, half = 0.5 * cells * _SPACING, _SPACING / 2
    points = lattice((-radius, -radius, -radius), (radius, radius, radius), half)
    points = points[np.linalg.norm(points, axis=1) < radius]
    volume = 4 / 3 * math.pi * radius**3 / len(points)
    return passive_body(replace(_RUBBER, density=density), points + place, volume, np.array([speed, 0.0, 0.0]))


def _momenta(rig: Rig, pieces: int) -> tuple[Array, Array, Array]:
    """Times [s], and place [m] and velocity [m/s] of the centre of mass, along three axes each."""
    weights = rig.mass / rig.mass.sum()
    places, speeds = [weights @ rig.positions], [weights @ rig.v]
    for _ in range(pieces):
        rig.advance(rig.steps // pieces)
        places.append(weights @ rig.positions)
        speeds.append(weights @ rig.v)
    return rig.times(pieces, rig.steps // pieces), np.array(places), np.array(speeds)


@case("coasting-ball", "potential flow: added mass of half the displaced", "6 cells across, in a box of 20")
def coasting_ball(record: CaseRecorder) -> None:
    """A ball of water's density is given 50 mm/s; what it keeps is 1 / (1 + added mass), and drag takes little more."""
    middle = 10 * _SPACING
    rig = Rig(_tank(_ball(6, 1000.0, 0.05, (middle, middle, middle)), (20, 20, 20)), _SPACING, 0.3)
    times, _, speeds = _momenta(rig, 150)
    share = speeds[:, 0] / 0.05
    record.within("added mass by displaced mass after 2 ms", 1 / np.interp(0.002, times, share) - 1, 0.5, 0.9)
    record.at_least("speed left after 10 ms", np.interp(0.01, times, share), 0.5)
    record.at_least("speed left after 0.3 s", share[-1], 0.45)
    figure = record.plot("A ball that is given 50 mm/s", "time [s]", "speed left [-]")
    figure.computed("6 cells across", times, share)
    figure.reference("1 / (1 + 0.5)", times, np.full_like(times, 2 / 3))


def _sinking(diameter: float, excess: float, times: Array) -> Array:
    """Way [m] of a sphere, denser than water by a share `excess`, with its added mass and drag."""
    way, speed, ways, dt = 0.0, 0.0, [0.0], (times[1] - times[0]) / 50
    for _ in times[1:]:
        for _ in range(50):
            reynolds = max(speed * diameter / 1e-6, 1.0)
            drag = max(0.44, 24 / reynolds * (1 + 0.15 * reynolds**0.687)) * 0.75 * speed**2 / diameter
            speed += dt * (excess * GRAVITY - drag) / (1.0 + excess + 0.5)
            way += dt * speed
        ways.append(way)
    return np.array(ways)


@case("sinking-ball", "Schiller & Naumann 1935, added mass of a half", "6 cells across, 10 % denser, in a box of 20")
def sinking_ball(record: CaseRecorder) -> None:
    """Released at rest, it falls as far in 0.3 s as the textbook says but for its thicker wake."""
    middle = 10 * _SPACING
    body = _ball(6, 1100.0, 0.0, (middle, 1.4 * middle, middle))
    rig = Rig(_tank(body, (20, 20, 20), (0.0, -GRAVITY, 0.0)), _SPACING, 0.3)
    times, places, _ = _momenta(rig, 50)
    way, exact = places[0, 1] - places[:, 1], _sinking(6 * _SPACING, 0.1, times)
    record.within("way in 0.3 s by the textbook's", way[-1] / exact[-1], 0.7, 1.1)
    figure = record.plot("A ball 10 % denser than water", "time [s]", "way [m]")
    figure.computed("6 cells across", times, way)
    figure.reference("added mass 0.5 and a sphere's drag", times, exact)


def _towed(reynolds: float) -> Array:
    """Drag coefficients of a ball, 6 cells across, in each of five diameters at 0.2 m/s along a box of 48 x 20 x 20
    cells."""
    wide, speed, h = 6 * _SPACING, 0.2, _SPACING
    water = GridWater(viscosity=speed * wide / reynolds)
    body = _ball(6, 1000.0, speed, (7 * h, 10 * h, 10 * h))
    rig = Rig(_tank(body, (48, 20, 20), water=water), h, wide / speed, precision=32, courant=0.7)
    mass, impulse = float(rig.mass.sum()), np.zeros(5)
    for diameter in range(5):
        for _ in range(rig.steps):
            rig.advance(1)
            slip = speed - float(rig.mass @ rig.v[:, 0]) / mass
            rig.v[:, 0] += slip
            impulse[diameter] += slip * mass
    found: Array = impulse * speed / wide / (0.5 * 1000.0 * speed**2 * math.pi * wide**2 / 4)
    return found


@case("towed-ball", "Schiller & Naumann 1935", "6 cells across, in a box of 48 x 20 x 20", is_fast=False, precision=32)
def towed_ball(record: CaseRecorder) -> None:
    """The water resists a ball at constant speed nearly as its viscosity says, on which that of the grid comes."""
    figure = record.plot("A ball that is towed from rest", "way [diameters]", "drag by that of the curve [-]")
    for reynolds in (100.0, 500.0):
        ratios = _towed(reynolds) / (24 / reynolds * (1 + 0.15 * reynolds**0.687))
        record.within(f"drag by that of the curve at a Reynolds number of {reynolds:g}", ratios[-1], 0.5, 2.0)
        figure.computed(f"Reynolds number {reynolds:g}", np.arange(5) + 0.5, ratios)


def _swim(frequency: float, way: float, place: float) -> tuple[Array, Array, float]:
    """A plate of 0.1 x 0.012 m, bent by a wave 0.2 m long that runs backward (`way` 1) or forward (-1).

    Its amplitude grows from 2 mm at the head to 10 mm at the tail. Its middle lies `place` cells beside the faces.

    Returns:
        times [s], the way ahead [m], and the speed in the last of four periods [m/s].
    """
    h, long, thick, wave = _SPACING, 0.1, 0.012, 0.2
    corner = np.array([13 * h - long / 2, 0.0, (7 + place) * h - thick / 2])
    points = lattice((0.0, 0.0, 0.0), (long, 4 * h, thick), (h / 2, h / 2, thick / 2)) + corner
    body = passive_body(_RUBBER, points, long * 4 * h * thick / len(points))
    rig = Rig(_tank(body, (26, 4, 14)), h, 1.0 / frequency, precision=32, courant=0.7)
    back = (corner[0] + long - points[:, 0]) / long
    amplitude, phase = 0.01 * (0.2 + 0.8 * back), -way * 2 * math.pi * back * long / wave
    rate, spring = 2 * math.pi * frequency, 300.0
    ahead, times = [0.0], [0.0]
    for step in range(4 * rig.steps):
        time = step * rig.dt
        swing = amplitude * min(1.0, time * frequency)
        lag = swing * np.sin(rate * time + phase) - (rig.positions[:, 2] - points[:, 2])
        slip = rate * swing * np.cos(rate * time + phase) - rig.v[:, 2]
        rig.v[:, 2] += rig.dt * (spring**2 * lag + 1.4 * spring * slip)
        rig.advance(1)
        if (step + 1) % (rig.steps // 8) == 0:
            times.append((step + 1) * rig.dt)
            ahead.append(float((rig.positions[:, 0] - points[:, 0]).mean()))
    period = np.interp(times[-1] - 1 / frequency, times, ahead)
    return np.array(times), np.array(ahead), (ahead[-1] - period) * frequency


@case("swimming-plate", "sign and proportion: Lighthill 1960; Strouhal number: Triantafyllou et al. 1993",
      "0.1 m in 6.4 cells, 0.8 cells thick", is_fast=False)  # fmt: skip
def swimming_plate(record: CaseRecorder) -> None:
    """A wave from head to tail drives it forward, in proportion to the frequency, and one from tail to head hardly."""
    figure = record.plot("A plate that is bent in a wave", "time in periods", "way ahead [m]")
    frequencies, places = (2.0, 4.0, 8.0), (0.0, 0.25, 0.5)
    strides = np.zeros((len(frequencies), len(places)))
    for row, frequency in enumerate(frequencies):
        for column, place in enumerate(places):
            times, ahead, speed = _swim(frequency, 1.0, place)
            strides[row, column] = speed / (0.1 * frequency)
        figure.computed(f"{frequency:g} Hz, to the tail", times * frequency, ahead)
    times, ahead, _ = _swim(4.0, -1.0, places[-1])
    figure.computed("4 Hz, to the head", times * 4.0, ahead)
    reversed_strides = np.array([_swim(4.0, -1.0, place)[2] / 0.4 for place in places])
    means = strides.mean(axis=1)
    record.at_least("lengths per period, the least of 2, 4, 8 Hz at three places on the grid", strides.min(), 0.05)
    record.at_most("spread over the frequencies, of the mean over the places, by it", np.ptp(means) / means.mean(), 0.3)
    record.at_most("Strouhal number at 4 Hz, the largest", (0.2 / strides[1]).max(), 1.5)
    record.at_most("speed by a wave to the head by that of the other", (reversed_strides / strides[1]).max(), 1 / 3)
