"""Readings of swimming: how the body swings while it moves through water."""

import math
from typing import TYPE_CHECKING

from zoobench.tasks.base import Motion

if TYPE_CHECKING:
    from torch import Tensor

_SLICES = 10
"""Slices of the body at rest, along its length, whose centres are followed."""

_FASTEST = 20.0
"""Largest frequency that is looked for [Hz]; a control frame is a sixth of its period."""

_LEAST_SPEED = 1e-6
"""[m/s], so that a body that swings on the spot has a Strouhal number."""


_STILL = 1e-9
"""[m] below which a tail does not swing."""

_UNITS = {
    "beat_frequency": "Hz", "tail_amplitude": "m", "head_amplitude": "m", "wave_phase": "rad", "strouhal_number": "1"
}  # fmt: skip


def swimming_readings(motion: Motion) -> "dict[str, tuple[Tensor, str]]":
    """Readings over the second half of an episode, `[worlds]` each with its unit.

    * `beat_frequency`: at which the body swings most, sideways or up and down.
    * `tail_amplitude`, `head_amplitude`: of the hindmost and the foremost tenth of the body about its path, at that
      frequency.
    * `wave_phase`: by which the tail lags behind the head, the lags from tenth to tenth added up: 2 pi for one wave
      along the body, negative for a wave from tail to head. Of a body that swings as a whole it is near 0, and of a
      standing wave a multiple of pi.
    * `strouhal_number`: frequency times twice the tail's amplitude by the speed (Triantafyllou et al. 1993).

    All are 0 where the half is shorter than two periods of the fastest beat, or nothing moves.
    """
    import torch

    half = len(motion.positions) // 2
    seconds = (len(motion.positions) - 1 - half) * motion.frame_seconds
    swings, speed = _swings(motion, half)
    if _FASTEST * seconds <= 2.0:
        zero = swings.new_zeros(swings.shape[1])
        return {name: (zero, unit) for name, unit in _UNITS.items()}
    frequencies = torch.arange(2.0 / seconds, _FASTEST, 0.125 / seconds, dtype=swings.dtype)
    spectrum = _spectrum(swings, frequencies, motion.frame_seconds)  # [frequencies, worlds, slices, planes]
    power = (spectrum.abs() ** 2).sum(dim=2).permute(1, 0, 2).flatten(1)
    best = power.argmax(dim=1)
    frequency, plane = frequencies[best // 2], best % 2
    worlds = torch.arange(swings.shape[1])
    wave = spectrum[best // 2, worlds, :, plane]  # [worlds, slices]
    lags = -torch.angle(wave[:, 1:] * wave[:, :-1].conj()).sum(dim=1)
    tail, head = wave[:, -1].abs(), wave[:, 0].abs()
    moves = tail > _STILL
    strouhal = 2.0 * tail * frequency / speed.clamp(min=_LEAST_SPEED)
    values = (frequency, tail, head, lags, strouhal)
    return {
        name: (torch.where(moves, value, 0.0), unit) for (name, unit), value in zip(_UNITS.items(), values, strict=True)
    }


def _swings(motion: Motion, start: int) -> "tuple[Tensor, Tensor]":
    """Places of the slices from the foremost on, to the side of the body's path and above it
    `[states, worlds, slices, 2]` [m], from the state `start` on, and the horizontal speed meanwhile `[worlds]` [m/s].
    """
    import torch

    along = motion.rest[:, 0]
    share = (along.max() - along) / (along.max() - along.min()).clamp(min=1e-12)
    number = (share * _SLICES).long().clamp(max=_SLICES - 1)
    places = []
    for n in range(_SLICES):
        own = number == n
        masses = motion.masses[:, own]
        if own.any() and (masses.sum(dim=1) > 0.0).all():
            weights = masses / masses.sum(dim=1, keepdim=True)
            places.append((motion.positions[start:, :, own] * weights[None, :, :, None]).sum(dim=2))
    centre = motion.centre_of_mass()[start:]
    offsets = torch.stack(places, dim=2) - centre[:, :, None]
    length = (offsets[:, :, 0] - offsets[:, :, -1]).mean(dim=0)
    level = torch.sqrt(length[:, 0] ** 2 + length[:, 2] ** 2).clamp(min=1e-12)
    ahead_x, ahead_z = (length[:, 0] / level)[:, None], (length[:, 2] / level)[:, None]
    side = offsets[..., 2] * ahead_x - offsets[..., 0] * ahead_z
    way = centre[-1] - centre[0]
    speed = torch.sqrt(way[:, 0] ** 2 + way[:, 2] ** 2) / ((len(centre) - 1) * motion.frame_seconds)
    return torch.stack([side, offsets[..., 1]], dim=-1), speed


def _spectrum(signals: "Tensor", frequencies: "Tensor", frame_seconds: float) -> "Tensor":
    """Complex amplitudes `[frequencies, ...]` of signals `[states, ...]`, under a Hann window, which leaves trends out.

    A signal a cos(w t - p) has the amplitude a exp(-i p) at w.
    """
    import torch

    count = len(signals)
    steps = torch.arange(count, dtype=signals.dtype)
    window = torch.sin(math.pi * (steps + 0.5) / count) ** 2
    window = (window / window.sum()).reshape(-1, *[1] * (signals.dim() - 1))
    varying = window * (signals - (window * signals).sum(dim=0))
    found = []
    for frequency in frequencies.tolist():
        angles = (2.0 * math.pi * frequency * frame_seconds * steps).reshape(window.shape)
        real, imaginary = ((turn(angles) * varying).sum(dim=0) for turn in (torch.cos, torch.sin))
        found.append(torch.complex(2.0 * real, -2.0 * imaginary))
    return torch.stack(found)
