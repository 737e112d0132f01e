"""Streams that are opened and closed again and again leave nothing behind."""

import os

import palpate as pp
import pytest

THOROUGH = os.environ.get("PALPATE_THOROUGH", "0") != "0"
COUNT = 10000 if THOROUGH else 100
WARM_UP = 20


@pytest.fixture
def watchdog():
    """None here: ctest's timeout is enough."""


def memory_kB():
    with open("/proc/self/status") as status:
        return next(int(line.split()[1]) for line in status if line.startswith("VmRSS"))


def threads():
    return len(os.listdir("/proc/self/task"))


def test_streams_leak_nothing():
    def once():
        with pp.open("synthetic:press?size=32x24", drop=False, outputs=["force", "surface"]) as stream:
            next(stream).depth_mm

    files = len(os.listdir("/proc/self/fd"))
    for _ in range(WARM_UP):
        once()
    start_kB, start_threads = memory_kB(), threads()
    for _ in range(COUNT):
        once()
    growth_kB = (memory_kB() - start_kB) / COUNT
    print(f"growth of {growth_kB:.2f} kB a stream over {COUNT}")
    assert growth_kB < 6
    assert threads() <= start_threads
    assert len(os.listdir("/proc/self/fd")) <= files + 10
