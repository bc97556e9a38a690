"""The picture of `bench`: what each panel shows."""

from pathlib import Path
from typing import Any

import pytest

from tests.verify.bench.rows import rate_row, results, run_share
from zoobench.errors import UsageError
from zoobench.render import figures
from zoobench_verify.bench.bench_plot import draw

pytest.importorskip("matplotlib")


@pytest.fixture
def drawn(monkeypatch: pytest.MonkeyPatch) -> list[Any]:
    """The figures that were drawn, in place of their files."""
    found: list[Any] = []
    monkeypatch.setattr(figures, "save", lambda figure, path: found.append(figure))
    return found


def test_rates_are_lines_over_particles_and_runs_are_bars(drawn: list[Any]) -> None:
    """A scene's lines go from few particles to many; a case without gradients has no second one."""
    rates = (rate_row(asked=1004, forward=8.0), rate_row(asked=104, forward=4.0), rate_row("ice", both_mps=None))
    draw(results(rates=rates, runs=(run_share("a"), run_share("b", cpu_s=10.0))), Path("bench.png"))
    lines, bars = drawn[0].axes
    assert [line.get_xydata().tolist() for line in lines.lines] == [
        [[100, 4.0], [1000, 8.0]],
        [[100, 4.0 / 3], [1000, 8.0 / 3]],
        [[9996, 6.0]],
        [],
    ]
    assert lines.get_xlim() == (100.0, 10_000.0)
    widths = [bar.get_width() for bar in bars.patches]
    assert widths[:2] == [50.0, 50.0]  # the share of advance in both runs
    assert sum(widths) == pytest.approx(200.0)


def test_a_panel_without_data_is_left_out(drawn: list[Any]) -> None:
    """And a picture without panels is refused."""
    draw(results(runs=()), Path("bench.png"))
    assert len(drawn[0].axes) == 1
    with pytest.raises(UsageError, match="nothing to draw"):
        draw(results(rates=(), runs=()), Path("bench.png"))
