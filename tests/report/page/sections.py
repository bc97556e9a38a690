"""Sections of a report, from databases whose content is known."""

from pathlib import Path

from tests.report.content import add_curve, add_ended, make_spec
from zoobench.db.rows import Ending, RunState
from zoobench.db.store import Store
from zoobench.report.footer import footer
from zoobench.report.learning_curves import curves
from zoobench.report.page.sections import Level, Section
from zoobench.report.run_results import choose_results, origins
from zoobench.report.tables import score_tables
from zoobench.spec import RunSelection

LEVELS = (Level("desert", "turning", "draft", 0.2, 1.0), Level("ocean", "turning", "draft", 0.1, 2.0))
HOSTILE = "</script><script>alert(1)</script><img src=x onerror=alert(1)>\x1b[31m"
METHODS = ("diffphysics-v2[lr=0.1]", "random-v1")


def section(folder: Path) -> Section:
    """Two methods with two seeds in four environments, and one more run that has failed with a hostile reason."""
    with Store(folder / "runs.db") as store:
        for place, env in enumerate(("desert-v1", "ground-v1", "ice-v1", "snow-v1")):
            for method, seed in ((method, seed) for method in METHODS for seed in range(2)):
                best = (10.0 if method == METHODS[0] else 1.0) + place + 0.1 * seed
                references = {"idle_score": 0.0, "random_score": 0.5}
                spec = make_spec(env=env, method=method, seed=seed)
                add_curve(store, spec, [None, 0.5 * best, best], references=references)
        add_ended(store, make_spec(env="clay-v1"), Ending(RunState.FAILED, HOSTILE))
        results = choose_results(store, RunSelection())
        tables = score_tables(results)
        foot = footer(tables, origins(store, results), ["zoobench", "report"])
        return Section("Results", "A test.", tables, results, 0, foot, curves(store, results, "substeps"))
