"""Requirements on every design space: shapes, ranges, gradients, independent worlds and a feasible prior."""

from collections.abc import Callable

import numpy as np
import pytest
import torch
from scipy.spatial import KDTree

from zoobench import registry
from zoobench.arrays import Array
from zoobench.designs.base import Body
from zoobench.designs.feasibility import feasible
from zoobench.designs.space import LEAST_STIFFNESS, DesignSpace, Form, SiteSpace
from zoobench.errors import UsageError
from zoobench.registry import Kind
from zoobench.sim.model.fidelity import Fidelity
from zoobench.spec import Ref

pytestmark = pytest.mark.usefixtures("few_iterations")
SPACES = [name for name in registry.names(Kind.DESIGN) if "space" in registry.get(Kind.DESIGN, name).tags]
SMOKE, DRAFT, TINY = Fidelity(1 / 32), Fidelity(1 / 64), Fidelity(1 / 32, particles_per_cell=1)

SITE_SPACES = [name for name in SPACES if "sites" in registry.get(Kind.DESIGN, name).tags]
BASED_SPACES = [name for name in SPACES if "base" in registry.get(Kind.DESIGN, name).parameters]
_SPACE_VERSIONS = {"barycenter": 8, "diff-cppn": 5, "implicit": 5, "particle": 5, "sdf-lerp": 8, "voxel": 5}
_BODY_VERSIONS = {
    "arm": 1, "baby-seal": 4, "block": 3, "caterpillar": 3, "cloud": 5, "clownfish": 9, "fish": 8, "gripper": 1,
    "mesh": 4, "orca": 11, "panda": 4, "shark": 9, "stored": 1, "tuna": 9,
}  # fmt: skip
"""Versions of the fixed bodies for which the versions of the spaces above were set."""
every_space = pytest.mark.parametrize("name", SPACES)
PARTIAL = ["voxel[optimise=geometry]", "implicit[optimise=muscles]", "sdf-lerp[optimise=stiffness]"]
"""Spaces with one part optimised; `test_parts.py` has all combinations."""
every_part = pytest.mark.parametrize("name", [*SPACES, *PARTIAL])
DEAR = "barycenter"
"""Its map is a transport, which is tested alone in `test_barycenter.py`, and its gradient in `test_mixture.py`."""
every_cheap_space, every_cheap_part = (
    pytest.mark.parametrize(
        "name", [pytest.param(name, marks=pytest.mark.slow if name == DEAR else ()) for name in names]
    )
    for names in (SPACES, [*SPACES, *PARTIAL])
)
every_workspace = pytest.mark.parametrize(
    ("name", "params"),
    [
        pytest.param(name, params, id="-".join([name, *params.values()]))
        for name in SPACES
        # some spaces live in the workspace of a fixed design, some in one of their own
        for params in (
            [{"base": "block"}, {"base": "caterpillar"}]
            if "base" in registry.get(Kind.DESIGN, name).parameters
            else [{}]
        )
    ]
    + [pytest.param(name, {}, id=name) for name in PARTIAL],
)
every_fidelity = pytest.mark.parametrize(
    "fidelity", [SMOKE, pytest.param(DRAFT, marks=pytest.mark.slow)], ids=["smoke", "draft"]
)


def made(name: str, **params: str) -> DesignSpace:
    """A registered space, which may have settings in its name."""
    space = registry.create(Kind.DESIGN, Ref.parse(name).with_defaults(**params))
    assert isinstance(space, DesignSpace)
    return space


def draws(space: DesignSpace, body: Body, count: int) -> torch.Tensor:
    """Draws from the prior `[count, parameter_count]`, with gradients."""
    rows = [space.initial(np.random.default_rng(seed), body) for seed in range(count)]
    return torch.tensor(np.array(rows), requires_grad=True)


def parts(form: Form) -> tuple[torch.Tensor, ...]:
    """All tensors of a form."""
    return form.occupancy, form.stiffness, form.muscle_membership, form.fibres


