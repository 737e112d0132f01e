"""Whole recordings in numbers."""

from __future__ import annotations

import functools
import html
import json
import math
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ._core import _palpate, path_text
from ._errors import ArgumentError
from ._live import names_of, Path, request_of, Sensor

__all__ = ["Modulus", "Recording", "measure", "modulus"]


def column_of(cells: Sequence[Any]) -> NDArray[Any]:
    """One column of a table: whole numbers, numbers (NaN: none) or texts."""
    there = [c for c in cells if c is not None]
    if any(isinstance(c, str) for c in there):
        return np.array(["" if c is None else c for c in cells], dtype=object)
    if len(there) == len(cells) and all(isinstance(c, int) for c in there):
        return np.array(cells, dtype=np.int64)
    return np.array([math.nan if c is None else c for c in cells], dtype=np.float64)


@functools.cache
def _columns_of_attributes() -> dict[str, str]:
    """The column of each attribute of a touch, by its name and by its older one."""
    return {name: column for column, _, _, *names in _palpate.quantities() for name in names if name and column}


def _frozen(columns: dict[str, NDArray[Any]]) -> dict[str, NDArray[Any]]:
    for column in columns.values():
        column.flags.writeable = False
    return columns


class Recording(Mapping[str, NDArray[Any]]):
    """The measurements of a recording.

    A mapping from the names of the columns of ``measurements.csv`` (``force_N``, ``force_sd_N``,
    ``force_state``, ...) and of the maps that were kept to arrays, one row a frame.  Numbers without meaning
    in a frame are NaN.
    """

    summary: dict[str, Any]
    """What ``summary.json`` says."""
    sensor: Sensor
    input: str
    """The source, of simulated scenes with every key."""
    warnings: tuple[str, ...]

    def __init__(self, answer: dict[str, Any]) -> None:
        names = answer["columns"].split(",")
        rows = [json.loads(row) for row in answer["rows"]]
        listed = [row.pop("contacts", None) for row in rows]
        if "contacts" in names:
            for row, contacts in zip(rows, listed):
                row["contacts"] = None if contacts is None else len(contacts)
        self._columns = _frozen({name: column_of([row.get(name) for row in rows]) for name in names})
        self._maps = answer["maps"]
        self._contacts = [
            {"frame": row["frame"], "time_s": row.get("time_s"), **contact}
            for row, contacts in zip(rows, listed)
            for contact in contacts or []
        ]
        self.summary = json.loads(answer["summary"])
        self.sensor = answer["sensor"]
        self.input = answer["input"]
        self.warnings = tuple(line for line in answer["warnings"] if line)

    @property
    def columns(self) -> tuple[str, ...]:
        """Names of the columns, in the order of ``measurements.csv``."""
        return tuple(self._columns)

    @property
    def frames(self) -> int:
        """Number of frames."""
        return len(self._columns["frame"])

    @property
    def contacts(self) -> dict[str, NDArray[Any]]:
        """Each contact of each frame: columns as in ``contacts.csv``."""
        names = dict.fromkeys(name for row in self._contacts for name in row)
        return _frozen({name: column_of([row.get(name) for row in self._contacts]) for name in names})

    def _known(self, name: str) -> str:
        """A column's own name: attributes of a touch name it too, and ``force_N_sd`` is ``force_sd_N``."""
        if name not in self._columns:
            name = _columns_of_attributes().get(name, name)
        if name not in self._columns and name.endswith("_sd") and "_" in name[:-3]:
            quantity, unit = name[:-3].rsplit("_", 1)
            return f"{quantity}_sd_{unit}"
        return name

    def __contains__(self, name: object) -> bool:
        return isinstance(name, str) and (self._known(name) in self._columns or name in self._maps)

    def __getitem__(self, name: str) -> NDArray[Any]:
        name = self._known(name)
        if name in self._columns:
            return self._columns[name]
        if name in self._maps:
            kept: NDArray[Any] = self._maps[name]
            return kept
        raise KeyError(f"{name!r}; there are {', '.join(self)}")

    def __iter__(self) -> Iterator[str]:
        yield from self._columns
        yield from self._maps

    def __len__(self) -> int:
        return len(self._columns) + len(self._maps)

    def __repr__(self) -> str:
        return f"<palpate.Recording {self.input!r}, {self.frames} frames, {len(self)} columns and maps>"

    def _repr_html_(self) -> str:
        names = ("frames", "touches", "largest_force_N", "largest_force_state", "largest_depth_mm", "largest_depth_state")
        shown = {k: self.summary[k] for k in names if k in self.summary}
        rows = "".join(f"<tr><th style='text-align:left'>{k}</th><td>{v}</td></tr>" for k, v in shown.items())
        return f"<b>{html.escape(self.input)}</b><table>{rows}</table>"


