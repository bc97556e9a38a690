"""Ratios of two checkouts, from rows that are known."""

from benchmarks.compare import lines


def test_ratios_are_those_of_each_round() -> None:
    """Their median, least and largest; what one of the checkouts lacks is left out."""
    rounds = [
        (
            {"ice": {"forward_fps": mine, "gradient_fps": None}, "new": {"forward_fps": 1.0}},
            {"ice": {"forward_fps": 2.0}},
        )
        for mine in (2.0, 4.0, 5.0)
    ]
    assert lines(rounds) == ["ice, forward_fps: 2.000 (1.000 to 2.500)"]


def test_runs_are_compared_by_their_seconds() -> None:
    """Of processor and wall."""
    assert lines([({"--env ice": {"cpu_s": 3.0, "wall_s": 1.0}}, {"--env ice": {"cpu_s": 4.0, "wall_s": 1.0}})]) == [
        "--env ice, cpu_s: 0.750 (0.750 to 0.750)",
        "--env ice, wall_s: 1.000 (1.000 to 1.000)",
    ]
