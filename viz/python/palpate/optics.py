"""Light in plane layers: reflection, total reflection, and the pad as a waveguide.

Media are named from the touched side to the camera (outside, layers, outside), or in the order in which the
light meets them; angles are from the normal, of rays that enter at the edge from the edge's normal.
"""

from __future__ import annotations

import html
from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from ._core import _palpate
from ._errors import ArgumentError
from ._live import Estimate

__all__ = [
    "ContactLight", "Fresnel", "GapLight", "LayerAngles", "Led", "LedLight", "LedRays", "MeasuredIndex",
    "StackLight", "Trapped", "contact", "critical", "critical_angle_deg", "fresnel", "gap", "index", "led",
    "numerical_aperture", "stack", "trapped",
]


def _indices(indices: Sequence[float], name: str = "indices") -> list[float]:
    try:
        return [float(n) for n in indices]
    except (TypeError, ValueError):
        raise ArgumentError(f"{name} as a list of numbers", repr(indices)[:80], "[1, 1.39, 1.40, 1.41, 1]") from None


def _led(led: object) -> tuple[int | None, float, float | None, float | None, float]:
    if isinstance(led, Led):
        return led.layer, led.edge_index, led.order, led.half_intensity_deg, led.half_angle_deg
    raise ArgumentError("led as a palpate.optics.Led", repr(led)[:80], "Led(layer=0)")


def _thickness(thickness_mm: float | Sequence[float], indices: Sequence[object]) -> list[float]:
    """One a layer between the first and the last of the media."""
    layers = max(len(indices) - 2, 0)
    given = _indices(np.atleast_1d(np.asarray(thickness_mm, dtype=object)).tolist(), "thickness_mm")
    return given * layers if np.ndim(thickness_mm) == 0 else given


def _together(**arrays: ArrayLike) -> tuple[tuple[int, ...], list[list[float]]]:
    """Arrays of one shape, each as a list; numbers that are not finite are refused."""
    flat = []
    for name, array in arrays.items():
        try:
            values = np.asarray(array, dtype=float)
        except (TypeError, ValueError):
            raise ArgumentError(f"{name} as an array of numbers", repr(array)[:60], "numpy.asarray") from None
        if not np.isfinite(values).all():
            place = tuple(int(i) for i in np.argwhere(~np.isfinite(values))[0])
            raise ArgumentError(f"finite numbers in {name}", f"{values[place]} at index {place}", "numpy.isfinite to find them all")
        flat.append(values)
    try:
        spread = np.broadcast_arrays(*flat)
    except ValueError:
        shapes = " and ".join(str(values.shape) for values in flat)
        raise ArgumentError(f"{' and '.join(arrays)} of shapes that fit each other", shapes, "arrays of one shape, or numbers") from None
    return spread[0].shape, [values.ravel().tolist() for values in spread]


def _table(columns: dict[str, NDArray[Any]]) -> str:
    """HTML of columns of equal length."""
    head = "".join(f"<th>{html.escape(name)}</th>" for name in columns)
    rows = zip(*(np.ravel(column).tolist() for column in columns.values()))
    body = "".join(
        "<tr>" + "".join(f"<td>{cell:.6g}</td>" if isinstance(cell, float) else f"<td>{cell}</td>" for cell in row) + "</tr>"
        for row in rows
    )
    return f"<table><tr>{head}</tr>{body}</table>"


@dataclass(frozen=True, eq=False, repr=False)
class StackLight:
    """Fractions of the light that a stack reflects, passes and absorbs; first axis s, p, unpolarised."""

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
    thickness = _thickness(thickness_mm, indices)
    angles = np.asarray(angle_deg)
    light = _palpate.optics_stack(_indices(indices), _indices(extinction, "extinction"), thickness, angles, wavelength_nm)
    return StackLight(
        angles, light["reflectance"], light["transmittance"], light["absorptance"], light["layer_absorptance"]
    )


