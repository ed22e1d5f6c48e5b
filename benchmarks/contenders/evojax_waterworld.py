"""The multi-agent WaterWorld of EvoJAX, a published task, with EvoJAX's simulation manager.

Source: Tang, Tian and Ha, *EvoJAX: Hardware-Accelerated Neuroevolution* (GECCO 2022, arXiv
2202.05008), and its `evojax.task.ma_waterworld`.

Common features with baldwinlab: many agents in a square world, each with its network, and items to
collect. Differences: 182 inputs instead of 3 (30 range sensors of 6 numbers, and the velocity),
moving items of which half are poison, no reappearing items, walls, 4 random actions, and no
learning.
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

from benchmarks.setting import Genomes, Setting, Simulate

WORLDS = 16
# EvoJAX stores every observation, so lifetimes are short.
STEPS = 100


def agent_steps(setting: Setting) -> int:
    return WORLDS * setting.agents * min(STEPS, setting.steps)


def prepare(setting: Setting, genomes: Genomes) -> Simulate:
    """Return a function that simulates as many agents, items and hidden units as in `setting`.

    `genomes` do not fit these networks and are not used.
    """
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

    def simulate(seed: int) -> None:
        weights = jax.random.normal(
            jax.random.key(seed), (setting.agents, network.num_params), jnp.float32
        )
        # The conversion waits for the scores.
        np.asarray(manager.eval_params(weights, test=False)[0])

    return simulate
