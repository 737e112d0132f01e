"""Light in the pad: numbers by formulas of one's own, and those of the program."""

import json
import subprocess

import numpy as np
import palpate as pp
import pytest

PAD = [1, 1.39, 1.40, 1.41, 1]


@pytest.fixture(scope="module")
def optics(program):
    """What `palpate optics` says as JSON."""

    def run(*words):
        command = [program, "optics", *map(str, words), "--json"]
        return json.loads(subprocess.run(command, check=True, capture_output=True).stdout)

    return run


def test_critical_angles():
    # asin(1/n), sqrt(n^2 - 1) and its arc sine, worked out by hand.
    for n, critical, aperture, accepted in (
        (1.39, 46.006983, 0.965453, 74.895740),
        (1.40, 45.584691, 0.979796, 78.463041),
        (1.41, 45.171476, 0.994032, 83.737305),
    ):
        assert pp.optics.critical_angle_deg(n, 1) == pytest.approx(critical, abs=5e-7)
        assert pp.optics.numerical_aperture(n, 1) == pytest.approx(aperture, abs=5e-7)
        row = PAD.index(n) - 1
        layers = pp.optics.critical(PAD)
        assert layers.acceptance_half_angle_deg[row] == pytest.approx(accepted, abs=5e-7)
        assert layers.critical_angle_above_deg[row] == pp.optics.critical_angle_deg(n, 1)
    n = np.linspace(1.01, 3, 12).reshape(3, 4)
    assert np.allclose(np.sin(np.radians(pp.optics.critical_angle_deg(n, 1))) * n, 1)
    assert np.isnan(pp.optics.critical_angle_deg(1.3, [1.33, 1.3])).all()
    assert (pp.optics.numerical_aperture(1.3, [1.33, 1.3]) == 0).all()


def test_fresnel():
    angle_deg = np.array([[0.0, 20.0], [50.0, 90.0]])
    light = pp.optics.fresnel(1.0, 1.5, angle_deg)
    cos1 = np.cos(np.radians(angle_deg))
    cos2 = np.sqrt(1 - (np.sin(np.radians(angle_deg)) / 1.5) ** 2)
    assert np.allclose(light.r_s, (cos1 - 1.5 * cos2) / (cos1 + 1.5 * cos2), atol=1e-14)
    assert np.allclose(np.abs(light.r_p), np.abs((1.5 * cos1 - cos2) / (1.5 * cos1 + cos2)), atol=1e-14)
    assert np.allclose(light.t_s, 2 * cos1 / (cos1 + 1.5 * cos2), atol=1e-14)
    assert np.allclose(np.abs(light.t_p), 2 * cos1 / (1.5 * cos1 + cos2), atol=1e-14)
    intensities = pp.optics.stack([1.0, 1.5], angle_deg=angle_deg)
    assert np.allclose(np.abs(light.r_s) ** 2, intensities.s_and_p_reflectance[0])
    assert np.allclose(np.abs(light.r_p) ** 2, intensities.s_and_p_reflectance[1])
    brewster = np.degrees(np.arctan(1.5))
    assert abs(pp.optics.fresnel(1.0, 1.5, brewster).r_p) < 1e-15
    assert np.allclose(np.abs(pp.optics.fresnel(1.5, 1.0, [45, 60, 80]).r_s), 1)  # total reflection
    silver = pp.optics.fresnel(1.0, 0.13, 0, extinction=4.0)
    assert np.abs(silver.r_s) ** 2 == pytest.approx(((0.13 - 1) ** 2 + 16) / ((0.13 + 1) ** 2 + 16))


def test_a_gap():
    thin = pp.optics.gap(1.41, 1.0, 1.41, angle_deg=60, gap_nm=[0, 50, 200, 2000])
    assert thin.s[0] == pytest.approx(1) and thin.p[0] == pytest.approx(1)
    assert (np.diff(thin.unpolarised) < 0).all() and thin.unpolarised[-1] < 1e-8
    # Two like media about a gap, beyond the critical angle: T = 1 / (1 + a sinh^2(kappa d)).
    n, angle, gap_nm = 1.41, np.radians(60), np.array([50, 200])
    kappa = 2 * np.pi / 630 * np.sqrt((n * np.sin(angle)) ** 2 - 1)
    a = (n**2 - 1) ** 2 / (4 * n**2 * np.cos(angle) ** 2 * (n**2 * np.sin(angle) ** 2 - 1))
    assert np.allclose(thin.s[1:3], 1 / (1 + a * np.sinh(kappa * gap_nm) ** 2))
    assert np.allclose(thin.unpolarised, (thin.s + thin.p) / 2)


