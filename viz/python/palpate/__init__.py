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

from ._errors import *
from ._errors import __all__ as _ERRORS

__version__ = "@PROJECT_VERSION@"

# Public names by the file that has them.
_FILES = {
    "_arrays": "Heights Match PlateFit Strain ThinPlate integrate match",
    "_export": "Exported export",
    "_live": "Contact Estimate Motion Sensor Stream Touch Truth Wrench open",
    "_machine": "Camera Device Recorded Simulation cameras devices record simulate",
    "_map": "Map MapPiece map",
    "_mechanics": "Compression Contacting Pressed WrenchSeries contact forward strain wrench",
    "_pair": "Grip Pair PairRecorded PairStream open_pair record_pair",
    "_recordings": "Modulus Recording measure modulus",
    "_setup": "Check Setup check setup",
    "_tables": "Table",
}
_PUBLIC = {name: file for file, names in _FILES.items() for name in names.split()}
_MODULES = {"calibrate", "lump", "optics", "profile"}

__all__ = [*_ERRORS, "__version__", *sorted(_PUBLIC), *sorted(_MODULES)]


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
