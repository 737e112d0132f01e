"""Streams of touches."""

from __future__ import annotations

import os
from collections.abc import Iterable
from typing import Union

from ._core import _palpate, path_text
from ._errors import ArgumentError

__all__ = ["Contact", "Estimate", "Motion", "Sensor", "Stream", "Touch", "Truth", "Wrench", "open"]

Contact = _palpate.Contact
Estimate = _palpate.Estimate
Sensor = _palpate.Sensor
Stream = _palpate.Stream
Touch = _palpate.Touch
Truth = _palpate.Truth
Wrench = _palpate.Wrench
Motion = _palpate.Motion

Path = Union[str, "os.PathLike[str]"]


def names_of(given: Iterable[str] | str | None) -> list[str]:
    """A list of names; one name alone is a list of one."""
    if given is None:
        return []
    return [given] if isinstance(given, str) else list(given)


def request_of(
    source: Path,
    sensor: Sensor | Path | None = None,
    background: Path | None = None,
    outputs: Iterable[str] | str | None = None,
    seed: int = 1,
    **settings: object,
) -> _palpate.RunSettings:
    """A source with its sensor, and settings by their names; what is wrong with one raises here."""
    if sensor is not None and not isinstance(sensor, Sensor):
        sensor = Sensor(path_text(sensor, "sensor"))
    if not hasattr(seed, "__index__") or seed < 0:
        raise ArgumentError("a seed of at least 0, a whole number", repr(seed), "seed=1")
    settings["background"] = path_text(background or "", "background")
    settings["outputs"] = names_of(outputs)
    return _palpate.RunSettings(path_text(source, "source"), sensor, seed, settings)


def count_of(frames: int | None) -> int:
    """How many frames; 0: all."""
    if frames is not None and (not hasattr(frames, "__index__") or frames < 1):
        raise ArgumentError("frames of at least 1, or None for all", repr(frames), "frames=100")
    return frames or 0


def rate_of(rate_Hz: float | None) -> float:
    """Frames a second; 0: those of the source."""
    if rate_Hz is not None and (isinstance(rate_Hz, str) or not 0 < rate_Hz < float("inf")):
        raise ArgumentError("rate_Hz above 0, or None", repr(rate_Hz), "rate_Hz=30")
    return rate_Hz or 0.0


def open(
    source: Path,
    *,
    sensor: Sensor | Path | None = None,
    background: Path | None = None,
    outputs: Iterable[str] | str | None = None,
    solver: str = "live",
    drop: bool = True,
    keep: Iterable[str] | str = (),
    fixed_light: bool = False,
    sequence: bool = False,
    rate_Hz: float | None = None,
    patience_s: float = 10.0,
    record: Path | None = None,
    logs: Iterable[str] | str = (),
    trace: Path | None = None,
    device: str = "",
    seed: int = 1,
) -> Stream:
    """A stream of touches: an iterator that gives one :class:`Touch` a frame.

    Args:
        source: ``"camera:/dev/video0"``, ``"synthetic:SCENE?size=640x480&rate=30"``, a video, an image, a
            folder of images, or a session's folder.
        sensor: a sensor file or a :class:`Sensor`.  Sessions and simulated scenes have their own; without
            one nothing is calibrated, and lengths are in px.
        background: the untouched image; else the sensor file's, the source's own, or its first frames.
        outputs: of ``force``, ``surface``, ``confidence``, ``contacts``, ``gradient``, ``skin``,
            ``traction``; by default what the sensor can.
        solver: of the surface: ``live``, or ``best``, on the device or the processor.
        drop: the newest frame wins, frames that come too fast are dropped and counted in
            ``stream.dropped``, and recordings come at their own pace.  ``False``: every frame, as fast as
            it is asked for.
        keep: maps that are read at once and stay: ``depth_mm``, ``image``, ``confidence``,
            ``pressure_kPa``, ``extrapolated``.  Others can be read until the next touch is asked for.
        fixed_light: a colour gel's light is not followed.
        sequence: images without a rate follow each other; otherwise each is a press of its own, and what only
            a sequence shows (shift, shear, slip, the skin's motion) is not measured.
        rate_Hz: frames a second of images, which carry no times of their own; they are a sequence then.
        patience_s: how long a camera that is unplugged or silent is waited for before :class:`DeviceError`
            is raised, 0 to infinity; ``stream.state`` says what it is waited for.
        record: a folder, which must not hold a session yet: frames and measurements are written there
            meanwhile, as :func:`record` does; ``stream.recorded`` says how far it is.  A recording that fails
            ends the stream with :class:`OutputError`.
        logs: of a robot or another instrument, recorded beside the frames on their clock: files of CSV or JSON
            lines, ``"-"`` (standard input) or ``"udp:PORT"``; ``"NAME=FILE"`` names one.  ``stream.log()``
            adds lines of this program.  They need ``record``.
        trace: a file for what each thread does when, as ``palpate live --trace`` writes it; it is whole once
            the stream is closed.  A disk that is full ends the trace, not the stream: ``stream.warning``
            says so.  One at a time in a process.
        device: index or part of the name of a Vulkan device; by default the best one.
        seed: of simulated scenes that name none.
    """
    settings = request_of(
        source, sensor, background, outputs, seed, solver=solver, fixed_light=fixed_light, sequence=sequence,
        rate_Hz=rate_Hz, patience_s=patience_s, logs=names_of(logs),
    )
    if names_of(logs) and not record:
        raise ArgumentError("record=FOLDER for logs", "none", 'record="out/press1"')
    record, trace = path_text(record or "", "record"), path_text(trace or "", "trace")
    return _palpate.open_stream(settings, drop, record, trace, device, names_of(keep))
