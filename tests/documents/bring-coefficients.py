"""What the page takes from its reader."""

import types

import numpy as np

_rng = np.random.default_rng(2)
clm = types.SimpleNamespace(coeffs=_rng.normal(size=(2, 4, 4)), normalization="4pi", csphase=-1)
signal = _rng.normal(size=16)
numbers = _rng.normal(size=27)
rows = _rng.normal(size=(9, 3))
red_green_blue = rows.T
features = _rng.normal(size=(5, 16, 3))
from_eye = np.eye(3)[[0, 1, 2, 0, 1]]
