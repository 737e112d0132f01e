from . import calibrate as calibrate, lump as lump, optics as optics, profile as profile
from ._arrays import *
from ._errors import *
from ._export import *
from ._live import *
from ._machine import *
from ._map import *
from ._mechanics import *
from ._pair import *
from ._recordings import *
from ._setup import *
from ._tables import *

__version__: str

def __dir__() -> list[str]: ...
