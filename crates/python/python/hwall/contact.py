"""Prediction of place, time and surface of the next touch of a tracked hand. Metres, seconds, one frame for hand and scene."""

from ._hwall import Estimator, LearnedModel, Predictor, Reach, reaches_from_csv

__all__ = ["Estimator", "LearnedModel", "Predictor", "Reach", "reaches_from_csv"]
