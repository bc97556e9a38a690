"""All stability cases, and their rows in listings and databases."""

from typing import Any

from zoobench.db.rows import StudyRow
from zoobench.verify.cases import CaseResult
from zoobench.verify.stability import (
    bad_inputs,
    contrast,
    domain,
    gradient_cases,
    horizon,
    impact,
    media_cases,
    muscles,
    particle_cases,
    strains,
    water_cases,
)

STUDY = "stability"
STEP_STUDY = "largest-step"

CASES = (
    *particle_cases.CASES,
    *strains.CASES,
    *impact.CASES,
    *contrast.CASES,
    *muscles.CASES,
    *domain.CASES,
    *media_cases.CASES,
    *water_cases.CASES,
    *gradient_cases.CASES,
    *horizon.CASES,
    *bad_inputs.CASES,
)


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
