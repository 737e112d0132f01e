from . import calibrate as calibrate, lump as lump, optics as optics
from ._arrays import (
    Heights as Heights,
    Match as Match,
    PlateFit as PlateFit,
    Strain as Strain,
    ThinPlate as ThinPlate,
    integrate as integrate,
    match as match,
)
from ._errors import (
    ArgumentError as ArgumentError,
    DeviceError as DeviceError,
    Error as Error,
    ExpiredError as ExpiredError,
    InputError as InputError,
    OutputError as OutputError,
    SensorError as SensorError,
    VersionError as VersionError,
)
from ._live import (
    Contact as Contact,
    Estimate as Estimate,
    Sensor as Sensor,
    Stream as Stream,
    Touch as Touch,
    Truth as Truth,
    Wrench as Wrench,
    open as open,
)
from ._recordings import Modulus as Modulus, Recording as Recording, measure as measure, modulus as modulus

__version__: str
__all__ = [
    "__version__",
    "ArgumentError",
    "calibrate",
    "Contact",
    "DeviceError",
    "Error",
    "Estimate",
    "ExpiredError",
    "Heights",
    "InputError",
    "integrate",
    "lump",
    "match",
    "Match",
    "measure",
    "Modulus",
    "modulus",
    "open",
    "optics",
    "OutputError",
    "PlateFit",
    "Recording",
    "Sensor",
    "SensorError",
    "Strain",
    "Stream",
    "ThinPlate",
    "Touch",
    "Truth",
    "VersionError",
    "Wrench",
]

def __dir__() -> list[str]: ...
