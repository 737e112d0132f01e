"""The lump behind pressure maps."""

from __future__ import annotations

import html
import json
from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from ._core import _palpate, path_text
from ._errors import ArgumentError
from ._live import Path

__all__ = ["Change", "DetectionLimit", "Interval", "Lump", "compare", "estimate"]


@dataclass(frozen=True)
class Interval:
    """A value with the interval that holds the truth nine times out of ten."""

    value: float
    low: float
    high: float

    def __float__(self) -> float:
        return self.value

    def __str__(self) -> str:
        return f"{self.value:.3g} ({self.low:.3g} to {self.high:.3g})"


@dataclass(frozen=True)
class DetectionLimit:
    """The smallest ball that would be seen nine times in ten; ``size_mm`` is None where none that fits would be."""

    depth_mm: float
    stiffness_ratio: float
    size_mm: float | None


@dataclass(frozen=True)
class Lump:
    """What is said of a lump; values are None where the state does not allow them."""

    state: str
    detection: float
    false_alarm_rate: float
    size_mm: Interval | None
    depth_mm: Interval | None
    stiffness_ratio: Interval | None
    x_mm: Interval | None
    y_mm: Interval | None
    shape: str
    shape_probability: dict[str, float]
    method: str
    reasons: tuple[str, ...]
    text: str
    detection_limits: tuple[DetectionLimit, ...] = ()
    """Where there is no lump: what would have been seen."""
    young_Pa: Interval | None = None
    """Of the tissue, where ``press_mm`` told it."""
    lumps: tuple[Lump, ...] = ()
    """Each lump that was estimated: both of two that are told apart, where the values above are None."""

    @property
    def found(self) -> bool:
        """There is a lump whose numbers can be used."""
        return self.state in ("found", "stiffness open")

    def __str__(self) -> str:
        return self.text

    def _repr_html_(self) -> str:
        return f"<pre>{html.escape(self.text)}</pre>"


@dataclass(frozen=True)
class Change:
    """A lump's change from the first day; values are None where the days cannot be compared."""

    day: str
    verdict: str
    sentence: str
    size_mm: Interval | None
    """Of the diameter."""
    depth_mm: Interval | None
    """Of the depth of its top."""
    size_factor: Interval | None
    depth_factor: Interval | None
    ratio_factor: Interval | None
    """Stiffness ratio over the first day's."""
    least_growth_mm: float | None
    """Growth that would have been told nine times in ten."""
    reasons: tuple[str, ...]

    def __str__(self) -> str:
        return self.sentence


def compare(
    first: Path,
    *later: Path,
    young_error: float = 0.1,
    thickness_error: float = 0.05,
    pitch_error: float = 0.01,
    network: Path | None = None,
) -> list[Change]:
    """How one lump has changed since the first day, each later day by itself.

    Args:
        first, later: folders that ``palpate lump estimate`` or ``palpate lump scan`` wrote with ``--out``.
        young_error, thickness_error, pitch_error: relative errors of the tissue's modulus and thickness and of
            the pitch (90 % intervals), alike on all days.
        network: a file of ``palpate-lab train``; by default the built-in one.
    """
    answer = json.loads(
        _palpate.lump_compare(
            [path_text(day, "a day") for day in (first, *later)], (young_error, thickness_error, pitch_error),
            path_text(network or "", "network"),
        )
    )

    def change(day: dict[str, Any]) -> Change:
        c = day["change"]

        def interval(name: str) -> Interval | None:
            return Interval(**c[name]) if name in c else None

        return Change(
            day=day["day"],
            verdict=c["verdict"],
            sentence=c["sentence"],
            size_mm=interval("size_mm"),
            depth_mm=interval("depth_mm"),
            size_factor=interval("size_factor"),
            depth_factor=interval("depth_factor"),
            ratio_factor=interval("ratio_factor"),
            least_growth_mm=c.get("least_growth_mm"),
            reasons=tuple(c["reasons"]),
        )

    return [change(day) for day in answer["days"][1:]]


