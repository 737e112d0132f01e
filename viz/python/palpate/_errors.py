"""Errors of palpate: one line that says what was wanted, what was found, what to try."""

from __future__ import annotations

__all__ = [
    "ArgumentError", "DeviceError", "Error", "ExpiredError", "InputError", "OutputError", "SensorError",
    "VersionError",
]


class Error(Exception):
    """Any failure of palpate.

    ``wanted``, ``found`` and ``remedy`` are the parts of the message.
    """

    def __init__(self, wanted: str, found: str, remedy: str) -> None:
        super().__init__(wanted, found, remedy)
        self.wanted = wanted
        self.found = found
        self.remedy = remedy

    def __str__(self) -> str:
        return f"wanted {self.wanted}; found {self.found}; try {self.remedy}"


class ArgumentError(Error, ValueError, TypeError):
    """An argument that makes no sense: a wrong type, shape or dtype, NaN, a number out of range."""


class InputError(Error):
    """A recording, image, table or array that is missing, unreadable or malformed."""


class SensorError(Error):
    """A sensor file that is missing, malformed or lacks what is asked of it."""


class DeviceError(Error, RuntimeError):
    """No usable Vulkan device or camera, or it failed."""


class OutputError(Error):
    """Results that cannot be written."""


class ExpiredError(Error, RuntimeError):
    """A frame's data that was not read in time, or a stream that is closed."""


class VersionError(Error, ImportError):
    """The compiled part is missing or of another version than the Python files next to it."""
