"""Reaction norms of conditions in different worlds are in different panels."""

from __future__ import annotations

from baldwinlab.analysis.assays.reaction_panels import make_reaction_panels
from tests.analysis.assays.artificial_assays import reaction


def test_models_without_maps_have_separate_panels() -> None:
    names = ("evo/A", "evo+self-taught/A", "evo/B")
    worlds = ("first", "first", "second")
    stored = {
        name: reaction(name, 60).assign_attrs(map="", world=world)
        for name, world in zip(names, worlds, strict=True)
    }
    panels = make_reaction_panels(stored)
    assert [list(panel.norms) for panel in panels[:2]] == [[*names[:2]], ["evo/B"]]
    assert {panel.map for panel in panels} == {""}
