"""Errors say what was wanted, what was found, what to try."""

import pickle

import numpy as np
import palpate as pp
import pytest
from palpate import _program

GOOD = np.zeros((8, 9), np.float32)
POINTS = np.random.default_rng(1).uniform(0, 10, (12, 2))
PRESS = "synthetic:press?size=64x48"
BAD = {
    "shape": (lambda: pp.integrate(np.zeros(5), np.zeros(5)), pp.ArgumentError, r"rows x columns.*shape \(5,\)"),
    "shapes": (lambda: pp.integrate(GOOD, GOOD.T), pp.ArgumentError, r"\(8, 9\) and \(9, 8\)"),
    "empty": (lambda: pp.integrate(GOOD[:0], GOOD[:0]), pp.ArgumentError, r"sides of 1"),
    "complex": (lambda: pp.integrate(GOOD * 1j, GOOD), pp.ArgumentError, r"dtype complex"),
    "texts": (lambda: pp.integrate([["a"]], [["b"]]), pp.ArgumentError, r"dtype <U1"),
    "objects": (lambda: pp.integrate(object(), GOOD), pp.ArgumentError, r"gx"),
    "NaN": (lambda: pp.integrate(np.where(GOOD == 0, np.nan, 0), GOOD), pp.ArgumentError, r"NaN.*\(0, 0\)"),
    "weights' shape": (lambda: pp.integrate(GOOD, GOOD, weights=GOOD[1:]), pp.ArgumentError, r"weights of the shape"),
    "negative weights": (lambda: pp.integrate(GOOD, GOOD, weights=GOOD - 1), pp.ArgumentError, r"at least 0"),
    "NaN weights": (lambda: pp.integrate(GOOD, GOOD, weights=GOOD * np.nan), pp.ArgumentError, r"NaN at index \(0, 0\)"),
    "solver": (lambda: pp.integrate(GOOD, GOOD, solver="bets"), pp.ArgumentError, r"did you mean 'best'"),
    "points' axes": (lambda: pp.match(np.zeros((5, 4)), POINTS), pp.ArgumentError, r"points x 2 or points x 3"),
    "NaN point": (lambda: pp.match(POINTS * np.inf, POINTS), pp.ArgumentError, r"infinity at index \(0, 0\)"),
    "few points": (lambda: pp.match(POINTS[:2], POINTS), pp.InputError, r"points"),
    "plate's values": (lambda: pp.ThinPlate(POINTS).fit(np.zeros(5)), pp.ArgumentError, r"values of 12 points"),
    "plate's lam": (lambda: pp.ThinPlate(POINTS).fit(np.zeros(12), lam=-1), pp.ArgumentError, r"lam of at least 0"),
    "plate's kernel": (lambda: pp.ThinPlate(POINTS, kernel="tps"), pp.ArgumentError, r"log, linear or cubic"),
    "place's axes": (lambda: pp.ThinPlate(POINTS).fit(np.zeros(12))([[1, 2, 3]]), pp.ArgumentError, r"points x 2"),
    "strain of one field": (lambda: pp.ThinPlate(POINTS).fit(np.zeros(12)).strain(POINTS), pp.ArgumentError, r"two shifts"),
    "no recording": (lambda: pp.open("nowhere.avi"), pp.InputError, r"nothing at 'nowhere.avi'"),
    "no scene": (lambda: pp.measure("synthetic:dance"), pp.InputError, r"'dance'; try one of"),
    "no camera": (lambda: pp.open("camera:/dev/nowhere"), pp.Error, r"/dev/nowhere"),
    "no sensor": (lambda: pp.open(PRESS, sensor="nowhere.json"), pp.SensorError, r"nowhere.json"),
    "bad sensor": (lambda: pp.Sensor.from_text("{}"), pp.SensorError, r"the text"),
    "output": (lambda: pp.open(PRESS, outputs=["forces"]), pp.ArgumentError, r"did you mean 'force'"),
    "map": (lambda: pp.open(PRESS, keep="depth"), pp.ArgumentError, r"maps to keep"),
    "device": (lambda: pp.open(PRESS, device="Quantum"), pp.DeviceError, r"Quantum"),
    "sample": (lambda: pp.modulus(PRESS, sample="cube"), pp.ArgumentError, r"SHAPE,SIZE"),
    "table": (lambda: pp.modulus(PRESS, sample="cube,10mm", table="wet"), pp.ArgumentError, r"sliding or bonded"),
    "pad": (lambda: pp.modulus("nowhere.csv", sample="cube,10mm"), pp.Error, r"nowhere.csv"),
    "gauge": (lambda: pp.calibrate.force(PRESS, gauge="nowhere.csv"), pp.InputError, r"nowhere.csv"),
    "gauges": (lambda: pp.calibrate.force([PRESS, PRESS], gauge=["a.csv"]), pp.ArgumentError, r"2 recordings and 1"),
    "objects": (
        lambda: pp.calibrate.force([PRESS, PRESS], gauge="truth", objects=["ball"]),
        pp.ArgumentError,
        r"2 recordings and 1 objects",
    ),
    "folder": (lambda: pp.measure(PRESS, out="/proc/nowhere"), pp.OutputError, r"/proc/nowhere"),
    "index": (lambda: pp.optics.stack([1, 0.3, 1]), pp.InputError, r"0.3"),
    "indices": (lambda: pp.optics.stack([1]), pp.ArgumentError, r"two indices"),
    "angle": (lambda: pp.optics.stack([1, 1.4, 1], angle_deg=91), pp.InputError, r"angle"),
    "forces": (lambda: pp.lump.estimate([GOOD], force_N=[1, 2], young_Pa=4000), pp.ArgumentError, r"a force for each of 1"),
    "source": (lambda: pp.open(None), pp.ArgumentError, r"source as a path; found None"),
    "sensor's type": (lambda: pp.open(PRESS, sensor=5), pp.ArgumentError, r"sensor as a path; found 5"),
    "frames": (lambda: pp.measure(PRESS, frames=0), pp.ArgumentError, r"frames of at least 1.*found 0"),
    "frames below 0": (lambda: pp.simulate(PRESS, frames=-1), pp.ArgumentError, r"frames of at least 1.*found -1"),
    "rate": (lambda: pp.measure(PRESS, rate_Hz=-3), pp.ArgumentError, r"rate_Hz above 0.*found -3"),
    "rate NaN": (lambda: pp.open(PRESS, rate_Hz=float("nan")), pp.ArgumentError, r"rate_Hz above 0.*found nan"),
    "texts for numbers": (lambda: pp.measure(PRESS, frames="9"), pp.ArgumentError, r"frames of at least 1.*found '9'"),
    "a text for a rate": (lambda: pp.measure(PRESS, rate_Hz="9"), pp.ArgumentError, r"rate_Hz above 0.*found '9'"),
    "a text for a seed": (lambda: pp.open(PRESS, seed="9"), pp.ArgumentError, r"seed of at least 0.*found '9'"),
    "patience": (lambda: pp.open(PRESS, patience_s=-1), pp.ArgumentError, r"patience_s of at least 0; found -1"),
    "seed": (lambda: pp.open(PRESS, seed=-1), pp.ArgumentError, r"seed of at least 0.*found -1"),
    "a text for a number": (lambda: pp.contact(young_kPa="60", force_N=1), pp.ArgumentError, r"young_kPa as a number, or one for each layer; found '60'"),
    "two of three": (lambda: pp.forward(block_mm=(1, 2)), pp.ArgumentError, r"block_mm as a list of 3.*found \[1.0, 2.0\]"),
    "a text for frames": (lambda: pp.strain(PRESS, frames="ab"), pp.ArgumentError, r"frames as a list of 2.*found 'ab'"),
    "no modulus and no way": (lambda: pp.lump.estimate([GOOD], force_N=[1]), pp.ArgumentError, r"young_Pa, or press_mm"),
    "half a skin": (lambda: pp.lump.estimate([GOOD + 100], force_N=[1], young_Pa=4000, skin_mm=2), pp.ArgumentError, r"skin_mm and skin_ratio; found skin_mm alone"),
    "a thick skin": (lambda: pp.lump.estimate([GOOD + 100], force_N=[1], young_Pa=4000, skin_mm=12, skin_ratio=2), pp.ArgumentError, r"half of the thickness.*found 12"),
    "a skin's words": (lambda: pp.lump.estimate([GOOD + 100], force_N=[1], young_Pa=4000, skin_mm=(1, 2, 3), skin_ratio=2), pp.ArgumentError, r"standard deviation; found \(1, 2, 3\)"),
    "a rough plate": (lambda: pp.lump.estimate([GOOD + 100], force_N=[1], young_Pa=4000, plate_friction=3), pp.ArgumentError, r"plate_friction from 0 to 2.*found 3"),
    "a plate's words": (lambda: pp.lump.estimate([GOOD + 100], force_N=[1], young_Pa=4000, plate_friction="oil"), pp.ArgumentError, r"standard deviation; found 'oil'.*plate_friction"),
    "two plates": (lambda: pp.lump.estimate([GOOD + 100], force_N=[1], young_Pa=4000, plate_friction=0.1, plate_sticks=True), pp.ArgumentError, r"either plate_friction or plate_sticks; found both"),
    "a number for maps": (lambda: pp.lump.estimate(5.0, force_N=1, young_Pa=4000), pp.ArgumentError, r"found 5.0"),
    "no maps": (lambda: pp.lump.estimate([], force_N=[], young_Pa=4000), pp.ArgumentError, r"found \[\]"),
    "ragged maps": (lambda: pp.lump.estimate([[[1, 2], [3]]], force_N=1, young_Pa=4000), pp.ArgumentError, r"maps of rows x columns"),
    "texts for indices": (lambda: pp.optics.stack(["a", 1]), pp.ArgumentError, r"indices as a list of numbers"),
    "led": (lambda: pp.optics.trapped([1, 1.4, 1], led=None), pp.ArgumentError, r"led as a palpate.optics.Led; found None"),
    "sizes": (lambda: pp.profile.measure(sizes=[640, 480]), pp.ArgumentError, r"sizes as \(width, height\)"),
    "profiles": (lambda: pp.profile.compare(1, 2), pp.ArgumentError, r"file as a path; found 1"),
    "method": (
        lambda: pp.lump.estimate([GOOD + 100], force_N=[1], young_Pa=4000, method="guess"),
        pp.ArgumentError,
        r"network, refined or direct",
    ),
}


