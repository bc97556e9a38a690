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
    for name in ("fish", "orca"):
        ahead, turned = (swim(4.0, way, "draft", name, _OCEAN).stride for way in (1.0, -1.0))
        record.within(f"lengths a beat by a wave to the head by that of the other, {name}", turned / ahead, -1.0, 1 / 3,
                      shortfall=Shortfall(_BOTH_WAYS, 0.75))  # fmt: skip


_BOTH_WAYS = "the thrust of Lighthill's theory, m (y_t^2 - U^2 y_x^2) / 2 at the tail, is that of either way"

_FAST = Shortfall(
    "at 6 and 8 Hz a beat takes the bodies farther than most fish; mackerel go a length (Videler 1993)", 1.0
)
_FASTER = {
    ("draft", 6.0): ("fish", "tuna", "clownfish", "orca"),
    ("draft", 8.0): ("fish", "clownfish", "orca"),
    ("paper", 8.0): ("fish",),
}
_RECOIL = Shortfall("slow waves swing the head by more of the tail's amplitude than in real fish", 0.7)
_SWINGING = {("draft", 2.0): ("tuna", "shark", "orca"), ("draft", 3.0): ("shark",), ("paper", 2.0): ("shark",)}


def _check(record: CaseRecorder, found: Swim, name: str, frequency: float, level: str) -> None:
    """The bounds of one swimmer at one frequency."""
    which, place = f"{name}, {frequency:g} Hz, {level}", (level, frequency)
    fast = _FAST if name in _FASTER.get(place, ()) else None
    recoil = _RECOIL if name in _SWINGING.get(place, ()) else None
    record.within(f"lengths a beat, {which}", found.stride, 0.3, 0.8, shortfall=fast)
    record.within(f"Strouhal number, {which}", found.strouhal, 0.2, 0.7)
    record.at_most(f"amplitude of the head by the tail's, {which}", found.head / found.tail, 0.5, shortfall=recoil)
    record.at_most(f"turn, {which}", abs(found.turn), 15.0, "degrees")
    record.at_most(f"pitch, {which}", abs(found.pitch), 15.0, "degrees")
