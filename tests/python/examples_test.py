"""The lines by which the module is introduced, each run on recordings made here."""

import json
import os
import re
import subprocess
from pathlib import Path

import numpy as np
import palpate as pp
import pytest


@pytest.fixture(scope="module")
def press(tmp_path_factory, program):
    """A press as a folder of images with its sensor and a gauge's table."""
    folder = tmp_path_factory.mktemp("press")
    command = [program, "simulate", "press", "--size", "160x120", "--rate", "20", "--out", folder, "--quiet"]
    subprocess.run(command, check=True, stdout=subprocess.DEVNULL)
    truth = np.genfromtxt(folder / "truth.csv", delimiter=",", names=True)
    rows = [f"{int(f)},{n:.6f}" for f, n in zip(truth["frame"], truth["true_force_N"])]
    (folder / "gauge.csv").write_text("frame,force_N\n" + "\n".join(rows) + "\n")
    return folder


def blocks_of(readme):
    """The Python code of a README, block by block."""
    text = (Path(os.environ["PALPATE_SOURCE_DIR"]) / readme).read_text()
    return re.findall(r"```python\n(.*?)```", text, re.S)


def test_the_readme_s_code_runs(press, tmp_path, monkeypatch, capsys):
    (tmp_path / "press").symlink_to(press)
    monkeypatch.chdir(tmp_path)
    blocks = blocks_of("viz/python/README.md")
    assert len(blocks) == 9
    names = {}
    for block in blocks:
        exec(compile(block, "README.md", "exec"), names)
    said = capsys.readouterr().out
    assert names["hill"].shape == (480, 640)
    assert names["both"][0].shape == names["both"][1].shape == (120, 160)
    assert "0.84 ± 0.01 N 0.8397 0.0121 valid\n9.5 ± 0.1 N (above range) False nan\n" in said
    assert (tmp_path / "pad_calibrated.json").exists()
    assert names["m"].reliable and names["s"].islands == 1
    assert "NaN at index (0, 0)" in said


def test_a_stream_of_touches(capsys):
    with pp.open("synthetic:palpation?size=160x120&rate=20", drop=False) as stream:
        for t in stream:
            if t.force_N > 1:
                hill = t.depth_mm
                break
            print(t.time_s, t.force_N, t.slip, len(t.contacts))
    lines = capsys.readouterr().out.splitlines()
    assert lines[0] == "0.0 no contact no contact 0"
    assert any(" ± " in line and line.endswith("N stick 1") for line in lines)
    assert hill.shape == (120, 160) and hill.max() > 0.1


def test_a_recording_in_columns(press):
    run = pp.measure(press / "frames", sensor=press / "sensor.json", keep=["depth_mm"], rate_Hz=20)
    assert run["depth_mm"].shape == (run.frames, 120, 160)
    assert run["depth_mm"].dtype == np.float32
    assert np.isclose(np.nanmax(run["force_N"]), 1.5, atol=0.1)
    assert np.array_equal(run["force_N_sd"], run["force_sd_N"], equal_nan=True)
    assert set(run["force_state"]) >= {"valid", "no contact"}
    assert np.array_equal(np.isfinite(run["force_N"]), run["force_state"] != "no contact")
    assert np.allclose(np.diff(run["time_s"]), 0.05)
    peak = int(np.nanargmax(run["force_N"]))
    assert np.isclose(run["depth_mm"][peak].max(), run["depth_max_mm"][peak], rtol=1e-3)
    with pytest.raises(KeyError, match="force_N"):
        run["force"]


def test_a_force_calibration(press, tmp_path):
    cal = pp.calibrate.force(press / "frames", gauge=press / "gauge.csv", sensor=press / "sensor.json", rate_Hz=20)
    assert cal.fit_for_use, cal.verdict
    assert "of full scale" in cal.verdict
    assert len(cal.samples["force_N"]) > 20
    cal.sensor.save(tmp_path / "pad_calibrated.json")
    run = pp.measure(press / "frames", sensor=tmp_path / "pad_calibrated.json", rate_Hz=20)
    truth = np.genfromtxt(press / "truth.csv", delimiter=",", names=True)["true_force_N"]
    valid = run["force_state"] == "valid"
    assert np.abs(run["force_N"] - truth)[valid].max() < 0.05


def test_heights_from_slopes():
    y, x = np.mgrid[:48, :64]
    z = np.exp(-((x - 30) ** 2 + (y - 20) ** 2) / 200)
    gy, gx = np.gradient(z)
    w = np.ones_like(gx)
    w[10:14, 40:50] = 0
    s = pp.integrate(gx, gy, weights=w)
    assert s.residual < 1e-5 and s.inconsistency < 0.01 and s.islands == 1 and s.unknown_px == 40
    assert np.abs(s.height - (z - z.mean())).max() < 0.01
    w[:, 20] = 0
    assert pp.integrate(gx, gy, weights=w).islands == 2


