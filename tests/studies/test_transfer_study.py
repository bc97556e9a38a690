"""Solutions elsewhere, as they are told."""

from dataclasses import replace

from zoobench.studies.transfer_study import TransferRow

ROW = TransferRow(
    1,
    "block-v1",
    "random-v1",
    0,
    ("ice-v1", "turning-v1", "draft-v1"),
    "ice-v1",
    "turning-v1",
    "draft-v1",
    9,
    0.25,
    "m/s",
    "",
)


def test_a_row_is_told_in_a_line() -> None:
    """Its score or error, or why there is none."""
    assert (ROW.title, ROW.result) == ("run 1", "score 0.25 m/s")
    assert replace(ROW, task="waypoint-following-v1", score=-0.25, unit="m").result == "error 0.25 m"
    assert replace(ROW, score=None, reason="torn").result == "torn"
