"""The levels of a study, written into the file that `--tolerance` and `--decide` read."""

import json
from dataclasses import asdict
from pathlib import Path
from typing import Any

from zoobench.errors import UsageError, reason
from zoobench.files import replace_files
from zoobench_verify.accuracy.analyse import analyse
from zoobench_verify.accuracy.records import Measurements, rounded


def write_levels(measurements: Measurements, path: Path) -> None:
    """Write the levels' errors and costs, a row each, without those at which only references were verified.

    Rows of environments and tasks that were not measured stay in the file.

    Raises:
        UsageError: the file cannot be read or written.
    """
    new = [rounded(asdict(row), 4) for row in analyse(measurements).levels if row.gaits > row.checked]
    places = {(row["env"], row["task"]) for row in new}
    try:
        nothing: dict[str, list[Any]] = {"origin": [], "levels": []}
        before = json.loads(path.read_text(encoding="utf-8")) if path.exists() else nothing
        kept = [row for row in before["levels"] if (row["env"], row["task"]) not in places]
        kept_and_new = sorted(kept + new, key=lambda row: (row["env"], row["task"], -row["spacing"]))
        rows = ",\n".join(json.dumps(row, allow_nan=False) for row in kept_and_new)
        head = json.dumps({"origin": sorted({*before["origin"], *measurements.origin})})
        replace_files({path: f'{head[:-1]}, "levels": [\n{rows}\n]}}\n'.encode()})
    except OSError as error:
        raise UsageError(f"Cannot write {path}: {reason(error)}. Choose another place.") from None
    except (ValueError, LookupError, TypeError, AttributeError, UsageError):
        raise UsageError(f"{path} holds something else than published levels. Choose another file.") from None
