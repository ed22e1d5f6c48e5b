"""What views of a model show: data that fits together, the same a second time, of genomes that are left as they are."""

from __future__ import annotations

from baldwinlab.api.checks.findings import FailsError
from baldwinlab.api.checks.fixture import Subject, is_of_miniworld
from baldwinlab.evolution import GenerationKey, draw_genomes
from baldwinlab.parts.views import arrays_of


def views_are_sound(subject: Subject) -> str:
    """Of newborns, the first agent and the last."""
    if is_of_miniworld(subject.experiment) or not subject.experiment.of_model.views:
        return "it declares none"
    model, key = subject.experiment.of_model, GenerationKey(subject.seed, 0, 0)
    genomes = draw_genomes(subject.experiment, key)
    for name, view in model.views.items():
        for agent in (0, len(genomes) - 1):
            given = genomes.copy()
            try:
                once, again = (arrays_of(view.of(model, key, given, agent)) for _ in range(2))
            except ValueError as error:
                raise FailsError(f"the view {name!r} of agent {agent}: {error}") from None
            if (given != genomes).any():
                raise FailsError(f"the view {name!r} changes the genomes that it is given")
            if any(once[each].tobytes() != again[each].tobytes() for each in once):
                raise FailsError(
                    f"the view {name!r} of agent {agent} differs from what it showed before"
                )
    return ", ".join(model.views)