def critical_angle_deg(n_in: ArrayLike, n_out: ArrayLike) -> NDArray[np.float64]:
    """The angle beyond which light in ``n_in`` is totally reflected at ``n_out``; NaN where none is.

    Args:
        n_in, n_out: refractive indices, 1 to 10, arrays of any shape.
    """
    shape, (inside, outside) = _together(n_in=n_in, n_out=n_out)
    return np.asarray(_palpate.optics_critical(inside, outside)[0].reshape(shape))


def numerical_aperture(n_in: ArrayLike, n_out: ArrayLike) -> NDArray[np.float64]:
    """sqrt(n_in^2 - n_out^2), 0 where nothing is kept in; indices as of :func:`critical_angle_deg`."""
    shape, (inside, outside) = _together(n_in=n_in, n_out=n_out)
    return np.asarray(_palpate.optics_critical(inside, outside)[1].reshape(shape))


@dataclass(frozen=True, eq=False, repr=False)
class Fresnel:
    """Complex amplitudes over the incident one, at each angle; s: the field stands on the plane of incidence."""

    angle_deg: NDArray[np.float64]
    r_s: NDArray[np.complex128]
    r_p: NDArray[np.complex128]
    t_s: NDArray[np.complex128]
    t_p: NDArray[np.complex128]


def fresnel(n_from: float, n_to: float, angle_deg: ArrayLike = 0.0, *, extinction: float = 0.0) -> Fresnel:
    """Fresnel's amplitudes at one plane interface; its intensities are those of ``stack([n_from, n_to])``.

    Args:
        n_from, n_to: refractive indices, 1 to 10; ``n_from`` is clear.
        angle_deg: of incidence, 0 to 90, an array of any shape.
        extinction: k of the far side, n - ik, 0 to 100.
    """
    shape, (angles,) = _together(angle_deg=angle_deg)
    parts = [part.reshape(shape) for part in _palpate.optics_fresnel(n_from, n_to, extinction, angles)]
    return Fresnel(np.asarray(angle_deg, dtype=float), *parts)


@dataclass(frozen=True, eq=False, repr=False)
class GapLight:
    """Fraction of the light that passes a thin gap."""

    s: NDArray[np.float64]
    p: NDArray[np.float64]
    unpolarised: NDArray[np.float64]


def gap(
    n_from: float,
    n_gap: float,
    n_to: float,
    *,
    angle_deg: ArrayLike,
    gap_nm: ArrayLike,
    wavelength_nm: float = 630.0,
    extinction: float = 0.0,
) -> GapLight:
    """Frustrated total reflection: light through a plane gap as thin as the wavelength.

    Args:
        n_from, n_gap: of the clear medium the light comes from, and of the clear gap; 1 to 10.
        n_to, extinction: of the medium behind, n - ik.
        angle_deg: of incidence, 0 to 90.
        gap_nm: of the gap, 0 or more; broadcast against the angles.
        wavelength_nm: in vacuum.
    """
    shape, (angles, gaps) = _together(angle_deg=angle_deg, gap_nm=gap_nm)
    rows = _palpate.optics_gap(n_from, n_gap, n_to, extinction, wavelength_nm, angles, gaps)
    return GapLight(*(np.asarray(row.reshape(shape)) for row in rows))


@dataclass(frozen=True, eq=False)
class LayerAngles:
    """What each layer of a waveguide can hold: one row a layer, from the touched face."""

    edge_index: float
    """Of the medium that light enters the edge from."""
    index: NDArray[np.float64]
    critical_angle_above_deg: NDArray[np.float64]
    """In the layer, of the outside of the touched face; NaN: nothing is kept in."""
    critical_angle_below_deg: NDArray[np.float64]
    """Of the outside towards the camera."""
    numerical_aperture: NDArray[np.float64]
    """Against the larger index outside."""
    acceptance_half_angle_deg: NDArray[np.float64]
    """Outside of the edge; light within it is kept in."""
    accepts_all: NDArray[np.bool_]
    """Whatever enters is kept in."""
    guided_n_sin: NDArray[np.float64]
    """From and to of n sin(angle) of the light that is kept in; NaN: none."""
    touching_n_sin: NDArray[np.float64]
    """Of the light that is kept in and meets the touched face."""

    def _repr_html_(self) -> str:
        return _table(
            {
                "index": self.index,
                "critical angle above, deg": self.critical_angle_above_deg,
                "critical angle below, deg": self.critical_angle_below_deg,
                "NA": self.numerical_aperture,
                "accepts, deg": self.acceptance_half_angle_deg,
            }
        )