def measure(
    source: Path,
    *,
    sensor: Sensor | Path | None = None,
    background: Path | None = None,
    outputs: Iterable[str] | str | None = None,
    keep: Iterable[str] | str = (),
    solver: str = "best",
    fixed_light: bool = False,
    sequence: bool = False,
    rate_Hz: float | None = None,
    frames: int | None = None,
    out: Path | None = None,
    trace: Path | None = None,
    device: str = "",
    seed: int = 1,
) -> Recording:
    """Measures a whole recording, every frame of it: what ``palpate process`` does, to the same digits.

    Args:
        source, sensor, background, outputs, solver, fixed_light, sequence, rate_Hz, trace, device, seed: as of
            :func:`open`.
        keep: maps to keep of every frame: ``depth_mm`` (frames x rows x columns, float32), ``image``,
            ``confidence``, ``pressure_kPa``, ``shear_kPa``, ``extrapolated``.
        frames: stop after that many.
        out: a folder for ``measurements.csv``, ``contacts.csv``, ``summary.csv`` and ``summary.json``; by
            default no file is written.
    """
    return Recording(
        _palpate.measure(
            request_of(
                source, sensor, background, outputs, seed, solver=solver, fixed_light=fixed_light,
                sequence=sequence, rate_Hz=rate_Hz, frames=frames,
            ),
            path_text(out or "", "out"),
            path_text(trace or "", "trace"),
            device,
            names_of(keep),
        )
    )


@dataclass(frozen=True, eq=False)
class Modulus:
    """Young's modulus of a sample, with its 95 % interval and state."""

    young_kPa: float
    """NaN where it is not determined."""
    interval_kPa: tuple[float, float]
    """95 %; where only a lower bound is known the upper one is infinite; NaN where there is no interval."""
    state: str
    """``valid``, ``pad limited``, ``not determined``, ``does not fit``, ..."""
    reason: str
    """Why it is not valid, or what to know."""
    method: str
    why: str
    residual: float
    strain_max: float
    readings: int
    methods: tuple[dict[str, Any], ...]
    """Each way to the modulus by itself."""
    notes: tuple[str, ...]
    presses: dict[str, NDArray[np.float64]]
    """What was read: force_N, radius_mm, depth_mm, approach_mm; NaN: not measured."""

    @property
    def valid(self) -> bool:
        return self.state == "valid"

    def __str__(self) -> str:
        low, high = self.interval_kPa
        if self.valid:
            return f"{self.young_kPa:.4g} kPa ({low:.4g} to {high:.4g})"
        return f"{self.state}: {self.reason}" if self.reason else self.state

    def _repr_html_(self) -> str:
        return f"<b>Young's modulus</b> {html.escape(str(self))}"


def modulus(
    recording: Path,
    *,
    sample: str,
    sensor: Sensor | Path | None = None,
    background: Path | None = None,
    sequence: bool = False,
    gauge: Path | None = None,
    approach: Path | None = None,
    stage_sd_mm: float = 0.005,
    zero_sd_mm: float = math.inf,
    poisson: float = 0.5,
    size_sd: float = 0.005,
    table: str = "sliding",
    law: str = "linear",
    pad_kPa: float | None = None,
    pad_thickness_mm: float | None = None,
    pad_poisson: float = 0.5,
    pad_sd: float = 0.02,
    force_sd: float = 0.01,
    scale_sd: float | None = None,
    replicates: int = 200,
    device: str = "",
    seed: int = 1,
) -> Modulus:
    """Young's modulus of a sample that is pressed between the pad and a rigid table.

    Args:
        recording: a recording of two presses or more, or a table (``.csv``) of presses: force_N, and any of
            radius_mm, area_mm2, depth_mm, mean_depth_mm, approach_mm.
        sample: ``cube,10mm``, ``block,10x8mm`` (width x height), ``cylinder,12x10mm`` (diameter x height) or
            ``sphere,16mm`` (diameter).
        gauge: table of a force gauge with the recording, instead of the image's force.
        approach: table of the stage's way: frame, approach_mm.
        stage_sd_mm, zero_sd_mm: standard errors of the stage and of its zero, mm.
        poisson, size_sd: of the sample: Poisson's ratio, relative standard error of its size.
        table: ``sliding``, or ``bonded``: the sample sticks to it.
        law: ``linear``, or ``rubber``: incompressible neo-Hookean.
        pad_kPa, pad_thickness_mm, pad_poisson: the pad; by default as the sensor file says.
        pad_sd, force_sd, scale_sd: relative standard errors of the pad's modulus, the force's scale and the
            camera's scale.
        replicates: of the bootstrap, 50 to 10000.
        sensor, background, sequence, device, seed: as of :func:`open`.
    """
    for name, value, known in (("table", table, ("sliding", "bonded")), ("law", law, ("linear", "rubber"))):
        if value not in known:
            raise ArgumentError(f"{name}={' or '.join(known)}", repr(value), known[0])
    recording = path_text(recording, "recording")
    is_table = recording.endswith(".csv")
    answer: dict[str, Any] = _palpate.modulus(
        None if is_table else request_of(recording, sensor, background, None, seed, sequence=sequence),
        recording if is_table else "",
        path_text(gauge or "", "gauge"),
        path_text(approach or "", "approach"),
        stage_sd_mm,
        sample,
        poisson,
        size_sd,
        table == "bonded",
        law == "rubber",
        pad_kPa or 0,
        pad_thickness_mm or 0,
        pad_poisson,
        pad_sd,
        force_sd,
        scale_sd or 0,
        zero_sd_mm,
        replicates,
        seed,
        device,
    )
    rows = answer["presses"]
    names = ("force_N", "radius_mm", "depth_mm", "approach_mm")
    answer["presses"] = {name: rows[:, i] for i, name in enumerate(names)}
    answer["methods"] = tuple(answer["methods"])
    answer["notes"] = tuple(_palpate.as_arguments(note) for note in answer["notes"])
    return Modulus(**answer)
