"""The language of formulas: its syntax, its vocabulary on NumPy and on intervals, its compilers.

Nothing here knows a scene.
"""
