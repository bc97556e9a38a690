"""Where a body begins so that the ground's skin carries it and nothing jumps at the start."""

from dataclasses import replace

import numpy as np

from zoobench.sim.model.ground_skin import heights_above
from zoobench.sim.model.scene import Scene

_BISECTIONS = 60


def standing(scene: Scene, edge: float) -> Scene:
    """The scene with its robot lifted or lowered, as a rigid body, to where the skin carries its weight.

    Without gravity the robot just touches the skin; one on or in a medium, or held, is left where it is.

    Args:
        scene: its robot may be anywhere.
        edge: of the cubes that the robot's particles stand for [m], see `Scene.robot_edge`.
    """
    ground, robot = scene.ground, scene.robot
    if ground is None or scene.medium is not None or scene.water is not None or robot.anchor or robot.drive:
        return scene
    skin = ground.skin
    volumes = robot.volumes  # whatever their occupancy: the start has no derivative by the body's parameters
    weight = -scene.gravity[1] * robot.material.density * float(volumes @ robot.density_ratio)
    gap, normal = heights_above(robot.positions, ground.terrain)

    def carried(lift: float) -> float:
        # on a slope that holds the robot by friction, the ground's normal force is the weight times the normal's y
        return float((volumes * skin.force(gap + lift * normal[:, 1], edge)) @ (1.0 / normal[:, 1]))

    # at the highest lift the skin is out of reach; deep enough it carries any weight
    high = float(((skin.thickness + edge / 2 - gap) / normal[:, 1]).max())
    low, step = high - skin.thickness, skin.thickness
    while carried(low) < weight:
        low, step = low - step, 2.0 * step
    for _ in range(_BISECTIONS):
        middle = 0.5 * (low + high)
        low, high = (middle, high) if carried(middle) > max(weight, 0.0) else (low, middle)
    return replace(scene, robot=replace(robot, positions=robot.positions + np.array([0.0, high, 0.0])))
