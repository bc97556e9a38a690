"""Forms from fields of numbers, one row for each particle, and the common prior of the design spaces.

A row holds numbers for occupancy, stiffness and every muscle, all unbounded, without those of parts that are not
optimised. The design spaces H.1 to H.4 of SoftZoo's paper are such fields with different parameters.
"""

from collections.abc import Callable
from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np

from zoobench.arrays import Array
from zoobench.designs.base import Body
from zoobench.designs.parts import Optimised, columns_of, parts_of
from zoobench.designs.space import Form, stiffness_multiplier

if TYPE_CHECKING:
    from torch import Tensor

Field = Callable[["Tensor"], "Tensor"]
"""Maps parameters of one world `[parameter_count]` to rows of all particles `[particle_count, width]`."""

SHARES = (0.4, 1.0)
"""Range of the prior's share of sites that are solid, uniform."""

SPREAD = 0.5
"""Standard deviation over the sites of the prior's numbers for occupancy. A site is solid where its number is positive,
so that most sites can change within 100 steps of 0.01."""

FIRM, FIRM_SPREAD = 0.4, 0.2
"""Mean and standard deviation of the prior's numbers for stiffness: a multiplier of 0.7, from 0.5 to 0.85."""

_OCCUPANCY_GAIN = 4.0  # before the sigmoid: an occupancy of 0.98 at 1
_STIFFNESS_GAIN = 2.0  # before the sigmoid: multipliers of 0.16 to 0.89 from -1 to 1
_MUSCLE_GAIN = 4.0  # before the softmax: a muscle has a share of 7/8 among eight where its number is greater by 1

_WAVES = 16  # in the prior's field
_WAVE_NUMBER = 2.0  # its standard deviation [1 / half extent of the workspace]: a leg or a neck or two along each axis

_PATTERN_SHARES = (0.2, 1.0)  # of sites that are solid, for a mean pattern of -1 and of 1
_LIFT = 1e-9  # of occupancy, so that the site at the level itself is solid, and so is a constant pattern


def width_of(optimised: Optimised, body: Body) -> int:
    """Length of a row."""
    return len(columns_of(optimised, body.muscle_count))


def grow(parameters: "Tensor", body: Body, optimised: Optimised, field: Field) -> Form:
    """The forms of a field for `parameters` `[worlds, parameter_count]`; parts not optimised are the workspace's.

    Each world is computed by itself from its own copy: the rounding of sums and sigmoids depends on the width of a
    batch and on its alignment in memory, and a form must not depend on the other worlds.
    """
    import torch

    rows = [field(row.clone()) for row in parameters]
    parts = parts_of(optimised)
    form = Form.filling(body, len(rows))
    if "geometry" in parts:
        form = replace(form, occupancy=torch.stack([torch.sigmoid(_OCCUPANCY_GAIN * row[:, 0]) for row in rows]))
    if "stiffness" in parts:
        column = parts.index("stiffness")
        numbers = [stiffness_multiplier(_STIFFNESS_GAIN * row[:, column]) for row in rows]
        form = replace(form, stiffness=torch.stack(numbers))
    if "muscles" in parts:
        first = parts.index("muscles")
        shares = [torch.softmax(_MUSCLE_GAIN * row[:, first:], dim=1) for row in rows]
        form = replace(form, muscle_membership=torch.stack(shares))
    return form


def painted(patterns: Array, optimised: Optimised) -> Array:
    """Rows, as one vector, for patterns `[n, 3 + muscle_count]`: occupancy, share, stiffness, muscles.

    Solid are the sites where the pattern of occupancy is highest, as many as the mean of the share's pattern tells. So
    the level follows the pattern, many of which are nowhere negative, and the share of the sites evolves by itself.
    Numbers for occupancy are those above the level in units of the pattern's deviation; all are clipped to [-1, 1].
    Patterns of 0 are a body of the prior's mean of stiffness and of equal shares of all muscles.
    """
    count = patterns.shape[1] - 3
    share = np.interp(np.clip(patterns[:, 1], -1.0, 1.0).mean(), (-1.0, 1.0), _PATTERN_SHARES)
    largest = np.abs(patterns[:, 0]).max()  # patterns grow without bound, and their deviation must be finite
    occupancy = levelled(patterns[:, 0] / (largest or 1.0), share) / SPREAD + _LIFT
    others = np.array([FIRM, *[0.0] * count]) + np.clip(patterns[:, 2:], -1.0, 1.0)
    rows: Array = np.column_stack([np.clip(occupancy, -1.0, 1.0), others])
    return rows[:, columns_of(optimised, count)].ravel()


def rows_like(membership: Array, places: Array, optimised: Optimised, rng: np.random.Generator) -> Array:
    """A draw of rows, as one vector, for sites with these shares of the base's muscles `[n, muscle_count]`.

    The muscles are mostly the base's; where it has none, their shares are equal but for the noise. An optimised
    field is drawn in the same way whatever else is optimised.

    Args:
        membership: see above.
        places: of the sites in the workspace, from -1 to 1 along each axis `[n, 3]`.
        optimised: the parts that a row has.
        rng: of the draw.
    """
    waves = rng.normal(0.0, _WAVE_NUMBER, (3, _WAVES))
    field = np.cos(places @ waves + rng.uniform(0.0, 2.0 * np.pi, _WAVES)).sum(axis=1)
    stiffness = rng.normal(FIRM, FIRM_SPREAD, len(field))
    muscles = membership + rng.normal(0.0, FIRM_SPREAD, membership.shape)
    rows = np.column_stack([levelled(field, rng.uniform(*SHARES)), stiffness, muscles])
    return rows[:, columns_of(optimised, membership.shape[1])].ravel()


def levelled(field: Array, share: float) -> Array:
    """Numbers for occupancy `[n]` in the shape of a field `[n]`, of which this share is positive."""
    deviation = field.std()
    numbers: Array = SPREAD * (field - np.quantile(field, 1.0 - share)) / (deviation if deviation > 0.0 else 1.0)
    return numbers
