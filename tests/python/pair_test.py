"""Streams of two fingers: which frames come together, what they hold, what is recorded."""

import csv
import os
import signal
import subprocess
import sys
import threading
import time

import numpy as np
import palpate as pp
import pytest


def finger(side, more="size=64x48&rate=60"):
    return f"synthetic:grip?{more}&weight_N=0.6&skew_ms=5&side={side}"


def both(more="size=64x48&rate=60"):
    return finger("left", more), finger("right", more)


@pytest.fixture(scope="module")
def recorded(tmp_path_factory, program):
    """A grip that the program has recorded, and the rows of its pairs.csv."""
    folder = tmp_path_factory.mktemp("pair") / "grip"
    left, right = both("size=160x120&rate=30")
    command = [program, "record", "--left", left, "--right", right, "--out", folder, "--quiet"]
    subprocess.run(command, check=True, stdout=subprocess.DEVNULL)
    with open(folder / "pairs.csv", newline="") as file:
        return folder, list(csv.DictReader(file))


def numbers(rows, name):
    return [float(row[name]) if row[name] else np.nan for row in rows]


def test_every_row_is_that_of_the_program(recorded):
    _, wanted = recorded
    with pp.open_pair(*both("size=160x120&rate=30"), drop=False) as stream:
        rows = list(stream)
        assert stream.dropped == 0 and stream.delivered == len(wanted)
    assert [(r.left.sequence, r.right.sequence) for r in rows] == [
        (int(w["left_frame"]), int(w["right_frame"])) for w in wanted
    ]
    assert np.allclose([r.time_s for r in rows], numbers(wanted, "time_s"), atol=1e-6)
    assert np.allclose([r.skew_ms for r in rows], 5)
    grips = [r.grip for r in rows]
    for name, places in (("grip_force_N", 1e-3), ("load_z_N", 1e-3), ("turn_rad", 1e-3), ("thickness_mm", 1e-3)):
        found = [g.value if not np.isnan((g := getattr(grip, name)).value) else np.nan for grip in grips]
        assert np.allclose(found, numbers(wanted, name), atol=places, equal_nan=True), name
    assert [g.grip_force_N.state for g in grips] == [w["grip_force_state"] for w in wanted]
    assert [g.grip_slip for g in grips] == [w["grip_slip"] for w in wanted]
    held = grips[len(grips) // 2]
    assert abs(float(held.load_z_N) + 0.6) < 0.03 and held.load_z_N.sd > 0 and held.load_z_N.unit == "N"


def test_the_attributes_of_a_grip_are_the_columns_of_the_table(recorded):
    _, wanted = recorded
    columns = [name for name in wanted[0] if "_sd" not in name and (not name.endswith("_state") or name == "stiffness_state")]
    attributes = [name for name in vars(pp.Grip) if not name.startswith("_")]
    assert sorted(attributes) == sorted(columns)


def test_a_recorded_pair_is_measured_as_it_was(recorded):
    folder, wanted = recorded
    with pp.open_pair(folder, drop=False) as stream:
        rows = list(stream)
        assert stream.inputs == (str(folder / "left"), str(folder / "right"))
    found = [r.grip.grip_force_N.value for r in rows]
    assert np.allclose(found, numbers(wanted, "grip_force_N"), atol=1e-4, equal_nan=True)
    with pytest.raises(pp.ArgumentError, match="its own grip"):
        pp.open_pair(folder, grip="grip.json")
    with pytest.raises(pp.InputError, match="pair.json"):
        pp.open_pair(folder / "left")


def test_frames_without_a_partner_come_alone():
    left, right = finger("left", "size=64x48&rate=30"), finger("right", "size=64x48&rate=60")
    with pp.open_pair(left, right, drop=False) as stream:
        rows = list(stream)
    alone = [r for r in rows if r.left is None]
    assert all(r.right is not None for r in rows)
    assert len(rows) == 2 * sum(r.left is not None for r in rows) == 2 * len(alone)
    assert [r.right.sequence for r in rows] == list(range(len(rows)))
    assert np.isnan(alone[0].skew_ms) and np.isnan(float(alone[0].grip.grip_force_N))
    assert alone[0].grip.left_frame is None and alone[0].grip.grip_slip is None
    assert "frames none and" in repr(alone[0])


def test_maps_of_both_can_be_read_until_the_next_row():
    with pp.open_pair(*both(), drop=False, keep="image") as stream:
        first = next(stream)
        depth = first.left.depth_mm
        assert depth.shape == first.right.image.shape == (48, 64)
        for _ in range(30):
            row = next(stream)
            row.left.depth_mm, row.right.depth_mm
        assert first.left.depth_mm is depth and first.left.image.dtype == np.uint8
        with pytest.raises(pp.ExpiredError):
            first.right.depth_mm
        assert row.left.truth.force_N >= 0


def test_the_newest_row_wins():
    with pp.open_pair(*both("size=64x48&rate=100&repeat=0")) as stream:
        assert stream.drops
        seen = []
        for row in stream:
            seen.append(row.time_s)
            if len(seen) == 5:
                break
            while stream.dropped < 10 * len(seen):  # what comes while this one is in hand
                time.sleep(0.005)
    assert seen == sorted(set(seen))
    assert seen[-1] > 0.2


def test_the_last_row_is_not_lost():
    frames = 360
    with pp.open_pair(*both()) as stream:
        for row in stream:
            pass
    assert max(r.sequence for r in (row.left, row.right) if r) == frames - 1
    assert stream.closed


def test_what_is_streamed_is_recorded(tmp_path):
    folder = tmp_path / "grip"
    with pp.open_pair(*both(), drop=False, record=folder) as stream:
        rows = sum(1 for _ in stream)
        said = stream.recorded
    assert said["rows"] == rows and said["folder"] == folder
    for side in ("left", "right"):
        assert said[side] == {"folder": folder / side, "recorded": rows, "dropped": 0, "measured": rows, "error": ""}
    assert len((folder / "pairs.csv").read_text().splitlines()) == rows + 1
    with pytest.raises(pp.OutputError, match="pair.json"):
        pp.open_pair(*both(), record=folder)
    done = pp.record_pair(*both(), tmp_path / "other")
    assert (tmp_path / "other" / "pairs.csv").read_bytes() == (folder / "pairs.csv").read_bytes()
    assert done.rows == done.pairs == rows and abs(done.skew_mean_ms - 5) < 1e-6
    with pytest.raises(pp.OutputError):
        pp.record_pair(*both(), tmp_path / "other")


def test_a_slow_reader_costs_no_recorded_pair(tmp_path):
    with pp.open_pair(*both(), record=tmp_path / "grip") as stream:
        for row in stream:
            time.sleep(0.05)
        said = stream.recorded
    assert stream.delivered < said["rows"]
    assert said["left"]["measured"] + said["right"]["measured"] >= said["rows"] >= said["left"]["measured"]


def test_a_log_is_kept_beside_both(tmp_path):
    with pp.open_pair(*both(), record=tmp_path / "grip") as stream:
        for row in stream:
            stream.log("robot", z_mm=row.time_s, q_rad=np.array([1.0, 2.0]))
            if row.time_s > 1:
                break
    rows = (tmp_path / "grip" / "log" / "robot.csv").read_text().splitlines()
    assert rows[0] == "time_s,z_mm,q_rad.0,q_rad.1" and len(rows) > 5
    assert not (tmp_path / "grip" / "left" / "log").exists()
    with pytest.raises(pp.ExpiredError):
        stream.log("robot", z_mm=1)
    with pytest.raises(pp.ArgumentError, match="record=FOLDER for logs"):
        pp.open_pair(*both(), logs="robot.csv")


def test_what_is_wrong_is_said(tmp_path):
    left, right = both()
    with pytest.raises(pp.InputError, match="nonsense"):
        pp.open_pair(left, "synthetic:grip?nonsense=1")
    with pytest.raises(pp.ArgumentError, match="left and the right"):
        pp.open_pair(left, right, sensors=[None, None, None])
    with pytest.raises(pp.InputError, match="grip.json"):
        pp.open_pair(left, right, grip=tmp_path / "grip.json")
    with pytest.raises(pp.DeviceError, match="port or serial"):  # another camera may be that node tomorrow
        pp.open_pair("camera:/dev/video0", right)
    with pytest.raises(pp.ArgumentError, match="names of maps"):
        pp.open_pair(left, right, keep="heights")
    with pp.open_pair(left, right) as stream:
        next(stream)
    assert stream.closed
    with pytest.raises(pp.ExpiredError, match="closed"):
        next(stream)


def test_sensors_are_those_of_each_finger(tmp_path):
    with pp.open_pair(*both(), drop=False) as stream:
        sensors = stream.sensors
        wanted = [float(r.grip.grip_force_N) for r in stream]
    sensors[1].save(tmp_path / "right.json")
    with pp.open_pair(*both(), drop=False, sensors=(sensors[0], tmp_path / "right.json")) as stream:
        assert np.array_equal([float(r.grip.grip_force_N) for r in stream], wanted, equal_nan=True)


def test_closing_from_another_thread_ends_the_wait():
    stream = pp.open_pair(*both("size=64x48&rate=0.5"))
    next(stream)
    threading.Timer(0.1, stream.close).start()
    with pytest.raises(pp.ExpiredError):
        while True:
            next(stream)


def test_ctrl_c_ends_the_wait():
    with pp.open_pair(*both("size=64x48&rate=0.5")) as stream:
        next(stream)
        threading.Timer(0.1, os.kill, (os.getpid(), signal.SIGINT)).start()
        with pytest.raises(KeyboardInterrupt):
            while True:
                next(stream)


def test_it_outlives_its_device_where_it_may_drop():
    layer = os.path.join(os.path.dirname(os.environ["PALPATE_PROGRAM"]), "tests", "layer")
    lost = {
        "VK_LAYER_PATH": layer,
        "VK_INSTANCE_LAYERS": "VK_LAYER_PALPATE_failing",
        "PALPATE_FAIL_CALL": "vkQueueSubmit2",
        "PALPATE_FAIL_AT": "60",
    }
    code = f"""
import palpate as pp
for drop in (True, False):
    last, error = 0, ""
    with pp.open_pair(*{both()!r}, drop=drop) as stream:
        try:
            for row in stream:
                last = row.time_s
        except pp.DeviceError as e:
            error = str(e)
        print(last > 5.9, stream.device_losses, "device lost" in error)
"""
    run = subprocess.run([sys.executable, "-c", code], env=os.environ | lost, capture_output=True, text=True)
    assert run.returncode == 0, run.stderr
    assert run.stdout.splitlines()[0] == "True 1 False"
