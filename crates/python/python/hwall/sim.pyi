from typing import Any, Literal, Optional

from numpy.typing import ArrayLike

from . import Arm, Command, Floats, Frame

class ServoArm:
    """An arm that follows commands after a delay, within limits of speed, acceleration and jerk."""

    def __new__(
        cls, arm: Arm, q: ArrayLike, *, seed: int = 0, delay: Optional[float] = None, torque_noise: Optional[float] = None
    ) -> ServoArm: ...
    @property
    def t(self) -> float: ...
    @property
    def q(self) -> Floats: ...
    @property
    def qd(self) -> Floats: ...
    @property
    def torque(self) -> Floats: ...
    @property
    def pose(self) -> Floats: ...
    def command(self, command: Command) -> None: ...
    def advance(self, dt: float) -> None: ...
    def push(self, force: ArrayLike, moment: Optional[ArrayLike] = None) -> None: ...

class Person:
    """A simulated person who touches points."""

    def __new__(
        cls,
        seed: int = 0,
        *,
        kind: Literal["plain", "varied", "fast", "slow", "glancing"] = "plain",
        head: Optional[ArrayLike] = None,
        hand: Optional[ArrayLike] = None,
    ) -> Person: ...
    def plan(self, targets: ArrayLike, normals: ArrayLike) -> Touches: ...

class Touches:
    """A planned sequence of touches: a function of time, which starts at 0."""

    @property
    def duration(self) -> float: ...
    @property
    def truth(self) -> list[dict[str, Any]]: ...
    def frame(self, t: float) -> Frame: ...
    def tip(self, t: float) -> tuple[Floats, Floats]: ...

def finger_force(
    base_from_board: ArrayLike,
    tip: ArrayLike,
    velocity: ArrayLike,
    *,
    stiffness: float = 500.0,
    damping: float = 2.0,
    half_extent: float = 0.1,
) -> tuple[Floats, Floats]: ...
