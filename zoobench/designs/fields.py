"""From the numbers of a field, one row for each particle, to a form; and the priors that the spaces share.

A row is occupancy, stiffness and one number for each muscle, all unbounded. Every space of the specification's H.1 to
H.4 is such a field and differs from the others only in what its parameters are.
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
"""The parameters of one world `[parameter_count]` to the rows of all particles `[particle_count, 2 + muscle_count]`."""

FULL, FIRM = 2.2, 0.8
"""Means of the prior's occupancy and stiffness before their sigmoids: nine tenths full, a multiplier of 0.7."""

SPREAD = 0.35
"""Deviation of both: occupancy 0.8 to 0.95 and stiffness 0.5 to 0.85 within two deviations."""

_CONTRAST = 2.0 * FULL  # of painted occupancy: where a pattern is -1, a body is as empty as it is full elsewhere
_SHADES = 2.0  # of painted stiffness: multipliers of 0.25 to 0.95
_LEAD = 3.0  # of painted muscles: in most places one of them leads

_LOYALTY = 4.0  # lead of a particle's own muscle in the softmax: seven eighths of it among eight


def width_of(body: Body) -> int:
    """Numbers in a row."""
    return 2 + body.muscle_count


def grow(parameters: "Tensor", body: Body, field: Field) -> Form:
    """The forms that a field describes for `parameters` `[worlds, parameter_count]`, with all fibres ahead.

    One world at a time, each from a copy of its own: how sums and sigmoids round depends on the width of a batch and on
    where in memory it starts, and a form must not depend on what is computed beside it.
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
    """Rows, as one vector, for patterns of order one `[n, 2 + muscle_count]`; what is beyond -1 and 1 is cut off.

    Where all patterns are 0, the body is as full and firm as the prior's mean, and belongs to all muscles alike.
    """
    count = patterns.shape[1] - 2
    means = np.array([FULL, FIRM, *[0.0] * count])
    gains = np.array([_CONTRAST, _SHADES, *[_LEAD] * count])
    rows: Array = (means + gains * np.clip(patterns, -1.0, 1.0)).ravel()
    return rows


def rows_like(membership: Array, rng: np.random.Generator) -> Array:
    """A draw of rows `[n, 2 + muscle_count]` for places with these shares `[n, muscle_count]` of the base's muscles.

    Nearly full (0.8 to 0.95), of stiffness 0.5 to 0.85, and loyal to the muscles of the base; where it had none, to all
    alike but for the noise.
    """
    count, muscle_count = membership.shape
    means = np.hstack([np.tile([FULL, FIRM], (count, 1)), _LOYALTY * membership])
    rows: Array = means + rng.normal(0.0, SPREAD, (count, 2 + muscle_count))
    return rows
