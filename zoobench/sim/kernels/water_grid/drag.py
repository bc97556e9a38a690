"""Robot and water at a face of the grid: drag inside the robot, and the mixture of both; with the adjoint.

Both have velocities of their own, and volume shares that add up to one. What makes the water go round the robot is one
pressure for their mixture; drag acts only where the robot fills the face to `DRAG_FROM` or more, and is complete from
`DRAG_WHOLE` on. With one velocity for both, or with drag wherever the robot's splines reach, the robot would be thicker
by a cell on every side, and water would stick to it there: a plate that bends in a wave from head to tail then drives
itself backwards. The band is a closure, calibrated once, on the added mass and the drag of a ball and on
that plate. The impulse is inelastic, equal and opposite: it conserves momentum and never adds energy, at any step.

Deep in the robot there is no water, and what stands for it moves as the robot does.
"""

import taichi as ti

DRAG_FROM, DRAG_WHOLE = 0.7, 0.95
"""Solid shares at which drag begins and is complete [-], of particles' volumes times their `cover`."""

DEEP_FROM, DEEP_WHOLE = 0.7, 0.95
"""Volume shares from which and at which the water moves as the robot does [-]."""

FULLEST = 0.97
"""Largest volume share of the robot at a face [-]."""


@ti.func
def shares(q, scene: ti.template()):
    """Of a face's row q, see `water_layout`: share phi, drag, its slope, depth, and mass of the water."""
    per_cell = scene.inverse * scene.inverse * scene.inverse
    phi = ti.min(FULLEST, q[2] * per_cell)
    t = ti.max(0.0, ti.min(1.0, (q[3] * per_cell - DRAG_FROM) / (DRAG_WHOLE - DRAG_FROM)))
    deep = ti.max(0.0, ti.min(1.0, (phi - DEEP_FROM) / (DEEP_WHOLE - DEEP_FROM)))
    return ti.Struct(
        phi=phi,
        drag=t * t * (3.0 - 2.0 * t),
        slope=6.0 * t * (1.0 - t) / (DRAG_WHOLE - DRAG_FROM) * per_cell,
        deep=deep,
        water=scene.medium.density * (1.0 - phi) / per_cell,
        per_cell=per_cell,
    )


@ti.func
def lightness(q, scene: ti.template()):
    """Density of water by that of the robot at a face with mass."""
    return scene.medium.density * q[2] / q[1]


@ti.func
def drag_velocities(q, u, lift, dt, scene: ti.template()):
    """Velocities (robot's, water's) at a face with mass after drag, from the robot's row q and the water's velocity u.

    `lift` [m/s^2] acts on the robot's excess of density over water: gravity, and the pressure's gradient over density,
    which the pressure to come counts as if the robot had the density of water (Dodd and Ferrante 2014); it is that of
    the last substep.
    """
    share = shares(q, scene)
    free = q[0] / q[1] + dt * (1.0 - lightness(q, scene)) * lift
    part = q[1] / (q[1] + share.water)
    slip = free - u
    v = free - share.drag * (1.0 - part) * slip
    dragged = u + share.drag * part * slip
    return v, dragged + share.deep * (v - dragged), share.phi


@ti.func
def drag_velocities_adjoint(c: ti.template(), q, u, lift, v_adjoint, u_adjoint, mixture_adjoint):
    """Adjoint of `drag_velocities` by q, u and lift, from those of the velocities and of the mixture's,
    (1 - phi) u + phi v."""
    share = shares(q, c.scene)
    light = lightness(q, c.scene)
    free = q[0] / q[1] + c.dt * (1.0 - light) * lift
    total = q[1] + share.water
    part = q[1] / total
    slip = free - u
    v = free - share.drag * (1.0 - part) * slip
    dragged = u + share.drag * part * slip
    after = dragged + share.deep * (v - dragged)
    v_by = v_adjoint + share.phi * mixture_adjoint
    after_by = u_adjoint + (1.0 - share.phi) * mixture_adjoint
    phi_by = mixture_adjoint * (v - after)
    if share.deep > 0.0 and share.deep < 1.0:
        phi_by += after_by * (v - dragged) / (DEEP_WHOLE - DEEP_FROM)
    v_by += share.deep * after_by
    dragged_by = (1.0 - share.deep) * after_by
    exchange = part * dragged_by - (1.0 - part) * v_by
    slip_by = share.drag * exchange
    part_by = share.drag * slip * (v_by + dragged_by)
    free_by = v_by + slip_by
    # part = m / (m + m_w), m_w = rho (1 - phi) h^3
    phi_by += part_by * part / total * c.scene.medium.density / share.per_cell
    light_by = 0.0 - c.dt * lift * free_by
    mass_by = part_by * (1.0 - part) / total - (free_by * q[0] / q[1] + light_by * light) / q[1]
    volume_by = light_by * c.scene.medium.density / q[1]
    if q[2] * share.per_cell < FULLEST:
        volume_by += phi_by * share.per_cell
    row = ti.Vector([free_by / q[1], mass_by, volume_by, slip * exchange * share.slope])
    return row, dragged_by - slip_by, c.dt * (1.0 - light) * free_by
