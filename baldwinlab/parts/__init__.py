"""Parts of one's own: everything that a file with a part needs, and how such a file is loaded.

    from baldwinlab.parts import Field, LearningRule, get, put

A part is a class derived from its kind (`baldwinlab.parts.kinds` says which phases each has), with a name; docs/changing-the-model.md
lists the kinds, each with its example. Importing a file with a part makes the part known; so does `load_file`, and so does an entry
point of the group `baldwinlab.parts`.
"""

from pydantic import Field

from baldwinlab.engine.jit import compiled
from baldwinlab.engine.lanes import any_of, bundle, choose, get, negated, put
from baldwinlab.engine.phases import per_agent, per_world
from baldwinlab.engine.rng import philox, unit
from baldwinlab.experiment.fields import Fields
from baldwinlab.parts.foreign import PartError, Source, load_entry_points, load_file, sources_of
from baldwinlab.parts.kinds import (
    Body,
    ItemRegion,
    LearningRule,
    Network,
    Part,
    Sense,
    WorldFeature,
    backward,
    forward,
)

__all__ = [
    "Body",
    "Field",
    "Fields",
    "ItemRegion",
    "LearningRule",
    "Network",
    "Part",
    "PartError",
    "Sense",
    "Source",
    "WorldFeature",
    "any_of",
    "backward",
    "bundle",
    "choose",
    "compiled",
    "forward",
    "get",
    "load_entry_points",
    "load_file",
    "negated",
    "per_agent",
    "per_world",
    "philox",
    "put",
    "sources_of",
    "unit",
]
