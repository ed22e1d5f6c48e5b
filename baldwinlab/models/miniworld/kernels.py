"""What an NVIDIA GPU runs: the birth of a generation, and its life.

A thread is an agent; the agents of a world share a thread block, and all steps are one launch. The phases are the CPU's own
functions, compiled again for a single lane. A thread works on a `State` of its own, of one world and one lane: what only its
agent uses (weights, activations, place) is local to the thread, where the compiler may keep it in registers; the items are the
world's, in global memory, and change only between two barriers.

The bits are those of the CPU: nothing is contracted to fused multiply-adds, and division rounds as IEEE 754 says.
"""

from __future__ import annotations

import functools
import importlib.util
import threading
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from typing import Any, cast

import numpy as np
from numba import config, cuda, float32, int32

from baldwinlab.engine.jit import Function
from baldwinlab.engine.lanes import FOR_ONE_LANE
from baldwinlab.models.miniworld.items import DIAGONAL, eat, grow, image, settle, slots_in_row, tidy, tiles_within, touches
from baldwinlab.models.miniworld.learning import choose_directions, learn, prepare, think
from baldwinlab.models.miniworld.senses import look_out, sense
from baldwinlab.models.miniworld.state import Model, State
from baldwinlab.models.miniworld.world import ZERO, bear, choose_action, move, stumble

COMPILING = threading.Lock()  # so that no thread compiles what another does already

_kernel_options: dict[str, Any] = {}
if not config.ENABLE_CUDASIM and importlib.util.find_spec("numba_cuda"):
    from numba.cuda.core import config as cuda_config
    from numba.cuda.extending import overload

    cuda_config.CUDA_LOW_OCCUPANCY_WARNINGS = 0  # a study of a few runs is one
    _kernel_options["lto"] = False  # optimisation at link time would contract after all
    for _function, _meaning in FOR_ONE_LANE.items():
        overload(_function, strict=False)(lambda *types, meaning=_meaning: meaning)

_device: Callable[[Function], Function] = cuda.jit(device=True)


def _kernel(threads: int) -> Callable[[Function], Function]:
    """Compile a kernel for thread blocks of at most so many threads, which share a processor's registers."""
    bounds = {} if config.ENABLE_CUDASIM else {"launch_bounds": threads}
    return cast(Callable[[Function], Function], cuda.jit(**_kernel_options, **bounds))


@_device
def _copy(rows: Any, lane: int, target: Any, target_lane: int) -> None:
    """Copy one lane of an array [row, lane] to a lane of another."""
    for row in range(target.shape[0]):
        target[row, target_lane] = rows[row, lane]


@_device
def _feed(model: Model, state: State, world: int, lane: int, claim: int, taking: bool) -> bool:
    """Claim every item that the agent touches, or take those where no claim was higher. Returns whether any was touched.

    The same as `eat`, for all agents of a world at once: first they all claim, then, after a barrier, they all take.
    """
    found = False
    for region in range(model.regions.shape[0] if state.alert[lane] != 0 else 0):
        for number in range(model.images[region]):
            x, y = image(model, region, number, state.x[lane], state.y[lane])
            columns = tiles_within(model, region, 0, x, DIAGONAL * model.reach)
            first_row, last_row = tiles_within(model, region, 1, y, DIAGONAL * model.reach)
            for row in range(first_row, last_row):
                begin, end = slots_in_row(model, state, world, region, row, columns)
                for slot in range(begin, end):
                    if touches(model, state, world, slot, x, y):
                        found = True
                        item = state.slot_item[world, slot]
                        if not taking:
                            cuda.atomic.max(state.touched, (world, item), claim)
                        elif state.touched[world, item] == claim:
                            state.touched[world, item] = claim + 1  # no claim is odd: nobody takes it a second time
                            state.eaten[region, lane] += 1
                            grow(model, state, world, region, item)
    return found