def entering_of(n):
    """Of Lambert's light onto a clear flat edge: the integral of the transmittance over sin^2."""
    sin2 = (np.arange(20000) + 0.5) / 20000
    cos1, cos2 = np.sqrt(1 - sin2), np.sqrt(1 - sin2 / n**2)
    r_s, r_p = (cos1 - n * cos2) / (cos1 + n * cos2), (n * cos1 - cos2) / (n * cos1 + cos2)
    return np.mean(1 - (r_s**2 + r_p**2) / 2)


def test_an_led_s_light_in_the_pad():
    n = np.array([[1.2, 1.3], [1.5, 1.7]])
    light = pp.optics.trapped([1, n, 1], thickness_mm=5)
    assert light.entering.shape == n.shape
    assert np.allclose(light.entering, np.vectorize(entering_of)(n), atol=2e-5)
    # Above sqrt(2) all that enters a pad in air is kept in; below, by chance as much as misses the four sides' cones.
    assert np.allclose(light.guided[n > 1.42], light.entering[n > 1.42], rtol=1e-6)
    assert (light.guided[n < 1.41] < light.entering[n < 1.41]).all()
    assert np.array_equal(light.touching, light.guided)  # one layer: what is kept in meets its face
    lit = [pp.optics.trapped(PAD, led=pp.optics.Led(layer=i)) for i in range(3)]
    assert lit[0].touching == lit[0].guided and lit[2].touching < lit[1].touching < lit[1].guided
    narrow = pp.optics.trapped([1, 1.41, 1], led=pp.optics.Led(half_intensity_deg=30, half_angle_deg=45))
    assert narrow.guided > lit[0].guided


def test_an_led_s_rays():
    angle_deg = np.array([-40.0, 0.0, 25.0])
    light = pp.optics.led([1, 1.41, 1], thickness_mm=6, depth_mm=1.5, length_mm=40, angle_deg=angle_deg)
    inside = np.arcsin(np.sin(np.radians(np.abs(angle_deg))) / 1.41)
    assert np.allclose(light.rays.n_sin, 1.41 * np.cos(inside))
    # Up: over the 1.5 mm above; down: to the bottom and back over all 6 mm.
    assert light.rays.first_mm[2] == pytest.approx(1.5 / np.tan(inside[2]))
    assert light.rays.first_mm[0] == pytest.approx((4.5 + 6) / np.tan(inside[0]))
    assert np.allclose(light.rays.hop_mm[[0, 2]], 12 / np.tan(inside[[0, 2]]))
    assert np.isinf(light.rays.first_mm[1]) and light.rays.fate[::2] == ("touching", "touching")
    assert all(path.shape[1] == 2 and tuple(path[0]) == (0, 1.5) for path in light.rays.path_mm)
    assert light.nearest_mm == pytest.approx(1.5 * np.tan(np.arcsin(1 / 1.41)))  # at the critical angle
    assert light.nearest_mm <= light.half_mm <= light.nine_tenths_mm
    assert (np.diff(light.fraction) >= 0).all() and light.fraction[-1] <= light.touching + 1e-9
    assert len(pp.optics.led(PAD, thickness_mm=2).rays.fate) == 21


def test_contacts():
    light = pp.optics.contact([1, 1.41, 1], thickness_mm=6, contact=[1.0, 1.33, 1.41, 1.6], albedo=[1, 1, 0.5, 1], reference_gray=100)
    assert light.leaving_per_meeting[0] == 0 and np.isnan(light.leaves_up_to_deg[0]) and light.gray[0] == 0
    assert light.leaves_up_to_deg[1] == pytest.approx(np.degrees(np.arcsin(1.33 / 1.41)))
    assert light.leaving_per_meeting[2] == pytest.approx(1)  # of the pad's own index: nothing is reflected
    assert np.allclose(light.gray, np.minimum(100 * light.relative, 255))
    assert not light.saturated.any()
    assert pp.optics.contact([1, 1.41, 1], thickness_mm=6, contact=1.41, reference_index=1.1, reference_gray=200).saturated
    assert np.isnan(pp.optics.contact([1, 1.41, 1], thickness_mm=6, contact=1.4).gray)
    gaps = pp.optics.contact([1, 1.41, 1], thickness_mm=6, contact=1.4, gap_nm=[0, 100, 500])
    assert gaps.relative[0] == pytest.approx(1) and (np.diff(gaps.relative) < 0).all()


