"""Calibrations: each gives a sensor, and says how good it is."""

from __future__ import annotations

import csv
import html
import io
import json
import os
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any, Union

from numpy.typing import NDArray

from ._core import _palpate, path_text, shape_words
from ._errors import ArgumentError
from ._live import Path, rate_of, request_of, Sensor
from ._recordings import column_of

Paths = Union[Path, Iterable[Path]]

__all__ = [
    "Calibration",
    "Lights",
    "background",
    "flat",
    "force",
    "lights",
    "lookup",
    "photometric",
    "scale",
    "shear",
]


@dataclass(frozen=True, eq=False)
class Calibration:
    """A calibrated sensor with its report."""

    sensor: Sensor
    """With the calibration in it."""
    fit_for_use: bool
    verdict: str
    """How good it is, in one line."""
    text: str = field(repr=False)
    """The report in lines for people."""
    report: dict[str, Any] = field(repr=False)
    """The same as values."""
    samples: dict[str, NDArray[Any]] = field(default_factory=dict, repr=False)

    def __str__(self) -> str:
        return self.text

    def _repr_html_(self) -> str:
        return f"<b>{html.escape(self.verdict)}</b><pre>{html.escape(self.text)}</pre>"


def _number(cell: str) -> int | float | str | None:
    if cell == "":
        return None
    try:
        return float(cell) if "." in cell or "e" in cell or "n" in cell else int(cell)
    except ValueError:
        return cell


def _table(text: str) -> dict[str, NDArray[Any]]:
    """A CSV text as columns."""
    rows = list(csv.reader(io.StringIO(text)))
    return {name: column_of([_number(row[i]) for row in rows[1:]]) for i, name in enumerate(rows[0])} if rows else {}


def _listed(given: Paths) -> list[Path]:
    return [given] if isinstance(given, (str, os.PathLike)) else list(given)


def _pairs(recordings: Paths, gauges: Paths) -> tuple[list[Path], list[str]]:
    """Recordings and gauges, "truth" for all of them."""
    inputs, tables = _listed(recordings), _listed(gauges)
    if tables == ["truth"]:
        tables = tables * len(inputs)
    return inputs, [path_text(table, "table") for table in tables]


def _made(answer: dict[str, Any]) -> Calibration:
    return Calibration(
        answer["sensor"], answer["fit_for_use"], answer["verdict"], answer["text"],
        json.loads(answer["report"]), _table(answer.get("samples", "")),
    )


def force(
    recordings: Paths,
    *,
    gauge: Paths,
    sensor: Sensor | Path | None = None,
    background: Path | None = None,
    objects: Sequence[str] = (),
    check: Paths = (),
    check_gauge: Paths = (),
    align: str | float = "",
    rate_Hz: float | None = None,
    sequence: bool = False,
    signal: str = "",
    model: str = "",
    branches: bool | None = None,
    keep_border: bool = False,
    device: str = "",
    seed: int = 1,
) -> Calibration:
    """Signal to newtons, from recordings with a force gauge.

    Args:
        recordings: one, or several.
        gauge: the gauge's table of each: time_s (or _ms, _us, _ns) or frame, and force_N (or _mN, _kN, _gf,
            _kgf, _lbf); ``"truth"`` of simulated scenes.
        sensor: to start from; sessions and simulated scenes have their own.
        objects: what is pressed in each recording: those of one object are left out together; by default each is
            an object of its own.
        check, check_gauge: recordings to judge the result by; not used for the fit.
        align: the gauge's clock: ``auto`` (by cross-correlation), ``none`` (it is the recording's), or seconds
            to add to it; by default auto, and none for tables that count frames.
        signal: ``gray-sum``, ``gradient``, ``area``, ``volume``, ``layer`` or ``layer-bending``; by default as
            held-out presses say.
        model: ``line``, ``power``, ``spline`` or ``layer``; likewise.
        branches: loading and unloading apart; likewise.
        keep_border: use contacts that reach the frame's border too.
        background, rate_Hz, sequence, device, seed: as of :func:`palpate.open`.
    """
    inputs, gauges = _pairs(recordings, gauge)
    checks, check_gauges = _pairs(check, check_gauge)

    def requests(all_inputs: list[Path]) -> list[_palpate.RunSettings]:
        return [request_of(one, sensor, background, None, seed) for one in all_inputs]

    return _made(
        _palpate.calibrate_force(
            requests(inputs), gauges, list(objects), requests(checks), check_gauges, str(align), rate_of(rate_Hz), sequence,
            signal, model, branches, keep_border, device,
        )
    )


