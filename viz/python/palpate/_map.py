"""One map larger than the pad, of a recording that moves over an object."""

from __future__ import annotations

import html
import json
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ._core import _palpate, path_text
from ._live import Path, request_of, Sensor

__all__ = ["Map", "MapPiece", "map"]


def _rotations(turns: NDArray[np.float64]) -> NDArray[np.float64]:
    """The rotations by |w| radians about each w: n x 3 x 3."""
    angle = np.linalg.norm(turns, axis=1)[:, None, None]
    x, y, z = turns.T
    none = np.zeros_like(x)
    cross = np.stack([none, -z, y, z, none, -x, -y, x, none], axis=1).reshape(-1, 3, 3)
    # sin(t)/t and (1 - cos(t))/t^2, at 0 too
    once, twice = np.sinc(angle / np.pi), np.sinc(angle / (2 * np.pi)) ** 2 / 2
    rotations: NDArray[np.float64] = np.eye(3) + once * cross + twice * (cross @ cross)
    return rotations


@dataclass(frozen=True, eq=False)
class MapPiece:
    """Key frames that hang together.  Axes are the pad's at the first of them: x to the right, y down, z out of
    the object.  Arrays have rows from the smallest y down, and are NaN where nothing was seen."""

    height_mm: NDArray[np.float32]
    error_mm: NDArray[np.float32]
    """Standard error, NaN where no two key frames overlap."""
    coverage: NDArray[np.float32]
    """Key frames that show a place."""
    x_mm: NDArray[np.float64]
    """Of the columns."""
    y_mm: NDArray[np.float64]
    """Of the rows."""
    frames: NDArray[np.int64]
    """Of the key frames."""
    poses: NDArray[np.float64]
    """From the map to the pad, one a key frame: n x 4 x 4, mm."""
    place_sd_mm: NDArray[np.float64]
    """Standard errors of their places, once the piece as a whole is aligned: n x 3."""
    report: dict[str, Any]
    """What ``map.json`` says of it."""

    @property
    def covered_mm2(self) -> float:
        return float(self.report["covered_mm2"])

    @property
    def error_rms_mm(self) -> float:
        """Of the stated errors; NaN where they are not known."""
        return _number(self.report["error_rms_mm"])

    def __repr__(self) -> str:
        rows, columns = self.height_mm.shape
        return f"<palpate.MapPiece {columns} x {rows}, {self.covered_mm2:.0f} mm2, {len(self.frames)} key frames>"


def _number(value: Any) -> float:
    return float("nan") if value is None else float(value)


def _piece(arrays: tuple[NDArray[np.float32], ...], said: dict[str, Any]) -> MapPiece:
    height, error, coverage = arrays
    keys = said["key_frames"]

    def column(name: str) -> NDArray[np.float64]:
        return np.array([key[name] for key in keys], dtype=np.float64).reshape(-1, 3)

    poses = np.tile(np.eye(4), (len(keys), 1, 1))
    poses[:, :3, :3] = _rotations(column("turn_rad"))
    poses[:, :3, 3] = column("shift_mm")
    made = {
        "x_mm": said["left_mm"] + said["pitch_mm"] * np.arange(said["columns"]),
        "y_mm": said["top_mm"] + said["pitch_mm"] * np.arange(said["rows"]),
        "frames": np.array([key["frame"] for key in keys], dtype=np.int64),
        "poses": poses,
        "place_sd_mm": column("place_sd_mm"),
    }
    for array in made.values():
        array.flags.writeable = False
    return MapPiece(height, error, coverage, report=said, **made)


class Map:
    """A map of an object in pieces, the largest first.

    What ``map.json`` says are attributes, too: ``frames_tracked``, ``frames_lost``, ``tracks``, ``loops``,
    ``loops_refused``, ``smooth_key_frames``, ``missed_key_frames``, ``residual_mm``, ``complete``, ...
    """

    pieces: tuple[MapPiece, ...]
    """Parts that no texture connects have axes of their own; empty: nothing could be mapped."""
    report: dict[str, Any]
    """All that ``map.json`` says."""
    warning: str
    """Of a recording that was cut short or is damaged, of which what came before is mapped; empty: none."""

    def __init__(self, answer: dict[str, Any]) -> None:
        self.report = json.loads(answer["report"])
        self.pieces = tuple(_piece(a, said) for a, said in zip(answer["pieces"], self.report["pieces"]))
        self.warning = answer["warning"]

    def __getattr__(self, name: str) -> Any:
        report = self.__dict__.get("report", {})
        if name in report:
            return report[name]
        raise AttributeError(f"palpate.Map has no attribute {name!r}; there are {', '.join(report)}")

    def __dir__(self) -> list[str]:
        return sorted({*super().__dir__(), *self.report})

    def __repr__(self) -> str:
        covered = sum(piece.covered_mm2 for piece in self.pieces)
        return f"<palpate.Map of {self.report['frames']} frames: {len(self.pieces)} pieces, {covered:.0f} mm2>"

    def _repr_html_(self) -> str:
        return html.escape(repr(self))


def map(
    recording: Path,
    *,
    sensor: Sensor | Path | None = None,
    background: Path | None = None,
    pitch_mm: float | None = None,
    key_overlap: float = 0.7,
    links: int = 6,
    loops: bool = True,
    most_keys: int = 400,
    contact_share: float = 0.3,
    solver: str = "best",
    fixed_light: bool = False,
    rate_Hz: float | None = None,
    frames: int | None = None,
    out: Path | None = None,
    device: str = "",
    seed: int = 1,
) -> Map:
    """One height map larger than the pad, of a recording that moves over an object: what ``palpate map`` makes.

    Args:
        pitch_mm: of the map's pixels; by default that of the key frames.
        key_overlap: part of a contact that the next key frame still shows, 0.3 to 0.95.
        links: key frames that each one is compared with, 1 to 50.
        loops: False compares each key frame with the last one alone.
        most_keys: key frames that are kept, 2 to 5000, 0.2 MB each.
        contact_share: part of the way from a frame's lowest to its deepest place from which it counts as
            touched, 0.05 to 0.9.
        frames: stop after that many.
        out: a folder for map.npy, map_error.npy, coverage.npy, map.ply, map.tif and map.json; by default no
            file is written.
        recording, sensor, background, solver, fixed_light, rate_Hz, device, seed: as of :func:`measure`.
    """
    return Map(
        _palpate.map(
            request_of(
                recording, sensor, background, None, seed, solver=solver, fixed_light=fixed_light,
                rate_Hz=rate_Hz, frames=frames,
            ),
            pitch_mm or 0, key_overlap, links, loops, most_keys, contact_share, path_text(out or "", "out"), device,
        )
    )
