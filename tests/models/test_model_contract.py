"""Every model of the registry has founders, lifetimes, measures and views as it declares them."""

from __future__ import annotations

from functools import cache
from typing import Any

import numpy as np
import pytest

import baldwinlab as bl
from baldwinlab import papers
from baldwinlab.evolution import GenerationKey
from baldwinlab.experiment import ExperimentError, assign
from baldwinlab.experiment.registry import LIBRARY, table_name
from baldwinlab.experiment.toml import from_toml, to_toml
from baldwinlab.parts import Model
from baldwinlab.parts.views import arrays_of
from baldwinlab.simulation.records import make_run_dataset
from baldwinlab.simulation.simulate import simulate_histories
from tests.evolution.single_runs import draw_genomes

# Settings of short lifetimes, with learning.
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
MODELS = tuple(LIBRARY["model"])
AGENTS = 12
SEED = 5
GENERATION = 33
RUNS = (2, 7)


@cache
def make_short_model(name: str) -> Model:
    experiment = assign(bl.load(name), SHORT_RUNS.get(name, []))
    model: Model = experiment.model_part
    return model


def draw_founders(model: Model) -> Any:
    """Return founders [run, agent, module, weight]."""
    keys = [GenerationKey(SEED, run, 0) for run in RUNS]
    return np.stack([model.founders(AGENTS, key) for key in keys])


@pytest.mark.parametrize("name", MODELS)
def test_founders_have_the_declared_layout_and_alleles(name: str) -> None:
    model = make_short_model(name)
    founders = draw_founders(model)
    assert founders.dtype == np.float32
    assert founders.shape == (2, AGENTS, len(model.modules), model.n_weights())
    assert np.isfinite(founders).all() or model.infinite_genes
    assert not model.alleles or set(np.unique(founders)) <= set(model.alleles.values())


@pytest.mark.parametrize("name", MODELS)
def test_lifetimes_have_the_declared_records_and_do_not_depend_on_other_runs(name: str) -> None:
    model = make_short_model(name)
    founders = draw_founders(model)
    genomes = founders.copy()
    both = model.simulate(SEED, RUNS, GENERATION, genomes)
    np.testing.assert_array_equal(genomes, founders)
    assert both.energy.dtype == both.cost.dtype == np.float64
    assert both.records.keys() == model.records.keys()
    for record, values in both.records.items():
        assert values.dtype == np.dtype(model.records[record].dtype)
        assert values.shape == (2, AGENTS)
    assert both.learned is None or both.learned.dtype == np.float32
    single = model.simulate(SEED, RUNS[1:], GENERATION, founders[1:])
    np.testing.assert_array_equal(both.energy[1], single.energy[0])
    np.testing.assert_array_equal(both.cost[1], single.cost[0])
    for record, values in both.records.items():
        np.testing.assert_array_equal(values[1], single.records[record][0])
    if both.learned is not None and single.learned is not None:
        assert both.learned.shape == (2, AGENTS, model.n_weights())
        np.testing.assert_array_equal(both.learned[1], single.learned[0])


@pytest.mark.parametrize("model", SHORT_RUNS)
def test_a_run_is_bit_identical_in_a_batch(model: str) -> None:
    short = ["evolution.generations=4", "evolution.elite=0", "record.genome_every=1"]
    if model != "erl-populations":
        short += ["population.size=20"]
    experiment = assign(bl.load(model), [*short, *SHORT_RUNS[model]])
    datasets = [
        make_run_dataset(history) for history in simulate_histories(experiment, 4, [0, 1, 5])
    ]
    assert not datasets[0].energy.equals(datasets[1].energy)
    for run, dataset in zip((0, 1, 5), datasets, strict=True):
        assert dataset.equals(bl.simulate(experiment, seed=4, run=run))


@pytest.mark.parametrize("name", MODELS)
def test_without_learning_a_model_does_not_learn_and_has_no_cost(name: str) -> None:
    model = make_short_model(name)
    control = model.without_learning()
    assert not control.learns
    assert control.without_learning() == control
    results = control.simulate(SEED, RUNS, GENERATION, draw_founders(control))
    assert (results.cost == 0).all()


@pytest.mark.parametrize("name", MODELS)
def test_declared_names_are_those_of_settings_and_records(name: str) -> None:
    model = make_short_model(name)
    settings = {model.learning_amount, model.lifetime_steps, *model.settings_without_learning}
    assert settings - {""} <= set(type(model).model_fields)
    records = {model.clock, model.innate_trait, model.learning_time}
    assert records - {""} <= set(model.records)
    assert {model.learned_distance} - {""} <= {*model.records, *model.shares}
    assert model.steps >= 1
    assert model.assimilation_obstacle == "" or model.assimilation_obstacle.endswith(".")


@pytest.mark.parametrize("name", MODELS)
def test_measures_have_one_value_per_run(name: str) -> None:
    short = [*SHORT_RUNS.get(name, []), "evolution.generations=2", "evolution.elite=0"]
    size = [] if name == "erl-populations" else [f"population.size={AGENTS}"]
    experiment = assign(bl.load(name), [*short, *size])
    runs = bl.simulate(experiment, seed=SEED).expand_dims(run=[0])
    for measure in experiment.model_part.all_measures().values():
        assert measure.of(runs).dims == ("run",)
    for share in experiment.model_part.all_shares().values():
        assert set(share.of(runs).dims) == {"run", "generation"}


