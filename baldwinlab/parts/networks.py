"""The kind of part that computes outputs from inputs, and its hooks."""

from __future__ import annotations

from typing import Any, ClassVar

from baldwinlab.engine.phases import hook
from baldwinlab.engine.simd import Lane, Value
from baldwinlab.parts.part import Part


@hook
def forward(part: Any, weights: Any, activations: Any, lane: Lane) -> None:
    """Compute the outputs of the network from its inputs.

    Per agent, once per step, and for a reinforcement module once more. The first rows of
    `activations` are the inputs. The hook writes the other rows. The last rows are the outputs.

    Parameters
    ----------
    part : NamedTuple
        Numeric settings, derived values and arrays of the part.
    weights : array, float32 [weight, lane]
        Weights of the module. Read only.
    activations : array, float32 [unit, lane]
        Activations of all units.
    lane : Lane
        Column of an agent, or a SIMD block.
    """


@hook
def backward(
    part: Any, rate: Value, weights: Any, activations: Any, errors: Any, targets: Any, lane: Lane
) -> None:
    """Change the weights so that the outputs move toward the targets.

    Per agent. Learning rules call it after `forward`, with the activations of that call.

    Parameters
    ----------
    part : NamedTuple
        Numeric settings, derived values and arrays of the part.
    rate : float32, or a SIMD block
        Learning rate of the agent.
    weights : array, float32 [weight, lane]
        Weights of the module. The hook changes them.
    activations : array, float32 [unit, lane]
        Activations of all units. Read only.
    errors : array, float32 [unit, lane]
        Scratch memory.
    targets : array, float32 [action, lane]
        Target of each output. Read only.
    lane : Lane
        Column of an agent, or a SIMD block.
    """


@hook
def links(part: Any, weights: Any, units: int, lane: int, table: Any) -> int:
    """Write the links of a network without layers, for drawings.

    Per agent, on demand. It is called in plain Python.

    Parameters
    ----------
    part : NamedTuple
        Numeric settings, derived values and arrays of the part.
    weights : array, float32 [weight, lane]
        Weights of the module. Read only.
    units : int
        Number of units.
    lane : int
        Column of the agent.
    table : array [weight, 3]
        Output: source unit, target unit and weight of each link. The source of a bias is -1.

    Returns
    -------
    int
        Number of links. 0 for a network with layers.
    """
    return 0


class Network(Part):
    """Network of an agent: outputs from inputs.

    Units are numbered from the inputs to the outputs. Weights are numbered in the order of the
    genome.

    Attributes
    ----------
    is_memoryless : bool
        True if the outputs depend on the current inputs alone. Then outputs may be looked up.
    infinite_genes : tuple of int
        Indices in a module of the genes that may be infinite. All other genes must be finite.
    """

    kind: ClassVar[str] = "network"
    is_memoryless: ClassVar[bool] = True
    infinite_genes: ClassVar[tuple[int, ...]] = ()

    def layers(self, inputs: int, hidden: tuple[int, ...], actions: int) -> tuple[int, ...]:
        """Return the number of units in each layer, from the inputs to the outputs.

        Parameters
        ----------
        inputs : int
            Number of inputs: the first units.
        hidden : tuple of int
            The setting `network.hidden`.
        actions : int
            Number of outputs: the last units.

        Returns
        -------
        tuple of int
            The sum is the number of units.
        """
        return (inputs, *hidden, actions)

    def memory(
        self, inputs: int, hidden: tuple[int, ...], actions: int
    ) -> tuple[tuple[int, int], ...]:
        """Return the context units of a recurrent network, for drawings.

        Parameters
        ----------
        inputs : int
            Number of inputs.
        hidden : tuple of int
            The setting `network.hidden`.
        actions : int
            Number of outputs.

        Returns
        -------
        tuple of (int, int)
            Pairs of a unit and of the unit that holds its activation of the previous step.
        """
        return ()

    forward: ClassVar[Any] = staticmethod(forward.default)
    backward: ClassVar[Any] = staticmethod(backward.default)
    links: ClassVar[Any] = staticmethod(links.default)
