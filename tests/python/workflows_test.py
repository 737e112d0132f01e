"""Sessions, simulated scenes, wrench, strain, mechanics: what the program does on recordings, from Python."""

import json
import struct
import subprocess
import zlib

import numpy as np
import palpate as pp
import pytest

SLIDE = "synthetic:slide?size=160x120&rate=20"


def report_of(program, *command):
    done = subprocess.run([program, *command, "--json", "--quiet"], capture_output=True, text=True)
    assert done.stdout, done.stderr
    return json.loads(done.stdout)


def test_devices_are_those_of_the_program(program):
    found = pp.devices()
    expected = report_of(program, "devices")["devices"]
    assert [d.name for d in found] == [d["name"] for d in expected]
    assert [d.usable for d in found] == [d["usable"] for d in expected]
    usable = next(d for d in found if d.usable)
    with pp.open("synthetic:press?size=64x48", device=str(usable.index)) as stream:
        assert stream.device == usable.name


def test_cameras_are_those_of_the_machine():
    for camera in pp.cameras():
        assert camera.source.startswith("camera:/dev/video")


def test_a_scene_with_its_truth():
    scene = pp.simulate(SLIDE, frames=30, depth=True)
    assert scene.images.shape == (30, 120, 160) and scene.images.dtype == np.uint8
    assert scene.background.shape == (120, 160)
    assert scene.depth_mm.shape == (30, 120, 160) and scene.depth_mm.dtype == np.float32
    assert scene.truth["force_N"].shape == (30,)
    assert np.array_equal(scene.truth["stick_share"], scene.truth["stick_fraction"])
    assert np.allclose(scene.depth_mm.max(axis=(1, 2)), scene.truth["depth_max_mm"], atol=0.02)
    with pp.open(SLIDE, drop=False) as stream:
        for i, t in zip(range(30), stream):
            assert np.array_equal(t.image, scene.images[i])
            assert t.truth.force_N == scene.truth["force_N"][i]
    assert pp.simulate("press?mode=gel&size=64x48", frames=1).images.shape == (1, 48, 64, 3)
    assert pp.simulate("press?bits=12&size=64x48", frames=1).images.dtype == np.uint16
    with pytest.raises(pp.InputError, match="nonsense"):
        pp.simulate("press?nonsense=1")


def test_a_session_is_measured_to_the_same_digits(tmp_path, program):
    written = pp.record(SLIDE, tmp_path / "session", frames=40, solver="best")
    assert (written.recorded, written.dropped, written.measured) == (40, 0, 40)
    run, direct = pp.measure(tmp_path / "session"), pp.measure(SLIDE, frames=40)
    for name in run.columns:
        if not name.startswith(("true", "depth_rms")):
            assert np.array_equal(run[name], direct[name], equal_nan=run[name].dtype == float), name
    report = report_of(program, "process", tmp_path / "session", "--as-recorded", "--out", tmp_path / "out")
    assert report["as_recorded"]["equal"] == 40 and report["as_recorded"]["different"] == 0
    with pp.open(tmp_path / "session", drop=False) as stream:
        assert [t.sequence for t in stream] == list(range(40))
    with pytest.raises(pp.OutputError):
        pp.record(SLIDE, tmp_path / "session")


def test_a_shear_calibration(tmp_path, program):
    scenes = ["synthetic:pull?size=160x120&rate=20", SLIDE]
    cal = pp.calibrate.shear(scenes, gauge="truth")
    report = report_of(program, "calibrate", "shear", *scenes, "--gauge", "truth", "--out", tmp_path / "pad.json")
    assert {**cal.report, "sensor": ""} == {**report, "sensor": ""}
    assert cal.sensor.has_shear


@pytest.fixture(scope="module")
def layered(tmp_path_factory):
    """The built-in sensor with an elastic layer stated."""
    scene = pp.simulate("press?size=160x120&rate=10", frames=1)
    text = json.loads(scene.sensor.text)
    text["layer"] = {"young_MPa": 0.2, "poisson": 0.485, "thickness_mm": 6}
    file = tmp_path_factory.mktemp("layer") / "pad.json"
    pp.Sensor.from_text(json.dumps(text)).save(file)
    return file


