"""Spaces that optimise parts of a body: the others stay the base's, and have no parameters."""

from dataclasses import fields

import numpy as np
import pytest
import torch

from zoobench import registry
from zoobench.designs.base import Body
from zoobench.designs.mixture import Mixture
from zoobench.designs.space import DesignSpace, SiteSpace
from zoobench.errors import UsageError
from zoobench.registry import Kind
from zoobench.sim.model.fidelity import Fidelity
from zoobench.spec import Ref

SPACES = [name for name in registry.names(Kind.DESIGN) if "space" in registry.get(Kind.DESIGN, name).tags]
BASED = [name for name in SPACES if "base" in registry.get(Kind.DESIGN, name).parameters]
MIXED = [name for name in SPACES if name not in BASED]
PARTS = ("geometry", "stiffness", "muscles")
COMBINATIONS = [*PARTS, "geometry+stiffness", "geometry+muscles", "stiffness+muscles", "+".join(PARTS)]
GRID = Fidelity(1 / 32)


def made(text: str) -> tuple[DesignSpace, Body]:
    """A space and its workspace."""
    space: DesignSpace = registry.create(Kind.DESIGN, Ref.parse(text))
    return space, space.body(GRID)


@pytest.mark.parametrize("parts", COMBINATIONS)
@pytest.mark.parametrize("name", [name for name in SPACES if name != "barycenter"])  # slow, and as the other mixture
def test_only_what_is_optimised_varies_with_the_parameters(name: str, parts: str) -> None:
    """Each part that is named depends on the parameters, every one of which matters, and no other part does."""
    space, body = made(f"{name}[optimise={parts}]")
    draw = torch.tensor(space.initial(np.random.default_rng(0), body)[None], requires_grad=True)
    assert draw.shape == (1, space.parameter_count(body))
    form = space.form(draw, body)
    varied = (form.occupancy, form.stiffness, form.muscle_membership)
    assert [part for part, array in zip(PARTS, varied, strict=True) if array.requires_grad] == parts.split("+")
    rng = np.random.default_rng(1)
    pull = sum((array * torch.as_tensor(rng.normal(size=array.shape))).sum() for array in varied)
    (gradient,) = torch.autograd.grad(pull, draw)
    assert (gradient != 0.0).all()


@pytest.mark.parametrize("name", SPACES)
def test_parts_have_the_parameters_of_the_whole_between_them(name: str) -> None:
    """What a network shares between its outputs belongs to each of them."""
    counts = {parts: made(f"{name}[optimise={parts}]")[0] for parts in COMBINATIONS}
    body = made(name)[1]
    sizes = {parts: space.parameter_count(body) for parts, space in counts.items()}
    shared = getattr(getattr(counts["geometry"], "network", None), "hidden_count", 0)
    assert sum(sizes[part] - shared for part in PARTS) == sizes["+".join(PARTS)] - shared
    assert sizes["geometry"] == sizes["stiffness"] < sizes["geometry+stiffness"] <= sizes["geometry+muscles"]


@pytest.mark.parametrize("name", BASED)
@pytest.mark.parametrize("base", ["fish", "panda"])
def test_where_only_geometry_varies_the_rest_is_the_base_itself(name: str, base: str) -> None:
    """Its stiff parts, passive tissue and directions of contraction, which other spaces replace."""
    space, body = made(f"{name}[base={base},optimise=geometry]")
    given: Body = registry.create(Kind.DESIGN, Ref(base)).body(GRID)
    for item in fields(Body):
        if item.name != "malleable":
            np.testing.assert_array_equal(getattr(body, item.name), getattr(given, item.name), err_msg=item.name)
    form = space.form(torch.as_tensor(space.initial(np.random.default_rng(0), body)[None]), body)
    matter = form.matter(body)
    assert given.stiffness.std() > 0.0
    assert torch.equal(matter["stiffness"][0], torch.as_tensor(given.stiffness) * form.occupancy[0] ** 2)
    assert torch.equal(form.muscle_membership[0], torch.as_tensor(given.muscle_membership))
    assert torch.equal(form.fibres[0], torch.as_tensor(given.fibres))


@pytest.mark.slow
@pytest.mark.parametrize("name", MIXED)
def test_a_mixture_without_a_part_has_that_of_the_first_animal(name: str) -> None:
    """As the mixture has it whose coefficients leave nothing to the others."""
    space, body = made(f"{name}[primitives=shark+orca,optimise=stiffness]")
    assert isinstance(space, Mixture)
    whole, _ = made(f"{name}[primitives=shark+orca]")
    form = space.form(torch.zeros(1, 2, dtype=torch.float64), body)
    pure = whole.form(torch.tensor([[50.0, -50.0, 0.0, 0.0, 50.0, -50.0]], dtype=torch.float64), body)
    for part in ("occupancy", "stiffness", "muscle_membership", "fibres"):
        torch.testing.assert_close(getattr(form, part), getattr(pure, part), rtol=0.0, atol=1e-9)


@pytest.mark.parametrize("name", BASED)
def test_a_draw_of_a_part_is_that_of_the_whole(name: str) -> None:
    """With the same generator, so that studies of parts begin where those of the whole do."""
    (part, body), (whole, _) = made(f"{name}[optimise=geometry]"), made(name)
    drawn = [space.initial(np.random.default_rng(4), body) for space in (part, whole)]
    forms = [space.form(torch.as_tensor(row[None]), body) for space, row in zip((part, whole), drawn, strict=True)]
    torch.testing.assert_close(forms[0].occupancy, forms[1].occupancy, rtol=0.0, atol=1e-12)


@pytest.mark.parametrize("name", ["particle", "voxel"])
@pytest.mark.parametrize("parts", COMBINATIONS)
def test_patterns_paint_only_what_is_optimised(name: str, parts: str) -> None:
    """The parameters fit, and what they give is what the whole space gives for the same patterns."""
    space, body = made(f"{name}[optimise={parts}]")
    assert isinstance(space, SiteSpace)
    whole, _ = made(name)
    assert isinstance(whole, SiteSpace)
    patterns = np.random.default_rng(2).normal(size=(len(space.sites(body)), 3 + body.muscle_count))
    painted = space.painted(patterns)
    assert painted.shape == (space.parameter_count(body),)
    form, every = (
        each.form(torch.as_tensor(params[None]), body)
        for each, params in ((space, painted), (whole, whole.painted(patterns)))
    )
    for part, array in zip(PARTS, ("occupancy", "stiffness", "muscle_membership"), strict=True):
        assert torch.equal(getattr(form, array), getattr(every, array)) == (part in parts)


@pytest.mark.parametrize("parts", ["colour", "muscles+geometry", "geometry+geometry"])
def test_other_parts_are_refused(parts: str) -> None:
    """The message has what is offered, each choice written in one way, so that a run has one key."""
    with pytest.raises(UsageError, match=r"not offered. Choose one of geometry\+stiffness\+muscles"):
        made(f"voxel[optimise={parts}]")
