"""The forces of water on a robot's surface and those within it, written anew in numpy, by what causes them."""

from dataclasses import dataclass

import numpy as np

from zoobench.arrays import Array
from zoobench.sim.model.fidelity import Fidelity
from zoobench.sim.model.rest_cells import RestCells, gradients
from zoobench.sim.model.scene import Scene
from zoobench.sim.model.surface_panels import SurfacePanels

_AREA, _SHARE, _WETTED, _MASS, _GROWTH, _AHEAD = slice(0, 3), 3, 4, 5, 6, 7
"""Columns of a panel's properties."""
_WEAK = 0.01
"""Volume of a weak point by that of its particle."""
_SLOW = 1e-4
"""Speed [m/s] below which the water's forces are smooth."""


@dataclass(frozen=True)
class Wet:
    """Forces of the water at one moment, `[nodes, 3]` [N] but for `added` and `resistance` `[nodes, 3, 3]` [kg, kg/s].

    Attributes:
        added: added mass.
        lift: with its suction.
        resistance: that of drag to motion along the normals, and of lift along q.
    """

    drag: Array
    lift: Array
    friction: Array
    reaction: Array
    added: Array
    resistance: Array


class PanelForces:
    """Forces on the nodes of a robot by the panels of its surface, for nodes at places [m], with velocities [m/s]."""

    def __init__(self, scene: Scene, fidelity: Fidelity, cells: RestCells) -> None:
        assert scene.surface_water is not None
        self._water = scene.surface_water
        panels = SurfacePanels.of(scene.robot, self._water, cells, fidelity.grid_spacing)
        given = panels.given.transpose(0, 2, 1)
        group, lane = np.nonzero(given[..., _WETTED] > 0.0)
        self._count, self._given, self._group = len(cells.places), given[group, lane], group
        self._nodes = cells.nodes[panels.cell[group]]
        self._weights = panels.weights[group, :, lane]
        self._slopes = gradients(np.full((1, 3), 0.5), fidelity.grid_spacing)[..., 0]  # in the middle of a cell
        self._around, self._bend = panels.around, panels.bend

    def at(self, places: Array, velocities: Array) -> Wet:
        """The forces but for that on accelerations."""
        given, water = self._given, self._water
        deformation, rate = (np.einsum("pia,ib->pab", q[self._nodes], self._slopes) for q in (places, velocities))
        v = np.einsum("pi,pia->pa", self._weights, velocities[self._nodes]) - np.array(water.current)
        area = _turned_areas(deformation, given[:, _AREA])
        size = np.linalg.norm(area, axis=1)
        n = area / size[:, None]
        across = (v * n).sum(axis=1)
        along = v - across[:, None] * n
        w = np.linalg.solve(deformation, along[..., None])[..., 0]
        turning = np.einsum("pa,pab,pb->p", n, rate, w)
        bending = np.einsum("pa,pabc,pb,pc->p", n, self._curvature(places), w, w)
        axis = np.linalg.inv(deformation)[:, 0]  # F^-T e_x
        onto = -(axis * v).sum(axis=1) * given[:, _GROWTH]
        q = n - given[:, _AHEAD, None] * axis
        sideways, front = (v * q).sum(axis=1), 0.5 * water.lift * water.density * given[:, _WETTED]
        lift = front * (_smooth(onto) + onto)
        suction = -0.5 * front * given[:, _GROWTH] * (1.0 + onto / _smooth(onto)) * sideways**2
        speed = np.sqrt((v * v).sum(axis=1) + _SLOW**2)
        drag = 0.25 * water.density * water.normal_drag * size * _smooth(across) ** 2 / speed
        rubbed = -0.5 * water.density * water.friction * size * given[:, _SHARE] * speed
        return Wet(
            drag=self._on_nodes(-(drag * across)[:, None] * n),
            lift=self._on_nodes(suction[:, None] * axis - (lift * sideways)[:, None] * q),
            friction=self._on_nodes(rubbed[:, None] * along),
            reaction=self._on_nodes((given[:, _MASS] * (2.0 * turning - bending))[:, None] * n),
            added=self._on_nodes(_along(given[:, _MASS], n)),
            resistance=self._on_nodes(_along(drag, n) + _along(lift, q)),
        )

    def _curvature(self, places: Array) -> Array:
        """Second derivatives of place `[panels, 3, 3, 3]` [1/m]."""
        near = places[self._around]
        xx, yy, zz, yz, xz, xy = np.einsum("gka,gkd->dga", near - near[:, :1], self._bend)[:, self._group]
        return np.moveaxis(np.array([[xx, xy, xz], [xy, yy, yz], [xz, yz, zz]]), (0, 1), (2, 3))

    def _on_nodes(self, values: Array) -> Array:
        """Sums over the panels of each node `[nodes, ...]`."""
        found = np.zeros((self._count, *values.shape[1:]))
        np.add.at(found, self._nodes, np.einsum("pi,p...->pi...", self._weights, values))
        return found


