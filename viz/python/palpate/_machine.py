"""What the machine has, sessions, simulated scenes."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass, field
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ._core import _palpate, path_text
from ._live import count_of, Path, request_of, Sensor

__all__ = ["Camera", "Device", "Recorded", "Simulation", "cameras", "devices", "record", "simulate"]


@dataclass(frozen=True)
class Device:
    """A Vulkan device."""

    index: int
    name: str
    type: str
    """``discrete GPU``, ``integrated GPU``, ``virtual GPU`` or ``CPU``."""
    driver: str
    api_version: str
    memory_bytes: int
    refusals: tuple[str, ...]
    """What it lacks; empty: it can be used."""

    @property
    def usable(self) -> bool:
        return not self.refusals


def devices() -> list[Device]:
    """The Vulkan devices of this machine; ``index`` or part of ``name`` is what ``device=`` takes."""
    return [Device(**one) for one in _palpate.devices()]


@dataclass(frozen=True)
class Camera:
    """A camera of this machine."""

    source: str
    """What :func:`palpate.open` takes."""
    name: str
    driver: str
    bus: str
    trouble: str
    """Why it cannot be asked; empty: it can."""


def cameras() -> list[Camera]:
    """The cameras of this machine."""
    return [Camera(**one) for one in _palpate.cameras()]


@dataclass(frozen=True)
class Recorded:
    """What was written to a session."""

    recorded: int
    dropped: int
    """Frames that came too fast for the file; only of cameras."""
    measured: int
    warning: str = ""
    """Why the trace ended early; empty where all is well."""


def record(
    source: Path,
    folder: Path,
    *,
    frames: int | None = None,
    sensor: Sensor | Path | None = None,
    background: Path | None = None,
    outputs: Iterable[str] | str | None = None,
    solver: str = "live",
    fixed_light: bool = False,
    sequence: bool = False,
    trace: Path | None = None,
    device: str = "",
    seed: int = 1,
) -> Recorded:
    """Records a source with its measurements into a session, a folder that :func:`open` and :func:`measure` take.

    Args:
        folder: to be made; one that holds a session is refused.
        frames: stop after that many; of a camera it is needed, unless Ctrl-C ends the recording.
        source, sensor, background, outputs, solver, fixed_light, sequence, trace, device, seed: as of
            :func:`palpate.open`.
    """
    settings = request_of(
        source, sensor, background, outputs, seed, solver=solver, fixed_light=fixed_light, sequence=sequence,
        frames=frames,
    )
    answer = _palpate.record(settings, path_text(folder, "folder"), path_text(trace or "", "trace"), device)
    return Recorded(**answer)


@dataclass(frozen=True, eq=False)
class Simulation:
    """Frames of the built-in sensor and what was really there."""

    input: str
    """The scene with every key."""
    sensor: Sensor
    rate_Hz: float
    images: NDArray[Any] = field(repr=False)
    """frames x rows x columns (x 3), uint8 or uint16."""
    background: NDArray[Any] = field(repr=False)
    """The untouched image."""
    truth: dict[str, NDArray[np.float64]] = field(repr=False)
    """One number a frame: force_N, shear_x_N, shear_y_N, slipping, center_x_px, ..."""
    depth_mm: NDArray[np.float32] | None = field(repr=False)
    """frames x rows x columns, where it was asked for."""


def simulate(scene: str, *, frames: int | None = None, depth: bool = False, seed: int = 1) -> Simulation:
    """Frames of a simulated scene with their truth.

    Args:
        scene: ``"synthetic:press?size=640x480&rate=30"``; the prefix may be left out.
        frames: at most that many; of a scene without an end it is needed.
        depth: give the true depth maps too.
        seed: of a scene that names none.
    """
    name = scene if scene.startswith("synthetic:") else "synthetic:" + scene
    return Simulation(**_palpate.simulate(request_of(name, seed=seed), count_of(frames), depth))