@pytest.mark.parametrize("call, kind, message", BAD.values(), ids=BAD.keys())
def test_a_mistake_is_named(call, kind, message):
    with pytest.raises(kind, match=message) as failure:
        call()
    error = failure.value
    assert isinstance(error, pp.Error)
    assert error.wanted and error.found and error.remedy
    assert str(error) == f"wanted {error.wanted}; found {error.found}; try {error.remedy}"
    assert "--" not in str(error)
    assert "\n" not in str(error)


def test_an_error_that_quotes_another_keeps_its_parts():
    with pytest.raises(pp.InputError) as failure:
        pp.open("synthetic:tissue?d=30")
    error = failure.value
    assert error.wanted == "a synthetic block that can be built"
    assert error.found.startswith("one that is refused (wanted ") and error.found.endswith("; try a value in that range)")
    assert error.remedy.startswith("size=")


@pytest.fixture
def failing(tmp_path, monkeypatch):
    """Stands in for the program: writes lines to stderr and ends with a code."""

    def replace(code, *lines):
        (tmp_path / "lines").write_text("\n".join(lines) + "\n")
        script = tmp_path / "palpate"
        script.write_text(f"#!/bin/sh\ncat '{tmp_path}/lines' >&2\nexit {code}\n")
        script.chmod(0o755)
        monkeypatch.setattr(_program, "program", lambda: str(script))

    return replace