def _turned_areas(deformation: Array, areas: Array) -> Array:
    """Nanson's formula."""
    cofactor = np.linalg.det(deformation)[:, None, None] * np.linalg.inv(deformation).transpose(0, 2, 1)
    found: Array = np.einsum("pab,pb->pa", cofactor, areas)
    return found


def _along(values: Array, directions: Array) -> Array:
    """Matrices `[n, 3, 3]` of values `[n]` along directions `[n, 3]`."""
    return values[:, None, None] * directions[:, :, None] * directions[:, None]


def _smooth(speed: Array) -> Array:
    """|speed|, smooth."""
    found: Array = np.sqrt(speed**2 + _SLOW**2)
    return found


class BodyForces:
    """Forces on the nodes within a robot, for nodes at places [m], with velocities [m/s].

    Args:
        masses, volumes, stiffness, fibres: of its particles.
    """

    def __init__(
        self, scene: Scene, cells: RestCells, masses: Array, volumes: Array, stiffness: Array, fibres: Array
    ) -> None:
        material = scene.robot.material
        cell, lane = np.nonzero((cells.particles >= 0) | (cells.particles <= -2))
        number = cells.particles[cell, lane]
        self._own, self._particle = number >= 0, np.where(number >= 0, number, -2 - number)
        self._nodes, self._slopes = cells.nodes[cell], cells.slopes[cells.shape[cell], :, :, lane]
        self._volume = volumes[self._particle] * np.where(self._own, 1.0, _WEAK)
        self._mu, self._lam = np.array(material.lame)[:, None] * stiffness[self._particle]
        self._eta, self._fibre = material.viscosity, fibres[self._particle]
        shares = cells.masses[cells.shape[cell], :, lane] * (self._own * masses[self._particle])[:, None]
        self.node_masses = np.zeros(len(cells.places))
        np.add.at(self.node_masses, self._nodes, shares)

    def elastic_energy(self, places: Array) -> float:
        """[J]."""
        deformation = self._gradient(places)
        log_j = np.log(np.linalg.det(deformation))
        density = self._mu * (0.5 * (deformation**2).sum((1, 2)) - 1.5 - log_j) + 0.5 * self._lam * log_j**2
        return float(self._volume @ density)

    def powers(self, places: Array, velocities: Array, mean: Array, tension: Array) -> tuple[float, float, float]:
        """Power [W] of elastic, viscous and muscles' forces at places and velocities, on the velocities `mean`."""
        deformation, rate, turned = (self._gradient(q) for q in (places, velocities, mean))
        h, log_j = np.linalg.inv(deformation).transpose(0, 2, 1), np.log(np.linalg.det(deformation))
        flow = rate @ h.transpose(0, 2, 1)
        elastic = self._mu[:, None, None] * deformation + (self._lam * log_j - self._mu)[:, None, None] * h
        viscous = self._eta * (flow + flow.transpose(0, 2, 1)) @ h
        pull = np.where(self._own, tension[self._particle], 0.0)
        stretched = np.einsum("pab,pb->pa", deformation, self._fibre)
        active = pull[:, None, None] * stretched[:, :, None] * self._fibre[:, None]
        return tuple(-float(self._volume @ (stress * turned).sum((1, 2))) for stress in (elastic, viscous, active))  # type: ignore[return-value]

    def _gradient(self, values: Array) -> Array:
        """Of values at the nodes, at the particles `[points, 3, 3]`."""
        return np.asarray(np.einsum("pia,pib->pab", values[self._nodes], self._slopes))
