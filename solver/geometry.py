"""Frames and rotations of the stand, the platform and the gyro's case.

All rotations are passive: they turn the frame, so that ``matrix @ vector`` gives the same vector's
components in the turned frame. With R₁, R₂, R₃ the elementary rotations about axes 1, 2, 3::

    A(θ, ψ)      = R₃(ψ)·R₁(θ)              commanded platform orientation, paper, eq. (7)
    E(α, β, γ)   = R₃(γ)·R₂(β)·R₁(α)        certified misalignment, paper, eq. (8)
    B(ε₁, ε₂, ε₃) = R₃(ε₃)·R₂(ε₂)·R₁(ε₁)    base of the stand (level, level, azimuth)
    Ã            = E·A·B                    geographic → case, paper, eq. (9)

Nothing here assumes small angles. Matrices are stacked along the leading axes: (..., 3, 3).
"""

from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from solver.records import Array, Observations


class Elements(NamedTuple):
    """The elements of Ã that the method uses, each (...,): paper, eq. (14).

    ``a``, ``b`` are the north components along the case axes x and y, ``c``, ``d``, ``e`` the
    upward ones along x, y and z; the latter are also the specific force in units of g.
    """

    a: Array
    b: Array
    c: Array
    d: Array
    e: Array


def rotation_1(angle: ArrayLike) -> Array:
    """R₁: passive rotation about the first axis; `angle` (...,) in rad gives (..., 3, 3)."""
    return _about(angle, 1, 2)


def rotation_2(angle: ArrayLike) -> Array:
    """R₂: passive rotation about the second axis; `angle` (...,) in rad gives (..., 3, 3)."""
    return _about(angle, 2, 0)


def rotation_3(angle: ArrayLike) -> Array:
    """R₃: passive rotation about the third axis; `angle` (...,) in rad gives (..., 3, 3)."""
    return _about(angle, 0, 1)


def _about(angle: ArrayLike, first: int, second: int) -> Array:
    """Rotate in the plane of axes `first` and `second`, from the first towards the second."""
    angle = np.asarray(angle, dtype=np.float64)
    matrix = np.zeros((*angle.shape, 3, 3))
    fixed = 3 - first - second
    matrix[..., fixed, fixed] = 1.0
    cosine, sine = np.cos(angle), np.sin(angle)
    matrix[..., first, first] = cosine
    matrix[..., first, second] = sine
    matrix[..., second, first] = -sine
    matrix[..., second, second] = cosine
    return matrix


def commanded(theta: ArrayLike, psi: ArrayLike) -> Array:
    """A(θ, ψ), the platform's commanded orientation, (..., 3, 3): paper, eq. (7)."""
    return rotation_3(psi) @ rotation_1(theta)


def misalignment(alpha: ArrayLike, beta: ArrayLike, gamma: ArrayLike) -> Array:
    """E(α, β, γ), the certified misalignment, (..., 3, 3): paper, eq. (8)."""
    return rotation_3(gamma) @ rotation_2(beta) @ rotation_1(alpha)


def base(level_1: ArrayLike, level_2: ArrayLike, azimuth: ArrayLike) -> Array:
    """B(ε₁, ε₂, ε₃), the orientation of the stand's base, (..., 3, 3)."""
    return rotation_3(azimuth) @ rotation_2(level_2) @ rotation_1(level_1)


def case_orientation(
    theta: ArrayLike,
    psi: ArrayLike,
    alpha: ArrayLike,
    beta: ArrayLike,
    gamma: ArrayLike,
    base_orientation: Array | None = None,
) -> Array:
    """Ã = E·A·B, geographic → case: paper, eq. (9).

    Parameters
    ----------
    theta, psi, alpha, beta, gamma
        Angles, rad, of one shape (...,) or broadcastable.
    base_orientation : (..., 3, 3) array, optional
        B; without it the base is level and oriented, as the paper takes it.
    """
    turned = misalignment(alpha, beta, gamma) @ commanded(theta, psi)
    return turned if base_orientation is None else turned @ base_orientation


def elements(orientation: Array) -> Elements:
    """Pick a, b, c, d, e from Ã (..., 3, 3): paper, eq. (14)."""
    return Elements(
        a=orientation[..., 0, 1],
        b=orientation[..., 1, 1],
        c=orientation[..., 0, 2],
        d=orientation[..., 1, 2],
        e=orientation[..., 2, 2],
    )


def elements_of(observations: Observations, base_orientation: Array | None = None) -> Elements:
    """Elements of (14) for every measured position, each (n,)."""
    at = observations
    return elements(case_orientation(at.theta, at.psi, at.alpha, at.beta, at.gamma, base_orientation))
