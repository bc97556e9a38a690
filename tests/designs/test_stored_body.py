"""Stored bodies: what a run has found, without parameters."""

from dataclasses import fields

import numpy as np
import pytest

from tests.conformance.cells import cell
from zoobench import registry
from zoobench.cell.robot import Robot
from zoobench.designs.base import Body
from zoobench.designs.space import DesignSpace
from zoobench.errors import UsageError
from zoobench.inputs import Start, run_name
from zoobench.registry import Kind
from zoobench.sim.model.fidelity import Fidelity
from zoobench.spec import Ref, RunSpec


def stored(keep: dict[str, Start], spec: RunSpec) -> tuple[Ref, np.ndarray]:
    """A run as a stored body, and its solution."""
    params = Robot.of_run(spec).initial(np.random.default_rng(6))
    name = run_name(spec.key())
    keep[name] = Start(spec, tuple(params.tolist()))
    return registry.resolve(Kind.DESIGN, Ref.parse(f"stored[run={name}]")), params


@pytest.mark.parametrize("design", ["voxel", "particle[base=panda,optimise=geometry]", "implicit", "sdf-lerp"])
def test_it_is_the_body_that_was_scored(keep: dict[str, Start], design: str) -> None:
    """In every array, at the fidelity of the run; and it is no design space."""
    spec = cell(design=design)
    ref, params = stored(keep, spec)
    made = registry.create(Kind.DESIGN, ref)
    assert not isinstance(made, DesignSpace)
    found, wanted = made.body(Fidelity(1 / 32)), Robot.of_run(spec).formed(params)
    for item in fields(Body):
        np.testing.assert_array_equal(getattr(found, item.name), getattr(wanted, item.name), err_msg=item.name)


def test_at_another_fidelity_it_is_made_again_or_refused(keep: dict[str, Start]) -> None:
    """A network's parameters fit every grid; those of particles do not."""
    network, _ = stored(keep, cell(design="implicit"))
    made = registry.create(Kind.DESIGN, network)
    coarse, fine = made.body(Fidelity(1 / 32)), made.body(Fidelity(1 / 64))
    assert fine.particle_count > 4 * coarse.particle_count
    particles, _ = stored(keep, cell(design="particle"))
    with pytest.raises(
        UsageError, match=r"parameters at smoke; at this fidelity particle takes [0-9]+. Give the run's"
    ):
        registry.create(Kind.DESIGN, particles).body(Fidelity(1 / 64))


@pytest.mark.slow
def test_it_is_refused_where_a_robot_has_other_particles(keep: dict[str, Start]) -> None:
    """In water by forces on the surface thin parts have fewer of them than on the ground, at the same fidelity."""
    swimmer, params = stored(keep, cell(environment="ocean", design="particle[base=clownfish,optimise=geometry]"))
    made = registry.create(Kind.DESIGN, swimmer)
    assert made.body(Fidelity(1 / 32, robot="lagrangian")).particle_count <= len(params)
    with pytest.raises(UsageError, match=r"at this fidelity particle takes [0-9]+"):
        made.body(Fidelity(1 / 32))


def test_a_body_that_was_given_is_refused(keep: dict[str, Start]) -> None:
    """The message names the design."""
    ref, _ = stored(keep, cell(design="caterpillar"))
    with pytest.raises(UsageError, match=r"was given to it. Give the same: --design 'caterpillar-v3"):
        registry.create(Kind.DESIGN, ref)


def test_it_can_be_a_base(keep: dict[str, Start]) -> None:
    """Such as for other muscles on the same solid."""
    ref, params = stored(keep, cell(design="voxel"))
    space = registry.create(Kind.DESIGN, Ref.parse(f"particle[base={ref},optimise=muscles]"))
    wanted = Robot.of_run(cell(design="voxel")).formed(params)
    np.testing.assert_array_equal(space.body(Fidelity(1 / 32)).positions, wanted.positions)