@every_workspace
@every_fidelity
def test_a_form_has_its_shapes_and_ranges(name: str, params: dict[str, str], fidelity: Fidelity) -> None:
    """Double precision, occupancy and stiffness in range, shares with sum 1, unit fibres."""
    space = made(name, **params)
    body = space.body(fidelity)
    assert body.malleable
    parameters = draws(space, body, 3)
    assert parameters.shape == (3, space.parameter_count(body))
    form = space.form(parameters, body)
    assert form.occupancy.shape == form.stiffness.shape == (3, body.particle_count)
    assert form.muscle_membership.shape == (3, body.particle_count, body.muscle_count)
    assert form.fibres.shape == (3, body.particle_count, 3)
    assert all(part.dtype == torch.float64 and part.isfinite().all() for part in parts(form))
    occupancy, stiffness, membership, fibres = (part.detach().numpy() for part in parts(form))
    assert 0.0 <= occupancy.min() <= occupancy.max() <= 1.0
    assert LEAST_STIFFNESS <= stiffness.min() <= stiffness.max() <= 1.0
    assert (membership >= 0.0).all()
    np.testing.assert_allclose(membership.sum(axis=2), 1.0, atol=1e-12)
    np.testing.assert_allclose(np.linalg.norm(fibres, axis=2), 1.0, atol=1e-12)


@every_workspace
@every_fidelity
def test_a_draw_from_the_prior_is_feasible(name: str, params: dict[str, str], fidelity: Fidelity) -> None:
    """Most draws can be built and keep most of their matter, and muscles differ, as bending requires."""
    space = made(name, **params)
    body = space.body(fidelity)
    form, reports = feasible(space.form(draws(space, body, 8), body), body, connected=False)
    assert sum(not report.fault for report in reports) >= 6
    assert np.median([report.mass_kept for report in reports]) > 0.7
    assert form.muscle_membership.std(dim=1).mean() > 0.1


@pytest.mark.parametrize("name", BASED_SPACES)
def test_draws_have_few_or_all_sites(name: str) -> None:
    """Shares of solid matter from about 0.3 to 1, in shapes: a solid site has mostly solid neighbours."""
    space = made(name)
    body = space.body(DRAFT)
    solid = (space.form(draws(space, body, 24), body).occupancy > 0.5).numpy()
    shares = solid.mean(axis=1)
    assert shares.min() < 0.45
    assert shares.max() > 0.85
    pairs = KDTree(body.positions).query_pairs(1.1 * np.cbrt(body.volumes.mean()), output_type="ndarray")
    alike = (solid[:, pairs[:, 0]] == solid[:, pairs[:, 1]]).mean()
    assert alike > 0.8, "independent sites agree in about 0.55 of the pairs"


@pytest.mark.parametrize(
    "name",
    # all begin with parameters of one size; 200 gradients of a transport take a minute, of the others a second
    [pytest.param(name, marks=() if name == "voxel" else pytest.mark.slow) for name in SPACES],
)
def test_the_published_settings_can_change_geometry(name: str) -> None:
    """100 steps of Adam at a rate of 0.01 fill or empty at least a fifth of the matter that a draw has.

    With logits two or four from the threshold, as in version 1, no site changed.
    """
    space = made(name)
    body = space.body(SMOKE)
    start = draws(space, body, 1).detach()
    solid = space.form(start, body).occupancy.numpy() > 0.5
    changed = np.zeros_like(solid)
    for sign in (1.0, -1.0):
        parameters = start.clone().requires_grad_()
        descent = torch.optim.Adam([parameters], lr=0.01)
        for _ in range(100):
            (parameters.grad,) = torch.autograd.grad(sign * space.form(parameters, body).occupancy.sum(), parameters)
            descent.step()
        changed |= (space.form(parameters, body).occupancy.detach().numpy() > 0.5) != solid
    assert changed.sum() >= 0.2 * solid.sum()


@every_cheap_part
def test_gradients_agree_with_differences(name: str) -> None:
    """Of all outputs, in random directions, against central differences."""
    space = made(name)
    body = space.body(TINY)
    start = draws(space, body, 2).detach()
    directions = torch.as_tensor(np.random.default_rng(9).normal(size=(5, *start.shape)))

    def varied(steps: torch.Tensor) -> tuple[torch.Tensor, ...]:
        form = space.form(start + torch.einsum("d,dwp->wp", steps, directions), body)
        return tuple(part for part in parts(form) if part.requires_grad)

    steps = torch.zeros(5, dtype=torch.float64, requires_grad=True)
    assert len(varied(steps)) >= (3 if name in SPACES else 1)
    assert torch.autograd.gradcheck(varied, steps, eps=1e-6, atol=1e-7, rtol=1e-6, fast_mode=True)


