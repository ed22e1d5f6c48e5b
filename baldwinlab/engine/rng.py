"""Counter-based random numbers: Philox4x32-10.

A random number is a pure function of seed, run, generation, purpose, index and draw. Therefore no
result depends on the order of threads, batches or runs, and any lifetime can be simulated again
alone.

Source: J. K. Salmon, M. A. Moraes, R. O. Dror, D. E. Shaw, "Parallel random numbers: as easy as 1,
2, 3", SC'11.
"""

from __future__ import annotations

import hashlib
from typing import Any, Final, NamedTuple

import numpy as np
import numpy.typing as npt

from baldwinlab.engine import poison
from baldwinlab.engine.jit import compiled, jit_entry_point

# Purposes of random numbers, with the meaning of index and draw. Stored results depend on these
# values, so new purposes are appended and old purposes are never renumbered.
BIRTHPLACE: Final = 0  # index: agent; draw: attempt
FOOD: Final = 1  # index: item; draw: number of earlier positions of the item
ACTION_WEIGHTS: Final = 2  # index: agent; draw: weight
REINFORCEMENT_WEIGHTS: Final = 3  # index: agent; draw: weight
SELECTION: Final = 4  # index: child; draw: 0
INHERITANCE: Final = 5  # index: child; draw: module and weight
MUTATION_GATE: Final = 6  # index: child; draw: 0
HEADING: Final = 7  # index: agent; draw: 0
MOTOR: Final = 8  # index: agent; draw: step
DRIFT: Final = 9  # index: agent; draw: weight
TEACHER: Final = 10  # index: child; draw: 0
FOUNDER: Final = 11  # founders of a model; index: agent; draw: chosen by the model
LIFE: Final = 12  # lifetimes of a model or part; index: agent; draw: chosen by the part
AGE: Final = 13  # index: agent; draw: 0
FOUNDER_SAMPLE: Final = 14  # index: agent of a genome file; draw: number of the file
GENES: Final = 15  # genes of parts; index: child; draw: gene
WORLD: Final = 16  # keys of the worlds of a run; index: repeat; draw: world
SELECTION_STREAM: Final = 30  # stream of a selection; index: 0; draw: chosen by the selection
SPECIES_SEED: Final = 20  # seed of a species; index: species; draw: 0
SPECIES_OF_CHILD: Final = 21  # index: child; draw: 0
# 64 + the number of a further module in the genome; index: agent; draw: weight
MODULE_WEIGHTS: Final = 64
# the first of the purposes that only custom parts use
FIRST_CUSTOM: Final = 1024
# Range of the purposes that have a name, see `purpose`.
FIRST_NAMED: Final = 2**16
END_NAMED: Final = 2**31

Word = Any  # 32 bits: np.uint32, or an integer that fits

# Constants of Philox4x32: multipliers, increments of the key, mask of the low word, shift.
_M0 = np.uint64(0xD2511F53)
_M1 = np.uint64(0xCD9E8D57)
_W0 = np.uint32(0x9E3779B9)
_W1 = np.uint32(0xBB67AE85)
_LOW = np.uint64(0xFFFFFFFF)
_SHIFT = np.uint64(32)
_UNIT = np.float32(2.0**-24)


def purpose(name: str) -> int:
    """Return the purpose of the random numbers of a custom part.

    The purpose is a hash of the name, above the purposes of the package. Two names have the same
    purpose with a probability of 5e-10.

    Parameters
    ----------
    name : str
        Name, for example that of the part and of the random numbers: "my-walls: position".

    Returns
    -------
    int
        Fourth argument of `philox`, from 65536 on. It is the same on all machines.

    Examples
    --------
    >>> POSITION = purpose("my-walls: position")
    """
    digest = hashlib.sha256(name.encode()).digest()
    return FIRST_NAMED + int.from_bytes(digest[:8], "little") % (END_NAMED - FIRST_NAMED)


