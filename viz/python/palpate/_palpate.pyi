"""The compiled part.  Everything that is public is in ``palpate``."""

from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray
from typing_extensions import Self

from ._arrays import Strain

version: str

def add_module_folder(arg0: Path) -> None: ...
def as_arguments(arg0: str) -> str: ...
def open_stream(settings: RunSettings, drop: bool, record: str, trace: str, device: str, keep: list[str]) -> Stream: ...
def open_pair_stream(*args: Any, **kwargs: Any) -> PairStream: ...
def record_pair(*args: Any, **kwargs: Any) -> dict[str, Any]: ...
def run_settings() -> list[tuple[str, str]]: ...
def measure(*args: Any, **kwargs: Any) -> dict[str, Any]: ...
def map(*args: Any, **kwargs: Any) -> dict[str, Any]: ...
def modulus(*args: Any, **kwargs: Any) -> dict[str, Any]: ...
def calibrate_force(*args: Any, **kwargs: Any) -> dict[str, Any]: ...
def integrate(*args: Any, **kwargs: Any) -> dict[str, Any]: ...
def match(*args: Any, **kwargs: Any) -> dict[str, Any]: ...
def optics_stack(*args: Any, **kwargs: Any) -> dict[str, NDArray[np.float64]]: ...
def optics_critical(*args: Any, **kwargs: Any) -> tuple[NDArray[np.float64], NDArray[np.float64]]: ...
def optics_fresnel(*args: Any, **kwargs: Any) -> tuple[NDArray[np.complex128], ...]: ...
def optics_gap(*args: Any, **kwargs: Any) -> NDArray[np.float64]: ...
def optics_layers(*args: Any, **kwargs: Any) -> dict[str, Any]: ...
def optics_trapped(*args: Any, **kwargs: Any) -> dict[str, NDArray[np.float64]]: ...
def optics_contact(*args: Any, **kwargs: Any) -> dict[str, NDArray[Any]]: ...
def optics_led(*args: Any, **kwargs: Any) -> dict[str, Any]: ...
def optics_index(*args: Any, **kwargs: Any) -> dict[str, Any]: ...
def calibrate_shear(*args: Any, **kwargs: Any) -> dict[str, Any]: ...
def calibrate_background(*args: Any, **kwargs: Any) -> dict[str, Any]: ...
def calibrate_flat(*args: Any, **kwargs: Any) -> dict[str, Any]: ...
def calibrate_scale(*args: Any, **kwargs: Any) -> dict[str, Any]: ...
def calibrate_photometric(*args: Any, **kwargs: Any) -> dict[str, Any]: ...
def calibrate_lookup(*args: Any, **kwargs: Any) -> dict[str, Any]: ...
def calibrate_lights(*args: Any, **kwargs: Any) -> dict[str, Any]: ...
def check(*args: Any, **kwargs: Any) -> dict[str, Any]: ...
def devices() -> list[dict[str, Any]]: ...
def cameras() -> list[dict[str, Any]]: ...
def record(*args: Any, **kwargs: Any) -> dict[str, Any]: ...
def simulate(*args: Any, **kwargs: Any) -> dict[str, Any]: ...
def wrench(*args: Any, **kwargs: Any) -> dict[str, Any]: ...
def strain(*args: Any, **kwargs: Any) -> dict[str, Any]: ...
def contact(*args: Any, **kwargs: Any) -> dict[str, Any]: ...
def forward(*args: Any, **kwargs: Any) -> dict[str, Any]: ...
def profile_load(file: str | Path) -> tuple[str, str]: ...
def profile_compare(texts: list[str]) -> tuple[str, str]: ...
def quantities() -> list[tuple[str, str, str, str, str]]: ...
def lump_compare(*args: Any, **kwargs: Any) -> str: ...
def lump_estimate(*args: Any, **kwargs: Any) -> tuple[str, str]: ...

class RunSettings:
    def __init__(self, input: str, sensor: Sensor | None, seed: int, settings: dict[str, Any]) -> None: ...

