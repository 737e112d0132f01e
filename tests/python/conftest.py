"""What all tests of the Python module share."""

import faulthandler
import os
import subprocess
import sys

import pytest

WATCHDOG_S = 900  # against tests that hang: no machine is that slow
SMALL = "size=160x120&rate=20"


@pytest.fixture(autouse=True)
def watchdog():
    """A test that hangs ends, and says where every thread stood."""
    faulthandler.dump_traceback_later(WATCHDOG_S, exit=True)
    yield
    faulthandler.cancel_dump_traceback_later()


@pytest.fixture
def small():
    """A simulated press that is quick to measure."""
    return "synthetic:press?" + SMALL


def run_python(code, timeout_s=600, **options):
    """Python in a process of its own, warnings on: its completed process."""
    return subprocess.run(
        [sys.executable, "-X", "dev", "-c", code], capture_output=True, text=True, timeout=timeout_s, **options
    )


@pytest.fixture
def python():
    return run_python


@pytest.fixture(scope="session")
def program():
    return os.environ["PALPATE_PROGRAM"]
