"""Calibrations that write a sensor file: the program's, to the same report."""

import json
import subprocess

import numpy as np
import palpate as pp
import pytest


def write_pgm(file, image):
    file.write_bytes(b"P5\n%d %d\n255\n" % image.shape[::-1] + np.ascontiguousarray(image, np.uint8).tobytes())


def report_of(program, *command):
    done = subprocess.run([program, "calibrate", *command, "--json", "--quiet"], capture_output=True, text=True)
    assert done.stdout, done.stderr
    return json.loads(done.stdout)


def same(found, expected):
    """Reports but for the names of files."""
    return {k: v for k, v in found.items() if k not in ("sensor", "image", "background", "lights_file")} == {
        k: v for k, v in expected.items() if k not in ("sensor", "image", "background", "lights_file")
    }


@pytest.fixture(scope="module")
def gel(tmp_path_factory, program):
    """A simulated gel that a ball presses, with its sensor file."""
    folder = tmp_path_factory.mktemp("gel")
    command = [program, "simulate", "press", "--mode", "gel", "--size", "320x240", "--rate", "5", "--radius", "5"]
    subprocess.run([*command, "--out", folder, "--quiet"], check=True, stdout=subprocess.DEVNULL)
    return folder


def test_background(gel, tmp_path, program):
    cal = pp.calibrate.background(gel / "frames", out=tmp_path / "gel.json")
    assert same(cal.report, report_of(program, "background", gel / "frames", "--out", tmp_path / "other.json"))
    assert cal.report["frames_used"] > 2
    assert (tmp_path / "gel_background.png").exists()
    assert cal.sensor.name == "gel"
    assert cal.verdict.startswith("nothing touches in")


def test_photometric(gel, tmp_path, program):
    options = {"sensor": gel / "sensor.json", "background": gel / "background.png", "ball_mm": 5}
    cal = pp.calibrate.photometric(gel / "frames", out=tmp_path / "gel.json", **options)
    command = [f"--sensor={gel / 'sensor.json'}", f"--background={gel / 'background.png'}", "--ball-mm=5"]
    assert same(cal.report, report_of(program, "photometric", gel / "frames", *command, "--out", tmp_path / "b.json"))
    assert cal.sensor.reading == "photometric"
    assert cal.report["depth_rmse_held_out_mm"] < 0.2
    assert cal.verdict.startswith("depth to ")
    assert cal.fit_for_use
    with pp.open(gel / "frames", sensor=cal.sensor, drop=False, rate_Hz=5) as stream:
        assert max(t.depth_mm.max() for t in stream) > 0.2


def test_photometric_without_a_file(gel, tmp_path):
    options = {"sensor": gel / "sensor.json", "background": gel / "background.png"}
    written = pp.calibrate.photometric(gel / "frames", out=tmp_path / "gel.json", ball_radius_mm=5, **options)
    cal = pp.calibrate.photometric(gel / "frames", ball_diameter_mm=10, **options)
    assert cal.report["depth_rmse_held_out_mm"] == written.report["depth_rmse_held_out_mm"]
    assert cal.sensor.reading == "photometric"
    with pp.open(gel / "frames", sensor=cal.sensor, drop=False, rate_Hz=5) as stream:
        assert max(t.depth_mm.max() for t in stream) > 0.2
    cal.sensor.save(tmp_path / "kept.json")
    assert pp.Sensor(tmp_path / "kept.json").reading == "photometric"
    named = pp.calibrate.photometric(gel / "frames", shape="ball:diameter=10", **options)
    assert named.report["presses"] == cal.report["presses"]
    twice = pp.calibrate.photometric(gel / "frames", shape="ball:radius=5", other_shapes={gel / "frames": "ball:radius=5"}, **options)
    assert len(twice.report["presses"]) == 2 * len(cal.report["presses"])
    with pytest.raises(pp.ArgumentError, match="by name"):
        pp.calibrate.photometric(gel / "frames", shape="cylinder:5", **options)
    with pytest.raises(pp.ArgumentError, match="once"):
        pp.calibrate.photometric(gel / "frames", ball_radius_mm=5, ball_diameter_mm=10, **options)


