"""Eyes and rings, by which a robot's head and segments are seen."""

from typing import Any

import numpy as np
import pytest

from tests.render.filmed import needs_drawing
from zoobench import registry
from zoobench.arrays import Array
from zoobench.designs.base import Body
from zoobench.registry import Kind
from zoobench.render.actors import put_skin
from zoobench.render.canvas import Canvas
from zoobench.render.marks import put_marks
from zoobench.render.skin import skin
from zoobench.sim.model.fidelity import Fidelity
from zoobench.spec import Ref


@pytest.fixture(autouse=True)
def _drawing() -> None:
    needs_drawing()


def _bounds(body: Body, way: Array) -> list[Array]:
    """Boxes `[3, 2]` [m] of what is put on the skin of a body that has gone `way` `[3]` [m] since."""
    cover = skin(body)
    with Canvas(160, 90) as canvas:
        look: dict[str, Any] = {"rgb": True}
        mesh = put_skin(canvas, cover, body.positions, np.ones((body.particle_count, 3)), **look)
        before = set(canvas.plotter.actors)
        update = put_marks(canvas, mesh, cover, body)
        mesh.points = mesh.points + way
        update()
        added = [actor for name, actor in canvas.plotter.actors.items() if name not in before]
        return [np.reshape(actor.bounds, (3, 2)) for actor in added]


def _animal(name: str) -> Body:
    found: Body = registry.create(Kind.DESIGN, Ref(name)).body(Fidelity(1 / 64))
    return found


@pytest.mark.parametrize(
    "name", ["caterpillar", *(pytest.param(name, marks=pytest.mark.slow) for name in ("panda", "orca", "block"))]
)
def test_every_body_has_two_eyes_at_its_head(name: str) -> None:
    """One on each side, in the foremost quarter and above the middle of that; they go with the skin."""
    body = _animal(name)
    way = np.array([0.3, 0.02, -0.1])
    there, moved = (np.array(_bounds(body, share * way)[:4]) for share in (0.0, 1.0))
    assert moved - there == pytest.approx(np.broadcast_to(way[:, None], there.shape), abs=1e-6)
    centres = there.mean(axis=2)
    low, high = body.box
    assert (centres[:, 0] > high[0] - 0.27 * (high[0] - low[0])).all()
    face = body.positions[body.positions[:, 0] > high[0] - 0.25 * (high[0] - low[0])]
    assert (centres[:, 1] > face[:, 1].mean()).all()
    assert (centres[:2, 2] < 0.0).all()
    assert (centres[2:, 2] > 0.0).all()


def test_rings_lie_between_segments() -> None:
    """Of the caterpillar, three; other bodies have none."""
    body = _animal("caterpillar")
    *_, rings = _bounds(body, np.zeros(3))
    assert len(_bounds(_animal("block"), np.zeros(3))) == 4
    assert body.rings == pytest.approx((-0.017, 0.0, 0.017))
    assert rings[0] == pytest.approx((-0.017, 0.017), abs=0.002)
    assert np.ptp(rings[1]) > 0.9 * body.size[1]
