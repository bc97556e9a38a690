"""The energy balances as shares of the work that muscles put in."""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from operator import itemgetter

from zoobench.registry import Kind, short
from zoobench_verify.accuracy.records import Measurements, grid_spacing, is_present


@dataclass(frozen=True)
class EnergyRow:
    """The energy balance of a short episode, as shares of the work put in by the muscles, `put_in` [J].

    Attributes:
        back: work taken back by stretched muscles.
        stored: growth of kinetic, elastic and potential energy.
        viscous, plastic, contact: lost to viscosity, to yield, to ground and walls.
        unexplained: lost without a physical cause; negative for a gain.
    """

    env: str
    fidelity: str
    put_in: float
    back: float
    stored: float
    viscous: float
    plastic: float
    contact: float
    unexplained: float


def energies(measurements: Measurements, envs: Sequence[str] = ()) -> Iterator[EnergyRow]:
    """Balances of `envs` (all if empty) by environment, from coarse to fine, each level before its knobs.

    Those of former versions are left out.
    """
    chosen = [
        (
            one.env.name,
            -grid_spacing(one.fidelity),
            short(Kind.FIDELITY, one.fidelity),
            short(Kind.ENV, one.env),
            one,
        )
        for one in measurements.balances
        if is_present(one) and one.put_in and (not envs or one.env.name in envs)
    ]
    for *_, fidelity, env, one in sorted(chosen, key=itemgetter(0, 1, 2, 3)):
        parts = (one.stored, one.viscous, one.plastic, one.contact)
        stored, viscous, plastic, contact = (energy / one.put_in for energy in parts)
        back = 1.0 - one.muscles / one.put_in
        yield EnergyRow(env, fidelity, one.put_in, back, stored, viscous, plastic, contact, one.unexplained)
