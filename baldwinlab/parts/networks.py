"""The kind of part that computes outputs from inputs, and the hooks of this kind."""

from __future__ import annotations

from typing import Any, ClassVar, NamedTuple

from baldwinlab.engine.phases import hook
from baldwinlab.engine.simd import Lane, Value
from baldwinlab.parts.part import Part


@hook
def forward(part: Any, weights: Any, activations: Any, lane: Lane) -> None:
    """Compute the outputs of the network from its inputs.

    Per agent. The engine calls it once per step for the action module, and once per step for the
    reinforcement module of a learning rule that has this module. The first rows of `activations`
    are the inputs. The hook writes the remaining rows. The last rows are the outputs.

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


class Training(NamedTuple):
    """A module of an agent, and the data from which its weights learn.

    Attributes
    ----------
    rate : float32, or a SIMD block
        Learning rate of the agent.
    weights : array, float32 [weight, lane]
        Weights of the module. `backward` changes them.
    activations : array, float32 [unit, lane]
        Activations of all units, as `forward` wrote them. Read only.
    errors : array, float32 [unit, lane]
        Scratch memory.
    targets : array, float32 [action, lane]
        Target of each output. Read only.
    """

    rate: Value
    weights: Any
    activations: Any
    errors: Any
    targets: Any


@hook
def backward(part: Any, training: Training, lane: Lane) -> None:
    """Change the weights so that the outputs move toward the targets.

    Per agent. A learning rule calls it after `forward`.

    Parameters
    ----------
    part : NamedTuple
        Numeric settings, derived values and arrays of the part.
    training : Training
        Weights, activations, targets and learning rate. The hook changes `training.weights`.
    lane : Lane
        Column of an agent, or a SIMD block.
    """


@hook
def links(part: Any, weights: Any, units: int, lane: int, table: Any) -> int:
    """Write the links of a network without layers, for drawings.

    Per agent. The engine never calls the hook. The lab and the figures call it in plain Python to
    draw a network.

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
        Output: source unit, target unit and weight of each link. A bias is a link from unit -1.

    Returns
    -------
    int
        Number of links. 0 for a network with layers.
    """
    return 0


class Network(Part):
    """Network of an agent, which computes outputs from inputs.

    The first units are the inputs, and the last units are the outputs. The weights have the order
    of the genome.

    Attributes
    ----------
    is_memoryless : bool
        True if the outputs depend on the current inputs alone. The engine may then read the outputs
        from a table.
    has_graph_genomes : bool
        True if a genome is a graph with a variable number of genes, as in NEAT.
    infinite_genes : tuple of int
        Indices in a module of the genes that may be infinite. All other genes must be finite.
    """

    kind: ClassVar[str] = "network"
    is_memoryless: ClassVar[bool] = True
    has_graph_genomes: ClassVar[bool] = False
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
            Number of units per layer. The sum is the number of units of the network.
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
            Pairs of a unit and its context unit. The context unit has the activation of the unit in
            the previous step.
        """
        return ()

    forward: ClassVar[Any] = staticmethod(forward.default)
    backward: ClassVar[Any] = staticmethod(backward.default)
    links: ClassVar[Any] = staticmethod(links.default)