def write_png(path, image):
    """An image of 8 bits and three colours."""
    height, width, _ = image.shape

    def chunk(kind, data):
        return struct.pack(">I", len(data)) + kind + data + struct.pack(">I", zlib.crc32(kind + data))

    rows = np.concatenate([np.zeros((height, 1), np.uint8), image.reshape(height, -1)], axis=1)
    header = struct.pack(">IIBBBBB", width, height, 8, 2, 0, 0, 0)
    path.write_bytes(
        b"\x89PNG\r\n\x1a\n" + chunk(b"IHDR", header) + chunk(b"IDAT", zlib.compress(rows.tobytes())) + chunk(b"IEND", b"")
    )


def test_wide_presses_have_the_light_of_their_series(tmp_path):
    """Pictures under a fifth more exposure: a wide press hides its own light, which the others show."""
    name = "synthetic:press?mode=gel&size=320x240&rate=2&radius=12&force=20"
    scene = pp.simulate(name)
    wide = int(np.argmin(np.abs(scene.truth["force_N"] - 13.3)))
    write_png(tmp_path / "rest.png", scene.background)
    for folder in ("series", "alone"):
        (tmp_path / folder).mkdir()
    for i, image in enumerate(scene.images):
        lit = np.clip(1.2 * image + 0.5, 0, 255).astype(np.uint8)
        write_png(tmp_path / "series" / f"{i:03}.png", lit)
        if i == wide:
            write_png(tmp_path / "alone" / f"{i:03}.png", lit)
    with pp.open(name) as stream:
        stream.sensor.save(tmp_path / "gel.json")
    options = {"sensor": tmp_path / "gel.json", "background": tmp_path / "rest.png"}
    series, alone = (pp.measure(tmp_path / folder, **options) for folder in ("series", "alone"))
    assert series["light_state"][wide] == "changed" and alone["light_state"][0] == "unknown"
    assert abs(series["wrench.fz_N"][wide] / scene.truth["force_N"][wide] - 0.95) < 0.06
    assert abs(alone["wrench.fz_N"][0] / scene.truth["force_N"][wide] - 1) > 0.15
    with pp.open(tmp_path / "series", drop=False, **options) as stream:
        assert [t.light_state for t in stream][wide] == "changed"


def test_wrench(layered, tmp_path, program):
    scene = "synthetic:press?size=160x120&rate=10"
    found = pp.wrench(scene, sensor=layered, gauge="truth")
    assert found.pressure_kPa.max() > 1 and found.pressure_kPa.dtype == np.float32
    force = found.pressure_kPa.sum() * found.cell_mm**2 * 1e-3  # kPa mm^2 are mN
    row = {name: column[found.peak] for name, column in found.columns.items()}
    peak = next(v for k, v in row.items() if k.endswith("fz_N"))
    assert np.isclose(force, peak, rtol=0.02)
    assert found.check["readings"] > 5
    command = ["wrench", scene, "--sensor", layered, "--gauge", "truth", "--out", tmp_path / "out"]
    report_of(program, *command)
    table = (tmp_path / "out" / "wrench.csv").read_text().splitlines()
    assert list(found.columns) == table[0].split(",")
    assert len(found.columns["frame"]) == len(table) - 1


def test_a_touch_has_its_wrench(layered):
    with pp.open("synthetic:press?size=160x120&rate=10", sensor=layered, drop=False) as stream:
        for t in stream:
            if t.force_N > 1:
                break
        wrench, pressure = t.wrench, t.pressure_kPa
    assert wrench.fz_N.unit == "N" and wrench.fz_N.value > 0.3
    assert wrench.mx_Nmm.unit == "N mm"
    assert np.isclose(pressure.max(), wrench.pressure_max_kPa, rtol=1e-4)
    assert t.shear_kPa is None and wrench.fx_N.state == "not calibrated"
    assert "fz" in repr(wrench)
    run = pp.measure("synthetic:press?size=160x120&rate=10", sensor=layered, keep="pressure_kPa")
    assert len(run["pressure_kPa"]) == run.frames
    assert np.isclose(np.nanmax(run["pressure_max_kPa"]), run["pressure_kPa"].max(), rtol=1e-4)


