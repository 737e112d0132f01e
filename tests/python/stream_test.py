"""Streams: what is handed out, in which order, how long it stays."""

import json
import os
import subprocess
import sys
import threading
import time

import numpy as np
import palpate as pp
import pytest


@pytest.fixture
def frames(tmp_path, program):
    """A folder of six images."""
    run = tmp_path / "run"
    command = [program, "simulate", "press", "--size", "64x48", "--frames", "6", "--out", run, "--quiet"]
    subprocess.run(command, check=True, stdout=subprocess.DEVNULL)
    return run / "frames"


def test_every_frame_comes_in_order(small):
    with pp.open(small, drop=False) as stream:
        touches = list(stream)
    assert [t.sequence for t in touches] == list(range(stream.frame_count))
    assert stream.dropped == 0
    assert stream.delivered == stream.frame_count
    assert np.allclose([t.time_s for t in touches], np.arange(len(touches)) / 20)
    pressed = [t for t in touches if t.contact]
    assert 10 < len(pressed) < len(touches)
    assert max(float(t.force_N) for t in pressed if t.force_N.valid) > 1


def test_a_touch_of_a_folder_names_its_file(frames, small):
    files = sorted(file.name for file in frames.iterdir())
    with pp.open(frames) as stream:
        touches = list(stream)
    assert [t.source for t in touches] == files
    assert f"of '{files[2]}'" in repr(touches[2])
    with pp.open(small) as stream:
        assert next(stream).source is None


def test_pictures_are_separate_presses(frames):
    with pp.open(frames) as stream:
        touches = list(stream)
    assert all(np.isnan([t.shift_x_mm, t.shift_y_mm, t.shift_x_px, t.shift_y_px]).all() for t in touches)
    with pp.open(frames, sequence=True) as stream:
        assert all(np.isfinite(t.shift_x_px) for t in stream)
    for start in (pp.open, pp.measure):
        with pytest.raises(pp.ArgumentError, match="the output skin.*press of its own.*try sequence"):
            start(frames, outputs="force,skin".split(","))


def test_a_touch_says_what_is_known_of_it():
    with pp.open("synthetic:press?mode=gel&size=160x120&rate=20", drop=False) as stream:
        touches = list(stream)
    assert repr(touches[0]).endswith("no contact>")
    deepest = max((t for t in touches if t.contact), key=lambda t: t.depth_max_mm.value)
    assert f"{deepest.depth_max_mm} deep" in repr(deepest)
    with pp.open("synthetic:press?size=160x120&rate=20", drop=False) as stream:
        pressed = next(t for t in stream if t.force_N > 0.5)
    assert f": {pressed.force_N}, {pressed.depth_max_mm} deep, {pressed.slip}>" in repr(pressed)


def test_numbers_are_near_the_truth(small):
    errors = []
    with pp.open(small, drop=False) as stream:
        for t in stream:
            if t.force_N.valid:
                errors.append(float(t.force_N) - t.truth.force_N)
            if t.force_N > 0.2:
                assert abs(t.centroid_x_px - t.truth.center_x_px) < 2
                assert len(t.contacts) == 1
                assert t.contacts[0].force_N == t.force_N
    assert len(errors) > 10
    assert np.abs(errors).max() < 0.1


def test_depth_is_read_only_float32_of_the_frame(small):
    with pp.open(small, drop=False) as stream:
        for t in stream:
            if t.force_N > 1:
                break
        depth = t.depth_mm
        assert depth.shape == (stream.height, stream.width) == (120, 160)
        assert depth.dtype == np.float32
        assert depth is t.depth_mm
        assert np.isclose(depth.max(), t.depth_max_mm.value, rtol=1e-3)
        with pytest.raises(ValueError):
            depth[0, 0] = 1
        with pytest.raises(ValueError):
            depth.flags.writeable = True


def test_what_was_read_stays_what_was_not_raises(small):
    with pp.open(small, drop=False) as stream:
        first = next(stream)
        depth, copy = first.depth_mm, first.depth_mm.copy()
        image, pixels = first.image, first.image.copy()
        unread = next(stream)
        for _ in range(20):
            next(stream)
        assert first.depth_mm is depth
    for _ in range(3):  # memory that was given back is used again
        with pp.open(small, drop=False) as other:
            for t in other:
                t.depth_mm
    assert np.array_equal(depth, copy)
    assert np.array_equal(image, pixels)
    with pytest.raises(pp.ExpiredError, match="depth_mm of frame 1") as failure:
        unread.depth_mm
    assert "keep" in failure.value.remedy
    with pytest.raises(pp.ExpiredError):
        unread.image
    assert unread.force_N.state == "no contact"  # numbers stay


