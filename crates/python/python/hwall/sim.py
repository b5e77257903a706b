"""A simulated arm and simulated people, seeded: the same seed and calls give the same run. Base frame of the arm, m, rad, s."""

from ._hwall import Person, ServoArm, Touches, finger_force

__all__ = ["Person", "ServoArm", "Touches", "finger_force"]
