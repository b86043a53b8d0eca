"""Locally adaptive products (Lee & Kim 2014).

Each module below registers experiments on the paper's tables, figures and choices.
"""

from ._leekim2014_exponent import exponent as exponent
from ._leekim2014_figure1 import figure1 as figure1
from ._leekim2014_figure8 import figure8 as figure8
from ._leekim2014_figure9 import figure9 as figure9
from ._leekim2014_figure10 import figure10 as figure10
from ._leekim2014_table1 import table1 as table1
from ._leekim2014_table2 import table2 as table2
from ._leekim2014_threshold import threshold as threshold
