"""EvoJAX's multi-agent WaterWorld, a published task of its own, through EvoJAX's simulation manager (scan over steps).

Source: Tang, Tian and Ha, *EvoJAX: Hardware-Accelerated Neuroevolution* (GECCO 2022, arXiv 2202.05008), and its
`evojax.task.ma_waterworld`.

Like ours: many agents in a square world, each with a network of its own and items to collect. Unlike ours: 30 range sensors of
6 numbers (and 2 of the agent's own velocity), so 182 inputs to 3; items move, half are poison, and none reappears; walls; 4
actions, drawn at random by the outputs; no learning in life.
"""

from __future__ import annotations

import logging

import jax
import jax.numpy as jnp
import numpy as np
from evojax.obs_norm import ObsNormalizer
from evojax.policy import MLPPolicy
from evojax.sim_mgr import SimManager
from evojax.task.ma_waterworld import MultiAgentWaterWorld

from benchmarks.setting import Genomes, Live, Setting

WORLDS, STEPS = 16, 100  # few steps, as it keeps every observation


def agent_steps(setting: Setting) -> int:
    return WORLDS * setting.agents * min(STEPS, setting.steps)


def lives(setting: Setting, genomes: Genomes) -> Live:
    """As many agents, items and hidden units as in `setting`; `genomes` do not fit these networks and are not used."""
    quiet = logging.getLogger("evojax")
    task = MultiAgentWaterWorld(
        num_agents=setting.agents, num_items=setting.items, max_steps=min(STEPS, setting.steps)
    )
    network = MLPPolicy(
        task.obs_shape[-1],
        [setting.hidden],
        task.act_shape[-1],
        output_act_fn="softmax",
        logger=quiet,
    )
    manager = SimManager(
        n_repeats=WORLDS,
        test_n_repeats=1,
        pop_size=setting.agents,
        n_evaluations=1,
        policy_net=network,
        train_vec_task=task,
        valid_vec_task=task,
        obs_normalizer=ObsNormalizer(task.obs_shape, dummy=True),
        logger=quiet,
    )

    def live(seed: int) -> None:
        weights = jax.random.normal(
            jax.random.key(seed), (setting.agents, network.num_params), jnp.float32
        )
        np.asarray(manager.eval_params(weights, test=False)[0])  # waits for the scores

    return live
