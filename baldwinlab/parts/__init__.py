"""Kinds of parts, the functions that parts use, and the functions that load files with parts.

For example::

    from baldwinlab.parts import Field, LearningRule, get, put

A part is a subclass of a kind, such as `LearningRule`, with a name. `docs/how-to/write-a-part.md`
shows an example of each kind. An import of the module, `load_file`, or the entry-point group
`baldwinlab.parts` registers the parts of a file.
"""

from typing import Any

from pydantic import Field

from baldwinlab.core.errors import PartError
from baldwinlab.core.variables import PER_AGENT_DIMS, Variable
from baldwinlab.engine.arithmetic import (
    logarithm,
    normal_quantile,
    power_of_ten,
    share_of_turn,
    sigmoid,
)
from baldwinlab.engine.jit import compiled
from baldwinlab.engine.phases import per_agent, per_run, per_world
from baldwinlab.engine.rng import FOUNDER, LIFE, Stream, draw, philox, purpose, uniforms, unit
from baldwinlab.engine.simd import any_of, choose, clamp, get, negated, put, simd_block, square_root
from baldwinlab.experiment.fields import Fields
from baldwinlab.experiment.file import File
from baldwinlab.experiment.measures import Measure
from baldwinlab.parts.births_and_deaths import bear, die, find_free_slot
from baldwinlab.parts.bodies import Body
from baldwinlab.parts.breeding import Fitness, Inheritance, Stop
from baldwinlab.parts.genes import Gene
from baldwinlab.parts.learning_rules import (
    LAYER_VALUES,
    LearningRule,
    Synapse,
    SynapticRule,
    for_each_synapse,
)
from baldwinlab.parts.lifetimes import Lifetimes
from baldwinlab.parts.loading import Source, load_entry_points, load_file, sources_of
from baldwinlab.parts.model_helpers import MODEL_HELPERS, draw_unit, load_model_helper
from baldwinlab.parts.model_part import LifeResults, Model
from baldwinlab.parts.networks import Network, Training, backward, forward
from baldwinlab.parts.part import Part
from baldwinlab.parts.selection import Generation, Selection
from baldwinlab.parts.senses import Sense
from baldwinlab.parts.variation import Brood, Mating, Variation
from baldwinlab.parts.views import GridView, MatrixView, PathView, View
from baldwinlab.parts.world_features import ItemRegion, LineOfSight, WorldFeature

__all__ = [
    "FOUNDER",
    "LAYER_VALUES",
    "LIFE",
    "PER_AGENT_DIMS",
    "Body",
    "Brood",
    "Field",
    "Fields",
    "File",
    "Fitness",
    "Gene",
    "Generation",
    "GridView",
    "Inheritance",
    "ItemRegion",
    "LearningRule",
    "LifeResults",
    "Lifetimes",
    "LineOfSight",
    "Mating",
    "MatrixView",
    "Measure",
    "Model",
    "Network",
    "Part",
    "PartError",
    "PathView",
    "Selection",
    "Sense",
    "Source",
    "Stop",
    "Stream",
    "Synapse",
    "SynapticRule",
    "Training",
    "Variable",
    "Variation",
    "View",
    "WorldFeature",
    "any_of",
    "backward",
    "bear",
    "choose",
    "draw",
    "clamp",
    "compiled",
    "die",
    "draw_unit",
    "find_free_slot",
    "for_each_synapse",
    "forward",
    "get",
    "load_entry_points",
    "load_file",
    "logarithm",
    "negated",
    "normal_quantile",
    "per_agent",
    "per_run",
    "per_world",
    "philox",
    "power_of_ten",
    "purpose",
    "put",
    "share_of_turn",
    "sigmoid",
    "simd_block",
    "sources_of",
    "square_root",
    "uniforms",
    "unit",
    *MODEL_HELPERS,
]


def __getattr__(name: str) -> Any:
    if name in MODEL_HELPERS:
        return load_model_helper(name)
    raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
