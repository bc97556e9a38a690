"""Where a body's muscles are, for controllers whose activity depends on it."""

import numpy as np

from zoobench.controllers.base import Controller, MusclePlaces, Placed
from zoobench.designs.base import Body
from zoobench.designs.mixture import Mixture
from zoobench.errors import UsageError

_UPRIGHT = 1.01
"""Ratio of moments from which a body is one that bends up and down: one that is square bends sideways."""

_LEAST_SIDE = 1e-3


def muscle_places(body: Body) -> MusclePlaces:
    """The places of a body's muscles at rest.

    The moment of a muscle about the body's centre is that of its active stress, the integral of f_x^2 z over its volume
    sideways, or of f_x^2 y up and down, with the fibre's direction f; its side is the moment by the integral of |z|.
    The plane is that with the larger sum of squared moments, that of the front half times that of the hind, as a wave
    runs through both; of all muscles, where in neither plane both have some. Channels of a base, which contract
    nothing, are in the middle of the body and bend it to no side.

    Raises:
        UsageError: no muscle bends the body.
    """
    matter = body.volumes * body.occupancy
    offset = body.positions - (matter[:, None] * body.positions).sum(axis=0) / matter.sum()
    shares = matter[:, None] * body.muscle_membership  # [particles, muscles]
    volumes = np.maximum(shares.sum(axis=0), 1e-30)
    along = body.fibres[:, 0] ** 2
    moments, arms = np.zeros((2, body.muscle_count)), np.zeros((2, body.muscle_count))
    for row, axis in enumerate((2, 1)):
        moments[row] = (shares * (along * offset[:, axis])[:, None]).sum(axis=0)
        arms[row] = (shares * np.abs(offset[:, axis])[:, None]).sum(axis=0)
    low, high = body.box
    centres = (shares * body.positions[:, :1]).sum(axis=0) / volumes
    centres[body.muscle_count - body.base_channels :] = (low[0] + high[0]) / 2
    back = (high[0] - centres) / (high[0] - low[0])
    front, hind = ((moments**2 * half).sum(axis=1) for half in (back <= 0.5, back > 0.5))
    sideways, upright = front * hind if (front * hind).any() else front + hind
    sides = moments / np.maximum(arms, 1e-30)
    side = sides[int(upright > _UPRIGHT * sideways)]
    if np.abs(side).max(initial=0.0) < _LEAST_SIDE:
        raise UsageError(
            f"None of the {body.muscle_count - body.base_channels} muscles bends this body to a side, so no wave of "
            "bending can run along it. Choose another controller, such as sine-basis, or a body with muscles left and "
            "right."
        )
    return MusclePlaces(back=back, side=side, right=sides[0], up=sides[1])


def placed_on(body: Body, controller: Controller, design: object = None) -> Controller:
    """The controller for this body of a design; the same one if it does not depend on the muscles' places."""
    if not isinstance(controller, Placed):
        return controller
    return controller.placed(muscle_places(design.with_muscles(body) if isinstance(design, Mixture) else body))
