"""Profiles of this machine: the program's numbers, their files, machines side by side."""

import csv
import json
import os
import signal
import subprocess
import sys
import time

import numpy as np
import palpate as pp
import pytest

TABLES = ("frames", "stages", "growth", "solvers", "outputs", "live", "ceiling")


@pytest.fixture(scope="module")
def measured(tmp_path_factory):
    # On a busy machine a budget leaves parts out, and says so: a larger one then.
    for budget_s in (6, 30, 150):
        out = tmp_path_factory.mktemp("profile") / "out"
        profile = pp.profile.measure(sizes=[(64, 48), (96, 64)], budget_s=budget_s, out=out)
        if set(profile.frames["width_px"]) == {64, 96} and all(getattr(profile, name).rows > 0 for name in TABLES):
            break
    return profile, out


def test_tables_are_the_program_s(measured):
    profile, out = measured
    assert profile.complete and profile.machine["palpate"] == pp.__version__
    for name in TABLES:
        table = getattr(profile, name)
        with open(out / f"{name}.csv", newline="", encoding="utf-8") as text:
            rows = list(csv.DictReader(text))
        assert list(table) == list(rows[0]) and table.rows == len(rows) > 0, name
        for column, values in table.items():
            for value, row in zip(values, rows, strict=True):
                assert str(value) == row[column] or float(f"{value:.6g}") == float(row[column]), (name, column)
            with pytest.raises(ValueError):
                values[:] = values[::-1]


def test_threads_and_fast_cameras_are_tables(measured, tmp_path):
    profile, out = measured
    with open(out / "threads.csv", newline="", encoding="utf-8") as text:
        assert list(profile.threads) == next(csv.reader(text))
    found = json.loads(profile.json)
    time = found["sizes"][0]["latency"]
    part = {"thread": "engine", "step": "device", "part": "device wait", "time": time, "ms_per_turn": 2.5, "busy": 0.25}
    figure = {"scene": "gel", "width_px": 640, "height_px": 480, "rate_Hz": 30, "frames": 9, "to_measured": time}
    counts = {"dropped_before_engine": 0, "dropped_before_display": 0, "waits_ms": 1, "frames_per_s": 90}
    found["photon"] = [{**figure, **counts, "to_picture": time, "parts": [part, part]}]
    (tmp_path / "profile.json").write_text(json.dumps(found), encoding="utf-8")
    threads = pp.profile.load(tmp_path).threads
    assert threads.rows == 2 and set(threads["part"]) == {"device wait"} and (threads["busy"] == 0.25).all()
    rate = {key: value for key, value in found["photon"][0].items() if key not in ("waits_ms", "parts")}
    found["rates"] = [rate]
    (tmp_path / "profile.json").write_text(json.dumps(found), encoding="utf-8")
    rates = pp.profile.load(tmp_path).rates
    with open(out / "rates.csv", newline="", encoding="utf-8") as text:
        assert list(rates) == next(csv.reader(text))
    assert rates.rows == 1 and rates["frames_per_s"][0] == 90 and rates["median_ms"][0] == time["median_ms"]
    del found["photon"], found["rates"]
    (tmp_path / "profile.json").write_text(json.dumps(found), encoding="utf-8")
    assert pp.profile.load(tmp_path).threads.rows == pp.profile.load(tmp_path).rates.rows == 0


def test_numbers_make_sense(measured):
    profile, _ = measured
    frames = profile.frames
    assert set(frames["width_px"]) == {64, 96} and frames["width_px"].dtype == np.int64
    assert (frames["min_ms"] <= frames["median_ms"]).all() and (frames["median_ms"] <= frames["max_ms"]).all()
    assert (frames["memory_bytes"] > 64 * 48 * 4).all() and (frames["frames_per_s"] > 0).all()
    one = profile.stages.where(reading="shading", width_px=64)
    assert one.rows == len(set(one["stage"])) > 1 and set(one["reading"]) == {"shading"}
    rate = (one["read_bytes"] + one["written_bytes"]) / one["median_ms"] / 1e6
    assert np.allclose(one["rate_GB_per_s"], rate)
    exact = profile.solvers
    front = exact["on_front"]
    assert front.any() and front.dtype == bool
    for truth in set(exact["truth"]):
        here = exact["truth"] == truth
        fastest = np.argmin(np.where(here, exact["median_ms"], np.inf))
        assert front[fastest]
    with pytest.raises(KeyError, match="there are reading"):
        frames["time"]
    with pytest.raises(KeyError, match="there are reading"):
        frames.where(mode="shading")