def test_strain_between_frames(program):
    scene = "synthetic:drag?skin=texture&size=320x240&rate=5"
    found = pp.strain(scene, frames=(6, 10))
    report = report_of(program, "strain", scene, "--frames", "6,10")
    assert found.frames == (6, 10)
    assert found.reason == (report["reason"] or "")
    assert found.by_skin and len(found.pairs) == report["pairs"]
    if not found.reason:
        assert found.plane["xx"] == report["strain"]["xx"] and found.plane_sd["xx"] == report["strain_sd"]["xx"]
        assert found.axial == report["axial"] and "axial strain" in str(found)


def test_the_skin_is_followed_where_pictures_are_one_sequence(program, tmp_path):
    scene = ["drag", "--skin", "texture", "--size", "320x240", "--rate", "5", "--frames", "11"]
    subprocess.run([program, "simulate", *scene, "--out", tmp_path], check=True, capture_output=True)
    known = {"sensor": tmp_path / "sensor.json", "background": tmp_path / "background.png", "frames": (6, 10)}
    assert not pp.strain(tmp_path / "frames", **known).by_skin
    assert pp.strain(tmp_path / "frames", sequence=True, **known).by_skin


def test_contact_is_hertz_on_a_deep_pad():
    found = pp.contact(force_N=0.01, young_kPa=100, radius_mm=5, shape="paraboloid")
    assert np.isclose(found.radius_mm, np.cbrt(3 * 0.01 * 5 / (4 * 0.1 / 0.75)), rtol=1e-6)
    assert np.isclose(found.depth_mm, found.radius_mm**2 / 5, rtol=1e-6)
    thin = pp.contact(force_N=0.01, young_kPa=100, radius_mm=5, thickness_mm=1)
    assert thin.depth_mm < found.depth_mm and abs(thin.hertz_error) > 0.1
    back = pp.contact(depth_mm=thin.depth_mm, young_kPa=100, radius_mm=5, thickness_mm=1)
    assert np.isclose(back.force_N, 0.01)
    # Hertz's pressure is an ellipse whose integral is the force.
    assert np.allclose(found.pressure_kPa[:100], found.pressure_max_kPa * np.sqrt(1 - (found.r_mm[:100] / found.radius_mm) ** 2), rtol=1e-3)
    assert np.isclose(np.trapz(2 * np.pi * found.r_mm * found.pressure_kPa, found.r_mm) / 1000, 0.01, rtol=5e-3)
    with pytest.raises(pp.ArgumentError, match="force_N or depth_mm"):
        pp.contact(young_kPa=100)


def test_contact_of_layers_and_of_soft_and_round_bodies_is_the_programs(program):
    words = ("--radius-mm", "5", "--radius2-mm", "20", "--force-N", "0.02", "--young-kPa", "140,80,34", "--thickness-mm", "2,2,3")
    told = report_of(program, "contact", *words, "--indenter-young-MPa", "2")
    found = pp.contact(
        force_N=0.02, radius_mm=5, radius2_mm=20, young_kPa=[140, 80, 34], thickness_mm=(2, 2, 3), indenter_young_MPa=2
    )
    assert found.young_kPa == pytest.approx(1e3 * told["young_MPa"], rel=1e-12)
    assert found.young_kPa == pytest.approx(7 / (2 / 140 + 2 / 80 + 3 / 34), rel=1e-9)
    assert found.depth_mm == told["exact"]["depth_mm"] and found.radius_mm == told["exact"]["contact_radius_mm"]
    assert pp.contact(force_N=0.02, radius_mm=5, young_kPa=[60, 60], series="paper").young_kPa == pytest.approx(30)
    with pytest.raises(pp.ArgumentError, match="one thickness_mm for each of young_kPa"):
        pp.contact(force_N=0.02, young_kPa=[140, 80], thickness_mm=2)


def test_a_lump_shows_on_the_surface():
    cells = (16, 16, 8)
    plain, lump = pp.forward(lump=None, cells=cells), pp.forward(lump="sphere", depth_mm=3, cells=cells)
    assert plain.converged and lump.converged
    assert lump.stress_Pa.shape == (17, 17) and lump.stress_Pa.dtype == np.float32
    assert lump.center_stress_Pa > 1.1 * plain.center_stress_Pa
    assert lump.force_N > plain.force_N
    assert lump.press_mm == 1
    by_force = pp.forward(lump="sphere", depth_mm=3, cells=cells, force_N=lump.force_N)
    assert np.isclose(by_force.press_mm, 1, rtol=1e-3)
    with pytest.raises(pp.ArgumentError, match="depth"):
        pp.forward(depth_mm=30)
