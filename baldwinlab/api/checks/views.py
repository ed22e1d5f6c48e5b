"""Check that the views of a model return consistent, reproducible data and change no genomes."""

from __future__ import annotations

from baldwinlab.api.checks.findings import FailsError
from baldwinlab.api.checks.fixture import PartGroup, is_of_miniworld
from baldwinlab.evolution import GenerationKey, draw_genomes
from baldwinlab.parts.views import arrays_of


def check_views(group: PartGroup) -> str:
    """Check the views of the first and the last newborn."""
    if is_of_miniworld(group.experiment) or not group.experiment.model_part.views:
        return "it declares none"
    model = group.experiment.model_part
    key = GenerationKey(group.seed, 0, 0)
    genomes = draw_genomes(group.experiment, key)
    for name, view in model.views.items():
        for agent in (0, len(genomes) - 1):
            copy = genomes.copy()
            try:
                first, second = (
                    arrays_of(view.make_data(model, key, copy, agent)) for _ in range(2)
                )
            except ValueError as error:
                raise FailsError(f"the view {name!r} of agent {agent}: {error}") from None
            if (copy != genomes).any():
                raise FailsError(f"the view {name!r} changes the genomes that it is given")
            if any(first[array].tobytes() != second[array].tobytes() for array in first):
                raise FailsError(f"the view {name!r} of agent {agent} differs when it is repeated")
    return ", ".join(model.views)
