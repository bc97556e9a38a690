"""Results as data frames: `zoobench.load("zoobench.db").results()`."""

import math
from collections.abc import Callable, Collection, Iterator, Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Any, Self

from zoobench.db.engine import batched
from zoobench.db.query import Reader
from zoobench.db.rows import FinalRow, RunRow
from zoobench.errors import UsageError
from zoobench.spec import AXES, Ref, RunSelection, Scalar

if TYPE_CHECKING:
    import pandas as pd

_RUNS_AT_ONCE = 500
_TIDY = ("run", "key", *AXES, "seed", "frames", "budget", "budget_kind", "score", "unit", "state", "reason", "seconds")
"""The first columns of tidy frames."""

_METRIC_COLUMNS = {"run": "int64", "name": "str", "step": "int64", "value": "float64"}


Defaults = Callable[[str, Ref], Mapping[str, Scalar]]
"""The defaults of the parameters of a component on an axis."""


class Frames:
    """The results in a database, as data frames of pandas; see `load`.

    Each method takes selectors for the axes, as the command line does: `results(env="desert,ice", method="cma*")`. It
    raises UsageError if one of them fits no run, and StorageError if the database cannot be read.
    """

    def __init__(self, location: str | Path, defaults: Defaults | None = None) -> None:
        self._reader = Reader(location, create=False)
        self._defaults = defaults or (lambda axis, ref: {})

    def results(self, **axes: str) -> "pd.DataFrame":
        """One row per run: number, key, settings, state, reason, attempts, seconds, and a column per final result.

        The unit of a final is part of its column's name, `score [m/s]`; a run without it, or not done, has NaN there.
        """
        selection = _selection(axes)
        types = self.result_types(selection)
        return _joined(self.result_parts(selection, types), types)

    def metrics(self, *names: str, **axes: str) -> "pd.DataFrame":
        """The learning curves with these names, all if none is given: run, name, step and value, one row per point."""
        return _joined(self.metric_parts(_selection(axes), names), _METRIC_COLUMNS)

    def curves(self, *names: str, **axes: str) -> "pd.DataFrame":
        """The same with one row per run and step, and a column per name; NaN where a curve has no point."""
        points = self.metrics(*names, **axes)
        table = points.pivot(index=["run", "step"], columns="name", values="value")
        return table.rename_axis(columns=None).reset_index()

    def tidy(self, *, keys: Collection[str] | None = None, **axes: str) -> "pd.DataFrame":
        """One row per run, one value per column: the run's settings, and its score.

        A component has its name in the column of its axis, and its version and each parameter, defaults included, in
        columns of their own: `env`, `env.version`, `env.friction`. A parameter that a component does not have is NaN.

        Args:
            keys: of the runs that are wanted; all that the axes choose if None.
            axes: selectors, as for `results`.
        """
        import pandas as pd

        chosen = self._reader.selected(_selection(axes))
        rows = [self._tidy_row(run, finals) for run, finals in chosen if keys is None or run.key in keys]
        return pd.DataFrame(rows, columns=list(dict.fromkeys([*_TIDY, *(name for row in rows for name in row)])))

    def tidy_curves(self, *names: str, **axes: str) -> "pd.DataFrame":
        """The learning curves with these names, all if none is given: the columns of `tidy`, name, step and value."""
        return self.metrics(*names, **axes).merge(self.tidy(**axes), on="run", how="left")

    def _tidy_row(self, run: RunRow, finals: list[FinalRow]) -> dict[str, Any]:
        spec, score = run.spec, next((final for final in finals if final.name == "score"), None)
        row: dict[str, Any] = {"run": run.id, "key": run.key}
        for axis in AXES:
            ref = getattr(spec, axis)
            row[axis] = ref.name
            params = {"version": ref.version, **self._defaults(axis, ref), **ref.kwargs}
            row |= {f"{axis}.{name}": value for name, value in params.items()}
        return row | {
            "seed": spec.seed,
            "frames": spec.frames,
            "budget": spec.budget.amount,
            "budget_kind": spec.budget.kind,
            "state": str(run.state),
            "reason": run.reason or "",
            "seconds": run.seconds,
            "score": math.nan if score is None else score.value,
            "unit": "" if score is None else score.unit,
        }

    def result_types(self, selection: RunSelection) -> dict[str, str]:
        """Names and types of the columns of `results`."""
        texts = dict.fromkeys(("key", *AXES), "str")
        numbers = {"seed": "int64", "frames": "int64", "budget_kind": "str", "budget_amount": "float64"}
        state = {"state": "str", "reason": "str", "attempts": "int64", "seconds": "float64"}
        finals = {_column(name, unit): "float64" for name, unit in self._reader.final_names(selection)}
        return {"run": "int64", **texts, **numbers, **state, **finals}

    def result_parts(self, selection: RunSelection, types: dict[str, str]) -> "Iterator[pd.DataFrame]":
        """`results` with columns of these types, some rows at a time."""
        import pandas as pd

        for some in batched(self._reader.selected(selection), _RUNS_AT_ONCE):
            rows = [_result_row(run, finals) for run, finals in some]
            yield pd.DataFrame(rows, columns=list(types)).astype(types)

    def metric_parts(self, selection: RunSelection, names: Collection[str] = ()) -> "Iterator[pd.DataFrame]":
        """`metrics`, those of some runs at a time."""
        import pandas as pd

        ids = [run.id for run, _ in self._reader.selected(selection)]
        for some in batched(ids, _RUNS_AT_ONCE):
            found = self._reader.all_metrics(some, names or None)
            rows = [(run, row.name, row.step, row.value) for run, points in found.items() for row in points]
            yield pd.DataFrame(rows, columns=list(_METRIC_COLUMNS)).astype(_METRIC_COLUMNS)

    def close(self) -> None:
        """Close all connections; the frames that were given stay."""
        self._reader.close()

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        self.close()


def _selection(axes: dict[str, str]) -> RunSelection:
    if unknown := sorted(axes.keys() - set(AXES)):
        raise UsageError(f"{unknown[0]!r} is no axis. Choose runs by {', '.join(AXES)}.")
    return RunSelection(**axes)


def _column(name: str, unit: str) -> str:
    return f"{name} [{unit}]" if unit else name


def _result_row(run: RunRow, finals: list[FinalRow]) -> dict[str, Any]:
    spec = run.spec
    return {
        "run": run.id,
        "key": run.key,
        **{axis: str(getattr(spec, axis)) for axis in AXES},
        "seed": spec.seed,
        "frames": spec.frames,
        "budget_kind": spec.budget.kind,
        "budget_amount": spec.budget.amount,
        "state": str(run.state),
        "reason": run.reason or "",
        "attempts": run.attempt,
        "seconds": run.seconds,
        **{_column(final.name, final.unit): final.value for final in finals},
    }


def _joined(parts: "Iterator[pd.DataFrame]", types: dict[str, str]) -> "pd.DataFrame":
    import pandas as pd

    found = [part for part in parts if len(part)]
    if found:
        return pd.concat(found, ignore_index=True)
    return pd.DataFrame({name: pd.Series(dtype=kind) for name, kind in types.items()})