@every_cheap_space
def test_gradients_reach_empty_places_by_the_surface(name: str) -> None:
    """Next to the remaining matter, empty particles have a gradient."""
    space = made(name)
    body = space.body(SMOKE)
    parameters = draws(space, body, 1)
    wanted = torch.as_tensor(np.where(body.positions[:, 0] > 0.0, 0.2, 0.9))
    descent = torch.optim.Adam([parameters], lr=0.1)
    # a few coefficients cannot take matter away where one likes: forms between primitives have empty places as they are
    for _ in range(60 if "base" in registry.get(Kind.DESIGN, name).parameters else 0):
        missing = space.form(parameters, body).occupancy[0] - wanted
        (parameters.grad,) = torch.autograd.grad((missing**2).sum(), parameters)
        descent.step()
    raw = space.form(parameters, body)
    form, _ = feasible(raw, body, connected=True)
    solid = raw.occupancy[0].detach().numpy() > 0.5
    # animals share the tip of the snout, about which no coefficient changes anything
    differs = np.ptp(space.form(draws(space, body, 3), body).occupancy.detach().numpy(), axis=0) > 1e-9
    near = KDTree(body.positions[solid]).query(body.positions)[0] < 1.1 * body.edge
    surface = np.flatnonzero(near & ~solid & differs)
    assert len(surface) > 3
    for particle in surface[:: max(1, len(surface) // 12)]:  # a dozen, evenly spread: each takes a backward pass
        (gradient,) = torch.autograd.grad(form.occupancy[0, particle], parameters, retain_graph=True)
        assert gradient.abs().max() > 1e-5


@every_cheap_part
def test_worlds_do_not_depend_on_each_other(name: str) -> None:
    """Forms and gradients of a batch are those of each world alone, bit for bit."""
    space = made(name)
    body = space.body(SMOKE)
    together = draws(space, body, 3)
    rng = np.random.default_rng(4)
    pulls = [torch.as_tensor(rng.normal(size=part.shape[1:])) for part in parts(space.form(together, body))]

    def gradient(parameters: torch.Tensor) -> torch.Tensor:
        values = zip(parts(space.form(parameters, body)), pulls, strict=True)
        return torch.autograd.grad(sum((part * pull).sum() for part, pull in values), parameters)[0]

    slopes = gradient(together)
    for world in range(3):
        alone = together[world : world + 1].detach().clone().requires_grad_()
        for whole, one in zip(parts(space.form(together, body)), parts(space.form(alone, body)), strict=True):
            assert torch.equal(whole[world], one[0])
        assert torch.equal(slopes[world], gradient(alone)[0])


@every_part
def test_the_prior_is_a_function_of_the_generator(name: str) -> None:
    """Equal seeds give equal draws and forms; other seeds do not."""
    space = made(name)
    body = space.body(SMOKE)
    first, again, other = (space.initial(np.random.default_rng(seed), body) for seed in (1, 1, 2))
    np.testing.assert_array_equal(first, again)
    assert (first != other).mean() > 0.5
    forms = [space.form(torch.as_tensor(row[None]), body) for row in (first, again)]
    assert all(torch.equal(one, two) for one, two in zip(*map(parts, forms), strict=True))


@every_part
def test_a_space_is_no_base(name: str) -> None:
    """The message names a base to give."""
    with pytest.raises(UsageError, match=r"is a design space.*base=block"):
        made("particle", base=name)


def test_a_space_has_a_version_for_its_bodies() -> None:
    """The settings of a space name a body without its version: where a body has a new one, so have all spaces."""
    versions = {name: registry.get(Kind.DESIGN, name).version for name in registry.names(Kind.DESIGN)}
    fixed = {name: version for name, version in versions.items() if name not in SPACES}
    assert {name: versions[name] for name in SPACES} == _SPACE_VERSIONS, "Write both versions anew."
    assert fixed == _BODY_VERSIONS, "Give every space the next version, and write both anew."


@every_space
def test_a_space_with_sites_has_the_tag(name: str) -> None:
    """Methods that paint bodies select spaces by the tag and by the protocol."""
    assert isinstance(made(name), SiteSpace) == (name in SITE_SPACES)


@pytest.mark.parametrize("name", SITE_SPACES)
@pytest.mark.parametrize("fidelity", [SMOKE, DRAFT], ids=["smoke", "draft"])
def test_a_body_has_the_patterns_that_are_painted_on_it(name: str, fidelity: Fidelity) -> None:
    """Full and firm ahead, empty and soft behind, and one muscle above another, for all particles but those whose
    voxel reaches across the middle."""
    space = made(name)
    assert isinstance(space, SiteSpace)
    body = space.body(fidelity)
    sites = space.sites(body)
    assert sites.shape == (space.parameter_count(body) // (2 + body.muscle_count), 7)
    assert np.abs(sites[:, :3]).max() < 1.0
    np.testing.assert_allclose(sites[:, 3:6] ** 2, sites[:, [0, 0, 1]] ** 2 + sites[:, [1, 2, 2]] ** 2)
    np.testing.assert_allclose(sites[:, 6], np.linalg.norm(sites[:, :3], axis=1))
    patterns = np.zeros((len(sites), 3 + body.muscle_count))
    patterns[:, 0] = patterns[:, 2] = np.tanh(50.0 * sites[:, 0])
    patterns[:, 1] = -0.25
    patterns[:, 3], patterns[:, 4] = 50.0 * sites[:, 1], -50.0 * sites[:, 1]
    form = space.form(torch.as_tensor(space.painted(patterns))[None], body)
    middle = (body.positions.min(axis=0) + body.positions.max(axis=0)) / 2
    x, y, _ = (body.positions - middle).T
    occupancy, stiffness = form.occupancy[0].numpy(), form.stiffness[0].numpy()
    shares = form.muscle_membership[0].numpy()
    assert occupancy[x > 0.0125].min() > 0.9 > 0.1 > occupancy[x < -0.0125].max()
    assert stiffness[x > 0.0125].min() > 0.9 > 0.3 > stiffness[x < -0.0125].max()
    assert (shares[y > 0.0125].argmax(axis=1) == 0).all()
    assert (shares[y < -0.0125].argmax(axis=1) == 1).all()


@pytest.mark.parametrize("name", SITE_SPACES)
@pytest.mark.parametrize(("share", "solid"), [(-9.0, 0.2), (-1.0, 0.2), (0.0, 0.6), (0.5, 0.8), (1.0, 1.0), (9.0, 1.0)])
@pytest.mark.parametrize("pattern", [np.abs, np.exp, np.log, lambda x: -np.abs(x), lambda x: 1e300 * x])
def test_solid_are_the_highest_sites_of_a_pattern(
    name: str, share: float, solid: float, pattern: Callable[[Array], Array]
) -> None:
    """As many as the share says, also where the pattern is nowhere negative or without bound."""
    space = made(name)
    assert isinstance(space, SiteSpace)
    body = space.body(SMOKE)
    radius = space.sites(body)[:, 6] + 1e-6 * np.arange(len(space.sites(body)))  # none as far as another
    patterns = np.zeros((len(radius), 3 + body.muscle_count))
    patterns[:, 0], patterns[:, 1] = pattern(radius), share
    numbers = space.painted(patterns).reshape(len(radius), -1)[:, 0]
    assert np.isfinite(numbers).all()
    assert (numbers > 0.0).mean() == pytest.approx(solid, abs=1.5 / len(radius))
    assert patterns[numbers > 0.0, 0].min() > patterns[numbers <= 0.0, 0].max(initial=-np.inf)


@pytest.mark.parametrize("name", SITE_SPACES)
def test_a_blank_pattern_is_solid(name: str) -> None:
    """Full occupancy, the prior's mean of stiffness, and equal shares of all muscles."""
    space = made(name)
    assert isinstance(space, SiteSpace)
    body = space.body(SMOKE)
    blank = space.painted(np.zeros((len(space.sites(body)), 3 + body.muscle_count))).reshape(-1, 2 + body.muscle_count)
    drawn = draws(space, body, 50).detach().numpy().reshape(-1, 2 + body.muscle_count)
    assert (blank[:, 0] > 0.0).all()
    np.testing.assert_allclose(blank[:, 1], drawn[:, 1].mean(), atol=0.05)
    assert not blank[:, 2:].any()
