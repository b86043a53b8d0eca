"""The experiments: one module per paper, one registered experiment per table or figure.

``python -m experiments list`` shows them; ``README.md`` here says how to write one. What an
experiment needs of the runner is below.
"""

from ._context import Context as Context
from ._context import Measurement as Measurement
from ._data import Data as Data
from ._errors import UserError as UserError
from ._registry import experiment as experiment
from ._report import Column as Column
from ._report import Table as Table