@_device
def _own_model(model: Model, sizes: Any, biases: bool, rule: int) -> Model:
    """The model of one world with one agent, whose network is known when it is compiled."""
    return Model(
        worlds=1,
        agents=1,
        width=model.width,
        height=model.height,
        start=model.start,
        random_headings=model.random_headings,
        regions=model.regions,
        region_items=model.region_items,
        region_tiles=model.region_tiles,
        grid=model.grid,
        tile_size=model.tile_size,
        images=model.images,
        cosine=model.cosine,
        sine=model.sine,
        visual_radius=model.visual_radius,
        alert_radius=model.alert_radius,
        open_boundaries=model.open_boundaries,
        square_contact=model.square_contact,
        reach=model.reach,
        motor_noise=model.motor_noise,
        sizes=sizes,
        biases=biases,
        rule=rule,
        learning_steps=model.learning_steps,
    )


@_device
def _own_state(state: State, world: int, lane: int, network: Any, body: Any, senses: Any) -> State:
    """The state of one world with one agent, from the arrays that its thread has to itself; other fields are the world's."""
    weights, activations, errors, targets, rate = network
    places, heading, near, action = body
    code, alert = senses
    return State(
        keys=state.keys[world : world + 1],
        generation=state.generation,
        places=places,
        x=places[0],
        y=places[1],
        near=near,
        heading=heading,
        code=code,
        alert=alert,
        action=action,
        eaten=state.eaten[:, lane : lane + 1],
        item_x=state.item_x[world : world + 1],
        item_y=state.item_y[world : world + 1],
        appearances=state.appearances[world : world + 1],
        touched=state.touched[world : world + 1],
        slot_x=state.slot_x[world : world + 1],
        slot_y=state.slot_y[world : world + 1],
        slot_item=state.slot_item[world : world + 1],
        tile_slots=state.tile_slots[world : world + 1],
        tile_next=state.tile_next[world : world + 1],
        stale=state.stale[world : world + 1],
        weights=weights,
        activations=activations,
        errors=errors,
        targets=targets,
        rate=rate,
        pupil=state.pupil[:, lane : lane + 1],
        pupil_activations=state.pupil_activations[:, lane : lane + 1],
        newborn=state.newborn[:, lane : lane + 1],
        signs=state.signs[:, lane : lane + 1],
        answers=state.answers[:, lane : lane + 1],
    )


@functools.cache
def begin_kernel(threads: int, weights: int) -> Any:
    """The kernel in which a generation is born: the agents of a world share the work of placing its items."""

    @_kernel(threads)
    def begin(model: Model, state: State, genomes: Any, fixed: Any) -> None:
        lane = cuda.grid(1)
        world, agent = lane // model.agents, lane % model.agents
        for weight in range(weights):
            state.weights[weight, lane] = genomes[lane, 0, weight]
            fixed[weight, lane] = genomes[lane, genomes.shape[1] - 1, weight]  # the reinforcement module, if there is one
        prepare(model, state, fixed, lane)
        state.code[lane] = -1
        bear(model, state, world, agent)
        choose_directions(model, state, world, agent)
        for region in range(model.regions.shape[0]):
            state.eaten[region, lane] = 0
            for item in range(model.region_items[region] + agent, model.region_items[region + 1], model.agents):
                state.touched[world, item] = -1
                state.appearances[world, item] = 0
                grow(model, state, world, region, item)
        cuda.syncthreads()
        for region in range(agent, model.regions.shape[0], model.agents):
            settle(model, state, world, region)

    return begin