def shear(
    recordings: Paths,
    *,
    gauge: Paths,
    sensor: Sensor | Path | None = None,
    background: Path | None = None,
    align: str | float = "",
    rate_Hz: float | None = None,
    sequence: bool = False,
    signal: str = "",
    friction: float | None = None,
    device: str = "",
    seed: int = 1,
) -> Calibration:
    """Shift to tangential force and friction, from pulls with a tangential gauge.

    Args:
        recordings: one, or several.
        gauge: the gauge's table of each: time_s or frame, fx_N and fy_N (or shear_N and direction_deg), and
            force_N for the friction; ``"truth"`` of simulated scenes.
        signal: ``centroid`` or ``skin``; by default what follows the gauge more closely.
        friction: coefficient, where no recording slips; by default the sensor file's.
        sensor, align, background, rate_Hz, sequence, device, seed: as of :func:`force`.
    """
    inputs, gauges = _pairs(recordings, gauge)
    requests = [request_of(one, sensor, background, None, seed) for one in inputs]
    return _made(
        _palpate.calibrate_shear(requests, gauges, str(align), rate_of(rate_Hz), sequence, signal, friction, device)
    )


def _written(answer: dict[str, Any], out: Path | None) -> Calibration:
    """A calibration whose sensor file was written, or that was made without one."""
    text = answer["text"]
    report = json.loads(answer["report"])
    sensor = answer["sensor"] if out is None else Sensor(path_text(out, "out"))
    return Calibration(sensor, not report.get("doubt"), text.splitlines()[0], text, report)


def _ball(ball_mm: float, ball_radius_mm: float, ball_diameter_mm: float) -> tuple[float, float, float]:
    """Radius, diameter, and the older way of saying, of which one is given."""
    return ball_radius_mm, ball_diameter_mm, ball_mm


def _named(file: Path | None) -> str:
    return path_text(file or "", "file")


def background(
    source: Path,
    *,
    out: Path,
    sensor: Path | None = None,
    frames: int = 30,
    every: int | None = None,
    like: int | None = None,
    set_threshold: bool = False,
) -> Calibration:
    """The untouched image, its noise, and a contact threshold that fits it.

    Args:
        source: frames as the camera gives them: a recording that shows the pad at rest somewhere, one
            untouched picture, or a camera while nothing touches.
        out: the sensor file to write; the image goes next to it.
        sensor: a sensor file to start from; by default what the frames say.
        frames: how many untouched frames make the image, 2 to 1000.
        every: look at every n-th frame; by default at 400.
        like: number of a frame in which nothing touches.
        set_threshold: set the threshold as suggested; without a sensor file it is.
    """
    answer = _palpate.calibrate_background(
        path_text(source, "source"), _named(sensor), path_text(out, "out"), frames, every or 0, like, set_threshold
    )
    return _written(answer, out)


def flat(
    source: Path, *, sensor: Path, out: Path, frames: int = 30, every: int = 1, change: bool = False
) -> Calibration:
    """Correct uneven light by a field that every frame is multiplied by.

    Args:
        source: frames of what should look even.
        sensor: the sensor file to start from.
        out: the sensor file to write; the field's image goes next to it.
        frames, every: how many, and which.
        change: even out the change from the untouched image: a waveguide, pressed all over.
    """
    answer = _palpate.calibrate_flat(path_text(source, "source"), path_text(sensor, "sensor"), path_text(out, "out"), frames, every, change)
    return _written(answer, out)


def scale(
    source: Path,
    *,
    out: Path | None = None,
    sensor: Path | None = None,
    background: Path | None = None,
    grid: tuple[int, int] | None = None,
    pattern: str = "chessboard",
    spacing_mm: float = 0.0,
    spacing_sd: float = 0.002,
    ring_mm: float = 0.0,
    ball_radius_mm: float = 0.0,
    ball_diameter_mm: float = 0.0,
    ball_mm: float = 0.0,
    travel_mm: Iterable[float] = (),
) -> Calibration:
    """mm per pixel and lens distortion, from pictures of a grid, a ring or a ball.

    Args:
        out: the sensor file to write; by default none: the sensor is in the answer.
        sensor: a sensor file to start from; by default only what the pictures say.
        background: the untouched image; a grid is then looked for in the change.
        grid: columns and rows of inner corners, or of dots.
        pattern: ``chessboard`` or ``dots``.
        spacing_mm, spacing_sd: from one point of the grid to the next; its relative standard error.
        ring_mm: outer diameter of a ring or disc pressed into the pad.
        ball_radius_mm, ball_diameter_mm: one of them, of a ball pressed several times; ``ball_mm``: its radius,
            by the older name.
        travel_mm: how deep the ball is in each picture in which it is pressed, any zero.
    """
    if pattern not in ("chessboard", "dots"):
        raise ArgumentError("pattern=chessboard or dots", repr(pattern), "chessboard")
    answer = _palpate.calibrate_scale(
        path_text(source, "source"), _named(sensor), _named(background), _named(out),
        "" if grid is None else f"{grid[0]}x{grid[1]}", pattern == "dots", spacing_mm, spacing_sd, ring_mm,
        _ball(ball_mm, ball_radius_mm, ball_diameter_mm), [float(way) for way in travel_mm],
    )
    return _written(answer, out)


