"""Incompressible water on a staggered grid, and a robot of particles in it.

A substep takes the water's velocity along by itself (`advection`), the robot's momentum to the water's faces (`faces`),
lets both meet in the robot (`drag`), and makes the mixture of both free of divergence by one pressure (`pressure`);
`immersed` drives these, and their adjoints stand beside them.

Component d of a velocity is on the face of a cell towards its lower neighbour along d: node (i, j, k) of the grid is
cell (i, j, k) with its three lower faces. The arena's walls run through the lower faces of cell `WALL_NODES` and
through those of the last; beyond are mirror images.
"""