def critical(indices: Sequence[float], *, edge_index: float | None = None) -> LayerAngles:
    """Critical angles, numerical aperture and acceptance of each layer of a waveguide.

    Args:
        indices: outside of the touched face, layers, outside towards the camera; 1 to 10.
        edge_index: of the medium that light enters the edge from; by default the larger outside.
    """
    return LayerAngles(**_palpate.optics_layers(_indices(indices), edge_index))


@dataclass(frozen=True)
class Led:
    """An LED at the pad's edge."""

    layer: int | None = None
    """Whose edge it lights, from 0 at the touched face; None: the middle one, the upper of two."""
    edge_index: float = 1.0
    """Of what lies between LED and edge: 1 is air, the layer's own index an LED that is cast in."""
    order: float | None = None
    """It shines as cos^order of the angle, 1 to 1000; None: 1, Lambert's law."""
    half_intensity_deg: float | None = None
    """Instead of the order: the angle off its axis at which half the intensity is left, up to 60."""
    half_angle_deg: float = 90.0
    """No light beyond this angle."""


@dataclass(frozen=True, eq=False)
class Trapped:
    """Fractions of an LED's light, in the shape of the indices."""

    entering: NDArray[np.float64]
    """The rest is reflected at the edge."""
    guided: NDArray[np.float64]
    """Stays in until something touches."""
    touching: NDArray[np.float64]
    """Guided, and meets the touched face."""
    arriving_per_mm: NDArray[np.float64]
    """At the touched face, meeting after meeting, per mm of the pad's length.

    In a pad of width w the irradiance is the LED's power times this over w.
    """

    def _repr_html_(self) -> str:
        return _table({name: getattr(self, name) for name in ("entering", "guided", "touching", "arriving_per_mm")})


def trapped(indices: Sequence[ArrayLike], *, thickness_mm: float | Sequence[float] = 1.0, led: Led = Led()) -> Trapped:
    """How much of an LED's light the layers hold.

    Args:
        indices: outside of the touched face, layers, outside towards the camera; 1 to 10.  Each may be an
            array, to vary it: ``trapped([1, 1.39, np.linspace(1.3, 1.6), 1.41, 1])``.
        thickness_mm: of each layer, or of all; ``arriving_per_mm`` alone depends on it.
        led: where it shines and how.
    """
    shape, columns = _together(**{f"indices[{i}]": n for i, n in enumerate(indices)}) if len(indices) else ((), [])
    rows = [list(row) for row in zip(*columns)] or [[]]
    found = _palpate.optics_trapped(rows, _thickness(thickness_mm, indices), _led(led))
    return Trapped(**{name: np.asarray(part.reshape(shape)) for name, part in found.items()})


@dataclass(frozen=True, eq=False)
class ContactLight:
    """Light that contacts let out of the pad, in the shape of what was given of them."""

    leaving_per_meeting: NDArray[np.float64]
    """Of the guided light that arrives, the fraction that leaves."""
    leaving_per_mm: NDArray[np.float64]
    """The fraction of the LED's light that leaves per mm of the contact's length along the pad."""
    leaves_up_to_deg: NDArray[np.float64]
    """In the touched layer: guided light up to this angle leaves in part; NaN: nothing leaves."""
    relative: NDArray[np.float64]
    """Brightness over that of the reference."""
    gray: NDArray[np.float64]
    """Change of gray, cut off at the largest; NaN without ``reference_gray``."""
    saturated: NDArray[np.bool_]
    """The gray is cut off."""

    def _repr_html_(self) -> str:
        names = ("leaving_per_meeting", "leaving_per_mm", "leaves_up_to_deg", "relative", "gray")
        return _table({name: getattr(self, name) for name in names})


