"""The cheapest fidelity within a tolerance, by the published results of the accuracy study."""

import json
import math
from dataclasses import asdict, dataclass
from functools import cache
from importlib.resources import files
from pathlib import Path
from typing import Any

from scipy.stats import chi2

from zoobench import registry
from zoobench.errors import UsageError
from zoobench.files import replace_files
from zoobench.registry import Kind
from zoobench.spec import Ref
from zoobench.verify.accuracy.analyse import LevelRow, analyse
from zoobench.verify.accuracy.records import Measurements, label

PUBLISHED = "published.json"
"""Written by `zoobench accuracy show --publish` when the fidelities were last measured; beside this file."""

CONFIDENCE = 0.95
"""Confidence level of an error's upper limit, for controllers like those of the study."""


@dataclass(frozen=True)
class FidelityChoice:
    """A fidelity, and the reason for its choice."""

    fidelity: Ref
    reason: str


def choose(env: Ref, task: str, tolerance: float) -> FidelityChoice:
    """The cheapest level whose score error in this environment and task, at `CONFIDENCE` and with the reference's own
    uncertainty, is within `tolerance` (a share of the scores' root mean square).

    Raises:
        UsageError: no level is, or this environment and task were not measured in their present version.
    """
    if not 0.0 < tolerance < math.inf:
        raise UsageError(f"A tolerance of {tolerance:g} cannot be met. Give a share of the score, as in 0.2.")
    rows = _rows(env, task)
    good = [row for row in rows if _bound(row) <= tolerance]
    if not good:
        best = min(rows, key=_bound)
        raise UsageError(
            f"No fidelity is known to be within {tolerance:g} in {env.name} x {task}: the best is {_describe(best)}. "
            "Give a larger tolerance, or choose with --fidelity."
        )
    cheapest = max(good, key=lambda row: row.spacing)
    others = ", ".join(_describe(row) for row in rows if row is not cheapest)
    return FidelityChoice(Ref(cheapest.fidelity), f"{env.name} x {task}: {_describe(cheapest)}; {others}")


@dataclass(frozen=True)
class Published:
    """The published results, by which `choose` judges.

    Attributes:
        origin: commits and machines of the measurements.
        components: the measured environments, with version and every parameter.
        levels: their errors and costs.
    """

    origin: tuple[str, ...]
    components: tuple[str, ...]
    levels: tuple[LevelRow, ...]


def publish(measurements: Measurements, path: Path) -> None:
    """Write the levels' errors and costs, a row each.

    Rows of environments that were not measured stay in the file.

    Raises:
        UsageError: the file cannot be read or written.
    """
    measured = {label(Kind.ENV, sample.env): sample.env for sample in measurements.samples}
    new = [
        {name: float(f"{value:.4g}") if isinstance(value, float) else value for name, value in asdict(row).items()}
        for row in analyse(measurements).levels
    ]
    own = {str(env) for env in measured.values() if label(Kind.ENV, env) == env.name}
    try:
        nothing: dict[str, list[Any]] = {"origin": [], "components": [], "levels": []}
        before = json.loads(path.read_text(encoding="utf-8")) if path.exists() else nothing
        kept = [row for row in before["levels"] if row["env"] not in measured]
        known = {text for text in before["components"] if Ref.parse(text).name not in measured} | own
        kept_and_new = sorted(kept + new, key=lambda row: (row["env"], row["task"], -row["spacing"]))
        rows = ",\n".join(json.dumps(row, allow_nan=False) for row in kept_and_new)
        head = json.dumps({"origin": sorted({*before["origin"], *measurements.origin}), "components": sorted(known)})
        replace_files({path: f'{head[:-1]}, "levels": [\n{rows}\n]}}\n'.encode()})
    except OSError as error:
        raise UsageError(f"Cannot write {path}: {error.strerror}. Choose another place.") from None
    except (ValueError, LookupError, TypeError, AttributeError, UsageError):
        raise UsageError(f"{path} holds something else than published levels. Choose another file.") from None


@cache
def published() -> Published:
    """The results that come with the package."""
    text = files("zoobench.verify.accuracy").joinpath(PUBLISHED).read_text(encoding="utf-8")
    document = json.loads(text)
    levels = tuple(LevelRow(**row) for row in document["levels"])
    return Published(tuple(document["origin"]), tuple(document["components"]), levels)


def _rows(env: Ref, task: str) -> list[LevelRow]:
    """The levels with a known error, from coarse to fine, measured with the present components."""
    now = registry.resolve(Kind.ENV, env)
    if str(now) not in published().components:
        raise UsageError(
            f"The accuracy of {label(Kind.ENV, now)} in its present version was not measured. "
            f"Measure it with `zoobench accuracy run --env {env.name}`, and choose with --fidelity."
        )
    rows = [row for row in published().levels if (row.env, row.task) == (label(Kind.ENV, now), task)]
    known = [row for row in rows if row.error is not None]
    if not known:
        raise UsageError(f"The accuracy of {env.name} x {task} was not measured. Choose with --fidelity.")
    return known


def _bound(row: LevelRow) -> float:
    """Limit of a score's error: that of its distance to the reference, and the reference's own uncertainty."""
    surely = _surely(row)
    return math.inf if surely is None or row.unknown is None else math.hypot(surely, row.unknown)


def _surely(row: LevelRow) -> float | None:
    """Upper limit of the error at `CONFIDENCE`, since it was measured on a few controllers only.

    That of a root mean square e of n independent normal errors is e sqrt(n / chi^2) with the lower quantile of chi^2
    with n degrees of freedom; 1.5 e for twelve.
    """
    judged = int(row.draws.partition(",")[0])
    if row.error is None or not judged:
        return None
    return float(row.error * math.sqrt(judged / chi2.ppf(1.0 - CONFIDENCE, judged)))


def _describe(row: LevelRow) -> str:
    unknown = "unknown" if row.unknown is None else f"{row.unknown:.2g}"
    seconds = "" if row.seconds is None else f", {row.seconds:.2g} s per simulated second"
    surely = _surely(row)
    limit = "" if surely is None else f"below {surely:.2g} at {CONFIDENCE:.0%}; "
    return f"{row.fidelity} with an error of {row.error:.2g} ({limit}reference known to {unknown}{seconds})"
