"""Where, when and on which surface a tracked hand is about to touch. Metres, seconds, one frame for hand and scene."""

from ._hwall import Estimator, LearnedModel, Predictor, Reach, reaches_from_csv

__all__ = ["Estimator", "LearnedModel", "Predictor", "Reach", "reaches_from_csv"]
