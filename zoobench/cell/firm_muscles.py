"""Muscles in matter that is too soft for them.

A muscle that pushes takes from the stiffness along its fibre: matter with k times the shear modulus mu has k mu - T
there (`sim.model.laws.elastic`), and lengthens without bound under a tension T above k mu. So matter that is too soft
for the full strength of its muscles has them in proportion to its stiffness.
"""

from dataclasses import replace
from typing import TYPE_CHECKING, TypeVar

from zoobench.arrays import Array
from zoobench.designs.base import Body
from zoobench.designs.space import Form
from zoobench.sim.model.laws.elastic import ElasticMaterial

if TYPE_CHECKING:
    from torch import Tensor

MOST_ACTIVE = 0.75
"""Largest tension of muscles by the shear modulus of their matter [-]: a free fibre that pushes so reaches 1.8 times
its length, and with muscles of 0.3 E, as published, matter of full stiffness has them whole."""

_TINY = 1e-12
_T = TypeVar("_T", "Tensor", Array)


def firmness(material: ElasticMaterial) -> float:
    """Least stiffness relative to this material of matter that has its muscles in full strength [-].

    It is 1 at most: what the environment's material itself is asked to bear it bears.
    """
    return min(1.0, material.muscle_strength / (MOST_ACTIVE * material.mu))


def firm_form(form: Form, workspace: Body, material: ElasticMaterial) -> Form:
    """A form in a workspace with the muscles that its matter bears."""
    import torch

    stiffness = form.stiffness * torch.as_tensor(workspace.stiffness)
    return replace(form, muscle_membership=form.muscle_membership * _borne(form.muscle_membership, stiffness, material))


def firm_body(body: Body, material: ElasticMaterial) -> Body:
    """A fixed body with the muscles that its matter bears; itself where that is all of them."""
    borne = _borne(body.muscle_membership, body.stiffness, material)
    return body if borne.min() == 1.0 else replace(body, muscle_membership=body.muscle_membership * borne)


def _borne(membership: _T, stiffness: _T, material: ElasticMaterial) -> _T:
    """Share of its muscles `[..., particle_count, 1]` that matter of this stiffness `[..., particle_count]` bears."""
    needed = firmness(material) * membership.sum(-1)
    borne: _T = (stiffness / needed.clip(min=_TINY)).clip(max=1.0)[..., None]
    return borne
