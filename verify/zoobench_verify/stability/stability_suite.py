"""All stability cases, and their rows in listings and databases."""

from typing import Any

from zoobench.db.rows import StudyRow
from zoobench_verify.cases import CaseResult, cases_of
from zoobench_verify.stability import (
    bad_inputs,
    contrast,
    domain,
    gradient_cases,
    horizon,
    impact,
    media_cases,
    muscles,
    object_cases,
    particle_cases,
    rest_frame_cases,
    strains,
    swimmer_cases,
)

STUDY = "stability"
STEP_STUDY = "largest-step"

CASES = cases_of(
    particle_cases, strains, impact, contrast, muscles, domain, media_cases, object_cases, swimmer_cases,
    rest_frame_cases, gradient_cases,
    horizon, bad_inputs,
)  # fmt: skip


def row_of(result: CaseResult) -> dict[str, Any]:
    """A result by the columns of the listing."""
    return {
        "case": result.case.name,
        "verdict": result.verdict,
        "measured": result.measured,
        **result.columns,
        "seconds": result.seconds,
    }


def stored(row: dict[str, Any]) -> StudyRow:
    """A row as the database stores it."""
    return StudyRow(row["case"], row["verdict"], {k: v for k, v in row.items() if k not in ("case", "verdict")})