def photometric(
    source: Path,
    *,
    out: Path | None = None,
    ball_radius_mm: float = 0.0,
    ball_diameter_mm: float = 0.0,
    ball_mm: float = 0.0,
    balls: Path | None = None,
    shape: str = "",
    other_shapes: Mapping[Path, str] | None = None,
    sensor: Path | None = None,
    background: Path | None = None,
    pitch_mm_per_px: float = 0.0,
    every: int | None = None,
    rest_weight: float = 1.0,
    model: str = "best",
    keep_markers: bool = False,
    keep_contact: bool = False,
) -> Calibration:
    """Colours of a gel to normals, from presses of a known ball or other shape.

    Args:
        source: an image, a folder of images, a video, a session.
        out: the sensor file to write; by default none: the sensor is in the answer, and names ``background`` where
            it lies.
        ball_radius_mm, ball_diameter_mm: one of them, of the ball whose contacts are found. ``ball_mm`` is its
            radius by the older name, refused where the pictures show that it is the diameter; or
        balls: a table of presses: image, center_x_px, center_y_px, contact_radius_px, ball_radius_mm; of other shapes
            also shape, axis_deg, length_px; or
        shape: what is pressed instead of a ball: ``"cylinder:radius=2"``, ``"cone:half-angle=60:tip-radius=0.3"``.
        other_shapes: further recordings, each with the shape pressed there; ``"ball:radius=3"`` too.
        sensor: a sensor file to start from; by default only what the pictures say.
        background: the untouched image; kept next to ``out``.
        pitch_mm_per_px: the scale; 0: the sensor file's.
        every: look at every n-th frame; by default at 400.
        rest_weight: weight of the untouched frame's pixels.
        model: ``best``, ``linear``, ``quadratic``, ``cubic``, or one of these with ``-products`` of colours.
        keep_markers: use the pixels of printed markers too.
        keep_contact: leave the section ``contact`` as it is.
    """
    answer = _palpate.calibrate_photometric(
        path_text(source, "source"), _named(sensor), _named(balls), _named(background), _named(out),
        _ball(ball_mm, ball_radius_mm, ball_diameter_mm), shape_words(shape, other_shapes), pitch_mm_per_px,
        every or 0, rest_weight, model, keep_markers, keep_contact,
    )
    return _written(answer, out)


def lookup(
    source: Path,
    *,
    out: Path | None = None,
    ball_radius_mm: float = 0.0,
    ball_diameter_mm: float = 0.0,
    ball_mm: float = 0.0,
    balls: Path | None = None,
    sensor: Path | None = None,
    background: Path | None = None,
    pitch_mm_per_px: float = 0.0,
    every: int | None = None,
) -> Calibration:
    """Depth of a gray gel by a table over its change, from presses of a known ball.

    Args:
        source, out, ball_radius_mm, ball_diameter_mm, ball_mm, balls, sensor, background, pitch_mm_per_px, every:
            as of :func:`photometric`.
    """
    answer = _palpate.calibrate_lookup(
        path_text(source, "source"), _named(sensor), _named(balls), _named(background), _named(out),
        _ball(ball_mm, ball_radius_mm, ball_diameter_mm), pitch_mm_per_px, every or 0,
    )
    return _written(answer, out)


@dataclass(frozen=True, eq=False)
class Lights:
    """Weights of several lights, in a file of their own."""

    file: str
    text: str = field(repr=False)
    report: dict[str, Any] = field(repr=False)


def lights(
    images: Iterable[Path], *, height: Path, pitch_mm_per_px: float, out: Path, order: int | None = None
) -> Lights:
    """Photometric stereo with three lights or more, one gray image each, from a known shape.

    Args:
        images: of one size, in the order of the lights.
        height: heights of what they show, mm: a NumPy file, rows x columns, or a scanner's TrueMap file.
        out: the file to write, which ``palpate integrate --lights`` reads.
        order: of the polynomial by which the light varies over the frame, 0 to 3; by default 0, 1 or 2.
    """
    files = [path_text(image, "image") for image in images]
    answer = _palpate.calibrate_lights(files, path_text(height, "height"), path_text(out, "out"), pitch_mm_per_px, order)
    return Lights(path_text(out, "out"), answer["text"], json.loads(answer["report"]))
