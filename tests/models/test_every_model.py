"""Test what all models share: runs do not depend on their batch, and invalid settings are refused.

The checks of parts (tests/parts/test_contract.py) compare all models in the nightly tests.
"""

from __future__ import annotations

import pytest

import baldwinlab as bl
from baldwinlab.experiment import ExperimentError, assign
from baldwinlab.simulation.simulate import simulate_histories

SHORT_RUNS = {
    "cell-foragers": ["cell_foragers.environments=6", "cell_foragers.steps_per_environment=30"],
    "erl-populations": [
        *("erl_populations.max_steps=200", "erl_populations.grid_size=20"),
        *("erl_populations.initial_agents=12", "erl_populations.max_agents=40"),
        *("erl_populations.initial_plants=60", "erl_populations.trees=5"),
        *("erl_populations.initial_carnivores=2", "erl_populations.sprouts_per_step=3"),
    ],
    "light-switch": ["light_switch.encoding=synapses", "light_switch.steps_per_life=200"],
    "neat-poles": ["neat_poles.max_steps=60"],
    "neat-poles-without-velocities": ["neat_poles_without_velocities.max_steps=150"],
    "neat-xor": ["neat_xor.max_links=20"],
    "plastic-prisoners": [],
    "t-mazes": [],
}


@pytest.mark.parametrize("model", SHORT_RUNS)
def test_a_run_is_bit_identical_in_a_batch(model: str) -> None:
    short = ["evolution.generations=4", "evolution.elite=0", "record.genome_every=1"]
    if model != "erl-populations":
        short += ["population.size=20"]
    experiment = assign(bl.load(model), [*short, *SHORT_RUNS[model]])
    datasets = [history.dataset() for history in simulate_histories(experiment, 4, [0, 1, 5])]
    assert not datasets[0].energy.equals(datasets[1].energy)
    for run, dataset in zip((0, 1, 5), datasets, strict=True):
        assert dataset.equals(bl.simulate(experiment, seed=4, run=run))


# An experiment, a change of its settings and the beginning of the error.
REFUSALS = [
    (
        *("baldwinian/deceptive", "evolution.lamarckian_share=0.5"),
        r"evolution\.lamarckian_share = 0\.5 must be 0 or 1 with the model",
    ),
    (
        *("climbing/rugged", "nk_climbers.bits=8 nk_climbers.k=8"),
        r"nk_climbers\.k = 8 must be less than nk_climbers\.bits = 8",
    ),
    ("equal", "plastic_elements.success_probabilities=[2]", r"success_probabilities\.0"),
    (
        *("equal", "plastic_elements.weights=[1,2]"),
        r"plastic_elements\.weights has 2 numbers; .* needs as many as .* 8",
    ),
    (
        *("equal", "plastic_elements.prerequisites=[0,2,0,0,0,0,0,0]"),
        r"prerequisites: element 2 needs element 2; .* with a smaller number, or 0",
    ),
    (
        *("erl-populations", "erl_populations.max_agents=50"),
        r"erl_populations\.max_agents = 50 must be at least erl_populations\.initial_agents = 100",
    ),
    (
        "evo/A",
        "evolution.variation=one-point-alleles evolution.one_point_alleles.mutation_law=founders",
        r"mutation_law = 'founders' needs a model with .* and not 'miniworld'",
    ),
    *(
        ("evo/A", f"evolution.{choice}", r"needs genomes that are graphs: those of network\.kind")
        for choice in ("selection=species", "variation=neat")
    ),
    ("fixed-walk/slope", "evolution.elite=2", r"evolution\.elite = 2"),
    (
        *("fixed-walk/slope", "lattice_walkers.slope=0 lattice_walkers.roughness=1"),
        r"lattice_walkers\.roughness = 1 must be less than 1 \+ lattice",
    ),
    (
        *("guessing", "evolution.variation=one-point-of-units"),
        r"variation = 'one-point-of-units' is only for the model 'cue-learners'",
    ),
    ("meta-pavlov", "population.size=1", r"population\.size = 1 must be at least 2"),
    *(
        (
            *(model, "evolution.variation=bit-flips"),
            f"model = '{model}' is bred by evolution.variation = 'neat', and not 'bit-flips'",
        )
        for model in ("neat-xor", "neat-poles", "neat-poles-without-velocities")
    ),
    *(
        ("nk-climbers", f"evolution.fitness={fitness}", f"fitness = '{fitness}' reads positions")
        for fitness in ("distance", "early-food", "novelty")
    ),
    (
        *("stepping/convex", "slope_climbers.curvature=0"),
        r"slope_climbers\.slope and slope_climbers\.curvature are both 0: there is no slope",
    ),
]


@pytest.mark.parametrize(("name", "changes", "message"), REFUSALS)
def test_invalid_settings_are_refused(name: str, changes: str, message: str) -> None:
    with pytest.raises(ExperimentError, match=message):
        assign(bl.load(name), changes.split())
