"""One figure, one function: labelled arrays in, a Matplotlib `Figure` out. Nothing here draws on a screen."""

from baldwinlab.analysis.figures.emergence import emergence, trajectories
from baldwinlab.analysis.figures.fitness import fitness_boxes, fitness_curves
from baldwinlab.analysis.figures.measures import Measured, clocks, measures, shares, survival
from baldwinlab.analysis.figures.networks import Kind, networks
from baldwinlab.analysis.figures.overview import overview, standings
from baldwinlab.analysis.figures.style import save, svg
from baldwinlab.analysis.figures.world import Look, agent_senses, sectors, world_maps

__all__ = [
    "Kind",
    "Look",
    "Measured",
    "agent_senses",
    "clocks",
    "emergence",
    "fitness_boxes",
    "fitness_curves",
    "measures",
    "networks",
    "overview",
    "save",
    "sectors",
    "shares",
    "standings",
    "survival",
    "svg",
    "trajectories",
    "world_maps",
]
