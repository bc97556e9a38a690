"""Results as files of Apache Parquet, written some rows at a time, however many there are."""

from collections.abc import Iterator
from pathlib import Path
from typing import TYPE_CHECKING

from zoobench.db.frames import Frames
from zoobench.errors import UsageError, extra
from zoobench.spec import RunSelection

if TYPE_CHECKING:
    import pandas as pd


def export_results(location: str | Path, path: Path, selection: RunSelection) -> int:
    """Write `Frames.results` to a file, which is replaced whole; the number of rows.

    Raises:
        UsageError: a selector fits no run, or the extra `parquet` is not installed.
        StorageError: the database cannot be read.
    """
    with Frames(location) as frames:
        return _write(path, frames.result_parts(selection, frames.result_types(selection)))


def export_metrics(location: str | Path, path: Path, selection: RunSelection) -> int:
    """Write `Frames.metrics` of the selected runs to a Parquet file; returns their number."""
    with Frames(location) as frames:
        return _write(path, frames.metric_parts(selection))


def _write(path: Path, parts: "Iterator[pd.DataFrame]") -> int:
    with extra("parquet", "Parquet files need"):
        import pyarrow
        import pyarrow.parquet
    unfinished = path.with_name(f"{path.name}.part")
    count, writer = 0, None
    try:
        for part in parts:
            table = pyarrow.Table.from_pandas(part, preserve_index=False)
            writer = writer or pyarrow.parquet.ParquetWriter(unfinished, table.schema)
            writer.write_table(table.cast(writer.schema))
            count += len(part)
        if writer is None:
            raise UsageError("There is no run to export. Try: zoobench run --env desert --task turning")
        writer.close()
        unfinished.replace(path)
    except FileNotFoundError:
        raise UsageError(f"There is no folder {path.parent}. Make it, or give another path with -o.") from None
    finally:
        unfinished.unlink(missing_ok=True)
    return count