def estimate(
    pressure_Pa: Sequence[ArrayLike],
    *,
    force_N: float | Sequence[float],
    young_Pa: float | None = None,
    press_mm: float | Sequence[float] = (),
    press_sd_mm: float = 0.05,
    thickness_mm: float = 20.0,
    block_mm: tuple[float, float] = (40.0, 40.0),
    pitch_mm: float = 1.25,
    window_mm: tuple[float, float] = (0.0, 0.0),
    noise_Pa: float | None = None,
    skin_mm: float | tuple[float, float] | None = None,
    skin_ratio: float | tuple[float, float] | None = None,
    plate_friction: float | tuple[float, float] | None = None,
    plate_sticks: bool = False,
    young_error: float = 0.1,
    thickness_error: float = 0.05,
    pitch_error: float = 0.01,
    uneven_sd: float = 0.01,
    place_sd_mm: float = 0.2,
    network: Path | None = None,
    method: str = "refined",
) -> Lump:
    """Size, depth and stiffness of the lump behind pressure maps, each with its interval.

    Args:
        pressure_Pa: a map (rows x columns, Pa; NaN: not seen) for each load, or one map alone.
        force_N: on the whole block at each load.
        young_Pa: of the tissue, from a place without a lump; not needed with ``press_mm``.
        press_mm: way of the plate at each load from where it touches; finds the modulus.
        press_sd_mm: its standard error.
        thickness_mm: of the tissue.
        block_mm: its length and width.
        pitch_mm: between a map's nodes.
        window_mm: the maps' middle from the block's middle, x and y.
        noise_Pa: standard deviation of a value; by default from the last map's roughness.
        skin_mm, skin_ratio: thickness of a skin on the tissue, part of ``thickness_mm``, and its modulus over that
            of the tissue below; ``(2, 0.2)``: 2 with a standard deviation of 0.2.
        plate_friction: coefficient with which the tissue slides along the plate, likewise; by default it slides
            without friction.
        plate_sticks: the plate holds the tissue sideways.
        young_error, thickness_error, pitch_error: relative errors of these (90 % intervals);
            they widen the intervals.
        uneven_sd: slow errors of pressure across the window, relative standard deviation.
        place_sd_mm: standard error of the window's place in the block.
        network: a file of ``palpate-lab train``; by default the built-in one.
        method: ``network``, ``refined``, or ``direct`` (finite elements, up to half a minute).
    """
    try:
        maps: list[Any] = list(pressure_Pa) if np.ndim(pressure_Pa[0]) > 1 else [pressure_Pa]
        forces = [float(f) for f in np.atleast_1d(force_N)]
        ways = [float(way) for way in np.atleast_1d(press_mm)]
    except (TypeError, ValueError, IndexError):
        raise ArgumentError(
            "pressure maps of rows x columns, a force each", repr(pressure_Pa)[:80], "estimate([map_Pa], force_N=[1], ...)"
        ) from None
    answer, text = _palpate.lump_estimate(
        maps, forces, young_Pa, ways, float(press_sd_mm), (*map(float, block_mm), float(thickness_mm)), pitch_mm,
        tuple(map(float, window_mm)), noise_Pa, _with_error(skin_mm), _with_error(skin_ratio),
        _with_error(plate_friction, "plate_friction=(0.1, 0.03)"), bool(plate_sticks),
        (young_error, thickness_error, pitch_error), float(uneven_sd), float(place_sd_mm),
        path_text(network or "", "network"), method,
    )
    found = json.loads(answer)
    whole = _lump(found, text.rstrip())
    return replace(whole, lumps=tuple(_lump({**found, **one}, whole.text) for one in found["lumps"]))


def _with_error(
    value: float | tuple[float, float] | None, example: str = "skin_mm=(2, 0.2)"
) -> tuple[float, float] | None:
    if value is None:
        return None
    try:
        one, *error = (float(v) for v in np.atleast_1d(value))
        (sd,) = error or (0.0,)
    except (TypeError, ValueError):
        raise ArgumentError(
            "a number, or one with its standard deviation", repr(value)[:80], example
        ) from None
    return one, sd


def _lump(found: dict[str, Any], text: str) -> Lump:
    def interval(name: str) -> Interval | None:
        return None if found[name] is None else Interval(**found[name])

    return Lump(
        state=found["verdict"],
        detection=found["evidence"],
        false_alarm_rate=found["false_alarm_rate"],
        size_mm=interval("size_mm"),
        depth_mm=interval("depth_mm"),
        stiffness_ratio=interval("stiffness_ratio"),
        x_mm=interval("x_mm"),
        y_mm=interval("y_mm"),
        shape=found["shape"],
        shape_probability=found["shape_probability"],
        method=found["method"],
        reasons=tuple(found["reasons"]),
        text=text,
        detection_limits=tuple(DetectionLimit(**limit) for limit in found["detection_limits"]),
        young_Pa=Interval(**found["tissue"]["young_Pa"]) if "tissue" in found else None,
    )