def test_views_have_arrays() -> None:
    models = [model for model in map(make_short_model, MODELS) if model.views]
    assert models
    key = GenerationKey(SEED, RUNS[0], GENERATION)
    for model in models:
        for view in model.views.values():
            assert view.description.endswith(".")
            assert arrays_of(view.make_data(model, key, draw_founders(model)[0], 1))


@pytest.mark.parametrize("name", MODELS)
def test_settings_are_written_and_read(name: str) -> None:
    experiment = assign(bl.load(name), [*SHORT_RUNS.get(name, []), "evolution.generations=2"])
    assert from_toml(to_toml(experiment), source="file") == experiment


@pytest.mark.parametrize("name", MODELS)
def test_numbers_beyond_their_limits_are_refused(name: str) -> None:
    experiment = bl.load(name)
    limits: list[tuple[str, Any]] = [
        (f"{table_name(name)}.{setting}", limit)
        for setting, field in type(experiment.model_part).model_fields.items()
        for limit in field.metadata
    ]
    values = [
        *((path, limit.ge - 1) for path, limit in limits if hasattr(limit, "ge")),
        *((path, limit.gt) for path, limit in limits if hasattr(limit, "gt")),
        *((path, limit.le + 1) for path, limit in limits if hasattr(limit, "le")),
    ]
    assert values
    for path, value in values:
        with pytest.raises(ExperimentError, match=rf"^{path} = {value}: input should be "):
            assign(experiment, [f"{path}={value}"])


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


# Condition with learning -> its control without learning, on the same map.
CONTROLS = {
    "ackley-littman-1991": {"ERL": "E", "L": "F"},
    "borenstein-2006": {"learning-walk": "fixed-walk", "random-walk": "fixed-walk"},
    "hinton-nowlan-1987": {"guessing": "never-guessing"},
    "keesing-stork-1991": {"trials-20": "trials-0", "trials-320": "trials-0"},
    "lande-2009": {"plastic-norms": "fixed-norms"},
    "le-2018": {"guessing": "not-guessing"},
    "mayley-1996": {"climbing": "not-climbing", "costly-climbing": "not-climbing"},
    "mery-kawecki-2004": {"learning-flies": "innate-flies"},
    "nolfi-elman-parisi-1994": {"predicting": "predicting-rate-0"},
    "nolfi-parisi-1993": {"auto-teaching": "auto-teaching-rate-0"},
    "paenke-2007": {"stepping": "not-stepping"},
    "soltoggio-2008": {"plain-plasticity": "no-plasticity"},
    "suzuki-arita-2004": {"meta-pavlov": "no-meta-pavlov"},
    "todd-miller-1991": {"hebbian": "not-hebbian"},
    "whitley-1994": {"baldwinian": "genetic-search", "lamarckian": "genetic-search"},
}


@pytest.mark.parametrize("paper", CONTROLS)
def test_a_control_of_a_paper_is_its_condition_without_learning(paper: str) -> None:
    for learner, control in CONTROLS[paper].items():
        for suffix in [f"/{name}" for name in papers.load(paper).names("maps")] or [""]:
            model = bl.load(f"{paper}:{learner}{suffix}").model_part
            assert model.learns
            expected = bl.load(f"{paper}:{control}{suffix}").model_part
            assert model.without_learning() == expected


# An experiment, changes of its settings, and mean and standard deviation of all genes of founders.
FOUNDERS = [
    ("bandit-explorers", "", 5, 10 / 12**0.5),
    ("cell-foragers", "", 0, 1 / 3**0.5),
    ("egg-layers", "egg_layers.initial_std=0.4", -2, 0.4),
    ("function-climbers", "", 0.5, 0.5),
    ("hinton-nowlan", "", 0.5, 8**-0.5),
    ("light-switch", "", 0.5, 0.5),
    ("moving-needle", "", 0.5, 8**-0.5),
    ("moving-optimum", "moving_optimum.initial_std=0.4", 0, 0.4),
    ("plastic-elements", "", 0.5, 0),
    ("plastic-elements", "plastic_elements.initial_unset_share=0.5", 0.5, 8**-0.5),
    ("plastic-prisoners", "", 0.5, 0.5),
    ("slope-climbers", "slope_climbers.initial_std=0.3", 0.75, 0.3),
    ("t-mazes", "", 0, 1 / 3**0.5),
    ("two-state-forager", "", 0.5, 0.5),
]


@pytest.mark.parametrize(("name", "change", "mean", "std"), FOUNDERS)
def test_genes_of_founders_have_their_distribution(
    name: str, change: str, mean: float, std: float
) -> None:
    experiment = assign(bl.load(name), [*change.split(), "population.size=4000"])
    genes = draw_genomes(experiment, GenerationKey(SEED, 0, 0)).astype(np.float64)
    for position in np.ndindex(genes.shape[1:]):
        sample = genes[:, *position]
        assert sample.mean() == pytest.approx(mean, abs=5 * std / len(sample) ** 0.5)
        assert sample.std() == pytest.approx(std, rel=0.1)
