"""The program palpate, in a process of its own."""

from __future__ import annotations

import os
import re
import shutil
import subprocess
import tempfile
import time
from collections.abc import Sequence
from pathlib import Path

from . import _errors
from ._core import _palpate

_FAILURES = {2: "ArgumentError", 3: "InputError", 4: "SensorError", 5: "DeviceError", 6: "DeviceError", 7: "OutputError"}


def program() -> str:
    """Its file: next to the module, or on the PATH."""
    here = Path(__file__).resolve().parent
    built = here.parents[1] / "palpate"
    installed = [folder / "bin" / "palpate" for folder in here.parents[2:5]]
    for file in (built, *installed):
        if file.is_file() and os.access(file, os.X_OK):
            return str(file)
    found = shutil.which("palpate")
    if found is None:
        raise _errors.InputError("the program palpate next to the module", "none, nor on the PATH", "installing the package palpate")
    return found


def _failure(code: int, said: str, wanted: str, command: str) -> _errors.Error:
    """Error of all that the program wrote to stderr: its line "palpate: wanted ...; found ...; try ...", and other lines."""
    lines = [line.strip() for line in said.splitlines() if line.strip()]
    kind: type[_errors.Error] = getattr(_errors, _FAILURES.get(code, "Error"))
    for i in reversed(range(len(lines))):
        # An error that is quoted in another is in what was found.
        parts = re.fullmatch(r"palpate: wanted (.*?); found (.*); try (.*)", lines[i])
        if parts:
            others = "; ".join(lines[:i] + lines[i + 1 :])
            found = parts[2] + (f" (and on stderr: {others})" if others else "")
            return kind(*(_palpate.as_arguments(part) for part in (parts[1], found, parts[3])))
    return kind(wanted, "; ".join(lines) or f"exit code {code} of palpate {command}", f"palpate {command} in a terminal")


def run_program(words: Sequence[str], wanted: str) -> str:
    """What ``palpate WORDS`` writes; it is waited for without the GIL, and Ctrl-C ends it.

    ``wanted`` is what an error says where the program says nothing.
    """
    with tempfile.TemporaryFile() as said, tempfile.TemporaryFile() as written:
        # In a session of its own, Ctrl-C is for this process alone.
        process = subprocess.Popen([program(), *words], stdin=subprocess.DEVNULL, stdout=written, stderr=said, start_new_session=True)
        try:
            while process.poll() is None:
                time.sleep(0.02)
        except BaseException:
            process.kill()
            process.wait()
            raise
        said.seek(0)
        written.seek(0)
        if process.returncode != 0:
            raise _failure(process.returncode, said.read().decode(errors="replace"), wanted, words[0])
        return written.read().decode(errors="replace")
