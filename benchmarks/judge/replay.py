"""A second answer for published gaits on firm ground: finite elements on tetrahedra that fit the body's surface.

    pip install scikit-fem
    python -m benchmarks.judge.checks                                                  # against closed forms, a minute
    python -m benchmarks.judge.replay best:ground/movement-speed/panda --cells 10,8,6.5  # minutes
    python -m benchmarks.judge.replay best:ground/movement-speed/caterpillar --frames 600 --cells 10 --csv long.csv

A row of the table is one replay: the gait's score in m/s by tetrahedra of a lattice with cubes of `cell_mm`, each with
ten nodes. Rows are added to the file, which is docs/accuracy-judge.csv by default. `--zoobench draft,paper` adds what
zoobench scores. A C++ compiler is needed.
"""

import argparse
import csv
import time
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np

from benchmarks.judge.meshes import outside
from benchmarks.judge.scene import Gait, body_of, gait_of, spec_of
from benchmarks.judge.solver import FRAME, Solver
from zoobench.errors import Divergence

COLUMNS = (
    "gait", "frames", "method", "cell_mm", "elements", "score", "way_mm", "aside_mm", "least_volume_ratio",
    "nodes_in_other_limbs", "cpu_s",
)  # fmt: skip


def replays(names: list[str], cells: list[float], frames: int, order: int, finer: float) -> Iterator[dict[str, Any]]:
    """One row for each gait and lattice [m].

    Every gait begins with the body put down anew: where it came to rest before would be another stance.
    """
    for cell in cells:
        for name in names:
            gait = gait_of(name, frames)
            body = body_of(gait, cell, order=order)
            body.stand()
            left = body.settle()
            print(f"{name} at {1e3 * cell:g} mm: {len(body.mesh.cells)} elements, {left:.1e} m/s at rest", flush=True)
            yield replay(body, gait, cell, finer)


def replay(body: Solver, gait: Gait, cell: float, finer: float = 1.0) -> dict[str, Any]:
    """Drive the muscles of a body at rest; the row of the table, with the speed after every frame."""
    start, cpu, least, inside = body.mean(body.x), time.process_time(), 1.0, 0
    speeds = np.zeros((len(gait.activity), 3))
    for frame, activity in enumerate(gait.activity):
        body.pull(gait.strength * activity)
        least = min(least, body.advance(FRAME, finer))
        speeds[frame] = body.mean(body.v)
        if not np.isfinite(speeds[frame]).all():
            raise FloatingPointError(f"{gait.name} at {1e3 * cell:g} mm diverged in frame {frame}. Take finer steps.")
        if frame % 5 == 4:
            inside = max(inside, strangers(body, cell))
        if frame % 50 == 49:
            print(f"  frame {frame + 1}: {speeds[: frame + 1, 0].mean():.5f} m/s, least J {least:.3f}", flush=True)
    way = 1e3 * (body.mean(body.x) - start)
    method = f"{'linear' if body.nodes == 4 else 'quadratic'} elements"
    values = (
        gait.name.removeprefix("best:"), len(gait.activity), method, f"{1e3 * cell:g}", len(body.mesh.cells),
        f"{speeds[:, 0].mean():.5f}", f"{way[0]:.1f}", f"{way[2]:.1f}", f"{least:.3f}", inside,
        f"{time.process_time() - cpu:.0f}",
    )  # fmt: skip
    return dict(zip(COLUMNS, values, strict=True)) | {"speeds": speeds, "body": body}


def strangers(body: Solver, cell: float) -> int:
    """Nodes of the surface that are inside of elements from more than two cells away: limbs that met."""
    from scipy.spatial import KDTree

    nodes, cells = np.unique(outside(body.mesh.cells[:, :4])), body.mesh.cells[:, :4]
    corners = body.x[cells]
    found = KDTree(corners.mean(axis=1)).query(body.x[nodes], k=12)[1]
    far = (
        np.linalg.norm(body.mesh.points[cells].mean(axis=1)[found] - body.mesh.points[nodes][:, None], axis=2)
        > 2.0 * cell
    )
    edges = corners[found][:, :, 1:] - corners[found][:, :, :1]
    share = np.linalg.solve(np.swapaxes(edges, 2, 3), (body.x[nodes][:, None] - corners[found][:, :, 0])[..., None])[
        ..., 0
    ]
    within = (share > 0.05).all(axis=2) & (share.sum(axis=2) < 0.95)
    return int((within & far).any(axis=1).sum())


def zoobench_rows(names: list[str], levels: list[str], frames: int) -> Iterator[dict[str, Any]]:
    """What zoobench scores at these levels."""
    from zoobench.cell.problem import Problem

    for level in levels:
        for name in names:
            spec, params = spec_of(name, level, frames)
            begin = time.process_time()
            episode = Problem(spec, worlds=1).episode(params)
            spacing, count, failure = 1e3 * float(spec.fidelity.kwargs["grid_spacing"]), 0, episode.evaluation.failure
            told = [f"{episode.evaluation.score:.5f}", "", ""]
            if episode.record is not None:
                places = episode.record.motion.positions[:, 0]
                count = places.shape[1]
                told[1:] = (f"{1e3 * float(way):.1f}" for way in (places[-1] - places[0]).mean(dim=0)[[0, 2]])
            if failure is not None:
                told = [f"torn in frame {failure.frame}" if isinstance(failure, Divergence) else str(failure), "", ""]
            values = (
                name.removeprefix("best:"), spec.frames, f"zoobench {level}", f"{spacing:.4g}", count, *told, "", "",
                f"{time.process_time() - begin:.0f}",
            )  # fmt: skip
            yield dict(zip(COLUMNS, values, strict=True))


def add(row: dict[str, Any], path: Path) -> None:
    """Append a row to the table."""
    is_new = not path.exists()
    with path.open("a", newline="") as file:
        writer = csv.DictWriter(file, COLUMNS, extrasaction="ignore", lineterminator="\n")
        if is_new:
            writer.writeheader()
        writer.writerow(row)
    print({name: row[name] for name in COLUMNS}, flush=True)


def main() -> None:
    """Replay the gaits of the command line."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("gaits", nargs="+", help="published solutions, such as best:ground/movement-speed/panda")
    parser.add_argument("--cells", default="10,8,6.5", help="edges of the lattice's cubes [mm]")
    parser.add_argument("--frames", type=int, default=0, help="by default the gait's own")
    parser.add_argument("--order", type=int, choices=(1, 2), default=2, help="of the elements")
    parser.add_argument("--finer", type=float, default=1.0, help="share of the time step to take")
    parser.add_argument("--zoobench", default="", help="levels at which zoobench is asked, too")
    parser.add_argument("--csv", type=Path, default=Path("docs/accuracy-judge.csv"))
    parser.add_argument("--keep", type=Path, help="a folder for the speeds of every frame and the last places")
    given = parser.parse_args()
    for row in zoobench_rows(given.gaits, [level for level in given.zoobench.split(",") if level], given.frames):
        add(row, given.csv)
    cells = [1e-3 * float(cell) for cell in given.cells.split(",") if cell]
    for row in replays(given.gaits, cells, given.frames, given.order, given.finer):
        add(row, given.csv)
        if given.keep is not None:
            body = row["body"]
            name = f"{row['gait'].replace('/', '-')}-{row['frames']}-{row['cell_mm']}-{given.order}.npz"
            np.savez(given.keep / name, speeds=row["speeds"], x=body.x, rest=body.mesh.points, cells=body.mesh.cells)


if __name__ == "__main__":
    main()
