"""Binary senses in addition to the sight of food: patches, last action, touch, heading.

The details are our interpretation of the sources:

- Last action: S. Nolfi, J. L. Elman and D. Parisi, "Learning and evolution in neural networks",
  Adaptive Behavior 3 (1994). Their networks get the last motor action as an input.
- Bumpers and compasses: S. Nolfi and D. Floreano, Evolutionary Robotics (2000).
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import Any, ClassVar

from baldwinlab.engine.phases import Array
from baldwinlab.models.miniworld.regions import kind_number
from baldwinlab.models.miniworld.senses.sight import SECTORS, Sectors, sense_items
from baldwinlab.models.miniworld.state import HEADING_COUNT
from baldwinlab.parts import Sense, per_agent

# Number of headings in a quarter turn.
QUARTER_TURN = HEADING_COUNT // 4


class PatchSight(Sense, name="patch"):
    """Three binary inputs: an item of a patch in the left, front and right sector."""

    inputs: ClassVar[tuple[str, ...]] = ("patch left", "patch in front", "patch right")
    sectors: ClassVar[Sectors] = SECTORS
    item_kind: ClassVar[str] = "patch"
    only_items: ClassVar[bool] = True
    derived: ClassVar[Mapping[str, Callable[[Any, Any], Any]]] = {"number": kind_number("patch")}

    @staticmethod
    def sense(part: Any, model: Any, state: Any, world: int, agent: int) -> int:
        return sense_items(model, state, world, agent, part.number)


class LastAction(Sense, name="last-action"):
    """Three binary inputs: the action of the previous step. All are 0 at birth."""

    inputs: ClassVar[tuple[str, ...]] = (
        "did the first action",
        "did the second action",
        "did the third action",
    )
    sectors: ClassVar[Sectors] = (None, None, None)

    def check(self, experiment: Any) -> None:
        """Raise ValueError if the body has more actions than the sense has inputs."""
        if len(experiment.actions) > len(self.inputs):
            raise ValueError(
                f"senses.kinds: 'last-action' has {len(self.inputs)} inputs, but there are "
                f"{len(experiment.actions)} actions of "
                f"motor.body = {experiment.motor.body!r}"
            )

    @staticmethod
    def sense(part: Any, model: Any, state: Any, world: int, agent: int) -> int:
        lane = world * model.agents + agent
        has_sensed_before = state.code[0, lane] >= 0
        if not has_sensed_before:
            return 0
        return 1 << int(state.action[0, lane])


class Touch(Sense, name="touch"):
    """One binary input: 1 if the last step did not change the position, for example at a wall."""

    inputs: ClassVar[tuple[str, ...]] = ("stopped",)
    sectors: ClassVar[Sectors] = (None,)
    # Position of the agent in the previous step.
    arrays: ClassVar[Mapping[str, Array]] = {"last_position": per_agent(2)}

    @staticmethod
    def sense(part: Any, model: Any, state: Any, world: int, agent: int) -> int:
        lane = world * model.agents + agent
        x = state.positions[0, lane]
        y = state.positions[1, lane]
        has_sensed_before = state.code[0, lane] >= 0
        has_stayed = (
            has_sensed_before
            and x == part.last_position[0, lane]
            and y == part.last_position[1, lane]
        )
        part.last_position[0, lane] = x
        part.last_position[1, lane] = y
        return 1 if has_stayed else 0


class Compass(Sense, name="compass"):
    """Four binary inputs: heading right, down, left, up.

    The sector of a direction starts 45 degrees before and ends 45 degrees after the direction.
    """

    inputs: ClassVar[tuple[str, ...]] = ("heads right", "heads down", "heads left", "heads up")
    sectors: ClassVar[Sectors] = (None, None, None, None)

    @staticmethod
    def sense(part: Any, model: Any, state: Any, world: int, agent: int) -> int:
        """Return the bit of the direction of the heading: 1 right, 2 down, 4 left, 8 up."""
        # The sector of direction 0 starts an eighth of a turn before heading 0.
        shifted_heading = int(state.heading[0, world * model.agents + agent]) + QUARTER_TURN // 2
        return 1 << (shifted_heading // QUARTER_TURN % 4)
