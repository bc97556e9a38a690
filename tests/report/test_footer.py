"""The footer of tables: what stands there beside the numbers."""

from pathlib import Path

from tests.report.content import add_done, make_spec
from zoobench import registry
from zoobench.db.store import Store
from zoobench.registry import Kind
from zoobench.report.footer import footer
from zoobench.report.run_results import choose_results, origins
from zoobench.report.tables import score_tables
from zoobench.spec import RunSelection


def test_it_says_what_is_not_known_of_agents_of_others(tmp_path: Path) -> None:
    """By the agent's name, and nothing of the methods that a budget pays for."""
    file = tmp_path / "agent.py"
    file.write_text("")
    with Store(tmp_path / "a.db") as store:
        for method in (f"external[policy={file},agent=mine]", "random"):
            add_done(store, make_spec(method=method), 0.5)
        found = choose_results(store, RunSelection())
        lines = footer(score_tables(found), origins(store, found), ["zoobench", "table"]).lines()
    assert [line for line in lines if line.startswith("external")] == [
        "external: ¶ mine was trained elsewhere at a cost that is not known: it wins and loses nothing"
    ]


def test_it_says_which_components_have_a_newer_version(tmp_path: Path) -> None:
    """Numbers of an older version are made no more; those of the newest and of plug-ins that are gone say nothing."""
    with Store(tmp_path / "a.db") as store:
        for env in ("ocean-v5", "moon-v3", f"desert-v{registry.get(Kind.ENV, 'desert').version}"):
            add_done(store, make_spec(env=env), 0.5)
        found = choose_results(store, RunSelection())
        lines = footer(score_tables(found), origins(store, found), ["zoobench", "table"]).lines()
    newest = registry.get(Kind.ENV, "ocean").version
    assert newest > 5
    (said,) = [line for line in lines if "superseded" in line]
    assert f"ocean-v5 is ocean-v{newest} now" in said
    assert "moon" not in said
    assert "desert" not in said
