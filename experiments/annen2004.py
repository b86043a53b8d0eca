"""Light from near emitters and its gradient (Annen, Kautz, Durand & Seidel 2004).

Each module below registers experiments on the paper's figures, its table and its claims.
"""

from ._annen2004_claims import claims as claims
from ._annen2004_figure1_5 import figure1_5 as figure1_5
from ._annen2004_figure4 import figure4 as figure4
from ._annen2004_figure6 import figure6 as figure6
from ._annen2004_figure7 import figure7 as figure7
from ._annen2004_figure8 import figure8 as figure8
from ._annen2004_glossy import glossy as glossy
from ._annen2004_orders import orders as orders
from ._annen2004_placement import placement as placement
from ._annen2004_table1 import table1 as table1
