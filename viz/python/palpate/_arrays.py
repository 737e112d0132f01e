"""Heights from slopes, matching of point sets, thin-plate splines."""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np
from numpy.typing import ArrayLike, NDArray

from ._core import _palpate

__all__ = ["Heights", "Match", "PlateFit", "Strain", "ThinPlate", "integrate", "match"]

PlateFit = _palpate.PlateFit
ThinPlate = _palpate.ThinPlate


@dataclass(frozen=True, eq=False)
class Heights:
    """Heights from slopes, and how far they are to be believed."""

    height: NDArray[np.float32] = field(repr=False)
    """rows x columns, mean 0, in the slopes' unit times one pixel."""
    residual: float
    """What the solve leaves of its equations, relative RMS."""
    inconsistency: float
    """Fraction of the slopes that no surface explains, 0 to 1."""
    peak_to_valley: float
    islands: int
    """Parts that nothing known joins: heights between them are not determined."""
    unknown_px: int
    kinks: int
    """Places where the slope jumps, where they were looked for."""
    iterations: int
    converged: bool


def integrate(
    gx: ArrayLike,
    gy: ArrayLike,
    *,
    weights: ArrayLike | None = None,
    solver: str = "best",
    kinks: bool = False,
    device: str = "",
) -> Heights:
    """The surface whose differences fit the slopes best (least squares, no rim pinned, tilt kept).

    Args:
        gx: dz/dx (to the right) of each pixel, rows x columns, any real dtype and strides.
        gy: dz/dy (downwards), likewise.
        weights: how much each pixel counts, rows x columns, at least 0; where it is 0 slopes may be NaN.  A
            mask of booleans will do.
        solver: ``best``, on the device or the processor, or ``live``, which is faster.
        kinks: look for places where the slope jumps, and keep heights around them from ringing.
        device: index or part of the name of a Vulkan device; by default the best one.
    """
    return Heights(**_palpate.integrate(gx, gy, weights, solver, kinks, device))


@dataclass(frozen=True, eq=False)
class Match:
    """Which point of one set is which of another."""

    reliable: bool
    verdict: str
    """Why not, where it is not reliable."""
    partner: NDArray[np.int64] = field(repr=False)
    """Of each point at rest the index of its partner; -1: none."""
    probability: NDArray[np.float64] = field(repr=False)
    """Of that partner, or of there being none, 0 to 1; NaN without a reliable match."""
    warped: NDArray[np.float64] = field(repr=False)
    """The points at rest brought onto the others; the best try where it is not reliable."""
    noise_sd: float
    """Of the points about the warped ones, per axis."""
    posterior: float
    """Of this match against other ones, 0 to 1."""
    target_outlier_fraction: float
    template_nil_fraction: float
    converged: bool

    @property
    def found(self) -> NDArray[np.bool_]:
        """Which points at rest have a partner."""
        return np.asarray(self.partner >= 0)


def match(
    rest: ArrayLike, pressed: ArrayLike, *, reflections: bool = False, most_turn_deg: float = 180.0
) -> Match:
    """Which point of ``pressed`` is which of ``rest``, bent, moved, noisy, some without a partner.

    Args:
        rest: points x 2 or points x 3, any unit.
        pressed: the same, in any order and number.
        reflections: the second set may be the first one's mirror image.
        most_turn_deg: turns by more are not tried, 0 to 180.
    """
    return Match(**_palpate.match(rest, pressed, reflections, most_turn_deg))


@dataclass(frozen=True, eq=False, repr=False)
class Strain:
    """Green-Lagrange strain in the plane at each place; one number a place."""

    xx: NDArray[np.float64]
    yy: NDArray[np.float64]
    xy: NDArray[np.float64]
    """Of the tensor: half the engineering shear."""
    first: NDArray[np.float64]
    """The larger principal strain."""
    second: NDArray[np.float64]
    direction_rad: NDArray[np.float64]
    """Of the first, from +x towards +y."""
    shear: NDArray[np.float64]
    """Largest of the tensor."""
    area: NDArray[np.float64]
    """Change of area over area at rest."""


def _strain(self: PlateFit, xy: ArrayLike) -> Strain:
    """Strain of a fit of two shifts at places (n x 2), shifts and places in one unit."""
    return Strain(**self._strain(xy))


setattr(PlateFit, "strain", _strain)
