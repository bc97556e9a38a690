"""The cheapest fidelity that is accurate enough, by what the accuracy study measured in that environment."""

import json
import math
from dataclasses import asdict, dataclass
from functools import cache
from importlib.resources import files
from pathlib import Path
from typing import Any

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
"""With which an error is within the tolerance, for controllers like those that it was measured with."""


@dataclass(frozen=True)
class Choice:
    """A fidelity, and why it is the one."""

    fidelity: Ref
    reason: str


def choose(env: Ref, task: str, tolerance: float) -> Choice:
    """The cheapest level whose score error in this environment and task, at `CONFIDENCE` and with the reference's own
    uncertainty, is within `tolerance` (a share of the scores' root mean square).

    Raises:
        UsageError: no level is, or this environment and task were not measured as they are now; with the figures.
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
    return Choice(Ref(cheapest.fidelity), f"{env.name} x {task}: {_describe(cheapest)}; {others}")


@dataclass(frozen=True)
class Published:
    """What `choose` judges by.

    Attributes:
        origin: commits and machines that it was measured with.
        components: environments as they were measured, with version and every parameter.
        levels: with errors and costs.
    """

    origin: tuple[str, ...]
    components: tuple[str, ...]
    levels: tuple[LevelRow, ...]


def publish(measurements: Measurements, path: Path) -> None:
    """Write what `choose` needs of the measurements: the levels' errors and costs, a row each.

    Environments that were not measured keep what the file says of them.

    Raises:
        UsageError: the file cannot be read or written.
    """
    measured = {label(Kind.ENV, sample.env): sample.env for sample in measurements.samples}
    new = [_rounded(asdict(row)) for row in analyse(measurements).levels]
    own = {str(env) for env in measured.values() if label(Kind.ENV, env) == env.name}
    try:
        before = json.loads(path.read_text(encoding="utf-8")) if path.exists() else _NOTHING
        kept = [row for row in before["levels"] if row["env"] not in measured]
        known = {text for text in before["components"] if Ref.parse(text).name not in measured} | own
        rows = ",\n".join(json.dumps(row, allow_nan=False) for row in sorted(kept + new, key=_order))
        head = json.dumps({"origin": sorted({*before["origin"], *measurements.origin}), "components": sorted(known)})
        replace_files({path: f'{head[:-1]}, "levels": [\n{rows}\n]}}\n'.encode()})
    except OSError as error:
        raise UsageError(f"Cannot write {path}: {error.strerror}. Choose another place.") from None
    except (ValueError, LookupError, TypeError, AttributeError, UsageError):
        raise UsageError(f"{path} holds something else than published levels. Choose another file.") from None


_NOTHING: dict[str, list[Any]] = {"origin": [], "components": [], "levels": []}


def _order(row: dict[str, Any]) -> tuple[str, str, float]:
    """By environment and task, from coarse to fine."""
    return row["env"], row["task"], -row["spacing"]


@cache
def published() -> Published:
    """What comes with the package."""
    text = files("zoobench.verify.accuracy").joinpath(PUBLISHED).read_text(encoding="utf-8")
    document = json.loads(text)
    levels = tuple(LevelRow(**row) for row in document["levels"])
    return Published(tuple(document["origin"]), tuple(document["components"]), levels)


def _rounded(row: dict[str, Any]) -> dict[str, Any]:
    return {name: float(f"{value:.4g}") if isinstance(value, float) else value for name, value in row.items()}


def _rows(env: Ref, task: str) -> list[LevelRow]:
    """The levels with an error, from coarse to fine; only what was measured with today's components counts."""
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
    """How wrong a score may be: its distance to the reference, at `CONFIDENCE`, and the reference's own."""
    surely = _surely(row)
    return math.inf if surely is None or row.unknown is None else math.hypot(surely, row.unknown)


def _surely(row: LevelRow) -> float | None:
    """What the error is below at `CONFIDENCE`: it was measured on a few controllers, and others may fare worse.

    The upper limit of a root mean square e of n independent normal errors: e sqrt(n / chi^2) with the lower quantile of
    chi^2 with n degrees of freedom; 1.5 e for twelve.
    """
    from scipy.stats import chi2

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
