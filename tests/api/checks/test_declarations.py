"""Oracles: their arguments, and the hooks that no oracle verifies."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from textwrap import dedent, indent

import pytest

import baldwinlab as bl
from baldwinlab.api.checks.declarations import (
    ORACLES,
    require_signature,
    unverified_hooks,
    verified_hooks,
)
from baldwinlab.api.checks.findings import FailsError
from baldwinlab.experiment import registry
from baldwinlab.parts.loading import load_file, parts_in
from tests.oracles.parts import BUILT_IN_ORACLES, use_oracles

Write = Callable[[str], Path]

HOOKS = {
    "learning rule": ("LearningRule", "def learn(part, model, state, step, lane)"),
    "network": ("Network", "def forward(part, weights, activations, lane)"),
    "body": ("Body", "def move(part, model, state, lane)"),
    "sense": ("Sense", "def sense(part, model, state, world, agent)"),
    "world feature": ("WorldFeature", "def blocks_movement(part, model, x, y)"),
    "selection": ("Selection", "def select(part, generation)"),
    "variation": ("Variation", "def vary(part, mating)"),
    "variation with genes": ("Variation", "def vary(part, mating)"),
    "vary_population": ("Variation", "def vary_population(part, brood)"),
    "inheritance": ("Inheritance", "def inherit(part, innate_genome, learned, inherited_genome)"),
    "fitness": ("Fitness", "def evaluate(part, lifetimes, fitness)"),
    "stop": ("Stop", "def should_stop(part, lifetimes, fitness, generation)"),
}
"""The class and a hook, by key of `ORACLES`."""


def write_class(kind: str, *methods: str, name: str = "some-part") -> str:
    """Return a file with a part whose static methods do nothing."""
    base, hook = HOOKS[kind]
    bodies = "".join(f"@staticmethod\n{method}:\n    pass\n" for method in (hook, *methods))
    head = f"from baldwinlab.parts import Gene, {base}\n\nclass Part({base}, name={name!r}):\n"
    genes = "genes = {'size': Gene(initial=1, low=1, high=2)}\n" if "genes" in kind else ""
    return head + indent(genes + bodies, "    ")


@pytest.mark.parametrize("kind", ORACLES)
def test_an_oracle_with_wrong_arguments_is_refused_with_the_expected_ones(
    write_part: Write, kind: str
) -> None:
    arguments = "(part, fitness, agent, a, b, c, d)"
    wrong = f"def oracle{arguments}"
    (part,) = parts_in(load_file(write_part(write_class(kind, wrong))))
    expected = f"oracle({ORACLES[kind].arguments})"
    with pytest.raises(FailsError) as refused:
        require_signature(part)
    message = str(refused.value)
    assert f"{part.kind} 'some-part': oracle has the arguments {arguments}" in message
    assert f"it must be a static method {expected}" in message


@pytest.mark.parametrize("kind", ORACLES)
def test_an_oracle_with_the_arguments_of_its_kind_verifies_a_hook(
    write_part: Write, kind: str
) -> None:
    right = f"def oracle({ORACLES[kind].arguments})"
    (part,) = parts_in(load_file(write_part(write_class(kind, right))))
    require_signature(part)
    assert len(verified_hooks(part)) == 1


def test_every_oracle_of_a_built_in_part_has_the_arguments_of_its_kind() -> None:
    with use_oracles():
        for part in BUILT_IN_ORACLES:
            require_signature(part)
    # Of the features of worlds, only walls have an oracle.
    kinds = registry.BUILT_IN.keys() - {"model", "world feature"}
    parts = {
        registry.find_class(kind, name) for kind in kinds for name in registry.package_parts(kind)
    }
    # The parts "none" do nothing.
    assert {part.name for part in parts - {*BUILT_IN_ORACLES}} == {"none"}


def test_an_oracle_that_is_not_a_static_method_is_refused(write_part: Write) -> None:
    text = write_class("fitness") + "\n    def oracle(self, lifetimes):\n        pass\n"
    (part,) = parts_in(load_file(write_part(text)))
    with pytest.raises(
        FailsError,
        match=r"oracle is not a static method; it must be .* oracle\(part, lifetimes\)",
    ):
        require_signature(part)


def test_the_message_about_a_wrong_oracle_names_the_hook_that_defines_its_arguments(
    write_part: Write,
) -> None:
    path = write_part(
        write_class("vary_population", "def oracle(part, fitter, second)", name="pool")
    )
    findings = bl.check_part(path, requirements=["signature"])
    failed = [str(finding) for finding in findings if finding.holds is False]
    message = (
        "does not hold: its oracle has the arguments of its kind: variation 'pool': "
        "oracle has the arguments (part, fitter, second); "
        "it must be a static method oracle(part, genome, fitness, parents, draws), "
        "because it has `vary_population`; "
    )
    assert len(failed) == 1
    assert failed[0].startswith(message)


TWO_PARTS = """
    import numpy as np
    from baldwinlab.models.miniworld.learning.teachers import SelfTaught
    from baldwinlab.parts import Fitness, LearningRule, WorldFeature

    class Verified(Fitness, name="verified"):
        @staticmethod
        def evaluate(part, lifetimes, fitness):
            for agent in range(fitness.size):
                fitness[agent] = lifetimes.energy[agent]

        @staticmethod
        def oracle(part, lifetimes):
            return lifetimes.energy

    class Tick(WorldFeature, name="tick"):
        @staticmethod
        def init_world(part, model, state, world):
            pass

        @staticmethod
        def end_step(part, model, state, world, step):
            pass

    class Copy(LearningRule, name="copy"):
        modules = ("action", "reinforcement")
        learn = staticmethod(SelfTaught.learn)
