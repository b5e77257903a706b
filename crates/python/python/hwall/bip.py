"""Interaction primitives: learn a motion from a few dozen demonstrations, then predict the rest of a new one.

The phase runs from 0 (start) to 1 (end). Values may have any units; time has the unit of the demonstrations.
"""

from ._hwall import Filter, Model, Prediction, fit, load

__all__ = ["Filter", "Model", "Prediction", "fit", "load"]