def test_an_index_from_spots():
    # n = n_air sin(atan(OD/ON)) / sin(atan(M1M2/NM2 OD/ON)), and its derivatives by small steps.
    def n_of(od, on, m1m2, nm2):
        return 1.000271 * np.sin(np.arctan(od / on)) / np.sin(np.arctan(m1m2 / nm2 * od / on))

    lengths, sd = np.array([800.0, 600.0, 10.3, 20.0]), np.array([0.5, 0.4, 0.1, 0.2])
    one = pp.optics.index(od_mm=800, on_mm=600, m1m2_mm=10.3, nm2_mm=20, sd_mm=sd.tolist())
    assert one.index.value == pytest.approx(n_of(*lengths), rel=1e-12)
    steps = [(n_of(*(lengths + e)) - n_of(*(lengths - e))) / 2e-4 for e in 1e-4 * np.eye(4)]
    assert one.index.sd == pytest.approx(np.sqrt(np.sum((np.array(steps) * sd) ** 2)), rel=1e-6)
    assert np.allclose(one.parts_sd[0, :4], np.abs(steps) * sd)
    assert f"{one.index}" == f"{one.index.value:.2f} ± {one.index.sd:.2f}"
    several = pp.optics.index(od_mm=[800, 500], on_mm=600, m1m2_mm=[10.3, 12.3], nm2_mm=20, sd_mm=0.1)
    weights = 1 / several.each_sd**2
    assert several.index.value == pytest.approx(np.sum(weights * several.each) / weights.sum())
    assert np.isnan(pp.optics.index(od_mm=800, on_mm=600, m1m2_mm=10.3, nm2_mm=20).index.sd)


def same(found, wanted):
    """NaN stands for null, infinity too."""
    wanted = np.array([np.nan if w is None else w for w in np.ravel(wanted)], dtype=float)
    assert np.array_equal(np.where(np.isinf(found), np.nan, found).ravel(), wanted, equal_nan=True)


def test_the_program_says_the_same(optics):
    media = ["--indices", "1,1.39,1.40,1.41,1"]
    thick = [*media, "--thickness-mm", "2,1,3"]
    lamp = ["--led-layer", 3, "--edge-index", 1.2, "--led-half-intensity-deg", 40, "--led-half-angle-deg", 80]
    led = pp.optics.Led(layer=2, edge_index=1.2, half_intensity_deg=40, half_angle_deg=80)

    told, layers = optics("critical", *media, "--edge-index", 1.1), pp.optics.critical(PAD, edge_index=1.1)
    for name in ("index", "critical_angle_above_deg", "critical_angle_below_deg", "numerical_aperture", "acceptance_half_angle_deg"):
        same(getattr(layers, name), [row[name] for row in told["layers"]])
    same(layers.touching_n_sin, [row["touching_n_sin"] for row in told["layers"]])

    told = optics("trapped", *media, *lamp, "--vary", "2:1.3:1.6")
    curve = told["curve"]
    found = pp.optics.trapped([1, 1.39, np.array(curve["index"]), 1.41, 1], led=led)
    for name in ("entering", "guided", "touching"):
        same(getattr(found, name), curve[name])

    told = optics("led", *thick, *lamp, "--length-mm", 25, "--rays", 7)
    found = pp.optics.led(PAD, thickness_mm=[2, 1, 3], led=led, length_mm=25, angle_deg=[r["angle_deg"] for r in told["rays"]])
    for name in ("depth_mm", "entering", "guided", "touching", "nearest_mm"):
        same(np.array([getattr(found, name)]), [told["place"][name]])
    same(np.array([found.half_mm, found.nine_tenths_mm]), [told["place"][f"{n}_mm"] for n in ("half_has_met", "nine_tenths_have_met")])
    assert [r["fate"] for r in told["rays"]] == list(found.rays.fate)
    assert np.allclose(found.rays.hop_mm, [r["hop_mm"] for r in told["rays"]], rtol=1e-12)

    asked = ["--contact", "1.33,1.45,1.5", "--contact-extinction", "0,0.01,0", "--albedo", "0.3,0.6,1", "--gap-nm", 40]
    told = optics("contact", *thick, *lamp, *asked, "--reference-gray", 90)["contacts"]
    found = pp.optics.contact(
        PAD, thickness_mm=[2, 1, 3], led=led, contact=[1.33, 1.45, 1.5], extinction=[0, 0.01, 0], albedo=[0.3, 0.6, 1], gap_nm=40,
        reference_gray=90,
    )
    for name in ("leaving_per_meeting", "leaving_per_mm", "leaves_up_to_deg", "relative", "gray"):
        same(getattr(found, name), [row[name] for row in told])

    spots = ["--od-mm", "800,500", "--on-mm", "600,600", "--m1m2-mm", "10.3,12.3", "--nm2-mm", "20,20", "--sd-mm", "0.5,0.5,0.1,0.1"]
    told = optics("index", *spots)
    found = pp.optics.index(od_mm=[800, 500], on_mm=600, m1m2_mm=[10.3, 12.3], nm2_mm=20, sd_mm=[0.5, 0.5, 0.1, 0.1])
    assert (found.index.value, found.index.sd, found.chi_square, found.widened) == (
        told["index"], told["standard_error"], told["chi_square"], told["widened"],
    )