class Estimate:
    """A number with its standard error, state and unit.

    ``float()`` and comparisons see the number where it is valid, else NaN.
    """

    def __init__(self, value: float, sd: float = ..., unit: str = "", state: str = "valid") -> None: ...
    @property
    def value(self) -> float:
        """The number whatever its state; NaN: there is none."""
    @property
    def sd(self) -> float:
        """Standard error, one sigma, in the number's unit; NaN: not stated."""
    @property
    def state(self) -> str:
        """``valid``, ``not calibrated``, ``no contact``, ``below range``, ``above range``, ``saturated``, ..."""
    @property
    def unit(self) -> str: ...
    @property
    def valid(self) -> bool: ...
    def __float__(self) -> float: ...
    def __bool__(self) -> bool: ...
    def __format__(self, arg0: str) -> str: ...
    def __hash__(self) -> int: ...
    def __array__(self, *args: Any) -> NDArray[np.float64]: ...
    def __lt__(self, arg0: Estimate | float) -> bool: ...
    def __le__(self, arg0: Estimate | float) -> bool: ...
    def __gt__(self, arg0: Estimate | float) -> bool: ...
    def __ge__(self, arg0: Estimate | float) -> bool: ...
    def __eq__(self, arg0: object) -> bool: ...
    def __ne__(self, arg0: object) -> bool: ...
    def _repr_html_(self) -> str: ...
    def __getstate__(self) -> tuple[float, float, str, str]: ...
    def __setstate__(self, arg0: tuple[float, float, str, str]) -> None: ...

class Sensor:
    """A sensor file: what is known of a sensor."""

    def __init__(self, file: str | Path) -> None: ...
    @staticmethod
    def load(file: str | Path) -> Sensor:
        """Reads a sensor file, as ``Sensor(file)`` does."""
    @staticmethod
    def from_text(text: str) -> Sensor:
        """From the text of a sensor file."""
    def save(self, file: str | Path) -> None:
        """Writes a sensor file; paths in it are absolute or relative to it."""
    @property
    def text(self) -> str:
        """The text of the sensor file (JSON)."""
    @property
    def name(self) -> str: ...
    @property
    def pitch_mm_per_px(self) -> float:
        """Of the rectified frame; NaN: not known."""
    @property
    def pitch_sd_mm_per_px(self) -> float:
        """Its standard error; 0: not stated."""
    @property
    def has_scale(self) -> bool: ...
    @property
    def has_force(self) -> bool: ...
    @property
    def has_shear(self) -> bool: ...
    @property
    def has_layer(self) -> bool: ...
    @property
    def reading(self) -> str | None:
        """How an image becomes a surface: ``shading``, ``photometric``, ``elastic``, ``lookup``; or None."""
    @property
    def surface(self) -> str | None:
        """Older name of ``reading``."""
    def __getstate__(self) -> str: ...
    def __setstate__(self, arg0: str) -> None: ...

class _Shape:
    """What a frame's whole touch and one contact have in common."""

    # quantities: shape

class Contact(_Shape):
    """One of several contacts, followed from frame to frame."""

    # quantities: contact
    @property
    def box_px(self) -> tuple[int, int, int, int]:
        """x, y, width and height around its pixels."""

class Truth:
    """What was really there, of simulated scenes."""

    # quantities: truth
    @property
    def sequence(self) -> int: ...
    @property
    def time_s(self) -> float: ...

class Wrench:
    """Force and moment on the pad by its elastic layer: x right, y down, z into the pad, about the frame's middle."""

    # quantities: wrench

class Motion:
    """Rigid motion of the object that touches the pad, since its track began: x right, y down, z into the pad, from the
    picture's middle.  What the surface does not determine is NaN, its state "not determined"."""

    # quantities: motion
    @property
    def pose(self) -> NDArray[np.float64]:
        """4 x 4: where a point of the object went, mm; along what is not determined it stays about where it was."""
    @property
    def covariance(self) -> NDArray[np.float64]:
        """6 x 6, of three shifts (mm) of the contact's middle and three turns (rad) about it."""