"""


def test_each_hook_without_an_oracle_has_a_line(
    write_part: Write, without_compilation: None
) -> None:
    path = write_part(dedent(TWO_PARTS))
    findings = bl.check_part(path, requirements=["oracle"])
    # `Copy` has a hook of the package, which needs no oracle.
    assert [str(finding) for finding in findings[1:]] == [
        "ok: the oracle agrees, step by step (fitness 'verified': evaluate)",
        "not verified: it has no oracle: world feature 'tick', init_world",
        "not verified: it has no oracle: world feature 'tick', end_step",
    ]


def test_a_variation_without_an_oracle_is_not_verified(
    write_part: Write, without_compilation: None
) -> None:
    text = """
        from baldwinlab.parts import Variation

        class Copies(Variation, name="copies"):
            @staticmethod
            def vary(part, mating):
                mating.child[:] = mating.fitter
        """
    findings = bl.check_part(write_part(dedent(text)), requirements=["oracle"])[1:]
    assert [str(finding) for finding in findings] == [
        "not verified: it has no oracle: variation 'copies', vary"
    ]
    assert findings[0].holds is None


def test_an_oracle_of_positions_does_not_verify_the_end_of_a_step(write_part: Write) -> None:
    methods = ("def end_step(part, model, state, world, step)", "def oracle(part, x, y, dx, dy)")
    (part,) = parts_in(load_file(write_part(write_class("world feature", *methods))))
    assert list(unverified_hooks(part)) == [("end_step", "its oracle does not cover this hook")]


def test_an_error_of_an_oracle_names_the_line(write_part: Write, without_compilation: None) -> None:
    text = """
        from baldwinlab.parts import Fitness

        class Part(Fitness, name="raises"):
            @staticmethod
            def evaluate(part, lifetimes, fitness):
                for agent in range(fitness.size):
                    fitness[agent] = lifetimes.energy[agent]

            @staticmethod
            def oracle(part, lifetimes):
                return lifetimes.energy + None
        """
    path = write_part(dedent(text))
    findings = bl.check_part(path, requirements=["oracle"])
    (message,) = [finding.message for finding in findings if finding.holds is False]
    assert message.startswith("fitness 'raises': its oracle fails: TypeError: ")
    assert message.endswith(f"({path.name}:12)")