def contact(
    indices: Sequence[float],
    *,
    thickness_mm: float | Sequence[float],
    contact: ArrayLike,
    extinction: ArrayLike = 0.0,
    albedo: ArrayLike = 1.0,
    gap_nm: ArrayLike = 0.0,
    wavelength_nm: float = 630.0,
    led: Led = Led(),
    reference_index: float = 1.4,
    reference_extinction: float = 0.0,
    reference_albedo: float = 1.0,
    reference_gray: float | None = None,
    most_gray: float = 255.0,
) -> ContactLight:
    """Which light contacts let out of the pad, and how bright they look to the camera.

    Light is unpolarised, lies along the pad as the LED and the layers make it, and the contact is so small
    that it meets undiminished light; gray is in proportion to light.

    Args:
        indices: outside of the touched face, layers, outside towards the camera; 1 to 10.
        thickness_mm: of each layer, or of all.
        contact: refractive index of what touches (water 1.33, skin 1.38 to 1.45), an array of any shape.
        extinction, albedo, gap_nm: of the contacts, broadcast against their indices: k of n - ik, the fraction
            of the light they send back (0 to 1), and the gap of the outside's medium left below them.
        wavelength_nm: matters with a gap only.
        led: where it shines and how.
        reference_index, reference_extinction, reference_albedo: of the contact that brightness is relative to.
        reference_gray: its change of gray at the same place, current and exposure.
        most_gray: the largest change of gray that the camera can show.
    """
    shape, columns = _together(contact=contact, extinction=extinction, albedo=albedo, gap_nm=gap_nm)
    rows = [(reference_index, reference_extinction, reference_albedo, 0.0), *zip(*columns)]
    thickness = _thickness(thickness_mm, indices)
    found = _palpate.optics_contact(
        _indices(indices), thickness, _led(led), rows, wavelength_nm, reference_gray, most_gray
    )
    return ContactLight(**{name: np.asarray(part.reshape(shape)) for name, part in found.items()})


@dataclass(frozen=True, eq=False)
class LedRays:
    """Rays in the plane of the LED, the edge at x = 0."""

    angle_deg: NDArray[np.float64]
    """Outside, from the edge's normal; positive: towards the touched face."""
    n_sin: NDArray[np.float64]
    """n sin of the angle from the layers' normal, the same in all layers."""
    fate: tuple[str, ...]
    """``touching`` (guided, meets the touched face), ``guided`` or ``leaving``."""
    entering: NDArray[np.float64]
    """Fraction that passes the edge."""
    first_mm: NDArray[np.float64]
    """Where it first meets the touched face; infinity: never."""
    hop_mm: NDArray[np.float64]
    """From one meeting to the next."""
    path_mm: tuple[NDArray[np.float64], ...] = field(repr=False)
    """The way of each: points x 2, distance from the edge and depth below the touched face."""


@dataclass(frozen=True, eq=False)
class LedLight:
    """Where an LED's light goes from the edge."""

    layer: int
    """That it lights, from 0 at the touched face."""
    depth_mm: float
    """Of the LED below the touched face."""
    entering: float
    """Fraction of its light that enters."""
    guided: float
    touching: float
    nearest_mm: float
    """Nearer to the edge no guided light in the LED's plane meets the face; infinity: none does."""
    half_mm: float
    """Within this distance half of the touching light has met the face; infinity: not within the pad."""
    nine_tenths_mm: float
    """Within this distance nine tenths of it have."""
    distance_mm: NDArray[np.float64] = field(repr=False)
    """From the edge, rising."""
    fraction: NDArray[np.float64] = field(repr=False)
    """Of the LED's light: has met the face at least once within ``distance_mm``."""
    rays: LedRays = field(repr=False)

    def _repr_html_(self) -> str:
        names = ("depth_mm", "entering", "guided", "touching", "nearest_mm", "half_mm", "nine_tenths_mm")
        return _table({name: np.array([getattr(self, name)], dtype=float) for name in names})