def test_flat(gel, tmp_path, program):
    still = "synthetic:still?mode=gel&size=160x120&rate=5"
    with pp.open(still) as stream:
        stream.sensor.save(tmp_path / "still.json")
    cal = pp.calibrate.flat(still, sensor=tmp_path / "still.json", out=tmp_path / "flat.json", frames=4)
    command = ["flat", still, "--sensor", tmp_path / "still.json", "--frames", "4", "--out", tmp_path / "b.json"]
    assert same(cal.report, report_of(program, *command))
    assert 0 < cal.report["unevenness_after"] < 0.01
    assert cal.report["frames"] == 4
    assert (tmp_path / "flat_flat.png").exists()


def test_lookup(tmp_path, program):
    y, x = np.mgrid[:240, :320]
    depth = np.sqrt(np.maximum(0, 16 - ((x - 160) ** 2 + (y - 120) ** 2) * 0.05**2)) - 3.5
    rest = np.full((240, 320), 180.0)
    write_pgm(tmp_path / "rest.pgm", rest)
    write_pgm(tmp_path / "press.pgm", rest - 120 * np.clip(depth, 0, None) ** 0.8)
    options = {"background": tmp_path / "rest.pgm", "ball_mm": 4, "pitch_mm_per_px": 0.05}
    cal = pp.calibrate.lookup(tmp_path / "press.pgm", out=tmp_path / "gray.json", **options)
    command = [f"--background={tmp_path / 'rest.pgm'}", "--ball-mm=4", "--pitch=0.05"]
    assert same(cal.report, report_of(program, "lookup", tmp_path / "press.pgm", *command, "--out", tmp_path / "b.json"))
    assert abs(cal.report["depth_max_mm"] - 0.5) < 0.05
    assert cal.sensor.reading == "lookup"


def test_scale(tmp_path, program):
    y, x = np.mgrid[:300, :400]
    white = (((x - 20) // 36 + (y - 20) // 36) % 2).astype(bool) & (x >= 20) & (y >= 20) & (x < 380) & (y < 272)
    write_pgm(tmp_path / "board.pgm", np.where(white | (x < 20) | (y < 20) | (x >= 380) | (y >= 272), 230, 40))
    cal = pp.calibrate.scale(tmp_path / "board.pgm", grid=(9, 6), spacing_mm=1.8, out=tmp_path / "pad.json")
    command = ["scale", tmp_path / "board.pgm", "--grid=9x6", "--spacing-mm=1.8", "--out", tmp_path / "b.json"]
    assert same(cal.report, report_of(program, *command))
    assert np.isclose(cal.sensor.pitch_mm_per_px, 0.05, rtol=0.01)
    with pytest.raises(pp.ArgumentError, match="spacing_mm"):
        pp.calibrate.scale(tmp_path / "board.pgm", grid=(9, 6), out=tmp_path / "pad.json")
    with pytest.raises(pp.ArgumentError, match="chessboard or dots"):
        pp.calibrate.scale(tmp_path / "board.pgm", grid=(9, 6), pattern="rings", out=tmp_path / "pad.json")


def test_lights(tmp_path, program):
    y, x = np.mgrid[:96, :128]
    z = sum(np.exp(-((x - a) ** 2 + (y - b) ** 2) / 150) for a, b in ((30, 20), (90, 30), (60, 70), (20, 80), (110, 75)))
    gy, gx = np.gradient(z)
    normal = np.stack([-gx, -gy, np.ones_like(z)]) / np.sqrt(1 + gx**2 + gy**2)
    names = []
    for i, angle in enumerate(np.arange(4) * np.pi / 2):
        light = np.array([np.cos(angle), np.sin(angle), 1.5])
        names.append(tmp_path / f"image{i}.pgm")
        write_pgm(names[-1], 200 * np.tensordot(light / np.linalg.norm(light), normal, 1))
    np.save(tmp_path / "height.npy", z.astype(np.float32))
    options = {"height": tmp_path / "height.npy", "pitch_mm_per_px": 1.0}
    found = pp.calibrate.lights(names, out=tmp_path / "lights.json", **options)
    command = ["lights", *names, f"--height={tmp_path / 'height.npy'}", "--pitch=1", "--out", tmp_path / "b.json"]
    assert same(found.report, report_of(program, *command))
    assert found.report["lights"] == 4 and found.report["explained_x"] > 0.9
    assert (tmp_path / "lights.json").exists()
