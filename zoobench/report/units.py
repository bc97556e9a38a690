"""Numbers in another unit: the same one with a prefix of the SI."""

from collections.abc import Iterable
from dataclasses import replace

from zoobench.errors import UsageError
from zoobench.tasks.quantities import Quantity

_PREFIXES = {"n": 1e-9, "u": 1e-6, "µ": 1e-6, "m": 1e-3, "c": 1e-2, "d": 1e-1, "k": 1e3, "M": 1e6}


def conversion(unit: str, wanted: str) -> float | None:
    """Factor from one unit to another, such as `mm/s` for `m/s`; None where there is none."""
    if unit == wanted:
        return 1.0
    found = [1.0 / scale for prefix, scale in _PREFIXES.items() if wanted == f"{prefix}{unit}"]
    back = [scale for prefix, scale in _PREFIXES.items() if unit == f"{prefix}{wanted}"]
    return next(iter(found + back), None) if unit and wanted else None


def in_units(quantity: Quantity, wanted: Iterable[str]) -> tuple[Quantity, float]:
    """The quantity in the first wanted unit that fits, with the factor of its numbers; unchanged if none does."""
    for unit in wanted:
        if (factor := conversion(quantity.unit, unit)) is not None:
            return replace(quantity, unit=unit), factor
    return quantity, 1.0


def check_units(wanted: tuple[str, ...], units: set[str]) -> None:
    """Check that each wanted unit fits a shown quantity.

    Raises:
        UsageError: one is not.
    """
    for unit in wanted:
        if not any(conversion(own, unit) for own in units):
            known = ", ".join(sorted(filter(None, units))) or "none"
            raise UsageError(f"Nothing here can be shown in {unit!r}. The units are {known}; give mm/s for m/s.")
