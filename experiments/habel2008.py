"""Preetham's sky in spherical harmonics (Habel, Mustata & Wimmer 2008).

Each module below registers experiments on the paper's claims.
"""

from ._habel2008_cost import cost as cost
from ._habel2008_day import figure1_5 as figure1_5
from ._habel2008_figure2 import figure2 as figure2
from ._habel2008_figure3 import figure3 as figure3
from ._habel2008_figure4 import figure4 as figure4
from ._habel2008_solvers import solvers as solvers
