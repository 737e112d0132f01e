"""Streams of two fingers."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass
from typing import Any, Optional, Union

from ._core import _palpate, path_text
from ._errors import ArgumentError
from ._live import names_of, Path, request_of, Sensor

__all__ = ["Grip", "Pair", "PairRecorded", "PairStream", "open_pair", "record_pair"]

Grip = _palpate.Grip
Pair = _palpate.Pair
PairStream = _palpate.PairStream

OneSensor = Optional[Union[Sensor, Path]]
OnePath = Optional[Path]


def _of_each(given: Any, name: str) -> tuple[Any, Any]:
    """One for both fingers, or a pair of left and right."""
    if not isinstance(given, (tuple, list)):
        return given, given
    if len(given) != 2:
        raise ArgumentError(f"{name} of the left and the right finger", f"{len(given)}", f"{name}=(left, right), or one for both")
    return given[0], given[1]


def _requests_of(
    left: Path, right: Path, sensors: Any, backgrounds: Any, seed: int, **settings: object
) -> list[_palpate.RunSettings]:
    """Settings of both; what is wrong with one raises here."""
    sensor, background = _of_each(sensors, "sensors"), _of_each(backgrounds, "backgrounds")
    outputs: Any = settings.pop("outputs")
    return [
        request_of(source, sensor[i], background[i], outputs, seed + i, **settings)  # two cameras do not share their noise
        for i, source in enumerate((left, right))
    ]


def open_pair(
    left: Path,
    right: OnePath = None,
    *,
    grip: OnePath = None,
    sensors: OneSensor | tuple[OneSensor, OneSensor] = None,
    backgrounds: OnePath | tuple[OnePath, OnePath] = None,
    outputs: Iterable[str] | str | None = None,
    solver: str = "live",
    drop: bool = True,
    keep: Iterable[str] | str = (),
    fixed_light: bool = False,
    rate_Hz: float | None = None,
    patience_s: float = 10.0,
    record: OnePath = None,
    logs: Iterable[str] | str = (),
    trace: OnePath = None,
    device: str = "",
    seed: int = 1,
) -> PairStream:
    """A stream of two fingers: an iterator that gives one :class:`Pair` for two frames taken together.

    Frames that are each other's nearest in time, and no more than half a period of the slower camera apart, are a
    pair; any other frame comes by itself, with None for the other.

    Args:
        left, right: as ``source`` of :func:`open`; cameras by what stays theirs, the port or the serial number:
            ``"camera:1-2"``.  Without ``right``, ``left`` is the folder of a recorded pair,
            whose settings, sensors and grip count.
        grip: a ``grip.json``: where the pads are in the gripper, and its opening.  Without one grip force and
            imbalance are known, and of two simulated fingers all.
        sensors, backgrounds: one for both, or those of left and right.
        drop: the newest row wins, rows that come too fast are dropped and counted in ``stream.dropped``, and
            recordings come at their own pace.  ``False``: every row, as fast as it is asked for.
        keep: as of :func:`open`, of both touches.
        record: a folder, which must not hold a pair yet: ``left/`` and ``right/``, each a session, and
            ``pairs.csv`` are written there meanwhile, of all that is measured.
        logs: as of :func:`open`, beside both fingers, on the clock of the rows.  They need ``record``.
        outputs, solver, fixed_light, rate_Hz, patience_s, trace, device, seed: as of :func:`open`.  A camera that
            is lost leaves the other alone (``stream.state``); its error is raised once both have ended.
    """
    texts = [path_text(path or "", name) for path, name in ((grip, "grip"), (record, "record"), (trace, "trace"))]
    if names_of(logs) and not record:
        raise ArgumentError("record=FOLDER for logs", "none", 'record="out/grip"')
    if right is None:
        left = path_text(left, "left")
        if grip is not None or sensors is not None or backgrounds is not None or outputs is not None:
            wanted = "a recorded pair with its own grip, sensors, backgrounds and outputs"
            raise ArgumentError(wanted, "others", "its fingers: left and right")
        return _palpate.open_pair_stream(None, left, texts[0], drop, texts[1], texts[2], device, names_of(keep))
    fingers = _requests_of(
        left, right, sensors, backgrounds, seed, outputs=outputs, solver=solver, fixed_light=fixed_light,
        rate_Hz=rate_Hz, patience_s=patience_s, logs=names_of(logs),
    )
    return _palpate.open_pair_stream(fingers, "", texts[0], drop, texts[1], texts[2], device, names_of(keep))


@dataclass(frozen=True)
class PairRecorded:
    """What was written of two fingers."""

    folder: Any
    rows: int
    """Of ``pairs.csv``."""
    pairs: int
    skew_mean_ms: float
    skew_sd_ms: float
    left: dict[str, Any]
    """``folder``, frames ``recorded``, ``dropped`` and ``measured``, ``error``."""
    right: dict[str, Any]


def record_pair(
    left: Path,
    right: Path,
    folder: Path,
    *,
    grip: OnePath = None,
    frames: int | None = None,
    sensors: OneSensor | tuple[OneSensor, OneSensor] = None,
    backgrounds: OnePath | tuple[OnePath, OnePath] = None,
    outputs: Iterable[str] | str | None = None,
    solver: str = "live",
    fixed_light: bool = False,
    device: str = "",
    seed: int = 1,
) -> PairRecorded:
    """Records two fingers with their measurements: ``left/`` and ``right/``, each a session, and ``pairs.csv``.

    Args:
        folder: to be made; one that holds a pair is refused.
        frames: stop after that many of each; of cameras it is needed, unless Ctrl-C ends the recording.
        left, right, grip, sensors, backgrounds: as of :func:`open_pair`.
        outputs, solver, fixed_light, device, seed: as of :func:`palpate.open`.
    """
    fingers = _requests_of(
        left, right, sensors, backgrounds, seed, outputs=outputs, solver=solver, fixed_light=fixed_light, frames=frames
    )
    return PairRecorded(**_palpate.record_pair(fingers, path_text(grip or "", "grip"), path_text(folder, "folder"), device))