@compiled
def philox(
    c0: Word, c1: Word, c2: Word, c3: Word, k0: Word, k1: Word
) -> tuple[Word, Word, Word, Word]:
    """Return four random words from a counter of four words and a key of two.

    Parameters
    ----------
    c0, c1, c2, c3 : int
        Counter: draw, index, generation, purpose.
    k0, k1 : int
        Key: seed, run.

    Returns
    -------
    tuple of uint32
        Four random words of 32 bits.
    """
    c0 = np.uint32(c0)
    c1 = np.uint32(c1)
    c2 = np.uint32(c2)
    c3 = np.uint32(c3)
    k0 = np.uint32(k0)
    k1 = np.uint32(k1)
    for _ in range(10):
        product0 = _M0 * np.uint64(c0)
        product1 = _M1 * np.uint64(c2)
        c0 = np.uint32(np.uint32(product1 >> _SHIFT) ^ c1 ^ k0)
        c2 = np.uint32(np.uint32(product0 >> _SHIFT) ^ c3 ^ k1)
        c1 = np.uint32(product1 & _LOW)
        c3 = np.uint32(product0 & _LOW)
        k0 = np.uint32(k0 + _W0)
        k1 = np.uint32(k1 + _W1)
    return c0, c1, c2, c3


@compiled
def unit(word: Word) -> np.float32:
    """Convert a random word to a float32 in [0, 1), a multiple of 2**-24."""
    return np.float32(np.uint32(word) >> np.uint32(8)) * _UNIT


@compiled
def uniform(word: Word) -> np.float64:
    """Convert a random word to a float64 in (0, 1): (word + 1/2) * 2**-32."""
    return (np.float64(word) + 0.5) * 2.0**-32


class Stream(NamedTuple):
    """Key of a sequence of random numbers, which `draw` returns.

    Attributes
    ----------
    seed, run, generation : int
        Seed of the study, index of the run, and generation.
    purpose : int
        Purpose of the random numbers, which the simulation sets.
    """

    seed: int
    run: int
    generation: int
    purpose: int


@compiled
def draw(stream: Stream, number: int) -> np.float64:
    """Return a random number of a stream.

    Parameters
    ----------
    stream : Stream
        The stream: an argument of a hook.
    number : int
        Number of the draw, 0 to 2**32 - 1. Equal numbers give equal results.

    Returns
    -------
    float64
        Uniform random number in (0, 1).
    """
    index = 0
    words = philox(number, index, stream.generation, stream.purpose, stream.seed, stream.run)
    return uniform(words[0])


@compiled
def draw_uniforms(
    seed: int, run: int, generation: int, purpose: int, index: int, out: npt.NDArray[np.float64]
) -> None:
    """Fill `out` [draw, 4] with the uniform random numbers of one index."""
    for draw in range(out.shape[0]):
        words = philox(draw, index, generation, purpose, seed, run)
        out[draw, 0] = uniform(words[0])
        out[draw, 1] = uniform(words[1])
        out[draw, 2] = uniform(words[2])
        out[draw, 3] = uniform(words[3])


@jit_entry_point
def _draw_all(
    seed: int, run: int, generation: int, purpose: int, out: npt.NDArray[np.float64]
) -> None:
    for index in range(out.shape[0]):
        draw_uniforms(seed, run, generation, purpose, index, out[index])


@jit_entry_point
def _fill(seed: int, run: int, generation: int, purpose: int, out: npt.NDArray[np.uint32]) -> None:
    for index in range(out.shape[0]):
        for draw in range(out.shape[1]):
            words = philox(draw, index, generation, purpose, seed, run)
            out[index, draw, 0] = words[0]
            out[index, draw, 1] = words[1]
            out[index, draw, 2] = words[2]
            out[index, draw, 3] = words[3]


def words(
    seed: int, run: int, generation: int, purpose: int, shape: tuple[int, int]
) -> npt.NDArray[np.uint32]:
    """Return random words [index, draw, 4] for all indices and draws of `shape`."""
    out = poison.empty((*shape, 4), np.uint32)
    _fill(seed, run, generation, purpose, out)
    return out


def uniforms(
    seed: int, run: int, generation: int, purpose: int, shape: tuple[int, int]
) -> npt.NDArray[np.float64]:
    """Return uniform random numbers of a purpose.

    Parameters
    ----------
    seed, run, generation : int
        Seed of the study, index of the run, and generation.
    purpose : int
        Purpose, for example `LIFE`.
    shape : tuple of int
        Number of indices and number of draws.

    Returns
    -------
    float64 [index, draw, 4]
        Numbers in (0, 1).
    """
    out = poison.empty((*shape, 4))
    _draw_all(seed, run, generation, purpose, out)
    return out