@functools.cache
def live_kernel(threads: int, sizes: tuple[int, ...], biases: bool, rule: int, weights: int, sequential: bool) -> Any:
    """The kernel in which a generation lives, for one kind of network: what is constant, the compiler can unroll or leave out."""
    layers, units, live_a_step = np.array(sizes, np.int64), sum(sizes), _step_one_by_one if sequential else _step_together

    @_kernel(threads)
    def live(shared: Model, state: State, first_step: int, last_step: int) -> None:
        lane = cuda.grid(1)
        world, agent = lane // shared.agents, lane % shared.agents
        own_weights, activations = cuda.local.array((weights, 1), float32), cuda.local.array((units, 1), float32)
        errors, targets = cuda.local.array((units, 1), float32), cuda.local.array((3, 1), float32)
        places, heading = cuda.local.array((2, 1), float32), cuda.local.array((1, 1), float32)
        near, action = cuda.local.array((1, 1), float32), cuda.local.array((1, 1), float32)
        rate = cuda.local.array((1, 1), float32)
        code, alert = cuda.local.array(1, int32), cuda.local.array(1, int32)
        _copy(state.weights, lane, own_weights, 0)
        _copy(state.activations, lane, activations, 0)
        _copy(state.targets, lane, targets, 0)
        _copy(state.rate, lane, rate, 0)
        _copy(state.places, lane, places, 0)
        _copy(state.heading, lane, heading, 0)
        _copy(state.action, lane, action, 0)
        code[0] = state.code[lane]
        model, network = _own_model(shared, layers, biases, rule), (own_weights, activations, errors, targets, rate)
        mine = _own_state(state, world, lane, network, (places, heading, near, action), (code, alert))
        for step in range(first_step, last_step):
            live_a_step(model, mine, shared.agents, agent, step)
        _copy(own_weights, 0, state.weights, lane)
        _copy(activations, 0, state.activations, lane)
        _copy(targets, 0, state.targets, lane)
        _copy(places, 0, state.places, lane)
        _copy(heading, 0, state.heading, lane)
        _copy(action, 0, state.action, lane)
        state.code[lane] = code[0]

    return live


@_device
def _decide(model: Model, mine: State, agent: int, step: int) -> None:
    """Sense, think, act and learn: what an agent does by itself."""
    look_out(model, mine, 0)
    sense(model, mine, 0, 0)
    think(model, mine, 0)
    choose_action(model, mine, 0)
    if model.motor_noise > ZERO:
        stumble(model, mine, 0, 0, agent, step)
    move(model, mine, 0)
    learn(model, mine, step, 0)


@_device
def _step_together(model: Model, mine: State, agents: int, agent: int, step: int) -> None:
    """All agents of a world decide, then eat. Items stay where they are until all of the block's agents have come to claim."""
    _decide(model, mine, agent, step)
    turn = (agent + agents - step % agents) % agents
    claim = 2 * (step * agents + agents - 1 - turn)  # later steps outbid earlier ones, earlier turns later ones
    found = _feed(model, mine, 0, 0, claim, False)
    if cuda.syncthreads_or(int32(found)) != 0:
        if found:
            _feed(model, mine, 0, 0, claim, True)
        cuda.syncthreads()
        if agent == 0:
            tidy(model, mine, 0)
        cuda.syncthreads()


@_device
def _step_one_by_one(model: Model, mine: State, agents: int, agent: int, step: int) -> None:
    """Agent after agent, in the step's order, each finds what the last one left (R7)."""
    for turn in range(agents):
        if agent == (step + turn) % agents:
            _decide(model, mine, agent, step)
            eat(model, mine, 0, 0, step)
            tidy(model, mine, 0)
        cuda.syncthreads()


@contextmanager
def uncontracted() -> Iterator[None]:
    """Compile without fused multiply-adds meanwhile: NVVM makes them by default, and numba-cuda has no switch for it."""
    if config.ENABLE_CUDASIM:
        yield
        return
    from numba.cuda.cudadrv import nvvm

    with COMPILING:
        compile_ir = nvvm.compile_ir
        nvvm.compile_ir = lambda code, **options: compile_ir(code, **(options | {"fma": False}))
        try:
            yield
        finally:
            nvvm.compile_ir = compile_ir
