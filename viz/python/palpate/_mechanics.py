"""Contact mechanics, the forward model, wrench and strain of recordings."""

from __future__ import annotations

import csv
import html
import io
import numbers
from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ._core import _palpate, path_text
from ._errors import ArgumentError
from ._live import Path, rate_of, request_of, Sensor
from ._recordings import column_of

__all__ = ["Compression", "Contacting", "Pressed", "WrenchSeries", "contact", "forward", "strain", "wrench"]


@dataclass(frozen=True, eq=False)
class Contacting:
    """An indenter on a pad."""

    force_N: float
    depth_mm: float
    """Of the deepest point."""
    radius_mm: float
    """Of the contact circle."""
    pressure_max_kPa: float
    hertz_error: float
    """Relative error of plain Hertz in force at this depth."""
    strain: float
    """0.2 a/R of a sphere: how far linear elasticity is stretched."""
    young_kPa: float
    """Of the pad, of layers in series."""
    r_mm: NDArray[np.float64] = field(repr=False)
    """221 distances from the axis, to a tenth beyond the rim."""
    pressure_kPa: NDArray[np.float64] = field(repr=False)
    """At these; infinite at the rim of a flat punch and at the tip of a cone."""


def _each_layer(value: object, name: str) -> list[float]:
    """A number, or one for each layer."""
    listed = [value] if isinstance(value, numbers.Real) else value
    if isinstance(listed, (Sequence, np.ndarray)) and not isinstance(listed, str):
        if all(isinstance(one, numbers.Real) and not isinstance(one, bool) for one in listed):
            return [float(one) for one in listed]
    raise ArgumentError(f"{name} as a number, or one for each layer", repr(value)[:80], f"{name}=60, or {name}=[140, 80, 34]")


def contact(
    *,
    force_N: float | None = None,
    depth_mm: float | None = None,
    young_kPa: float | Sequence[float],
    poisson: float = 0.5,
    thickness_mm: float | Sequence[float] | None = None,
    series: str = "thickness",
    shape: str = "sphere",
    radius_mm: float = 1.0,
    radius2_mm: float | None = None,
    half_angle_deg: float = 70.0,
    indenter_young_MPa: float | None = None,
    indenter_poisson: float = 0.3,
    sliding: bool = False,
) -> Contacting:
    """Contact of an indenter with an elastic pad of finite thickness.

    Args:
        force_N, depth_mm: one of them.
        young_kPa, poisson: of the pad; of several layers a modulus each.
        thickness_mm: of a pad on a rigid base, or of each layer; None: a half space.
        series: modulus of several layers together: ``thickness``, sum(t) / sum(t/E), or ``paper``, 1 / sum(1/E).
        shape: ``sphere``, ``paraboloid``, ``cone`` or ``flat``.
        radius_mm: of sphere, paraboloid or flat punch.
        radius2_mm: of a domed pad; None: flat.
        half_angle_deg: of a cone, from its axis.
        indenter_young_MPa, indenter_poisson: of the indenter; None: rigid.
        sliding: the pad slides on its base; else it is bonded.
    """
    return Contacting(
        **_palpate.contact(
            force_N, depth_mm, _each_layer(young_kPa, "young_kPa"), poisson,
            [] if thickness_mm is None else _each_layer(thickness_mm, "thickness_mm"), series, shape,
            radius_mm, radius2_mm, half_angle_deg, indenter_young_MPa, indenter_poisson, sliding,
        )
    )


@dataclass(frozen=True, eq=False)
class Pressed:
    """A pressed block; where it is not ``converged`` no number is to be used."""

    converged: bool
    residual: float
    force_N: float
    press_mm: float
    center_stress_Pa: float
    contact_radius_mm: float
    core_strain: float
    pitch_mm: tuple[float, float]
    """Of the maps, along x and y."""
    stress_Pa: NDArray[np.float32] = field(repr=False)
    """Normal stress on the surface, pressure counts up; one value a node."""
    deflection_mm: NDArray[np.float32] = field(repr=False)
    warnings: tuple[str, ...]


def forward(
    *,
    block_mm: Sequence[float] = (40.0, 40.0, 20.0),
    young_Pa: float = 4000.0,
    poisson: float = 0.495,
    lump: str | None = "sphere",
    size_mm: float | Sequence[float] = 8.0,
    depth_mm: float = 5.0,
    stiffness_ratio: float = 10.0,
    offset_mm: Sequence[float] = (0.0, 0.0),
    presser: str = "flat",
    ball_radius_mm: float = 0.0,
    press_mm: float | None = None,
    force_N: float | None = None,
    cells: Sequence[int] = (64, 64, 32),
    large_strain: bool = False,
    threads: int = 0,
) -> Pressed:
    """What a block of tissue with a lump in it answers to a press, by finite elements.

    Args:
        block_mm, young_Pa, poisson: length, width and thickness of the tissue; its elasticity.
        lump: ``sphere``, ``ellipsoid``, ``cylinder``, ``lying``, or None.
        size_mm: of the lump along x, y and z, or of all.
        depth_mm: from the surface to the lump's top.
        stiffness_ratio: the lump's modulus over the tissue's.
        offset_mm: of the lump's centre from the block's middle.
        presser: ``flat``, ``sphere`` (of ``ball_radius_mm``) or ``pressure``.
        press_mm, force_N: one of them; by default 1 mm.
        cells: of the tissue along x, y and z.
        large_strain: neo-Hookean tissue; of the flat presser.
        threads: 0: one a core.
    """
    sizes = np.broadcast_to(np.asarray(size_mm, dtype=float), 3).tolist()
    way = 1.0 if press_mm is None and force_N is None else press_mm
    return Pressed(
        **_palpate.forward(
            list(map(float, block_mm)), young_Pa, poisson, lump, sizes, depth_mm, stiffness_ratio,
            list(map(float, offset_mm)), presser, ball_radius_mm, way, force_N, list(cells), large_strain,
            threads,
        )
    )


