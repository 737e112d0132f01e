"""palpate: a camera behind a silicone pad as a calibrated touch instrument.

    import palpate as pp
    with pp.open("synthetic:palpation") as stream:
        for touch in stream:
            print(touch.time_s, touch.force_N, touch.slip, len(touch.contacts))

Numbers have their unit in their name, a standard error and a state.  The
compiled part, and what it needs, is loaded when it is first used.
"""

from __future__ import annotations

import importlib
from typing import Any

from ._errors import (
    ArgumentError,
    DeviceError,
    Error,
    ExpiredError,
    InputError,
    OutputError,
    SensorError,
    VersionError,
)

__version__ = "@PROJECT_VERSION@"

_PUBLIC = {
    "Camera": "_machine",
    "Check": "_setup",
    "Compression": "_mechanics",
    "Contact": "_live",
    "Contacting": "_mechanics",
    "Device": "_machine",
    "Estimate": "_live",
    "Heights": "_arrays",
    "Match": "_arrays",
    "Modulus": "_recordings",
    "PlateFit": "_arrays",
    "Pressed": "_mechanics",
    "Recorded": "_machine",
    "Recording": "_recordings",
    "Sensor": "_live",
    "Setup": "_setup",
    "Simulation": "_machine",
    "Strain": "_arrays",
    "Stream": "_live",
    "Table": "_tables",
    "ThinPlate": "_arrays",
    "Touch": "_live",
    "Truth": "_live",
    "Wrench": "_live",
    "WrenchSeries": "_mechanics",
    "cameras": "_machine",
    "check": "_setup",
    "contact": "_mechanics",
    "devices": "_machine",
    "forward": "_mechanics",
    "integrate": "_arrays",
    "match": "_arrays",
    "measure": "_recordings",
    "modulus": "_recordings",
    "open": "_live",
    "record": "_machine",
    "setup": "_setup",
    "simulate": "_machine",
    "strain": "_mechanics",
    "wrench": "_mechanics",
}
_MODULES = {"calibrate", "lump", "optics", "profile"}

__all__ = [
    "ArgumentError",
    "DeviceError",
    "Error",
    "ExpiredError",
    "InputError",
    "OutputError",
    "SensorError",
    "VersionError",
    "__version__",
    *sorted(_PUBLIC),
    *sorted(_MODULES),
]


def __getattr__(name: str) -> Any:
    if name in _MODULES:
        return importlib.import_module("." + name, __name__)
    if name in _PUBLIC:
        value = getattr(importlib.import_module("." + _PUBLIC[name], __name__), name)
        globals()[name] = value
        return value
    raise AttributeError(f"module 'palpate' has no attribute '{name}'")


def __dir__() -> list[str]:
    return sorted(__all__)