def led(
    indices: Sequence[float],
    *,
    thickness_mm: float | Sequence[float],
    led: Led = Led(),
    depth_mm: float | None = None,
    length_mm: float = 30.0,
    angle_deg: ArrayLike | None = None,
) -> LedLight:
    """Where an LED's rays go from the edge: what is trapped, and where it first meets the face.

    Args:
        indices: outside of the touched face, layers, outside towards the camera; 1 to 10.
        thickness_mm: of each layer, or of all.
        led: the layer it lights and how it shines.
        depth_mm: of the LED below the touched face; by default the middle of its layer.
        length_mm: of the pad from this edge.
        angle_deg: of the rays to follow, between -90 and 90; by default 21, evenly spread.
    """
    lit = _led(led)
    widest = min(lit[-1], 89.0)
    angles = np.linspace(-widest, widest, 21) if angle_deg is None else angle_deg
    _, (given,) = _together(angle_deg=angles)
    thickness = _thickness(thickness_mm, indices)
    found: dict[str, Any] = _palpate.optics_led(_indices(indices), thickness, lit, depth_mm, length_mm, given)
    rays = LedRays(
        angle_deg=np.array(given), n_sin=found.pop("n_sin"), fate=tuple(found.pop("fate")),
        entering=found.pop("ray_entering"), first_mm=found.pop("first_mm"), hop_mm=found.pop("hop_mm"),
        path_mm=tuple(found.pop("path_mm")),
    )
    return LedLight(rays=rays, **found)


@dataclass(frozen=True, eq=False)
class MeasuredIndex:
    """A refractive index from laser spots, by one measurement or several."""

    index: Estimate
    """With its standard error; several measurements: the mean weighted by their errors."""
    each: NDArray[np.float64]
    each_sd: NDArray[np.float64]
    incidence_deg: NDArray[np.float64]
    refraction_deg: NDArray[np.float64]
    parts_sd: NDArray[np.float64] = field(repr=False)
    """Measurements x 5: what OD, ON, M1M2, NM2 and the air's index add to the standard error."""
    chi_square: float
    """Of the measurements about their mean; 0 where no uncertainty is known."""
    widened: bool
    """They scatter more than their own errors say, and the error is widened by that."""

    def _repr_html_(self) -> str:
        return html.escape(f"n = {self.index}")


def index(
    *,
    od_mm: ArrayLike,
    on_mm: ArrayLike,
    m1m2_mm: ArrayLike,
    nm2_mm: ArrayLike,
    sd_mm: float | Sequence[float] = 0.0,
    air_index: float = 1.000271,
    air_index_sd: float = 0.0,
) -> MeasuredIndex:
    """Refractive index of a clear liquid or silicone on a glass plate, from laser spots on a wall.

    Args:
        od_mm, on_mm: tan of the angle of incidence is OD / ON; arrays where the measurement was repeated.
        m1m2_mm: between the spots of the liquid's surface (M2) and of the glass below it (M1).
        nm2_mm: from the bare glass's spot (N) to M2; more than ``m1m2_mm``.
        sd_mm: standard uncertainty of the lengths: one for all, or of OD, ON, M1M2 and NM2; 0: not known.
        air_index, air_index_sd: of the air, 1 to 2, with its standard uncertainty.
    """
    _, columns = _together(od_mm=od_mm, on_mm=on_mm, m1m2_mm=m1m2_mm, nm2_mm=nm2_mm)
    sd = [float(s) for s in np.atleast_1d(sd_mm)] * (4 if np.ndim(sd_mm) == 0 else 1)
    if len(sd) != 4:
        raise ArgumentError("one sd_mm for all lengths, or four: of OD, ON, M1M2, NM2", str(len(sd)), "sd_mm=0.5")
    found: dict[str, Any] = _palpate.optics_index([list(row) for row in zip(*columns)], sd, air_index, air_index_sd)
    mean, error = found.pop("index"), found.pop("standard_error")
    known = any(sd) or air_index_sd > 0 or len(columns[0]) > 1
    return MeasuredIndex(index=Estimate(mean, error if known else float("nan")), **found)
