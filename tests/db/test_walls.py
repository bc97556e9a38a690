"""The gap from the arena's sides in records of an export."""

from typing import Any

import pytest

from zoobench.db.walls import wall_gap_in
from zoobench.spec import is_at_wall, standing

READ: dict[str, Any] = {"finals": {"wall_gap": {"value": 2.5, "unit": "cells"}}}
LENGTHENED: dict[str, Any] = {"finals": {}, "lasting": {"home_gap": 1.5}}
POLICY: dict[str, Any] = {"finals": {}, "lasting": {"home_gap": None}}


@pytest.mark.parametrize(
    ("record", "gap"),
    [(READ, 2.5), ({**LENGTHENED, **READ}, 2.5), (LENGTHENED, 1.5), (POLICY, None), ({"finals": {}}, None)],
)
def test_the_gap_is_read_or_known_from_a_longer_episode(record: dict[str, Any], gap: float | None) -> None:
    """That of the run itself comes first."""
    assert wall_gap_in(record) == gap


def test_a_result_at_a_wall_is_the_last_choice() -> None:
    """Below three cells, or where nobody looked; among these, and among the others, the score decides."""
    assert [is_at_wall(gap) for gap in (2.99, 3.0, None)] == [True, False, False]
    ordered = sorted([(0.3, 1.0), (0.2, None), (0.1, 9.0), (0.4, 2.0)], key=lambda pair: standing(*pair))
    assert [score for score, _ in ordered] == [0.2, 0.3, 0.4, 0.1]
