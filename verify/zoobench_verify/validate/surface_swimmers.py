"""Swimmers in water by forces on their surface: how far a beat takes them, and how they swing."""

import numpy as np

from zoobench_verify.cases import CaseRecorder, Shortfall, case
from zoobench_verify.validate.swimmers import Swim, swim

_OCEAN = "ocean[water=surface]"
_SWIMMERS = ("fish", "tuna", "shark", "clownfish", "orca")
_FREQUENCIES = {"draft": (2.0, 3.0, 4.0, 6.0, 8.0), "paper": (2.0, 4.0, 8.0)}


@case("swimmers", "strides of fish: Bainbridge 1958, Videler 1993; Strouhal numbers: Triantafyllou et al. 1993",
      "five animals, 2 to 8 Hz, draft and paper", is_fast=False, precision=32)  # fmt: skip
def swimmers(record: CaseRecorder) -> None:
    """Waves of all muscles drive five animals by as many lengths a beat as real ones, straight ahead."""
    figure = record.plot("Five swimmers", "frequency [Hz]", "lengths a beat [-]")
    for level, frequencies in _FREQUENCIES.items():
        for name in _SWIMMERS:
            swims = [swim(frequency, level=level, name=name, ocean=_OCEAN) for frequency in frequencies]
            for frequency, found in zip(frequencies, swims, strict=True):
                _check(record, found, name, frequency, level)
            figure.computed(f"{name}, {level}", np.array(frequencies), np.array([found.stride for found in swims]))
    for name in _SWIMMERS:
        ahead, turned = (swim(4.0, way, "paper", name, _OCEAN).stride for way in (1.0, -1.0))
        record.within(f"lengths a beat by a wave to the head by that of the other, {name}, paper", turned / ahead, -1.0,
                      1 / 3)  # fmt: skip


_SLOW = 4.0
"""Frequency up to which waves are slow [Hz]."""
_RECOIL = Shortfall("waves of 4 Hz and less swing the head by more of the tail's amplitude than in real fish", 0.9)


def _check(record: CaseRecorder, found: Swim, name: str, frequency: float, level: str) -> None:
    """The bounds of one swimmer at one frequency."""
    which = f"{name}, {frequency:g} Hz, {level}"
    recoil = _RECOIL if frequency <= _SLOW else None
    record.within(f"lengths a beat, {which}", found.stride, 0.3, 0.8)
    record.within(f"Strouhal number, {which}", found.strouhal, 0.2, 0.7)
    record.at_most(f"amplitude of the head by the tail's, {which}", found.head / found.tail, 0.5, shortfall=recoil)
    record.at_most(f"turn, {which}", abs(found.turn), 15.0, "degrees")
    record.at_most(f"pitch, {which}", abs(found.pitch), 15.0, "degrees")
