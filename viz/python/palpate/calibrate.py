"""Calibrations: each gives a sensor, and says how good it is."""

from __future__ import annotations

import csv
import html
import io
import json
import os
from collections.abc import Iterable
from dataclasses import dataclass, field
from typing import Any, Union

from numpy.typing import NDArray

from ._core import _palpate
from ._live import Path, Sensor, request_of
from ._recordings import column_of

Paths = Union[Path, Iterable[Path]]

__all__ = ["Calibration", "force", "shear"]


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
    return inputs, [os.fspath(table) for table in tables]


def _made(answer: dict[str, Any]) -> Calibration:
    return Calibration(
        answer["sensor"],
        answer["fit_for_use"],
        answer["verdict"],
        answer["text"],
        json.loads(answer["report"]),
        _table(answer.get("samples", "")),
    )


def force(
    recordings: Paths,
    *,
    gauge: Paths,
    sensor: Sensor | Path | None = None,
    background: Path | None = None,
    check: Paths = (),
    check_gauge: Paths = (),
    align: str | float = "",
    rate_Hz: float | None = None,
    signal: str = "",
    model: str = "",
    branches: bool | None = None,
    keep_border: bool = False,
    device: str = "",
    seed: int = 1,
) -> Calibration:
    """Signal to newtons, from recordings beside a force gauge.

    Args:
        recordings: one, or several.
        gauge: the gauge's table of each: time_s (or _ms, _us, _ns) or frame, and force_N (or _mN, _kN, _gf,
            _kgf, _lbf); ``"truth"`` of simulated scenes.
        sensor: to start from; sessions and simulated scenes bring their own.
        check, check_gauge: recordings to judge the result by; not used for the fit.
        align: the gauge's clock: ``auto`` (by cross-correlation), ``none`` (it is the recording's), or seconds
            to add to it; by default auto, and none for tables that count frames.
        signal: ``gray-sum``, ``gradient``, ``area``, ``volume`` or ``layer``; by default as held-out presses
            say.
        model: ``line``, ``power``, ``spline`` or ``layer``; likewise.
        branches: loading and unloading apart; likewise.
        keep_border: use contacts that reach the frame's border too.
        background, rate_Hz, device, seed: as of :func:`palpate.open`.
    """
    inputs, gauges = _pairs(recordings, gauge)
    checks, check_gauges = _pairs(check, check_gauge)

    def requests(all_inputs: list[Path]) -> list[_palpate.InputRequest]:
        return [request_of(one, sensor, background, None, seed) for one in all_inputs]

    return _made(
        _palpate.calibrate_force(
            requests(inputs),
            gauges,
            requests(checks),
            check_gauges,
            str(align),
            rate_Hz or 0,
            signal,
            model,
            branches,
            keep_border,
            device,
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
    signal: str = "",
    friction: float | None = None,
    device: str = "",
    seed: int = 1,
) -> Calibration:
    """Shift to tangential force and friction, from pulls beside a tangential gauge.

    Args:
        recordings: one, or several.
        gauge: the gauge's table of each: time_s or frame, fx_N and fy_N (or shear_N and direction_deg), and
            force_N for the friction; ``"truth"`` of simulated scenes.
        signal: ``centroid`` or ``skin``; by default what follows the gauge more closely.
        friction: coefficient, where no recording slips; by default the sensor file's.
        sensor, align, background, rate_Hz, device, seed: as of :func:`force`.
    """
    inputs, gauges = _pairs(recordings, gauge)
    requests = [request_of(one, sensor, background, None, seed) for one in inputs]
    return _made(
        _palpate.calibrate_shear(requests, gauges, str(align), rate_Hz or 0, signal, friction, device)
    )
