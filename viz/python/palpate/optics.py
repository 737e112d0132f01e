"""Light in stacks of plane layers."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from ._core import _palpate

__all__ = ["StackLight", "stack"]


@dataclass(frozen=True, eq=False, repr=False)
class StackLight:
    """Shares of the light that a stack reflects, passes and absorbs; first axis s, p, unpolarised."""

    angle_deg: NDArray[np.float64]
    s_and_p_reflectance: NDArray[np.float64]
    s_and_p_transmittance: NDArray[np.float64]
    s_and_p_absorptance: NDArray[np.float64]
    layer_absorptance: NDArray[np.float64]

    @property
    def reflectance(self) -> NDArray[np.float64]:
        """Of unpolarised light, at each angle."""
        return np.asarray(self.s_and_p_reflectance[2])

    @property
    def transmittance(self) -> NDArray[np.float64]:
        """Of unpolarised light, at each angle."""
        return np.asarray(self.s_and_p_transmittance[2])

    @property
    def absorptance(self) -> NDArray[np.float64]:
        """Of unpolarised light, at each angle."""
        return np.asarray(self.s_and_p_absorptance[2])


def stack(
    indices: Sequence[float],
    *,
    angle_deg: ArrayLike = 0.0,
    extinction: Sequence[float] = (),
    thickness_mm: float | Sequence[float] = 1.0,
    wavelength_nm: float = 630.0,
) -> StackLight:
    """Light onto plane layers that are thick against its coherence length: intensities add.

    Args:
        indices: of the medium the light comes from, of each layer, and of the medium behind; 1 to 10.
        angle_deg: of incidence, 0 to 90, an array of any shape.
        extinction: of each of these media (0: clear), k of n - ik; by default all are clear.
        thickness_mm: of each layer, or of all; of no effect where a layer is clear.
        wavelength_nm: in vacuum.
    """
    layers = max(len(indices) - 2, 0)
    given = np.atleast_1d(np.asarray(thickness_mm, dtype=float)).tolist()
    thickness = given * layers if np.ndim(thickness_mm) == 0 else given
    angles = np.asarray(angle_deg)
    light = _palpate.optics_stack([float(n) for n in indices], [float(k) for k in extinction], thickness, angles, wavelength_nm)
    return StackLight(
        angles, light["reflectance"], light["transmittance"], light["absorptance"], light["layer_absorptance"]
    )