def bent(points):
    return points + 1.5 * np.sin(points[:, ::-1] / 30)


def test_matching_and_strain():
    rng = np.random.default_rng(3)
    rest_xy = rng.uniform(0, 100, (60, 2))
    order = rng.permutation(60)[:55]
    pressed_xy = bent(rest_xy)[order] + rng.normal(0, 0.05, (55, 2))
    m = pp.match(rest_xy, pressed_xy)
    assert m.reliable
    assert m.found.sum() >= 50 and (m.partner[~m.found] == -1).all()
    assert (order[m.partner[m.found]] == np.flatnonzero(m.found)).mean() > 0.95
    assert ((m.probability >= 0) & (m.probability <= 1)).all()
    assert np.abs(m.warped - bent(rest_xy)).max() < 1
    shift_mm = pressed_xy[m.partner[m.found]] - rest_xy[m.found]
    f = pp.ThinPlate(rest_xy[m.found]).fit(shift_mm)
    xy = np.array([[50.0, 50.0], [40.0, 60.0]])
    assert np.abs(f(xy) - (bent(xy) - xy)).max() < 0.1
    gradient = f.gradient(xy)
    assert gradient.shape == (2, 2, 2)
    assert abs(gradient[0, 0, 1] - np.cos(50 / 30) * 1.5 / 30) < 0.02
    assert np.allclose(f.strain(xy).xx, gradient[:, 0, 0] + (gradient[:, 0, 0] ** 2 + gradient[:, 1, 0] ** 2) / 2)


def test_a_young_s_modulus(tmp_path):
    force = np.array([0.001, 0.002, 0.003, 0.004])
    radius = np.cbrt(3 * force * 8 / (4 * (0.1 / 0.75 / 2)))  # Hertz, pad as hard as the sample
    rows = [f"{f},{r},0.002" for f, r in zip(force, radius)]
    (tmp_path / "presses.csv").write_text("force_N,radius_mm,radius_sd_mm\n" + "\n".join(rows) + "\n")
    E = pp.modulus(tmp_path / "presses.csv", sample="sphere,16mm", pad_kPa=100)
    assert E.state == "valid" and E.valid
    assert E.interval_kPa[0] < 100 < E.interval_kPa[1]
    assert abs(E.young_kPa - 100) < 3
    assert "kPa" in str(E)


def test_a_modulus_that_is_not_determined():
    E = pp.modulus("synthetic:press?seed=3&size=320x240&rate=10", sample="dome,16mm")
    assert E.state == "pad limited"
    assert np.isnan(E.young_kPa) and E.interval_kPa[0] > 200 and np.isinf(E.interval_kPa[1])
    assert E.reason and E.reason in str(E)


def test_a_lump():
    x = (np.arange(33) - 16) * 1.25
    r2 = x[:, None] ** 2 + x[None, :] ** 2
    rng = np.random.default_rng(1)
    a_Pa = 600 + 250 * np.exp(-r2 / 50) + rng.normal(0, 5, r2.shape)
    b_Pa = 1200 + 500 * np.exp(-r2 / 50) + rng.normal(0, 5, r2.shape)
    lump = pp.lump.estimate([a_Pa, b_Pa], force_N=[1, 2], young_Pa=4000, thickness_mm=20, pitch_mm=1.25)
    assert lump.detection >= 1
    assert lump.state in ("found", "stiffness open", "outside training", "inconsistent")
    assert lump.text
    nothing = pp.lump.estimate(
        [np.full((33, 33), 600.0) + rng.normal(0, 5, r2.shape)], force_N=[1], young_Pa=4000, pitch_mm=1.25
    )
    assert not nothing.found


def test_each_of_two_lumps():
    maps_Pa = np.load(Path(__file__).parent.parent / "data" / "lump" / "two_balls.npy")
    force_N = [0.50206, 1.003878, 1.5087, 2.011764]
    found = pp.lump.estimate(list(maps_Pa), force_N=force_N, young_Pa=4000)
    assert found.state == "several lumps" and not found.found
    assert found.size_mm is None and len(found.lumps) == 2
    for lump in found.lumps:
        assert lump.found
        assert lump.size_mm.low < 7 < lump.size_mm.high
        assert lump.depth_mm.low < 2.5 < lump.depth_mm.high
    first, second = sorted(found.lumps, key=lambda lump: lump.x_mm.value)
    assert abs(first.x_mm.value + 5.5) < 0.3 and abs(second.x_mm.value - 5.5) < 0.3


