"""Where shadows fall."""

import numpy as np

from zoobench.render.actors import covered


def test_the_shadow_falls_straight_down() -> None:
    """Under the robot, not beside it."""
    ground = np.array([[0.0, 0.0, 0.0], [0.0, 0.0, 0.05], [0.2, 0.0, 0.0]])
    assert covered(ground, np.array([[0.0, 0.3, 0.0]]), 0.01).tolist() == [True, False, False]
