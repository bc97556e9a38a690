"""The whole suite: every family of cases in the order in which they are carried out."""

from collections.abc import Iterable, Iterator
from dataclasses import asdict
from typing import TYPE_CHECKING

from zoobench.db.rows import StudyRow
from zoobench.verify.selection import select

from zoobench.verify.stability.base import Case, Result, registered

# imported for the cases that they register, in this order
from zoobench.verify.stability import (  # isort: skip  # noqa: F401
    particle_cases,
    strains,
    impact,
    contrast,
    muscles,
    domain,
    media_cases,
    water_cases,
    gradient_cases,
    horizon,
    bad_inputs,
)

if TYPE_CHECKING:
    from zoobench.verify.stability.largest import StepRow

STUDY = "stability"
STEP_STUDY = "largest-step"


def suite() -> tuple[Case, ...]:
    """All cases."""
    return registered()


def stability(patterns: Iterable[str] = ("*",), *, fast: bool = False) -> Iterator[Result]:
    """Carry out the cases whose names match, only the fast ones if told so; one result as each is done.

    Raises:
        UnknownNameError: a pattern that matches no case.
        UsageError: only fast ones are asked for, and none that matches is.
    """
    chosen = select(suite(), patterns, noun="stability case", fast=fast)
    return (found.run() for found in chosen)


def stored(row: "Result | StepRow") -> StudyRow:
    """A result as the database keeps it."""
    document = {name: value for name, value in asdict(row).items() if name not in ("case", "verdict")}
    return StudyRow(row.case, row.verdict, document)