class Touch(_Shape):
    """The measurements of one frame.

    Numbers stay.  Maps and pixels can be read until the stream's next touch is asked for; once read, or kept,
    they stay too.
    """

    # quantities: frame
    # quantities: touch
    @property
    def time_ns(self) -> int: ...
    @property
    def monotonic_s(self) -> float:
        """Time of exposure on the clock of ``time.monotonic()``; NaN: not known (recordings)."""
    @property
    def contacts(self) -> list[Contact]:
        """Each by itself, the largest 64."""
    @property
    def depth_mm(self) -> NDArray[np.float32]:
        """rows x columns, mm below the rest level, read-only."""
    @property
    def image(self) -> NDArray[Any]:
        """The rectified frame: rows x columns (x 3), uint8 or uint16, read-only."""
    @property
    def confidence(self) -> NDArray[np.uint16]:
        """rows x columns: confidence 0 to 255, and 256 times the reasons (1 saturated, 2 shadowed, 4 outside)."""
    @property
    def pressure_kPa(self) -> NDArray[np.float32] | None:
        """On the pad, cells of several px; None without contact."""
    @property
    def shear_kPa(self) -> NDArray[np.float32] | None:
        """2 (x, y) x rows x columns of cells; None where no skin is followed, and without contact."""
    @property
    def extrapolated(self) -> NDArray[np.bool_]:
        """rows x columns, True where the pad is dented at a place or with a colour that its calibration never saw."""
    @property
    def wrench(self) -> Wrench: ...
    @property
    def motion(self) -> Motion: ...
    @property
    def skin_points(self) -> NDArray[np.float32]:
        """Followed places x 5: x and y at rest, shift in x and y (px), correlation (0: lost)."""
    @property
    def truth(self) -> Truth | None: ...
    def keep(self, *names: str) -> Touch:
        """Reads maps now, so that they stay; without names depth and image.  Gives the touch itself."""
    def _repr_html_(self) -> str: ...

class Stream:
    """An iterator of touches, one a frame.

    Waiting holds no lock of the interpreter and ends by Ctrl-C.
    """

    def __iter__(self) -> Self: ...
    def __next__(self) -> Touch: ...
    def __enter__(self) -> Self: ...
    def __exit__(self, *args: object) -> None: ...
    def close(self) -> None:
        """Ends the stream; what was read stays.  Any thread, any number of times."""
    def log(self, name: str, **values: object) -> None:
        """A row of a log beside what is recorded (``record=``), at the time of the call: numbers, lists and arrays.

        ``stream.log("robot", z_mm=1.25, joints_rad=[0.1, 0.2])`` adds to ``log/robot.csv`` of the session; another
        time is ``monotonic_s=``, as ``time.monotonic()`` counts.
        """
    @property
    def closed(self) -> bool: ...
    @property
    def dropped(self) -> int:
        """Frames that the camera took and nobody got."""
    @property
    def delivered(self) -> int: ...
    @property
    def drops(self) -> bool:
        """The newest frame wins; else none is lost."""
    @property
    def input(self) -> str: ...
    @property
    def sensor(self) -> Sensor: ...
    @property
    def width(self) -> int: ...
    @property
    def height(self) -> int: ...
    @property
    def frame_count(self) -> int | None: ...
    @property
    def rate_Hz(self) -> float | None: ...
    @property
    def live(self) -> bool:
        """A camera: frames come when they come."""
    @property
    def clock(self) -> str:
        """What ``time_s`` counts on: ``CLOCK_MONOTONIC`` less its start, or the ``recording``'s own."""
    @property
    def warning(self) -> str: ...
    @property
    def damaged(self) -> int:
        """Frames that do not decode whole, and are left out."""
    @property
    def state(self) -> str:
        """What a camera is waited for; empty: its frames come."""
    @property
    def details(self) -> list[tuple[str, str]]:
        """Settings of a camera as it uses them."""
    @property
    def device_losses(self) -> int:
        """Times that the device was lost and opened anew; frames until then expired."""
    @property
    def recorded(self) -> dict[str, Any] | None:
        """The session of ``record=``: ``folder``, frames ``recorded``, ``dropped`` and ``measured``, ``error``."""
    @property
    def device(self) -> str: ...