def test_files(measured, tmp_path):
    profile, out = measured
    for source in (out, out / "profile.json", os.fspath(out)):
        assert pp.profile.load(source).json == profile.json
    profile.save(tmp_path / "profile.json")
    assert pp.profile.load(tmp_path).json == profile.json
    assert "Surface: error against run time" in str(profile)
    assert "<th>median_ms</th>" in profile._repr_html_() and profile.machine["device"] in profile._repr_html_()
    with pytest.raises(pp.OutputError):
        profile.save(tmp_path / "nowhere" / "profile.json")
    for text, message in (("{}", "JSON of another kind"), ("{", "damaged JSON"), (profile.json.replace('"palpate_profile": 1', '"palpate_profile": 9'), "version 9")):
        (tmp_path / "bad.json").write_text(text)
        with pytest.raises(pp.InputError, match=message):
            pp.profile.load(tmp_path / "bad.json")
    with pytest.raises(pp.InputError, match="no such file"):
        pp.profile.load(tmp_path / "nowhere")


def test_machines_side_by_side(measured, tmp_path, program):
    profile, out = measured
    other = json.loads(profile.json)
    other["machine"]["device"] = "Slow"
    for size in other["sizes"]:
        for name in ("min_ms", "q25_ms", "median_ms", "q75_ms", "p95_ms", "p99_ms", "max_ms"):
            size["latency"][name] *= 2
    (tmp_path / "slow.json").write_text(json.dumps(other))
    both = pp.profile.compare(profile, tmp_path / "slow.json")
    assert both.names[0].startswith("A: ") and both.names[1] == "B: Slow"
    assert np.allclose(both.frame_ratio, [1, 2]) and np.allclose(both.frame_ratio_spread, 1)
    frames = both.figures.where(what="frame", machine="B: Slow")
    assert np.allclose(frames["ratio_to_a"], 2) and (frames["ratio_low"] <= 2).all() and (frames["ratio_high"] >= 2).all()
    assert set(frames["unit"]) == {"ms"} and frames.rows == profile.frames.rows
    command = [program, "profile", "--compare", out / "profile.json", tmp_path / "slow.json"]
    assert str(both) == subprocess.run(command, check=True, capture_output=True, text=True).stdout.rstrip()
    assert "<td>frame</td>" in both._repr_html_()
    with pytest.raises(pp.ArgumentError, match="two profiles or more"):
        pp.profile.compare(profile)


def test_mistakes(tmp_path):
    for options, kind, message in (
        ({"device": "Quantum"}, pp.DeviceError, "Quantum"),
        ({"sizes": [(0, 48)]}, pp.ArgumentError, "0x48"),
        ({"budget_s": 0}, pp.ArgumentError, "budget_s"),
        ({"out": "/proc/nowhere"}, pp.OutputError, "/proc/nowhere"),
    ):
        with pytest.raises(kind, match=message) as failure:
            pp.profile.measure(quick=True, **options)
        assert failure.value.remedy and "--" not in str(failure.value)


def test_ctrl_c_ends_it():
    code = """
import palpate as pp, os, signal
signal.signal(signal.SIGINT, signal.default_int_handler)  # a shell's background would leave it ignored
print("started", flush=True)
try:
    pp.profile.measure()
except KeyboardInterrupt:
    children = [line for line in open(f"/proc/{os.getpid()}/task/{os.getpid()}/children").read().split()]
    print("ended", children, flush=True)
"""
    with subprocess.Popen([sys.executable, "-c", code], stdout=subprocess.PIPE, text=True) as process:
        assert process.stdout.readline() == "started\n"
        time.sleep(1)
        process.send_signal(signal.SIGINT)
        assert process.stdout.readline() == "ended []\n"
