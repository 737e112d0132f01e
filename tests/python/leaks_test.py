"""Streams that are opened and closed again and again leave nothing behind."""

import ctypes
import gc
import os

import palpate as pp
import pytest

THOROUGH = os.environ.get("PALPATE_THOROUGH", "0") != "0"
COUNT = 10000 if THOROUGH else 60
WARM_UP = 20


@pytest.fixture
def watchdog():
    """None here: ctest's timeout is enough."""


class Mallinfo2(ctypes.Structure):
    """Of the C library, bytes over all arenas."""

    _fields_ = [
        (name, ctypes.c_size_t)
        for name in ("arena", "ordblks", "smblks", "hblks", "hblkhd", "usmblks", "fsmblks", "uordblks", "fordblks", "keepcost")
    ]


def allocated_kB():
    """What was allocated and not freed; what is resident moves by megabytes with what the arenas keep."""
    library = ctypes.CDLL(None)
    library.mallinfo2.restype = Mallinfo2
    found = library.mallinfo2()
    return (found.uordblks + found.hblkhd) / 1024


def resident_kB():
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
    start_resident_kB, start_threads = resident_kB(), threads()
    allocated = []
    for _ in range(COUNT):
        once()
        gc.collect()
        allocated.append(allocated_kB())
    # The driver's threads hold 8 MB more at one moment than at another: compared is the least of either third.
    third = COUNT // 3
    growth_kB = (min(allocated[-third:]) - min(allocated[:third])) / (COUNT - third)
    resident = resident_kB() - start_resident_kB
    print(f"growth of {growth_kB:.3f} kB allocated a stream over {COUNT}, {resident / 1024:.1f} MB resident in all")
    assert growth_kB < 1
    assert resident < 20 * 1024
    assert threads() <= start_threads
    assert len(os.listdir("/proc/self/fd")) <= files + 10
