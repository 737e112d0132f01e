"""A sensor file from recordings of a sensor of one's own, step by step, and whether it is still true."""

from __future__ import annotations

import html
import json
import os
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field

import numpy as np

from ._core import _palpate, path_text, shape_words
from ._errors import ArgumentError
from ._live import Path, Sensor
from ._program import run_program
from ._tables import Table

__all__ = ["Check", "Setup", "check", "setup"]

Corners = Sequence[Sequence[float]]


@dataclass(frozen=True, eq=False)
class Setup:
    """A sensor file, and what of it is known."""

    sensor: Sensor
    file: str
    """Where it was written."""
    steps: Table = field(repr=False)
    """One row a step, frame to force: ``step``, ``known`` (True or False), ``what`` is known, what is ``missing`` and the
    command that does the step ``again``."""

    @property
    def complete(self) -> bool:
        """Every step is known."""
        return bool(np.all(self.steps["known"]))

    def __str__(self) -> str:
        lines = []
        for step, known, what, missing in zip(*(self.steps[name] for name in ("step", "known", "what", "missing"))):
            lines.append(f"{'known  ' if known else 'MISSING'}  {step:<16} {what}".rstrip())
            lines += [f"{'':25} -> {one}" for one in missing.splitlines()]
        return "\n".join(lines)

    def _repr_html_(self) -> str:
        return f"<b>{html.escape(self.file)}</b>" + self.steps._repr_html_()


def _length(value: float | None, name: str) -> list[str]:
    if value is None:
        return []
    if isinstance(value, str) or not 0 < value < float("inf"):
        raise ArgumentError(f"{name} above 0, or None", repr(value), f"{name}=3.0")
    return [repr(float(value))]


def _corners(corners: str | Corners | None) -> list[str]:
    if corners is None or isinstance(corners, str):
        if corners not in (None, "auto"):
            raise ArgumentError("four corners, or 'auto'", repr(corners), "corners='auto'")
        return [corners] if corners else []
    try:
        places = np.asarray(corners, dtype=np.float64).reshape(4, 2)
    except (TypeError, ValueError):
        wanted = "four corners as (x, y) in px: top left, top right, bottom right, bottom left"
        raise ArgumentError(wanted, repr(corners)[:80], "corners=[(83, 97), (457, 132), (466, 368), (89, 413)]") from None
    return [",".join(repr(float(one)) for one in places.ravel())]


