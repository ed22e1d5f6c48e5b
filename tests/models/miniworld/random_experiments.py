"""Random experiments in small worlds with many agents and items."""

from __future__ import annotations

from typing import Any

from hypothesis import strategies as st

from baldwinlab.experiment import Experiment, validate


@st.composite
def food_regions(draw: st.DrawFn, width: int, height: int) -> dict[str, Any]:
    """Draw a food region of a map with these sizes."""

    def draw_edges(size: int) -> list[float]:
        low = draw(st.integers(0, size - 1))
        return [low, draw(st.integers(low + 1, size))]

    energy = draw(st.sampled_from([1, 0, 2.5]))
    # The engine processes items in blocks of sixteen.
    count = draw(st.integers(0, 6) | st.sampled_from([15, 16, 17, 33]))
    return {"x": draw_edges(width), "y": draw_edges(height), "count": count, "energy": energy}


@st.composite
def learning_settings(draw: st.DrawFn) -> dict[str, Any]:
    """Draw the settings of learning."""
    rule = draw(st.sampled_from(["self-taught", "none"]))
    rate = draw(st.sampled_from([0.01, 0, 0.3, 1]))
    steps = draw(st.sampled_from([10**8, 10**8, 0, 7]))
    # Results in float32 and float64 differ too much at rates far above 1.
    evolved_rate = rule != "none" and rate == 0.01 and draw(st.booleans())
    # Without learning, the other settings have no effect, and are refused.
    if rule == "none":
        return {"rule": rule}
    return {"rule": rule, "rate": rate, "steps": steps, "evolved_rate": evolved_rate}


@st.composite
def experiments(draw: st.DrawFn, update: str) -> Experiment:
    """Draw an experiment in which agents see items, compete and eat."""
    width = draw(st.integers(20, 110))
    height = draw(st.integers(20, 110))
    half = min(width, height) / 2
    start: dict[str, Any] = {
        "x": draw(st.integers(0, width - 1)),
        "y": draw(st.integers(0, height - 1)),
        "radius": draw(st.integers(0, 20)) * half / 20,
    }
    learning = draw(learning_settings())
    start["headings"] = draw(st.sampled_from(["equal", "random"]))
    food = draw(st.lists(food_regions(width, height), min_size=1, max_size=3))
    experiment: Experiment = validate(
        {
            "name": "random",
            "world": {"width": width, "height": height, "start": start, "food": food},
            "population": {"size": draw(st.integers(1, 6))},
            "senses": {
                "visual_radius": min(draw(st.sampled_from([40, 4, 10, 20])), half),
                "boundaries": draw(st.sampled_from(["closed", "open"])),
            },
            "contact": {
                "shape": draw(st.sampled_from(["circle", "square"])),
                "reach": min(draw(st.sampled_from([10, 5, 2, 7.5])), half),
            },
            "network": {
                "hidden": draw(st.lists(st.integers(1, 12), max_size=2)),
                "biases": draw(st.booleans()),
            },
            "learning": learning,
            "motor": {"noise": draw(st.sampled_from([0, 0, 0.2]))},
            "evolution": {
                "generations": 2,
                "inheritance": draw(st.sampled_from(["darwinian", "none"])),
            },
            "lifetime": {"steps": draw(st.integers(1, 60)), "update": update},
        }
    )
    return experiment
