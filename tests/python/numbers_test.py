"""The module's numbers are the program's, to the last digit."""

import csv
import importlib
import json
import subprocess

import numpy as np
import palpate as pp
import pytest

SCENES = {
    "waveguide": "synthetic:press?size=160x120&rate=5",
    "gel": "synthetic:slide?mode=gel&size=160x120&rate=5",
    "skin": "synthetic:drag?skin=texture&size=320x240&rate=2",
    "two contacts": "synthetic:fingers?size=160x120&rate=5",
}
LAYERED = "synthetic:twist?mode=gel&skin=markers&size=320x240&rate=1"


def columns_of(file):
    with open(file, newline="", encoding="utf-8") as text:
        rows = list(csv.DictReader(text))
    return {name: [row[name] for row in rows] for name in rows[0]} if rows else {}


def assert_same(found, cells):
    for value, cell in zip(found, cells, strict=True):
        if cell == "":
            assert value == "" or np.isnan(value)
        elif isinstance(value, str):
            assert value == cell
        else:
            assert float(value) == float(cell)


@pytest.fixture(params=SCENES.values(), ids=SCENES.keys(), scope="module")
def both(request, tmp_path_factory, program):
    """One scene measured by the module and by the program."""
    out = tmp_path_factory.mktemp("out")
    command = [program, "process", request.param, "--out", out, "--all-digits", "--depth", "npy", "--quiet"]
    subprocess.run(command, check=True, stdout=subprocess.DEVNULL)
    return pp.measure(request.param, keep=["depth_mm"]), out


def test_measurements(both):
    run, out = both
    table = columns_of(out / "measurements.csv")
    assert run.columns == tuple(table)
    for name, cells in table.items():
        assert_same(run[name], cells)
    assert sum(cell != "" for cells in table.values() for cell in cells) > 1000


def test_contacts(both):
    run, out = both
    table = columns_of(out / "contacts.csv")
    assert len(run.contacts["id"]) == len(table["id"]) > 0
    for name, cells in table.items():
        if name in run.contacts:
            assert_same(run.contacts[name], cells)
        else:
            assert not any(cells)


def test_summary_and_depth(both):
    run, out = both
    summary = json.loads((out / "summary.json").read_text())
    for changing in ("seconds", "frames_per_s", "depth_clipped_px"):
        summary.pop(changing, None), run.summary.pop(changing, None)
    assert run.summary == summary
    files = sorted((out / "depth").glob("*.npy"))
    assert len(files) == run.frames
    for frame in (0, run.frames // 2, run.frames - 1):
        assert np.array_equal(run["depth_mm"][frame], np.load(files[frame]))


def attribute_of(touch, name):
    for part in name.split("."):
        touch = getattr(touch, part)
    return touch


def is_empty(cell):
    return cell == "" or (isinstance(cell, float) and np.isnan(cell))


@pytest.mark.parametrize(
    "scene, outputs",
    [(SCENES["waveguide"], None), (SCENES["skin"], None), (LAYERED, ["force", "surface", "contacts", "skin", "traction", "confidence", "gradient"])],
)
def test_a_stream_gives_the_same_numbers(scene, outputs):
    """Each quantity of the list: Python's attribute, the row of JSON, and the column have one value."""
    _palpate = importlib.import_module("palpate._palpate")
    run = pp.measure(scene, outputs=outputs)
    compared = set()
    with pp.open(scene, outputs=outputs, drop=False, solver="best") as stream:
        for i, t in enumerate(stream):
            for column, error, state, attribute, older in _palpate.quantities():
                if not attribute:
                    continue
                value = attribute_of(t, attribute)
                if older:
                    assert repr(attribute_of(t, older)) == repr(value)
                cells = {column: value}
                if isinstance(value, pp.Estimate):
                    cells = {column: value.value, error: value.sd, state: value.state}
                for name, number in cells.items():
                    if name in run and not is_empty(run[name][i]):
                        assert number == run[name][i], name
                        compared.add(name)
    assert len(compared) > 20
    assert {"gray_sum", "depth_max_mm", "depth_state", "slip"} <= compared


def test_columns_answer_to_the_names_of_attributes():
    run = pp.measure(SCENES["skin"], frames=3)
    assert run["stick_fraction"] is run["stick_share"] and "stick_fraction" in run
    assert run["sequence"] is run["frame"]
    assert "wrench.fx_N" not in run


def test_files_are_written_where_asked(tmp_path):
    run = pp.measure(SCENES["waveguide"], out=tmp_path / "out", frames=5)
    assert run.frames == 5
    assert len(columns_of(tmp_path / "out" / "measurements.csv")["frame"]) == 5
    assert json.loads((tmp_path / "out" / "summary.json").read_text())["frames"] == 5


def test_force_calibration(tmp_path, program):
    scene = "synthetic:press?size=160x120&rate=20"
    out = tmp_path / "pad.json"
    command = [program, "calibrate", "force", scene, "--gauge", "truth", "--out", out, "--json"]
    done = subprocess.run(command, capture_output=True, text=True)
    cal = pp.calibrate.force(scene, gauge="truth")
    expected = json.loads(done.stdout)
    assert {k: v for k, v in cal.report.items() if k != "sensor"} == {k: v for k, v in expected.items() if k != "sensor"}
    found, wanted = json.loads(cal.sensor.text), json.loads(out.read_text())
    for sensor in (found, wanted):
        sensor["force"]["origin"].pop("made")
    assert found == wanted


def test_integration(tmp_path, program):
    rng = np.random.default_rng(2)
    slopes = rng.normal(0, 1, (40, 50, 2)).astype(np.float32)
    weights = rng.uniform(0, 1, (40, 50)).astype(np.float32)
    np.save(tmp_path / "slopes.npy", slopes)
    np.save(tmp_path / "weights.npy", weights)
    for more, options in (([], {}), (["--weights", tmp_path / "weights.npy"], {"weights": weights})):
        command = [program, "integrate", tmp_path / "slopes.npy", "--out", tmp_path, "--json", "--quiet", *more]
        report = json.loads(subprocess.run(command, check=True, capture_output=True).stdout)
        s = pp.integrate(slopes[..., 0], slopes[..., 1], **options)
        assert np.array_equal(s.height, np.load(tmp_path / "height.npy"))
        assert s.residual == report["residual"] and s.inconsistency == report["inconsistency"]


def test_strided_and_wide_arrays_are_the_same():
    rng = np.random.default_rng(2)
    slopes = rng.normal(0, 1, (40, 50, 2)).astype(np.float32)
    plain = pp.integrate(slopes[..., 0].copy(), slopes[..., 1].copy())
    wide = np.zeros((80, 100, 2))
    wide[::2, ::2] = slopes
    for gx, gy in (
        (slopes[..., 0], slopes[..., 1]),
        (wide[::2, ::2, 0], wide[::2, ::2, 1]),
        (np.asfortranarray(slopes[..., 0]), slopes[..., 1].tolist()),
    ):
        assert np.array_equal(pp.integrate(gx, gy).height, plain.height)