def test_a_lump_in_tissue_that_nobody_measured():
    folder = Path(__file__).parent.parent / "data" / "calculix"
    about = json.loads((folder / "deep_ellipsoid.json").read_text())
    lump = pp.lump.estimate(
        [np.loadtxt(folder / load["file"], delimiter=",") for load in about["loads"]],
        force_N=[load["force_N"] for load in about["loads"]],
        press_mm=[load["press_mm"] for load in about["loads"]],
        noise_Pa=4,
    )
    assert lump.young_Pa is not None
    assert lump.young_Pa.low < about["young_Pa"] < lump.young_Pa.high
    assert abs(lump.young_Pa.value / about["young_Pa"] - 1) < 0.02


def test_a_skin_that_is_told():
    folder = Path(__file__).parent.parent / "data" / "calculix"
    about = json.loads((folder / "deep_ellipsoid.json").read_text())
    maps = [np.loadtxt(folder / load["file"], delimiter=",") for load in about["loads"]]
    forces = [load["force_N"] for load in about["loads"]]
    bare = pp.lump.estimate(maps, force_N=forces, young_Pa=4000, noise_Pa=4)
    # One as stiff as the tissue is none; a stiff one would look like a shallower lump.
    none = pp.lump.estimate(maps, force_N=forces, young_Pa=4000, noise_Pa=4, skin_mm=(2, 0.1), skin_ratio=1)
    assert none.found and abs(none.depth_mm.value / bare.depth_mm.value - 1) < 0.02
    stiff = pp.lump.estimate(maps, force_N=forces, young_Pa=4000, noise_Pa=4, skin_mm=2, skin_ratio=4)
    assert stiff.depth_mm is None or abs(stiff.depth_mm.value / bare.depth_mm.value - 1) > 0.02


def test_a_plate_that_is_told():
    folder = Path(__file__).parent.parent / "data" / "calculix"
    about = json.loads((folder / "deep_ellipsoid.json").read_text())
    maps = [np.loadtxt(folder / load["file"], delimiter=",") for load in about["loads"]]
    forces = [load["force_N"] for load in about["loads"]]
    bare = pp.lump.estimate(maps, force_N=forces, young_Pa=4000, noise_Pa=4)
    # These slid; under a plate that sticks the same maps would be of another lump.
    slides = pp.lump.estimate(maps, force_N=forces, young_Pa=4000, noise_Pa=4, plate_friction=(0, 0.01))
    assert slides.found and abs(slides.depth_mm.value / bare.depth_mm.value - 1) < 0.02
    sticks = pp.lump.estimate(maps, force_N=forces, young_Pa=4000, noise_Pa=4, plate_sticks=True)
    assert sticks.depth_mm is None or abs(sticks.depth_mm.value / bare.depth_mm.value - 1) > 0.02


def test_a_lump_on_two_days(tmp_path):
    x = (np.arange(23) - 11) * 1.25
    r2 = x[:, None] ** 2 + x[None, :] ** 2
    for day, seed in ("may", 1), ("june", 2):
        folder = tmp_path / day
        folder.mkdir()
        rng = np.random.default_rng(seed)
        maps = [load * (600 + 250 * np.exp(-r2 / 50)) + rng.normal(0, 5, r2.shape) for load in (1, 2)]
        np.save(folder / "pressure_Pa.npy", np.array(maps, np.float32))
        about = {
            "format": "palpate pressure observation 1", "force_N": [1, 2], "pitch_mm": [1.25, 1.25], "window_mm": [0, 0],
            "place_sd_mm": 0.5, "noise_Pa": 5, "uneven_sd": 0.01, "saturated_share": 0, "block_mm": [40, 40, 20],
            "young_Pa": 4000,
        }
        (folder / "observation.json").write_text(json.dumps(about))
    (change,) = pp.lump.compare(tmp_path / "may", tmp_path / "june", pitch_error=0)
    assert change.day.endswith("june") and change.sentence == str(change)
    assert change.verdict in ("no change", "not comparable")
    if change.size_mm is not None:
        assert change.size_mm.low <= change.size_mm.value <= change.size_mm.high
    with pytest.raises(pp.ArgumentError, match="two days"):
        pp.lump.compare(tmp_path / "may")
    with pytest.raises(pp.Error, match="observation"):
        pp.lump.compare(tmp_path / "may", tmp_path / "never")


def test_light_in_a_stack():
    light = pp.optics.stack([1, 1.39, 1.40, 1.41, 1], angle_deg=np.arange(90))
    assert light.reflectance.shape == (90,)
    one = ((1.39 - 1) / (1.39 + 1)) ** 2
    assert one < light.reflectance[0] < 3 * one
    assert np.allclose(light.reflectance + light.transmittance + light.absorptance, 1)
    assert np.isclose(light.reflectance, light.s_and_p_reflectance[:2].mean(axis=0)).all()