MISTAKES = {
    "few media": (lambda: pp.optics.critical([1, 1.4]), pp.ArgumentError, "three indices or more"),
    "no media": (lambda: pp.optics.trapped([]), pp.ArgumentError, "three indices or more"),
    "index": (lambda: pp.optics.critical_angle_deg(0.9, 1), pp.InputError, "0.9"),
    "NaN": (lambda: pp.optics.critical_angle_deg([1.4, np.nan], 1), pp.ArgumentError, r"n_in; found nan at index \(1,\)"),
    "texts": (lambda: pp.optics.fresnel(1, 1.5, ["a"]), pp.ArgumentError, "angle_deg as an array of numbers"),
    "angle": (lambda: pp.optics.fresnel(1, 1.5, 91), pp.ArgumentError, "0 to 90 deg"),
    "shapes": (lambda: pp.optics.critical_angle_deg([1.4, 1.5], [1, 1, 1]), pp.ArgumentError, r"\(2,\) and \(3,\)"),
    "thicknesses": (lambda: pp.optics.trapped(PAD, thickness_mm=[1, 2]), pp.ArgumentError, "each of 3 layers"),
    "layer": (lambda: pp.optics.trapped(PAD, led=pp.optics.Led(layer=3)), pp.ArgumentError, "from 0 to 2"),
    "two orders": (lambda: pp.optics.trapped(PAD, led=pp.optics.Led(order=2, half_intensity_deg=30)), pp.ArgumentError, "found both"),
    "order": (lambda: pp.optics.trapped(PAD, led=pp.optics.Led(order=0.5)), pp.InputError, "1 to 1000"),
    "depth": (lambda: pp.optics.led(PAD, thickness_mm=2, depth_mm=7), pp.InputError, "from 0 to 6"),
    "depth's layer": (
        lambda: pp.optics.led(PAD, thickness_mm=2, depth_mm=5, led=pp.optics.Led(layer=0)), pp.ArgumentError, "in layer 2"
    ),
    "length": (lambda: pp.optics.led(PAD, thickness_mm=2, length_mm=0), pp.InputError, "> 0 mm"),
    "albedo": (lambda: pp.optics.contact(PAD, thickness_mm=2, contact=1.4, albedo=2), pp.InputError, "albedo from 0 to 1"),
    "gap": (lambda: pp.optics.gap(1.4, 1, 1.4, angle_deg=60, gap_nm=-1), pp.InputError, "gap >= 0 nm"),
    "spots": (lambda: pp.optics.index(od_mm=800, on_mm=600, m1m2_mm=21, nm2_mm=20), pp.InputError, "M1M2 < NM2"),
    "uncertainties": (lambda: pp.optics.index(od_mm=800, on_mm=600, m1m2_mm=10, nm2_mm=20, sd_mm=[1, 2]), pp.ArgumentError, "or four"),
}


@pytest.mark.parametrize("call, kind, message", MISTAKES.values(), ids=MISTAKES.keys())
def test_a_mistake_is_named(call, kind, message):
    with pytest.raises(kind, match=message) as failure:
        call()
    error = failure.value
    assert error.wanted and error.found and error.remedy and "--" not in str(error)


def test_tables_for_a_notebook():
    for shown in (
        pp.optics.critical(PAD),
        pp.optics.trapped(PAD),
        pp.optics.led(PAD, thickness_mm=2),
        pp.optics.contact(PAD, thickness_mm=2, contact=[1.33, 1.4]),
    ):
        assert shown._repr_html_().startswith("<table><tr><th>")
    assert pp.optics.contact(PAD, thickness_mm=2, contact=[1.33, 1.4])._repr_html_().count("<tr>") == 3
    assert "n = 1.361 ± 0.009" == pp.optics.index(od_mm=800, on_mm=600, m1m2_mm=10.9, nm2_mm=20, sd_mm=0.1)._repr_html_()
