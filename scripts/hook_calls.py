"""The order in which the engine calls the hooks of parts.

`scripts.part_reference` prints this table.
`tests/test_part_reference.py` compares it with the calls of a simulated generation.
"""

from __future__ import annotations

from typing import Final, NamedTuple


class Call(NamedTuple):
    """One row of the table: a hook, or a step of the engine between hooks."""

    stage: str
    """"founders", "birth", "step" or "reproduction"."""
    kind: str
    """The class of the part, or "" for the engine."""
    hook: str
    scope: str
    """"agent", "world" or "population"; for the engine, the text of the row."""
    writes: str
    """The data that the hook may write, and its return value."""
    condition: str = ""
    """When the engine calls the hook, if it does not call it always."""


OF_PART: Final = "arrays of the part"

CALLS: Final = (
    Call("founders", "Variation", "init_founders", "population", "`genome`"),
    Call(
        "birth",
        "",
        "",
        "Load weights, genes of further modules and learning rate of each agent; reset the senses.",
        "",
    ),
    Call("birth", "LearningRule", "load_genes", "agent", f"column of the agent in the {OF_PART}"),
    Call("birth", "WorldFeature", "init_world", "world", OF_PART),
    Call(
        "birth",
        "WorldFeature",
        "blocks_placement",
        "position",
        "nothing; it returns a bool",
        "for each candidate birthplace",
    ),
    Call(
        "birth",
        "LearningRule",
        "init_agent",
        "agent",
        f"column of the agent in the {OF_PART} and in `state`",
    ),
    Call(
        "birth",
        "WorldFeature",
        "blocks_placement",
        "position",
        "nothing; it returns a bool",
        "for each candidate position of an item",
    ),
    Call("step", "Sense", "prepare_senses", "world", f"{OF_PART}, and per-agent arrays of `state`"),
    Call(
        "step",
        "Sense",
        "sense",
        "agent",
        f"column of the agent in the {OF_PART}; it returns the inputs as bits",
        "if `is_continuous` is false",
    ),
    Call(
        "step",
        "Sense",
        "measure",
        "agent",
        f"`state.activations` from row `first`, and the {OF_PART}",
        "if `is_continuous` is true",
    ),
    Call(
        "step",
        "WorldFeature",
        "blocks_sight",
        "position",
        "nothing; it returns a mask",
        "for each item in the visual range",
    ),
    Call("step", "Network", "forward", "agent", "`activations`"),
    Call("step", "Body", "choose_action", "agent", "`state.action`"),
    Call(
        "step", "", "", "Replace the action by a random one with the probability `motor.noise`.", ""
    ),
    Call("step", "Body", "move", "agent", "`state.positions`, `state.heading`"),
    Call(
        "step",
        "WorldFeature",
        "blocks_movement",
        "position",
        "nothing; it returns a mask",
        "at the position after the move",
    ),
    Call(
        "step",
        "LearningRule",
        "observe_others",
        "world",
        f"{OF_PART}, and per-agent arrays of `state`",
    ),
    Call(
        "step",
        "LearningRule",
        "learn",
        "agent",
        f"`state.weights`, `state.errors`, and the {OF_PART}",
        "in the first `learning.steps` steps, or in all steps",
    ),
    Call(
        "step",
        "Network",
        "backward",
        "agent",
        "`weights`, `errors`",
        "if the learning rule calls it",
    ),
    Call("step", "", "", "Agents eat the items that they touch; each item reappears.", ""),
    Call(
        "step",
        "WorldFeature",
        "end_step",
        "world",
        f"{OF_PART}, items and per-agent arrays of `state`",
    ),
    Call("step", "Fitness", "end_step", "world", f"{OF_PART}, such as its records"),
    Call("step", "Selection", "end_step", "world", f"{OF_PART}, such as its records"),
    Call("reproduction", "Fitness", "evaluate", "population", "`fitness`"),
    Call(
        "reproduction",
        "Stop",
        "should_stop",
        "population",
        "nothing; it returns a bool",
        'if `evolution.stop` is not `"none"`',
    ),
    Call(
        "reproduction",
        "Inheritance",
        "inherit",
        "agent",
        "`inherited`",
        "if `wants_learned` is true",
    ),
    Call(
        "reproduction",
        "Inheritance",
        "assign_teachers",
        "agent",
        "`taught`",
        "if the genome has a second module",
    ),
    Call("reproduction", "Selection", "select_with_genomes", "population", "`parents`"),
    Call(
        "reproduction",
        "Selection",
        "select",
        "population",
        "`parents`",
        "if the part has no `select_with_genomes`",
    ),
    Call(
        "reproduction",
        "Selection",
        "mark_survivors",
        "population",
        "the first `count` rows of `parents`",
        "`count` is `evolution.elite`",
    ),
    Call("reproduction", "Variation", "vary_population", "population", "`children`"),
    Call(
        "reproduction",
        "Variation",
        "vary",
        "child",
        "`child`",
        "if the part has no `vary_population`",
    ),
)
"""Calls in one generation, in order. Network.links is called only to draw a network."""

STAGES: Final = {
    "founders": "First generation",
    "birth": "Start of a lifetime",
    "step": "Each step",
    "reproduction": "Between two generations",
}
