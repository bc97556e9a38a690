"""Snow: fixed corotated elasticity with clamped principal stretches and hardening, and its adjoint.

`constants` are (mu, lambda, critical compression, critical stretch, hardening), as `matter` lists them.
"""

import taichi as ti

from zoobench.sim.kernels.hencky import SMALLEST_SQUARE
from zoobench.sim.kernels.linalg import assemble, eigen_symmetric, matmul
from zoobench.sim.model.matter import LARGEST_PLASTIC, SMALLEST_PLASTIC


@ti.func
def snow_stretch(stretch, plastic, constants):
    """Clamped principal stretches, and the plastic volume ratio before it is held within its bounds."""
    held = ti.min(ti.max(stretch, 1.0 - constants[2]), 1.0 + constants[3])
    ratio = (stretch[0] / held[0]) * (stretch[1] / held[1]) * (stretch[2] / held[2])
    return held, plastic * ratio


@ti.func
def snow_update(b, plastic, constants):
    """Elastic b, new plastic volume ratio and Kirchhoff stress of snow (Stomakhin et al. 2013)."""
    mu, lam = constants[0], constants[1]
    squares, frame = eigen_symmetric(b)
    held, grown = snow_stretch(ti.sqrt(ti.max(squares, SMALLEST_SQUARE)), plastic, constants)
    after = ti.min(ti.max(grown, SMALLEST_PLASTIC), LARGEST_PLASTIC)
    hardening = ti.exp(constants[4] * (1.0 - after))
    J = held[0] * held[1] * held[2]
    # fixed corotated: tau = 2 mu (F - R) F^T + lambda J (J - 1) I in principal values
    stress = hardening * (2.0 * mu * held * (held - 1.0) + lam * J * (J - 1.0))
    return assemble(frame, held * held), after, assemble(frame, stress)


@ti.func
def snow_update_adjoint(b, plastic, b_adjoint, new_plastic_adjoint, tau_adjoint, constants):
    """Adjoint of `snow_update` by the trial b and the old plastic volume ratio, for adjoints that are symmetric."""
    mu, lam, low, high = constants[0], constants[1], 1.0 - constants[2], 1.0 + constants[3]
    squares, frame = eigen_symmetric(b)
    stretch = ti.sqrt(ti.max(squares, SMALLEST_SQUARE))
    held, grown = snow_stretch(stretch, plastic, constants)
    after = ti.min(ti.max(grown, SMALLEST_PLASTIC), LARGEST_PLASTIC)
    hardening = ti.exp(constants[4] * (1.0 - after))
    J = held[0] * held[1] * held[2]
    transposed = frame.transpose()
    b_inner = matmul(transposed, matmul(b_adjoint, frame))
    tau_inner = matmul(transposed, matmul(tau_adjoint, frame))
    soft = 2.0 * mu * held * (held - 1.0) + lam * J * (J - 1.0)
    work = tau_inner[0, 0] * soft[0] + tau_inner[1, 1] * soft[1] + tau_inner[2, 2] * soft[2]
    after_adjoint = new_plastic_adjoint - constants[4] * hardening * work
    grown_adjoint = 0.0 * after_adjoint  # while the ratio is held at a bound its derivative is zero
    if grown > SMALLEST_PLASTIC and grown < LARGEST_PLASTIC:
        grown_adjoint = after_adjoint
    volume_adjoint = hardening * lam * (2.0 * J - 1.0) * tau_inner.trace()
    inner = 0.0 * b
    for i in ti.static(range(3)):
        held_adjoint = 2.0 * held[i] * b_inner[i, i] + hardening * 2.0 * mu * (2.0 * held[i] - 1.0) * tau_inner[i, i]
        held_adjoint += (volume_adjoint * J - grown_adjoint * grown) / held[i]
        stretch_adjoint = grown_adjoint * grown / stretch[i]
        if stretch[i] > low and stretch[i] < high:
            stretch_adjoint += held_adjoint
        inner[i, i] = stretch_adjoint / (2.0 * stretch[i])  # stretch = sqrt(b)
        for j in ti.static(range(3)):
            if ti.static(i != j):
                # h for held, s for stretch: that of b is (h_i^2 - h_j^2) / (s_i^2 - s_j^2), that of the stress
                # 2 mu (h_i - h_j) (h_i + h_j - 1) / (s_i^2 - s_j^2)
                gap = stretch[i] - stretch[j]
                divided = 0.0  # of the clamp; at equal stretches its derivative
                if ti.abs(gap) > 1e-6 * stretch[i]:
                    divided = (held[i] - held[j]) / gap
                elif stretch[i] > low and stretch[i] < high:
                    divided = 1.0
                both = held[i] + held[j]
                rise = both * b_inner[i, j] + hardening * 2.0 * mu * (both - 1.0) * tau_inner[i, j]
                inner[i, j] = divided * rise / (stretch[i] + stretch[j])
    return matmul(frame, matmul(inner, transposed)), grown_adjoint * grown / plastic
