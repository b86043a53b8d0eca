"""The check of coefficients from elsewhere: which convention they are in."""

from ._entry import check
from ._verdict import Verdict

__all__ = ["Verdict", "check"]
