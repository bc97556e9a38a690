"""Forms from fields of numbers, one row for each particle, and the common prior of the design spaces.

A row holds numbers for occupancy, stiffness and every muscle, all unbounded. The design spaces H.1 to H.4 of the
specification are such fields with different parameters.
"""

from collections.abc import Callable
from typing import TYPE_CHECKING

import numpy as np

from zoobench.arrays import Array
from zoobench.designs.base import Body
from zoobench.designs.space import Form, stiffness_multiplier

if TYPE_CHECKING:
    from torch import Tensor

Field = Callable[["Tensor"], "Tensor"]
"""Maps parameters of one world `[parameter_count]` to rows of all particles `[particle_count, 2 + muscle_count]`."""

FULL, FIRM = 2.2, 0.8
"""Means of the prior's occupancy and stiffness before their sigmoids: an occupancy of 0.9, a multiplier of 0.7."""

SPREAD = 0.35
"""Standard deviation of both: occupancy 0.8 to 0.95 and stiffness 0.5 to 0.85 within two deviations."""

_OCCUPANCY_GAIN = 2.0 * FULL  # of patterns: -1 gives the opposite of the prior's mean
_STIFFNESS_GAIN = 2.0  # of patterns: multipliers of 0.25 to 0.95
_MUSCLE_GAIN = 3.0  # of patterns: in most places one muscle dominates

_OWN_MUSCLE = 4.0  # of a particle's muscle in the base, before the softmax: a share of 7/8 among eight muscles


def width_of(body: Body) -> int:
    """Length of a row."""
    return 2 + body.muscle_count


def grow(parameters: "Tensor", body: Body, field: Field) -> Form:
    """The forms of a field for `parameters` `[worlds, parameter_count]`, with fibres ahead.

    Each world is computed by itself from its own copy: the rounding of sums and sigmoids depends on the width of a
    batch and on its alignment in memory, and a form must not depend on the other worlds.
    """
    import torch

    rows = [field(row.clone()) for row in parameters]
    ahead = parameters.new_tensor([1.0, 0.0, 0.0]).expand(len(rows), body.particle_count, 3)
    return Form(
        occupancy=torch.stack([torch.sigmoid(row[:, 0].contiguous()) for row in rows]),
        stiffness=torch.stack([stiffness_multiplier(row[:, 1].contiguous()) for row in rows]),
        muscle_membership=torch.stack([torch.softmax(row[:, 2:], dim=1) for row in rows]),
        fibres=ahead,
    )


def painted(patterns: Array) -> Array:
    """Rows, as one vector, for patterns `[n, 2 + muscle_count]`, which are clipped to [-1, 1].

    Patterns of 0 give the prior's mean of occupancy and stiffness, and equal shares of all muscles.
    """
    count = patterns.shape[1] - 2
    means = np.array([FULL, FIRM, *[0.0] * count])
    gains = np.array([_OCCUPANCY_GAIN, _STIFFNESS_GAIN, *[_MUSCLE_GAIN] * count])
    rows: Array = (means + gains * np.clip(patterns, -1.0, 1.0)).ravel()
    return rows


def rows_like(membership: Array, rng: np.random.Generator) -> Array:
    """A draw of rows `[n, 2 + muscle_count]` for places with these shares of the base's muscles `[n, muscle_count]`.

    Occupancy is 0.8 to 0.95, stiffness 0.5 to 0.85, and the muscles are mostly the base's; where it has none, their
    shares are equal but for the noise.
    """
    count, muscle_count = membership.shape
    means = np.hstack([np.tile([FULL, FIRM], (count, 1)), _OWN_MUSCLE * membership])
    return means + rng.normal(0.0, SPREAD, (count, 2 + muscle_count))
