"""What weights by an estimated u(J) add to the uncertainty of an estimate.

Where u_i is small by chance the weight is large, so that an estimate q = H·right_side with weights by û leans on
the currents whose û is below their σ, and H·Σ(û²)·Hᵀ is too small. To first order in 1/ν, with Hk_i the effect of
a current's error on the parameters (`solver.inputs.by_currents`)::

    ∂ ln (Hk_i)²/∂ ln σ_i² = −2·r_i,    r_i = σ_i²·k_iᵀ·WᵀW·(1 − design·H)·k_i
    E[(Hk_i)²·(û_i² − σ_i²)] = −(4·r_i/ν_i)·(Hk_i)²·σ_i²

which counting û_i²·(1 + 4·r_i/ν_i) in the place of û_i² makes good. r_i is what the fit leaves of a unit error
in a whitened current: 1 minus its leverage. For a weighted mean that is Meier's correction (P. Meier, Biometrics 9,
1953, 59), for V⁻¹ as weights that of M. G. Kenward and J. H. Roger (Biometrics 53, 1997, 983). It
does not change the weights themselves, nor χ². A channel whose û are all one, pooled or stated so, has no
such weights: nothing is added.
"""

from dataclasses import replace

import numpy as np

from solver.error_model import Equations
from solver.estimators.rate_noise import Noise, blocks_of, whiten
from solver.inputs import by_currents
from solver.records import Array


def widening_of(equations: Equations, values: Array, gain: Array, whitening: Array | None) -> Array | None:
    """Factors on u(J), (n, 2), that allow for weights by estimates of it; None where u(J) is exact.

    Parameters
    ----------
    values : (8,) array
        The estimate.
    gain : (8, 2n) array
        H.
    whitening : (n, 2, 2) or (2n, 2n) array or None
        W of its weights, by position or whole; None: it does not weigh.
    """
    u, dof = equations.u_currents, equations.dof_currents
    if u is None or dof is None or whitening is None or not np.isfinite(dof).any():
        return None
    columns = by_currents(len(u), values) * u.ravel()
    left = columns - equations.design @ (gain @ columns)
    if whitening.ndim == 2:
        columns, left = whitening @ columns, whitening @ left
    else:
        columns, left = whiten(whitening, columns), whiten(whitening, left)
    remaining = np.maximum(np.einsum("ij,ij->j", columns, left), 0.0).reshape(u.shape)
    return np.asarray(np.sqrt(1.0 + np.where(np.ptp(u, axis=0) > 0.0, 4.0 * remaining / dof, 0.0)))


def widened(noise: Noise, equations: Equations, values: Array, widening: Array | None) -> Noise:
    """Noise with the currents' part widened where it counts for the covariance, not where residuals are judged."""
    if widening is None or equations.u_currents is None or noise.basis != "given":
        return noise
    added = blocks_of(values, equations.u_currents * np.sqrt(widening**2 - 1.0))
    covariance = noise.covariance + added
    alone = noise.independent is noise.covariance
    return replace(
        noise, covariance=covariance, independent=covariance if alone else noise.independent + added
    )


def widened_block(
    design: Array, u: tuple[Array, Array], dof: tuple[Array, Array], values: Array, covariance: Array
) -> Array:
    """Covariances of a block of sessions solved by least squares, with u(J) widened; (8, 8, B).

    Parameters
    ----------
    design : (B, 2n, 8) array
    u, dof : two of (n, B) or (n, 1) arrays
        Of Jx and Jy.
    values : (8, B) array
    covariance : (8, 8, B) array
        That of the weights.
    """
    count, rows, _ = design.shape
    kx, ky, kxy, kyx = values[:4]
    inverse = np.array([[ky, -kxy], [-kyx, kx]]) / (kx * ky - kxy * kyx)
    scale = np.stack(np.broadcast_arrays(*u), axis=-1).swapaxes(0, 1)  # (B or 1, n, 2)
    freedom = np.stack(np.broadcast_arrays(*dof), axis=-1).swapaxes(0, 1)
    whole = inverse.transpose(2, 0, 1)[:, None] @ design.reshape(count, rows // 2, 2, 8) / scale[..., None]
    whitened = whole.reshape(count, rows, 8)
    gain = whitened @ covariance.transpose(2, 0, 1)
    remaining = np.maximum(1.0 - np.einsum("bmi,bmi->bm", whitened, gain), 0.0).reshape(count, -1, 2)
    differ = np.ptp(scale, axis=1, keepdims=True) > 0.0
    factor = np.where(differ, 4.0 * remaining / freedom, 0.0).reshape(count, rows, 1)
    return np.asarray(covariance + (gain.swapaxes(1, 2) @ (factor * gain)).transpose(1, 2, 0))
