"""Recordings in the formats of other programs."""

from __future__ import annotations

import json
import os
import pathlib
import tempfile
from collections.abc import Iterable
from dataclasses import dataclass

from ._core import path_text
from ._errors import ArgumentError
from ._live import Path, rate_of, Sensor
from ._program import run_program

__all__ = ["Exported", "export"]


@dataclass(frozen=True)
class Exported:
    """Files that were written."""

    files: tuple[pathlib.Path, ...]
    there: tuple[pathlib.Path, ...]
    """Files of HDF5 that were there already, whole, and stayed as they are."""


def export(
    recordings: Path | Iterable[Path],
    *,
    mcap: Path | None = None,
    hdf5: Path | None = None,
    cloud: bool = False,
    frames: str = "",
    sensor: Sensor | Path | None = None,
    background: Path | None = None,
    solver: str = "",
    sequence: bool = False,
    rate_Hz: float | None = None,
    device: str = "",
    seed: int = 1,
) -> Exported:
    """Writes recordings as MCAP (Foxglove, ROS 2) or HDF5 (for learning): what ``palpate export`` does.

    Args:
        recordings: a session, or any recording that :func:`open` takes; for ``hdf5`` also several, or a folder of
            sessions.
        mcap: a folder for ``recording.mcap`` and ``metadata.yaml``, of one recording.
        hdf5: a file (``.h5``) of one recording, or a folder: one file for each recording.  Without ``mcap`` files
            that are there already stay, so that the same call goes on where it was stopped.
        cloud: with ``mcap``: the surface as points too, thrice the size.
        frames: ``"FIRST:END"`` or ``"FIRST:END:STEP"``, END not included; all by default.
        solver: of the surface, ``live`` or ``best``; by default the session's, else ``best``.
        sensor, background, sequence, rate_Hz, device, seed: as of :func:`open`; by default the session's.
    """
    if mcap is None and hdf5 is None:
        raise ArgumentError("mcap=FOLDER or hdf5=FILE", "neither", 'export("out/press", hdf5="press.h5")')
    given = [recordings] if isinstance(recordings, (str, os.PathLike)) else recordings
    inputs = [path_text(one, "recordings") for one in given]
    if not inputs:
        raise ArgumentError("one recording at least", "none", 'export(["out/a", "out/b"], hdf5="out/episodes")')
    with tempfile.TemporaryDirectory() as scratch:
        if isinstance(sensor, Sensor):
            sensor.save(pathlib.Path(scratch) / "sensor.json")
            sensor = pathlib.Path(scratch) / "sensor.json"
        words = ["export", *inputs, "--seed", str(seed), *["--cloud"] * cloud, *["--sequence"] * sequence]
        for option, path in (("--hdf5", hdf5), ("--sensor", sensor), ("--background", background)):
            words += [] if path is None else [option, path_text(path, option[2:])]
        settings = {"--frames": frames, "--solver": solver, "--rate": rate_of(rate_Hz), "--device": device}
        words += [word for option, value in settings.items() if value for word in (option, str(value))]
        if mcap is not None:
            words += ["--mcap", "--out", path_text(mcap, "mcap")]
        said = json.loads(run_program([*words, "--json", "--quiet"], "a recording to export"))
    if mcap is None:
        return Exported(tuple(map(pathlib.Path, said["written"])), tuple(map(pathlib.Path, said["skipped"])))
    folder = pathlib.Path(path_text(mcap, "mcap"))
    episode = [] if hdf5 is None else [pathlib.Path(path_text(hdf5, "hdf5"))]
    return Exported((folder / "recording.mcap", folder / "metadata.yaml", *episode), ())