def test_keep_reads_at_once(small):
    with pp.open(small, drop=False, keep=["depth_mm", "image"]) as stream:
        touches = list(stream)
    peaks = [t.depth_mm.max() for t in touches]
    assert np.argmax(peaks) in range(len(touches) // 4, 3 * len(touches) // 4)
    assert touches[0].image.shape == (120, 160)
    assert touches[0].image.dtype == np.uint8
    with pp.open(small, drop=False) as stream:
        kept = next(stream).keep("depth_mm")
        next(stream)
    assert kept.depth_mm.shape == (120, 160)
    with pytest.raises(pp.ExpiredError):
        kept.image


def test_colour_images_are_rows_columns_channels():
    with pp.open("synthetic:press?mode=gel&size=64x48", drop=False) as stream:
        image = next(stream).image
    assert image.shape == (48, 64, 3)


def test_deep_images_are_of_16_bits():
    with pp.open("synthetic:press?bits=12&size=64x48", drop=False) as stream:
        image = next(stream).image
    assert image.dtype == np.uint16
    assert image.max() > 255


def test_the_newest_frame_wins():
    with pp.open("synthetic:press?size=64x48&rate=200&repeat=0") as stream:
        assert stream.drops
        seen = []
        for t in stream:
            seen.append(t.sequence)
            if len(seen) == 6:
                break
            while stream.dropped < 10 * len(seen):  # what comes while this one is in hand
                time.sleep(0.005)
    assert seen == sorted(set(seen))
    assert seen[-1] >= 50


def test_the_last_frame_is_not_lost(frames):
    with pp.open(frames, rate_Hz=100) as stream:
        for t in stream:
            time.sleep(0.2)
    assert t.sequence == 5
    assert t.time_s == 0.05
    assert stream.dropped + stream.delivered == 6


def test_a_recording_comes_at_its_own_pace():
    with pp.open("synthetic:press?size=64x48&rate=100") as stream:
        start_s = time.monotonic()
        for t in stream:
            if t.time_s >= 0.5:
                break
        took_s = time.monotonic() - start_s
    assert took_s > 0.45


def test_images_without_times_lose_none(frames):
    with pp.open(frames) as stream:
        assert stream.rate_Hz is None
        assert not stream.drops
        assert len(list(stream)) == 6


def test_outputs_are_those_asked_for(small):
    with pp.open(small, drop=False, outputs="force") as stream:
        t = next(stream)
        with pytest.raises(pp.SensorError, match="surface"):
            t.depth_mm
    with pp.open(small, drop=False, outputs=["force", "surface", "confidence"]) as stream:
        assert next(stream).confidence.dtype == np.uint16


def test_a_stream_is_one_iterator(small):
    with pp.open(small, drop=False) as stream:
        for t in stream:
            if t.sequence == 4:
                break
        assert next(iter(stream)).sequence == 5
    assert stream.closed
    with pytest.raises(pp.ExpiredError, match="closed"):
        next(stream)


def test_closing_from_another_thread_ends_the_wait(frames):
    stream = pp.open(frames, rate_Hz=1e-4)  # hours from frame to frame
    next(stream)
    threading.Timer(0.1, stream.close).start()
    with pytest.raises(pp.ExpiredError):
        next(stream)


def test_sensor_files_go_in_and_out(tmp_path, small):
    with pp.open(small, drop=False) as stream:
        sensor = stream.sensor
        expected = [float(t.force_N) for t in stream]
    assert sensor.has_force and sensor.has_scale and sensor.reading
    sensor.save(tmp_path / "pad.json")
    for given in (tmp_path / "pad.json", str(tmp_path / "pad.json"), pp.Sensor(tmp_path / "pad.json"), sensor):
        with pp.open(small, drop=False, sensor=given) as stream:
            found = [float(t.force_N) for t in stream]
        assert np.array_equal(found, expected, equal_nan=True)


def test_what_is_streamed_can_be_recorded(small, tmp_path):
    session = tmp_path / "session"
    with pp.open(small, drop=False, record=session) as stream:
        live = [float(t.force_N) for t in stream]
        assert stream.recorded == {
            "folder": session,
            "recorded": len(live),
            "dropped": 0,
            "measured": len(live),
            "error": "",
        }
    with pp.open(session, drop=False) as stream:
        assert stream.recorded is None
        assert np.array_equal([float(t.force_N) for t in stream], live, equal_nan=True)
    with pytest.raises(pp.OutputError, match="session"):
        pp.open(small, record=session)


def spans_of(trace):
    """Names of the spans of each thread."""
    events = json.loads(trace.read_text())
    names = {e["tid"]: e["args"]["name"] for e in events if e["ph"] == "M"}
    spans = {name: [] for name in names.values()}
    for event in events:
        if event["ph"] == "X":
            spans[names[event["tid"]]].append(event["name"])
    return spans


def test_what_runs_can_be_traced(small, tmp_path):
    trace = tmp_path / "trace.json"
    with pp.open(small, drop=False, trace=trace) as stream:
        frames = sum(1 for _ in stream)
        with pytest.raises(pp.OutputError, match="trace.json', which is not finished"):
            pp.open(small, trace=tmp_path / "other.json")
    spans = spans_of(trace)
    assert set(spans) == {"capture", "engine", "stream"} and stream.warning == ""
    assert spans["engine"].count("finish") == spans["stream"].count("offer") == frames
    run = pp.measure(small, frames=5, outputs="force", trace=trace)
    assert spans_of(trace)["engine"].count("finish") == 5 and run.warnings == ()
    done = pp.record(small, tmp_path / "session", frames=5, outputs="force", trace=trace)
    assert spans_of(trace)["record"] == 5 * ["encode"] and done.warning == ""
    with pytest.raises(pp.OutputError, match="trace"):
        pp.open(small, trace=tmp_path / "none" / "trace.json")


def test_a_full_disk_ends_the_trace_alone(small, tmp_path, python):
    trace = tmp_path / "trace.json"
    done = python(f"""
import resource
import palpate as pp
with pp.open({small!r}, drop=False) as stream:
    expected = sum(1 for _ in stream)
resource.setrlimit(resource.RLIMIT_FSIZE, (4096, 4096))
with pp.open({small!r}, drop=False, trace={str(trace)!r}) as stream:
    assert sum(1 for _ in stream) == expected
print(stream.warning)
print(pp.measure({small!r}, trace={str(trace)!r}).warnings[0])
""")
    assert done.returncode == 0, done.stderr
    for line in done.stdout.splitlines():
        assert "trace.json" in line and "it ends early" in line and "freeing disk space" in line, line
    assert len(done.stdout.splitlines()) == 2 and isinstance(json.loads(trace.read_text()), list)


def after_a_loss(drop):
    """Frames, losses and error of a stream whose device is lost once."""
    layer = os.path.join(os.path.dirname(os.environ["PALPATE_PROGRAM"]), "tests", "layer")
    lost = {
        "VK_LAYER_PATH": layer,
        "VK_INSTANCE_LAYERS": "VK_LAYER_PALPATE_failing",
        "PALPATE_FAIL_CALL": "vkQueueSubmit2",
        "PALPATE_FAIL_AT": "30",
    }
    code = f"""
import palpate as pp
frames, error = [], ""
with pp.open("synthetic:press?size=64x48&rate=100", drop={drop}) as stream:
    try:
        frames = [t.sequence for t in stream]
    except pp.DeviceError as e:
        error = str(e)
    print(len(frames), frames[-1:], stream.frame_count, stream.device_losses, "device lost" in error)
with pp.open("synthetic:press?size=64x48&rate=100", drop=False) as after:
    print(len(list(after)) == after.frame_count)
"""
    run = subprocess.run([sys.executable, "-c", code], env=os.environ | lost, capture_output=True, text=True)
    assert run.returncode == 0, run.stderr
    return run.stdout.split("\n")


def test_a_live_stream_outlives_its_device():
    first, then, _ = after_a_loss(drop=True)
    frames, last, count, losses, error = first.split()
    assert int(frames) > 0
    assert last == f"[{int(count) - 1}]"
    assert (losses, error) == ("1", "False")
    assert then == "True"  # others get the new device too


def test_a_stream_of_every_frame_ends_with_its_device():
    first, then, _ = after_a_loss(drop=False)
    assert first.split()[-2:] == ["0", "True"]
    assert then == "True"


def test_a_log_is_kept_beside_what_is_recorded(tmp_path):
    folder = tmp_path / "session"
    with pp.open("synthetic:press?size=64x48&rate=60", record=folder) as stream:
        for t in stream:
            stream.log("Robot 1", x=t.sequence)
            stream.log("axis", z_mm=np.float32(0.5) * t.sequence, q_rad=np.array([1.0, 2.0]), on=True)
            if t.sequence > 20:
                break
        with pytest.raises(pp.ArgumentError, match="numbers to log"):
            stream.log("axis")
    rows = (folder / "log" / "axis.csv").read_text().splitlines()
    assert rows[0] == "time_s,z_mm,q_rad.0,q_rad.1,on"
    assert len(rows) > 10
    assert len((folder / "log" / "robot_1.csv").read_text().splitlines()) == len(rows)
    assert json.loads((folder / "log" / "axis.json").read_text())["aligned_by"] == "monotonic"
    with pytest.raises(pp.ExpiredError):
        stream.log("axis", z_mm=1)
    with pytest.raises(pp.ArgumentError, match="record=FOLDER for logs"):
        pp.open("synthetic:press", logs="robot.csv")
    with pp.open("synthetic:press?size=64x48") as unrecorded, pytest.raises(pp.ArgumentError, match="is recorded"):
        unrecorded.log("axis", z_mm=1)
    with pytest.raises(pp.InputError, match="no such file"):
        pp.open("synthetic:press?size=64x48", record=tmp_path / "other", logs=["/nowhere/robot.csv"])
