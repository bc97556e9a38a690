"""Fidelity: the numerical settings that trade accuracy for time."""

from dataclasses import dataclass, replace
from typing import Literal, NamedTuple, get_args

from zoobench.errors import UsageError

PARTICLES_PER_CELL = (1, 4, 8, 27)

REST_FRAME_PARTICLES = (8, 27)
"""Those of a cell in the rest frame: one alone resists none of its hourglass modes, and four are no cubic lattice."""

SHIFT_ASIDE = 0.618
"""The golden ratio: evenly spaced shifts give evenly distributed places along both directions."""

Transfer = Literal["apic", "pic", "aflip"]
Kernel = Literal["quadratic", "cubic"]
Device = Literal["cpu", "cuda"]
Robot = Literal["mpm", "lagrangian"]


class Spline(NamedTuple):
    """Properties of a B-spline that the rest of the simulator needs.

    Attributes:
        width: nodes of a particle's stencil in each direction.
        inverse_moment: h^2 over the spline's second moment, sum w_i (x_i - x_p)^2 (Jiang et al. 2016, sec. 5.3).
    """

    width: int
    inverse_moment: float


SPLINES: dict[Kernel, Spline] = {"quadratic": Spline(3, 4.0), "cubic": Spline(4, 3.0)}


@dataclass(frozen=True)
class Fidelity:
    """The numerical settings of a simulation.

    Attributes:
        grid_spacing: h [m].
        courant: the step as a fraction of the largest safe one, dt_iso = h sqrt(rho0 / kappa); refused above 0.9.
        particles_per_cell: 1, 4 (face-centred), 8 or 27; 8 is enough, 1 is unusable for accuracy. A design
            may have more, as swimmers do.
        precision: 32 or 64 bits for every real number of the simulation.
        step: a fixed step [s], shortened to divide the control frame; 0 lets every world choose its own, frame by
            frame, from the state it is in.
        transfer: of the robot's velocity between particles and grid: `apic` an affine velocity field (Jiang et al.
            2015), `pic` the velocity alone, which damps heavily, `aflip` an affine field and 95 % of the motion that
            the grid does not resolve (after Fei et al. 2021, see `kernels.flip`), which damps least.
        medium_transfer: the same of a medium that has none of its own; with `aflip` clay and mud are without F-bar, and
            lock (`kernels.fbar`).
        kernel: the B-spline between particles and nodes, `quadratic` over 3 nodes or `cubic` over 4 in each direction.
        shift: displacement of the robot on the grid [cells] along x, and `SHIFT_ASIDE` times it along z. A converged
            simulation does not depend on it; the scatter over several shifts is the noise floor.
        sleep: speed [m/s] below which solid matter of a bed is at rest through a control frame unless something faster
            is near, see `sim.sleep`; 0 to have all of it move, as all of it does on a GPU.
        device: `cpu`, or `cuda` for a GPU of NVIDIA, where sums differ in their last bits from run to run.
        robot: `mpm`, which moves through the grid as matter of a bed does, or `lagrangian`, on a grid in its rest frame
            (`kernels.rest_frame`): on firm ground and in water by forces on its surface alone, faster, and it does
            not tear. Then transfer, kernel and shift have no meaning.
    """

    grid_spacing: float
    courant: float = 0.7
    particles_per_cell: int = 8
    precision: Literal[32, 64] = 32
    step: float = 0.0
    transfer: Transfer = "aflip"
    medium_transfer: Transfer = "apic"
    kernel: Kernel = "quadratic"
    shift: float = 0.0
    sleep: float = 0.003
    device: Device = "cpu"
    robot: Robot = "mpm"

    def __post_init__(self) -> None:
        if not 0.0 < self.grid_spacing < 1.0:
            raise UsageError(f"The grid spacing {self.grid_spacing:g} m is not between 0 and 1 m. Try 1/64.")
        if not 0.0 < self.courant <= 0.9:
            raise UsageError(f"The Courant fraction {self.courant:g} is not in (0, 0.9]. 0.7 is a good choice.")
        if self.particles_per_cell not in PARTICLES_PER_CELL:
            raise UsageError(
                f"{self.particles_per_cell} particles per cell are not offered. Choose one of {PARTICLES_PER_CELL}."
            )
        if self.precision not in (32, 64):
            raise UsageError(f"A precision of {self.precision} bits is not offered. Choose 32 or 64.")
        if not 0.0 <= self.step < 1.0:
            raise UsageError(f"A fixed step of {self.step:g} s is not between 0 and 1 s. Give 0 to have it chosen.")
        for name, offered in (
            ("transfer", get_args(Transfer)), ("medium_transfer", get_args(Transfer)), ("kernel", get_args(Kernel)),
            ("device", get_args(Device)), ("robot", get_args(Robot)),
        ):  # fmt: skip
            if (given := getattr(self, name)) not in offered:
                raise UsageError(f"The {name} {given!r} is not offered. Choose one of {', '.join(offered)}.")
        if self.robot == "lagrangian":
            self._check_rest_frame()
        if not -1.0 <= self.shift <= 1.0:
            raise UsageError(f"A shift of {self.shift:g} cells is not between -1 and 1. Give 0 for none.")

        if not 0.0 <= self.sleep < 1.0:
            raise UsageError(f"A speed of sleep of {self.sleep:g} m/s is not between 0 and 1 m/s. Try 0.001.")

    def _check_rest_frame(self) -> None:
        """Refuse settings that a robot in its rest frame is not simulated with."""
        if self.particles_per_cell not in REST_FRAME_PARTICLES:
            raise UsageError(
                f"{self.particles_per_cell} particles per cell do not hold the cells of a robot in its rest frame "
                "(robot=lagrangian). Give 8 or 27, or robot=mpm."
            )

    @property
    def least_occupancy(self) -> float:
        """Relaxed matter of less occupancy is left out.

        On a grid it is carried along, and the bound is where it has no effect and a vanishing gradient. In its rest
        frame it hangs on the matter beside it, which would turn it inside out: 0.1 is too little for some bodies.
        """
        return 1e-4 if self.robot == "mpm" else 0.3

    @property
    def spline(self) -> Spline:
        """The kernel's stencil and moment."""
        return SPLINES[self.kernel]

    @property
    def moment(self) -> float:
        """Second moment of the kernel [m^2]: the inertia per mass of a particle's affine motion along each axis."""
        return self.grid_spacing**2 / self.spline.inverse_moment

    @property
    def particle_edge(self) -> float:
        """Edge of the cube that a particle stands for [m]."""
        return float(self.grid_spacing / self.particles_per_cell ** (1 / 3))

    @property
    def displacement(self) -> tuple[float, float, float]:
        """Displacement of the robot by `shift` [m]."""
        return (self.shift * self.grid_spacing, 0.0, SHIFT_ASIDE * self.shift * self.grid_spacing)

    def with_particles(self, least: int) -> "Fidelity":
        """With at least so many particles per cell."""
        return replace(self, particles_per_cell=max(self.particles_per_cell, least))
