"""Configs, registry, runs and reports: what every experiment needs."""

from .context import Context as Context
from .context import Measurement as Measurement
from .data import Data as Data
from .errors import UserError as UserError
from .registry import experiment as experiment
from .report import Column as Column
from .report import Table as Table
