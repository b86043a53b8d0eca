"""The experiments: a folder per paper, one registered experiment per table or figure.

``python -m experiments list`` shows them; ``README.md`` here says how to write one. What an
experiment needs of the runner is in ``experiments.runner``, what several share in
``experiments.shared``.
"""