class Grip:
    """What two fingers hold: a row of ``pairs.csv``.  Of a frame without a partner no number is known."""

    # quantities: grip

class Pair:
    """Frames of two fingers that were taken together, or one without a partner."""

    @property
    def left(self) -> Touch | None:
        """None: the right one is alone."""
    @property
    def right(self) -> Touch | None:
        """None: the left one is alone."""
    @property
    def grip(self) -> Grip: ...
    @property
    def time_s(self) -> float:
        """Exposure since the first row, of a pair the middle of both frames."""
    @property
    def skew_ms(self) -> float:
        """Time of the right frame less that of the left one; NaN: one is alone."""

class PairStream:
    """An iterator of pairs, and of frames without a partner, in their order.

    Waiting holds no lock of the interpreter and ends by Ctrl-C.
    """

    def __iter__(self) -> Self: ...
    def __next__(self) -> Pair: ...
    def __enter__(self) -> Self: ...
    def __exit__(self, *args: object) -> None: ...
    def close(self) -> None:
        """Ends the stream; what was read stays.  Any thread, any number of times."""
    def log(self, name: str, **values: object) -> None:
        """A row of a log beside what is recorded, as ``Stream.log``; in the folder ``log`` of the pair."""
    @property
    def closed(self) -> bool: ...
    @property
    def dropped(self) -> int:
        """Rows that nobody got, and frames of both cameras that were not measured."""
    @property
    def delivered(self) -> int:
        """Rows."""
    @property
    def drops(self) -> bool:
        """The newest row wins; else none is lost."""
    @property
    def live(self) -> bool:
        """Of either a camera."""
    @property
    def warning(self) -> str: ...
    @property
    def state(self) -> str:
        """Why a finger gives no frames at present, while the other goes on; empty: both do."""
    @property
    def device(self) -> str: ...
    @property
    def device_losses(self) -> int:
        """Times that the device was lost and opened anew; frames until then expired."""
    @property
    def inputs(self) -> tuple[str, str]:
        """Left, right."""
    @property
    def sensors(self) -> tuple[Sensor, Sensor]:
        """Left, right."""
    @property
    def recorded(self) -> dict[str, Any] | None:
        """Of ``record=``: ``folder``, ``rows`` of pairs.csv, and ``left`` and ``right`` as ``Stream.recorded``."""

class PlateFit:
    """A fitted spline: ``f(xy)``, ``f.gradient(xy)``, ``f.strain(xy)``."""

    def __call__(self, xy: ArrayLike) -> NDArray[np.float64]:
        """Values at places (n x axes): n, or n x fields."""
    def gradient(self, xy: ArrayLike) -> NDArray[np.float64]:
        """First derivatives at places: n (x fields) x axes."""
    def strain(self, xy: ArrayLike) -> Strain:
        """Strain of a fit of two shifts at places (n x 2), shifts and places in one unit."""
    def _strain(self, xy: ArrayLike) -> dict[str, NDArray[np.float64]]: ...
    @property
    def lam(self) -> float:
        """Smoothing, of points scaled to an RMS distance of 1 from their centre; 0: through all points."""
    @property
    def lam_by_data(self) -> bool: ...
    @property
    def lam_raised(self) -> bool: ...
    @property
    def freedom(self) -> float:
        """From 1 + rank (a polynomial) to the number of points."""
    @property
    def condition(self) -> float: ...
    @property
    def merged(self) -> int: ...
    @property
    def rank(self) -> int: ...
    @property
    def residual_sd(self) -> NDArray[np.float64]:
        """Of each field: standard deviation of a point about the spline."""

class ThinPlate:
    """Fixed points (n x 2 or n x 3), factored once for the fields that are fitted over them."""

    def __init__(self, points: ArrayLike, weights: ArrayLike | None = None, *, kernel: str = "") -> None: ...
    def fit(self, values: ArrayLike, lam: float | None = None) -> PlateFit:
        """A spline through values (n, or n x fields); ``lam`` None: as smooth as the data ask for."""
    def __len__(self) -> int: ...
