"""Draw figures with Matplotlib: each function takes labeled arrays and returns a `Figure`.

Figures are drawn without a display.
"""

from baldwinlab.analysis.figures.boxes import describe_p_values, draw_fitness_boxes
from baldwinlab.analysis.figures.emergence import draw_emergence, draw_trajectories
from baldwinlab.analysis.figures.fitness import draw_fitness_curves
from baldwinlab.analysis.figures.measures import (
    MeasureValues,
    draw_fitness_by_evaluations,
    draw_measures,
    draw_shares,
    draw_survival,
)
from baldwinlab.analysis.figures.networks import AgentKind, draw_networks
from baldwinlab.analysis.figures.style import SavedFigure, render_figure, save_figure, to_svg
from baldwinlab.analysis.figures.world import (
    Appearance,
    SensorSector,
    draw_agent_senses,
    draw_world_maps,
    group_sectors,
)

__all__ = [
    "AgentKind",
    "Appearance",
    "MeasureValues",
    "SavedFigure",
    "SensorSector",
    "describe_p_values",
    "draw_agent_senses",
    "draw_emergence",
    "draw_fitness_boxes",
    "draw_fitness_by_evaluations",
    "draw_fitness_curves",
    "draw_measures",
    "draw_networks",
    "draw_shares",
    "draw_survival",
    "draw_trajectories",
    "draw_world_maps",
    "group_sectors",
    "render_figure",
    "save_figure",
    "to_svg",
]