@dataclass(frozen=True, eq=False)
class WrenchSeries:
    """Force and moment on the pad by its elastic layer, frame by frame."""

    columns: dict[str, NDArray[Any]] = field(repr=False)
    """As in the table of ``palpate wrench``: frame, time_s, contact, six components with errors and states."""
    peak: int | None
    """The row of the largest normal force; None: nothing touches."""
    pressure_kPa: NDArray[np.float32] | None = field(repr=False)
    """At the peak, rows x columns of cells of ``cell_mm``."""
    shear_kPa: NDArray[np.float32] | None = field(repr=False)
    """2 (x, y) x rows x columns; None where no skin is followed."""
    cell_mm: float
    check: dict[str, float] | None
    """Against a gauge: mean_error_N, coverage of the 95 % interval, ..."""
    notes: tuple[str, ...]


def _cell(text: str) -> float | str | None:
    if text == "":
        return None
    try:
        return float(text)
    except ValueError:
        return text


def wrench(
    recording: Path,
    *,
    sensor: Sensor | Path | None = None,
    background: Path | None = None,
    gauge: Path | None = None,
    align: str | float = "",
    rate_Hz: float | None = None,
    sequence: bool = False,
    device: str = "",
    seed: int = 1,
) -> WrenchSeries:
    """Force and moment on the pad, pressure and shear, by its elastic layer (``layer`` of the sensor file).

    Args:
        gauge: table of a force gauge with the recording, or ``"truth"`` of a simulated scene.
        align: as of :func:`palpate.calibrate.force`.
        recording, sensor, background, rate_Hz, sequence, device, seed: as of :func:`palpate.open`.
    """
    found = _palpate.wrench(
        request_of(recording, sensor, background, None, seed), path_text(gauge or "", "gauge"), str(align),
        rate_of(rate_Hz), sequence, device,
    )
    rows = list(csv.reader(io.StringIO(found.pop("csv"))))
    columns = {name: column_of([_cell(row[i]) for row in rows[1:]]) for i, name in enumerate(rows[0])}
    return WrenchSeries(columns=columns, notes=tuple(found.pop("notes")), **found)


@dataclass(frozen=True, eq=False)
class Compression:
    """How a shape changed from one frame to another."""

    frames: tuple[int, int]
    reason: str
    """Why there is no strain; empty: there is."""
    by_skin: bool
    """Points of the skin were followed; else points of the shape were matched."""
    plane: dict[str, float] | None
    """Green-Lagrange strain: xx, yy, xy, first, second, direction_rad, area."""
    plane_sd: dict[str, float] | None
    """Its standard errors."""
    axial: float
    """By the change of area; NaN: not known."""
    axial_sd: float
    deepening_mm: float
    pairs: NDArray[np.float64] = field(repr=False)
    """Points x 7: x, y, depth before and after (mm), probability."""

    def __str__(self) -> str:
        if self.reason:
            return f"no strain: {self.reason}"
        return f"axial strain {100 * self.axial:+.2f} ± {100 * self.axial_sd:.2f} %"

    def _repr_html_(self) -> str:
        return html.escape(str(self))


def strain(
    recording: Path,
    *,
    frames: tuple[int, int] | None = None,
    forces_N: tuple[float, float] | None = None,
    sensor: Sensor | Path | None = None,
    background: Path | None = None,
    sequence: bool = False,
    by_shape: bool = False,
    poisson: float = 0.5,
    lam: float | None = None,
    device: str = "",
    seed: int = 1,
) -> Compression:
    """Measure how an object's shape changes from one compression to the next.

    Args:
        frames: the two frames, or
        forces_N: the frames nearest to these while loading; by default half of the peak and the peak.
        by_shape: match shapes although the skin's points were followed.
        poisson: for the axial strain, 0 to 0.5.
        lam: stiffness of the spline; None: chosen by the data.
        recording, sensor, background, sequence, device, seed: as of :func:`palpate.open`.
    """
    request = request_of(recording, sensor, background, None, seed, sequence=sequence)
    return Compression(**_palpate.strain(request, frames, forces_N, by_shape, poisson, lam, seed, device))