def setup(
    recording: Path,
    out: Path,
    *,
    like: str = "",
    background: Path | None = None,
    corners: str | Corners | None = None,
    pitch_mm_per_px: float | None = None,
    grid_pictures: Path | None = None,
    grid_background: Path | None = None,
    grid: tuple[int, int] | None = None,
    pattern: str = "dots",
    spacing_mm: float | None = None,
    ball_radius_mm: float | None = None,
    balls: Path | None = None,
    other_balls: Mapping[Path, float] | None = None,
    shape: str = "",
    other_shapes: Mapping[Path, str] | None = None,
    ball_table: Path | None = None,
    surface: str = "auto",
    gauge: Path | None = None,
    sequence: bool = False,
    name: str = "",
) -> Setup:
    """The sensor file of a sensor of one's own, as ``palpate setup`` makes it.

    Nothing but the recording has to be there; what is missing is said step by step.  The program does it in a
    process of its own, which Ctrl-C ends.

    Args:
        recording: of touches: a video, a folder of images, a session, or ``"camera:/dev/video0"``.
        out: the sensor file to write; it is begun anew.
        like: kind of sensor to start from: ``"gelsight_mini"``, ``"gelsight_mini_markers"``, ``"digit"``, or a file.
            Its scale, gel and markers are nominal; depth stays unknown until a ball is pressed.
        background: picture of the pad at rest; else found in the recording.
        corners: of the pad in the picture, four (x, y) in px: top left, top right, bottom right, bottom left;
            ``"auto"``: those of the light; None: the whole picture.
        pitch_mm_per_px: the scale, where it is known.
        grid_pictures, grid_background, grid, pattern, spacing_mm: else pictures of a grid (its pad at rest, (columns,
            rows), ``"dots"`` or ``"chessboard"``, mm from one point to the next).
        ball_radius_mm: radius of a ball that is pressed, for depth; with ``balls``, the recording of its presses
            where they are not in ``recording``, or ``ball_table``, their places by hand.
        other_balls: recordings of presses of further balls, each with its radius in mm.
        shape, other_shapes: what is pressed instead of a ball, and further recordings with the shape pressed there:
            ``"cylinder:radius=2"``, ``"cone:half-angle=60:tip-radius=0.3"``.
        surface: ``"auto"``, ``"photometric"`` or ``"lookup"``.
        gauge: a force gauge's table of the recording.
        sequence: images without a rate follow each other; otherwise each is a press of its own.
        name: of the sensor; else the file's.
    """
    file = path_text(out, "out")
    words = ["setup", path_text(recording, "recording"), "--out", file, "--surface", surface, "--pattern", pattern]

    def add(option: str, given: list[str]) -> None:
        for one in given:
            words.extend((option, one))

    files = {"background": background, "grid_pictures": grid_pictures, "grid_background": grid_background, "balls": balls, "ball_table": ball_table, "gauge": gauge}
    for argument, path in files.items():
        add("--" + argument.replace("_", "-"), [] if path is None else [path_text(path, argument)])
    for path, radius_mm in (other_balls or {}).items():
        add("--other-ball", [f"{path_text(path, 'other_balls')}={one}" for one in _length(radius_mm, "other_balls")])
    add("--shape", shape_words(shape, other_shapes))
    add("--corners", _corners(corners))
    add("--pitch", _length(pitch_mm_per_px, "pitch_mm_per_px"))
    add("--spacing-mm", _length(spacing_mm, "spacing_mm"))
    add("--ball-mm", _length(ball_radius_mm, "ball_radius_mm"))
    if grid is not None:
        try:
            columns, rows = (int(one) for one in grid)
        except (TypeError, ValueError):
            raise ArgumentError("grid as (columns, rows)", repr(grid)[:80], "grid=(9, 7)") from None
        add("--grid", [f"{columns}x{rows}"])
    if sequence:
        words.append("--sequence")
    if name:
        add("--name", [name])
    if like:
        add("--like", [like])
    found = json.loads(run_program([*words, "--json", "--quiet"], f"a sensor file '{os.fspath(file)}'"))
    columns_of_steps = ("step", "known", "what", "missing", "again")
    steps = Table("Setup", columns_of_steps, [[step[one] for one in columns_of_steps] for step in found["steps"]])
    return Setup(Sensor(file), file, steps)


@dataclass(frozen=True, eq=False)
class Check:
    """Whether a sensor file is still true for its gel."""

    holds: bool
    sentence: str
    """As calibrated, or what is needed again with the commands that do it."""
    rows: Table = field(repr=False)
    """``name``, ``value`` and ``unit``, the limits ``least`` and ``most`` (NaN: none), ``state`` and ``what`` was compared."""
    again: list[str] = field(repr=False)
    """Commands of what is to be made again, in order."""
    text: str = field(repr=False)

    def __bool__(self) -> bool:
        return self.holds

    def __str__(self) -> str:
        return self.text

    def _repr_html_(self) -> str:
        return f"<b>{html.escape(self.sentence)}</b>" + self.rows._repr_html_()


def check(
    sensor: Path,
    recording: Path,
    *,
    background: Path | None = None,
    ball_radius_mm: float = 0.0,
    ball_diameter_mm: float = 0.0,
    weight_g: float | Sequence[float] = (),
    out: Path | None = None,
    device: str = "",
) -> Check:
    """Is a calibration still true for this gel today?  As ``palpate check`` judges it.

    Args:
        sensor: its file.
        recording: of today: a video, a folder of images, a session.
        background: picture of the pad at rest today; else found in the recording.
        ball_radius_mm, ball_diameter_mm: size of a ball that is pressed in the recording; its depth is then judged too.
        weight_g: what a scale showed at each press in the recording, grams, in order; the force is then judged too.
        out: sensor file to write, mended by these weights.
        device: that reads depth and force, by index or part of its name.
    """
    rest = path_text(background or "", "background")
    weights = [float(weight_g)] if isinstance(weight_g, (int, float)) else [float(one) for one in weight_g]
    mended = path_text(out or "", "out")
    answer = _palpate.check(
        path_text(sensor, "sensor"), path_text(recording, "recording"), rest, ball_radius_mm, ball_diameter_mm, weights, mended, device
    )
    found = json.loads(answer["report"])
    columns = ("name", "value", "unit", "least", "most", "state", "what")
    rows = Table("Check", columns, [[row[one] for one in columns] for row in found["rows"]])
    again = [remedy["command"] for remedy in found["again"]]
    return Check(found["holds"], found["sentence"], rows, again, answer["text"])
