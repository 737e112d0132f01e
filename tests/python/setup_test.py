"""A sensor file from recordings: the program's, step by step."""

import json
import subprocess

import palpate as pp
import pytest


@pytest.fixture(scope="module")
def press(tmp_path_factory, program):
    """A simulated gel that a ball of 5 mm presses."""
    folder = tmp_path_factory.mktemp("press")
    command = [program, "simulate", "press", "--mode", "gel", "--size", "320x240", "--rate", "5", "--radius", "5"]
    subprocess.run([*command, "--out", folder, "--quiet"], check=True, stdout=subprocess.DEVNULL)
    return folder


def test_it_is_what_the_program_makes(press, tmp_path, program):
    pitch = pp.Sensor.load(press / "sensor.json").pitch_mm_per_px
    made = pp.setup(press / "frames", tmp_path / "gel.json", background=press / "background.png", pitch_mm_per_px=pitch, ball_radius_mm=5)
    options = [f"--background={press / 'background.png'}", f"--pitch={pitch!r}", "--ball-mm=5"]
    command = [program, "setup", press / "frames", *options, "--out", tmp_path / "same.json", "--json", "--quiet"]
    done = subprocess.run(command, capture_output=True, text=True)
    assert done.returncode == 0, done.stderr
    expected = json.loads(done.stdout)["steps"]
    assert list(made.steps["step"]) == [step["step"] for step in expected]
    assert list(made.steps["known"]) == [step["known"] for step in expected]
    assert list(made.steps["what"]) == [step["what"] for step in expected]
    assert made.sensor.reading == "photometric"
    assert abs(made.sensor.pitch_mm_per_px - pitch) < 1e-9
    assert made.file == str(tmp_path / "gel.json")
    assert not made.complete  # no gauge: no force
    assert "MISSING  force" in str(made) and "-> " in str(made)
    shaped = pp.setup(press / "frames", tmp_path / "shaped.json", background=press / "background.png", pitch_mm_per_px=pitch, shape="ball:radius=5")
    assert list(shaped.steps["what"]) == list(made.steps["what"])
    with pp.open(press / "frames", sensor=made.sensor, drop=False) as stream:
        assert max(t.depth_mm.max() for t in stream) > 0.2


def test_what_calibration_never_saw_is_a_map(press, tmp_path):
    pitch = pp.Sensor.load(press / "sensor.json").pitch_mm_per_px
    gel = tmp_path / "gel.json"
    pp.setup(press / "frames", gel, background=press / "background.png", pitch_mm_per_px=pitch, ball_radius_mm=5)
    sensor = json.loads(gel.read_text())
    seen = sensor["surface"]["photometric"]
    # As if all presses had been at the left edge: there nothing is left of what the touches in the middle show.
    for made in seen["presses"]:
        made[0] = -0.9
    gel.write_text(json.dumps(sensor))
    outputs = ["force", "surface", "contacts"]
    found = pp.measure(press / "frames", sensor=gel, outputs=outputs, keep=["depth_mm", "extrapolated"])
    marked = found["extrapolated"]
    assert marked.shape == found["depth_mm"].shape and marked.dtype == bool
    at = int(found["depth_max_mm"].argmax())
    assert marked[at].sum() == found["extrapolated_px"][at] > 500
    assert found["depth_mm"][at][marked[at]].min() > 0
    assert found.summary["extrapolated_frames"] > 0
    with pp.open("synthetic:press?size=64x48", drop=False) as stream, pytest.raises(pp.SensorError, match="presses of its calibration"):
        next(stream).extrapolated


def test_a_check_is_what_the_program_says(press, tmp_path, program):
    pitch = pp.Sensor.load(press / "sensor.json").pitch_mm_per_px
    own = tmp_path / "gel.json"
    rest = press / "background.png"
    pp.setup(press / "frames", own, background=rest, pitch_mm_per_px=pitch, ball_radius_mm=5)
    found = pp.check(own, press / "frames", background=rest, ball_radius_mm=5)
    command = [program, "check", own, press / "frames", "--background", rest, "--ball-radius-mm=5", "--json", "--quiet"]
    done = subprocess.run(command, capture_output=True, text=True)
    expected = json.loads(done.stdout)
    assert done.returncode == (0 if found else 3)
    assert found.sentence == expected["sentence"] and found.holds
    assert list(found.rows["state"]) == [row["state"] for row in expected["rows"]]
    assert found.again == [] and str(found).startswith("as calibrated: ")
    wrong = pp.check(own, press / "frames", background=rest, ball_radius_mm=12)
    assert not wrong and "palpate calibrate photometric" in wrong.sentence and wrong.again
    mended = tmp_path / "mended.json"
    with pytest.raises(pp.SensorError, match="calibration of force"):
        pp.check(own, press / "frames", background=rest, weight_g=500, out=mended)
    assert not mended.exists()


def test_a_kind_of_sensor_gives_the_scale(press, tmp_path):
    made = pp.setup(press / "frames", tmp_path / "like.json", like="gelsight_mini")
    assert abs(made.sensor.pitch_mm_per_px - 0.0634) < 1e-4
    assert made.sensor.reading is None


def test_corners_cut_the_pad_out(press, tmp_path):
    corners = [(10, 10), (309, 10), (309, 229), (10, 229)]
    made = pp.setup(press / "frames", tmp_path / "cut.json", corners=corners, name="cut")
    assert made.sensor.name == "cut"
    assert json.loads(made.sensor.text)["frame"]["quad_px"] == [list(map(float, corner)) for corner in corners]


def test_images_are_a_sequence_when_said(press, tmp_path):
    gauge = tmp_path / "gauge.csv"
    gauge.write_text("frame,force_N\n" + "".join(f"{i},{i / 10}\n" for i in range(len(list((press / "frames").iterdir())))))
    for sequence in (False, True):
        made = pp.setup(press / "frames", tmp_path / "gauged.json", gauge=gauge, sequence=sequence)
        (again,) = (a for s, a in zip(made.steps["step"], made.steps["again"]) if s == "force")
        assert ("--sequence" in again) == sequence


def test_what_cannot_be_is_refused(press, tmp_path):
    out = tmp_path / "none.json"
    with pytest.raises(pp.ArgumentError, match="ball_radius_mm above 0"):
        pp.setup(press / "frames", out, ball_radius_mm=-1)
    with pytest.raises(pp.ArgumentError, match="four corners"):
        pp.setup(press / "frames", out, corners=[(1, 2), (3, 4)])
    with pytest.raises(pp.ArgumentError, match="columns, rows"):
        pp.setup(press / "frames", out, grid=9)
    with pytest.raises(pp.Error, match="nowhere"):
        pp.setup(tmp_path / "nowhere", out)
    assert not out.exists()


def test_a_sensor_file_is_loaded(press):
    sensor = pp.Sensor.load(press / "sensor.json")
    assert sensor.text == pp.Sensor(press / "sensor.json").text
    assert repr(sensor) == repr(pp.Sensor(str(press / "sensor.json")))
    with pytest.raises(pp.SensorError):
        pp.Sensor.load(press / "frames")
