"""A neural network of fully connected layers."""

from __future__ import annotations

from typing import Annotated, NamedTuple

from sheldrake.common._kernels.generic import cos, sin, tanh
from sheldrake.common.kernel import IntMatrix, IntVector, Vector, Vectors, kernel
from sheldrake.common.record import Items, Record, integer, table

IDENTITY, RELU, TANH = 0, 1, 2


class Layer(Record):
    """Of the network: y = activation(W x + b)."""

    num_inputs = integer("size of x")
    num_outputs = integer("size of y")
    start = integer("where in p are W, column by column, and then b")
    activation = integer("IDENTITY, RELU or TANH")


@table
class Network(NamedTuple):
    """A network.

    layer: from the input on.
    periodic: 1 for inputs that enter as sine and cosine.
    """

    layer: Annotated[IntMatrix, Items("layers", Layer)]
    periodic: IntVector


class Values(NamedTuple):
    """Scratch: values of a layer and of the next, as many as the largest has."""

    x: Vector
    y: Vector


@kernel
def affine(p, layer, x, y):
    """y = W x + b."""
    n, at = layer.num_outputs, layer.start
    for i in range(n):
        y[i] = p[at + n * layer.num_inputs + i]
    for j in range(layer.num_inputs):
        for i in range(n):
            y[i] += p[at + j * n + i] * x[j]


@kernel(top=True)
def perceptron(network_model: Network, p: Vector, u: Vectors, x: Vector, y: Vector, out: Vector) -> None:
    """The output of the network."""
    n = 0
    for i in range(u[0].shape[0]):
        if network_model.periodic[i] == 1:
            x[n] = sin(u[0][i])
            n += 1
            x[n] = cos(u[0][i])
        else:
            x[n] = u[0][i]
        n += 1
    for k in range(len(network_model.layers)):
        layer = network_model.layers[k]
        affine(p, layer, x, y)
        for i in range(layer.num_outputs):
            x[i] = y[i]
            if layer.activation == RELU:
                x[i] = max(y[i], 0.0)
            elif layer.activation == TANH:
                x[i] = tanh(y[i])
    for i in range(out.shape[0]):
        out[i] = x[i]