def test_all_that_the_program_wrote_is_in_the_error(failing):
    error = "palpate: wanted a pad; found one (wanted a file; found none; try ls); try --pad-kPa 200"
    failing(3, "palpate: frame 7 is lost", error, "driver: 2 leaks")
    with pytest.raises(pp.InputError) as failure:
        _program.run_program(["profile"], "a profile")
    assert failure.value.wanted == "a pad"
    assert failure.value.found == "one (wanted a file; found none; try ls) (and on stderr: palpate: frame 7 is lost; driver: 2 leaks)"
    assert failure.value.remedy == "pad_kPa=200"


def test_a_program_that_crashes_is_quoted_whole(failing):
    failing(134, "terminate called after throwing an instance of 'std::length_error'", "  what():  vector::reserve")
    with pytest.raises(pp.Error) as failure:
        _program.run_program(["profile"], "a profile")
    assert failure.value.found == "terminate called after throwing an instance of 'std::length_error'; what():  vector::reserve"
    failing(134)
    with pytest.raises(pp.Error, match="exit code 134 of palpate profile"):
        _program.run_program(["profile"], "a profile")


def test_options_of_the_command_line_read_as_arguments(tmp_path):
    (tmp_path / "presses.csv").write_text("force_N,radius_mm\n1,2\n2,3\n")
    with pytest.raises(pp.ArgumentError, match="pad_kPa=200 pad_thickness_mm=6"):
        pp.modulus(tmp_path / "presses.csv", sample="cube,10mm")


def test_classes():
    assert issubclass(pp.ArgumentError, ValueError) and issubclass(pp.ArgumentError, TypeError)
    assert issubclass(pp.DeviceError, RuntimeError)
    for kind in (pp.ArgumentError, pp.InputError, pp.SensorError, pp.DeviceError, pp.OutputError, pp.ExpiredError, pp.VersionError):
        assert issubclass(kind, pp.Error)
    error = pickle.loads(pickle.dumps(pp.InputError("a", "b", "c")))
    assert (type(error), error.wanted, error.found, error.remedy) == (pp.InputError, "a", "b", "c")


def test_a_failed_call_leaves_the_module_usable():
    with pytest.raises(pp.Error):
        pp.open("nowhere.avi")
    with pp.open(PRESS, drop=False) as stream:
        assert next(stream).sequence == 0


def test_arguments_that_there_are_none_of():
    with pytest.raises(TypeError, match="nonsense"):
        pp.open(PRESS, nonsense=1)
    with pytest.raises(pp.ArgumentError, match="drop as True or False; found 'no'"):
        pp.open(PRESS, drop="no")
