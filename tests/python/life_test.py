"""What happens at the edges: threads, signals, forks, streams that are left alone."""

import gc
import os
import signal
import subprocess
import sys
import threading
import time
from functools import partial

import numpy as np
import palpate as pp
import pytest

SLOW = "synthetic:press?size=64x48&rate=0.1&repeat=0"  # a frame in ten seconds


def frames_of(small, n=None):
    with pp.open(small, drop=False) as stream:
        return [t.gray_sum for _, t in zip(range(n or stream.frame_count), stream)]


def test_an_abandoned_generator_ends(small):
    def pressed():
        with pp.open(small, drop=False) as stream:
            opened.append(stream)
            yield from stream

    opened = []
    touches = pressed()
    next(touches)
    touches.close()
    assert opened[0].closed


def test_a_forgotten_stream_ends_its_threads(small):
    before = threads()
    stream = pp.open(small)
    next(stream)
    assert threads() > before
    del stream
    gc.collect()
    assert threads() <= before + 1  # the driver may keep one of its own


def threads():
    return len(os.listdir("/proc/self/task"))


def test_two_pipelines_in_two_threads(small):
    expected = frames_of(small)
    found = {}
    workers = [threading.Thread(target=lambda i=i: found.update({i: frames_of(small)})) for i in range(2)]
    for worker in workers:
        worker.start()
    for worker in workers:
        worker.join()
    assert found == {0: expected, 1: expected}


def test_two_threads_read_one_stream(small):
    """None waits for the interpreter while it holds the stream, nor asks for the stream while it is held so."""
    seen = []

    def read():
        for touch in stream:
            seen.append(touch.sequence)
            sum(range(50_000))  # the other's frame comes while this one has the interpreter

    with pp.open(small, drop=False) as stream:
        workers = [threading.Thread(target=read) for _ in range(2)]
        for worker in workers:
            worker.start()
        for worker in workers:
            worker.join()
        assert sorted(seen) == list(range(stream.frame_count))


def counted_while(work):
    """How far a thread counts between the beginning and the end of `work`."""
    counts, stop, counting = [0], threading.Event(), threading.Event()

    def count():
        while not stop.is_set():
            counts[0] += 1
            counting.set()
            time.sleep(0.0005)

    counter = threading.Thread(target=count)
    counter.start()
    counting.wait()
    before = counts[0]
    work()
    counted = counts[0] - before
    stop.set()
    counter.join()
    return counted


def random_slopes(side):
    return np.random.default_rng(1).normal(size=(2, side, side)).astype(np.float32)


WORK = {
    "waiting": lambda: wait_for_second,
    "measuring": lambda: partial(pp.measure, "synthetic:press?size=320x240&rate=10"),
    "solving": lambda: partial(pp.integrate, *random_slopes(900), solver="best"),
    "matching": lambda: partial(pp.match, *np.random.default_rng(1).uniform(0, 9, (2, 300, 2))),
}


def wait_for_second():
    with pp.open("synthetic:press?size=64x48&rate=2") as stream:
        next(stream), next(stream)


@pytest.mark.parametrize("make", WORK.values(), ids=WORK.keys())
def test_others_go_on(make):
    """A counting thread goes on counting: it could not while the interpreter is held, however often it is tried."""
    work = make()
    assert any(counted_while(work) > 10 for _ in range(20))


CTRL_C = {
    "waiting": f"s = palpate.open('{SLOW}'); next(s); ready(); next(s)",
    "iterating": "s = palpate.open('synthetic:press?rate=500&repeat=1000', drop=False)\nfor t in s:\n if t.sequence == 3: ready()",
    "measuring": "ready(); palpate.measure('synthetic:press?rate=500')",
    "matching": "p = np.random.default_rng(1).uniform(0, 9, (2, 800, 2)); ready(); palpate.match(*p)",
    "fitting": "p = np.random.default_rng(1).uniform(0, 9, (3000, 2)); ready(); palpate.ThinPlate(p).fit(p)",
}


@pytest.mark.parametrize("code", CTRL_C.values(), ids=CTRL_C.keys())
def test_ctrl_c(code):
    """KeyboardInterrupt is raised in the midst of work that would go on for long. How soon is printed: it is the machine's affair."""
    lines = """
import signal, sys, time
import numpy as np, palpate
signal.signal(signal.SIGINT, signal.default_int_handler)  # a shell's background would leave it ignored
def ready():
    print("ready", flush=True)
try:
    palpate.open
    {}
except KeyboardInterrupt:
    print(time.monotonic(), flush=True)
"""
    code = lines.format(code.replace("\n", "\n    "))
    took_ms = []
    for _ in range(3):
        with subprocess.Popen([sys.executable, "-c", code], stdout=subprocess.PIPE, text=True) as child:
            assert child.stdout.readline() == "ready\n"
            time.sleep(0.15)
            sent_s = time.monotonic()
            child.send_signal(signal.SIGINT)
            raised_s = child.stdout.readline()
            assert raised_s, "the work ended as if nothing had happened"
            took_ms.append(1000 * (float(raised_s) - sent_s))
            assert child.wait() == 0
    print("Ctrl-C, ms:", took_ms)


def test_a_fork_is_told(small):
    stream = pp.open(small, drop=False)
    next(stream)
    read, write = os.pipe()
    child = os.fork()
    if child == 0:
        said = []
        for attempt in (lambda: next(stream), lambda: pp.open(small), lambda: pp.integrate(np.eye(4), np.eye(4))):
            try:
                attempt()
                said.append("nothing")
            except pp.DeviceError as error:
                said.append(type(error).__name__ + ("fork" if "fork" in str(error) else ""))
        said.append(str(pp.ThinPlate(np.eye(3)[:, :2]).fit(np.zeros(3)).rank))  # what needs no device works
        del stream
        gc.collect()
        os.write(write, " ".join(said).encode())
        os._exit(0)
    os.close(write)
    assert os.read(read, 1000) == b"DeviceErrorfork DeviceErrorfork DeviceErrorfork 2"
    assert os.waitpid(child, 0)[1] == 0
    assert next(stream).sequence == 1  # the parent goes on
    stream.close()


def test_a_child_by_multiprocessing_can_open(python, small):
    code = f"""
import multiprocessing, palpate
def first(scene):
    with palpate.open(scene) as stream:
        return next(stream).sequence
if __name__ == "__main__":
    first("{small}")
    with multiprocessing.get_context("fork").Pool(1) as pool:
        try:
            pool.apply(first, ("{small}",))
        except palpate.DeviceError as error:
            print("fork" in error.found)
"""
    assert python(code).stdout == "True\n"


@pytest.mark.parametrize("end", ["pass", "sys.exit(3)", "raise RuntimeError", "os.kill(os.getpid(), signal.SIGINT)"])
def test_the_interpreter_may_end_at_any_time(python, small, end):
    done = python(f"import os, signal, sys, palpate; s = palpate.open('{small}'); next(s); t = next(s); {end}")
    assert done.returncode in (0, 1, 3, -signal.SIGINT), done.stderr
