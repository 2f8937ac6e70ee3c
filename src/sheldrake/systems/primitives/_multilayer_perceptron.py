"""A neural network as a system."""

from __future__ import annotations

from collections.abc import Callable
from typing import TYPE_CHECKING, Any

import numpy as np

from sheldrake.common._checked import checked
from sheldrake.common._enums import NumberEnum
from sheldrake.common._kinds import instance_of, integers, list_of
from sheldrake.common._overloads import overload, overloaded
from sheldrake.common._scalars import writable
from sheldrake.systems.framework import BasicVector, LeafSystem
from sheldrake.systems.primitives._kernels import perceptron as kernels

if TYPE_CHECKING:
    from numpy.typing import ArrayLike

    from sheldrake.common import RandomGenerator
    from sheldrake.systems.framework import Context


class PerceptronActivationType(NumberEnum):
    """Activation functions."""

    kIdentity = 0
    kReLU = 1
    kTanh = 2


def _activate(kind: PerceptronActivationType, x: np.ndarray) -> np.ndarray:
    if kind is PerceptronActivationType.kIdentity:
        return x
    if x.dtype == object:
        if kind is PerceptronActivationType.kTanh:
            return np.array([v.tanh() for v in x.ravel()], object).reshape(x.shape)
        return np.array([v if v > 0 else 0.0 * v for v in x.ravel()], object).reshape(x.shape)
    return np.tanh(x) if kind is PerceptronActivationType.kTanh else np.maximum(x, 0.0)


def _slope(kind: PerceptronActivationType, y: np.ndarray) -> np.ndarray:
    """Derivative of an activation, from its value."""
    if kind is PerceptronActivationType.kTanh:
        return 1.0 - y * y
    return np.ones_like(y) if kind is PerceptronActivationType.kIdentity else (y > 0).astype(float)


@checked
class MultilayerPerceptron(LeafSystem):
    """Layers y = activation(W x + b); all W and b are one group of numeric parameters.

    Args:
        layers: Size of the input, of each hidden layer, and of the output.
        activation_type: Of every hidden layer; the output's is the identity.
        activation_types: Of every layer but the input, instead.
        use_sin_cos_for_input: Which inputs x enter as (sin x, cos x); then
        remaining_layers: the layers without the input.
    """

    _generic = True

    @overloaded(
        overload(
            layers=integers,
            activation_type=(instance_of(PerceptronActivationType), PerceptronActivationType.kTanh),
        ),
        overload(layers=integers, activation_types=list_of(PerceptronActivationType)),
        overload(
            use_sin_cos_for_input=list_of(bool),
            remaining_layers=integers,
            activation_types=list_of(PerceptronActivationType),
        ),
    )
    def __init__(self, *given: Any):
        super().__init__()
        *periodic, self._layers, kinds = given
        if periodic:
            (self._periodic,) = periodic
            self._layers = [len(self._periodic) + sum(self._periodic), *self._layers]
        else:
            self._periodic = [False] * sum(self._layers[:1])
        if isinstance(kinds, PerceptronActivationType):
            kinds = [kinds] * (len(self._layers) - 2) + [PerceptronActivationType.kIdentity]
        self._kinds = kinds
        if len(self._layers) < 2 or min(self._layers) < 1 or len(self._kinds) != len(self._layers) - 1:
            raise RuntimeError(
                f"MultilayerPerceptron: {len(self._layers)} layers {self._layers} of positive size need "
                f"{len(self._layers) - 1} activations, got {len(self._kinds)}."
            )
        self._at, n = [], 0
        for rows, cols in zip(self._layers[1:], self._layers[:-1]):
            self._at.append((n, n + rows * cols, n + rows * cols + rows))
            n += rows * cols + rows
        self._count = n
        self.DeclareNumericParameter(BasicVector(np.zeros(n)))
        self.DeclareVectorInputPort("x", len(self._periodic))
        self.DeclareVectorOutputPort("y", self._layers[-1], self._calc)
        largest = max(self._layers)
        self._declare_scratch(kernels.Values(np.zeros(largest), np.zeros(largest)))
        self._compute_natively(0, kernels.perceptron)

    def _kernel_models(self, root: Any) -> dict:
        sizes = zip(self._layers[:-1], self._layers[1:])
        layers = [(n, m, a, int(kind)) for (n, m), (a, *_), kind in zip(sizes, self._at, self._kinds)]
        return {"network_model": kernels.Network(np.array(layers, np.int64), np.array(self._periodic, np.int64))}

    # Parameters.

    def layers(self) -> list[int]:
        """Sizes of the layers."""
        return list(self._layers)

    def activation_type(self, layer: int) -> PerceptronActivationType:
        """Activation after weights `layer`."""
        return self._kinds[layer]

    def num_parameters(self) -> int:
        """Number of all weights and biases."""
        return self._count

    def _vector(self, source: Any) -> np.ndarray:
        if isinstance(source, np.ndarray):
            return source
        self.ValidateContext(source)
        return source.get_numeric_parameter(0)._v

    def GetParameters(self, context: Context) -> np.ndarray:
        """All parameters, shape (num_parameters,), read-only."""
        self.ValidateContext(context)
        return context.get_numeric_parameter(0).value()

    def GetMutableParameters(self, context: Context) -> np.ndarray:
        """All parameters, shape (num_parameters,), to write through."""
        self.ValidateContext(context)
        return context.get_mutable_numeric_parameter(0).get_mutable_value()

    def SetParameters(self, context: Context, params: ArrayLike) -> None:
        """Sets all parameters."""
        self.ValidateContext(context)
        context.get_mutable_numeric_parameter(0).SetFromVector(params)

    def GetWeights(
        self, context: Context | None = None, layer: int = 0, *, params: ArrayLike | None = None
    ) -> np.ndarray:
        """Weights `layer`, shape (rows, cols), in a context or an array of parameters."""
        a, b, _ = self._at[layer]
        return self._vector(context if params is None else params)[a:b].reshape(self._shape(layer), order="F").copy()

    def GetBiases(
        self, context: Context | None = None, layer: int = 0, *, params: ArrayLike | None = None
    ) -> np.ndarray:
        """Biases `layer`, shape (rows,), in a context or an array of parameters."""
        _, b, c = self._at[layer]
        return self._vector(context if params is None else params)[b:c].copy()

    def SetWeights(
        self,
        context: Context | None = None,
        layer: int = 0,
        W: ArrayLike | None = None,
        *,
        params: np.ndarray | None = None,
    ) -> None:
        """Sets weights `layer`."""
        a, b, _ = self._at[layer]
        self._write(context if params is None else params, a, b, np.asarray(W), self._shape(layer))

    def SetBiases(
        self,
        context: Context | None = None,
        layer: int = 0,
        b: ArrayLike | None = None,
        *,
        params: np.ndarray | None = None,
    ) -> None:
        """Sets biases `layer`."""
        _, first, last = self._at[layer]
        self._write(context if params is None else params, first, last, np.asarray(b), (last - first,))

    def _write(self, target: Any, a: int, b: int, value: np.ndarray, shape: tuple) -> None:
        if value.shape != shape:
            raise RuntimeError(f"MultilayerPerceptron: expected shape {shape}, got {value.shape}.")
        if not isinstance(target, np.ndarray):
            target = self.GetMutableParameters(target)
        target[a:b] = value.reshape(-1, order="F")

    def _shape(self, layer: int) -> tuple[int, int]:
        return self._layers[layer + 1], self._layers[layer]

    def _set_random_context(self, context: Context, generator: RandomGenerator) -> None:
        params = self.GetMutableParameters(context)
        for layer, (a, _, c) in enumerate(self._at):
            bound = np.sqrt(3.0 / self._layers[layer])
            params[a:c] = [bound * (2.0 * generator._uniform() - 1.0) for _ in range(a, c)]

    # Values and gradients.

    def _features(self, X: np.ndarray) -> np.ndarray:
        if not any(self._periodic):
            return X
        rows: list[Any] = []
        for periodic, x in zip(self._periodic, X):
            rows += [np.sin(x), np.cos(x)] if periodic else [x]
        return np.stack(rows)

    def _forward(self, context: Context, X: np.ndarray) -> list[np.ndarray]:
        """Values of all layers, each with a column for each sample."""
        values = [self._features(X)]
        for layer, kind in enumerate(self._kinds):
            W, b = self.GetWeights(context, layer), self.GetBiases(context, layer)
            values.append(_activate(kind, W @ values[-1] + b[:, None]))
        return values

    def _calc(self, context: Context, output: BasicVector) -> None:
        x = self.get_input_port().Eval(context)
        if x.dtype == object and any(self._periodic):
            rows: list[Any] = []
            for periodic, v in zip(self._periodic, x):
                rows += [v.sin(), v.cos()] if periodic else [v]
            y = np.array(rows, object)[:, None]
            for layer, kind in enumerate(self._kinds):
                y = _activate(kind, self.GetWeights(context, layer) @ y + self.GetBiases(context, layer)[:, None])
            output.SetFromVector(y[:, 0])
        else:
            output.SetFromVector(self._forward(context, x[:, None])[-1][:, 0])

    def BatchOutput(
        self, context: Context, X: ArrayLike, Y: np.ndarray | None = None, dYdX: np.ndarray | None = None
    ) -> np.ndarray | None:
        """Outputs for columns of inputs; into `Y` if given, with gradients into `dYdX` for a single output."""
        self.ValidateContext(context)
        for name, given in (("Y", Y), ("dYdX", dYdX)):
            if given is not None:
                writable("BatchOutput", name, given)
        if dYdX is not None and self._layers[-1] != 1:
            raise RuntimeError(
                "BatchOutput: dYdX != nullptr, but BatchOutput only supports gradients when the output layer has size "
                "1."
            )
        X = np.asarray(X, float)
        values = self._forward(context, X)
        if Y is None:
            return values[-1]
        Y[...] = values[-1]
        if dYdX is not None:
            _, slopes = self._backward(context, values, np.ones_like(values[-1]))
            dYdX[...] = self._input_slopes(X, slopes)
        return None

    def _input_slopes(self, X: np.ndarray, slopes: np.ndarray) -> np.ndarray:
        out, row = np.zeros_like(X), 0
        for i, periodic in enumerate(self._periodic):
            if periodic:
                out[i] = slopes[row] * np.cos(X[i]) - slopes[row + 1] * np.sin(X[i])
            else:
                out[i] = slopes[row]
            row += 1 + periodic
        return out

    def _backward(self, context: Context, values: list, slopes: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Gradients by parameters and by features, of the sum over samples of slopes times outputs."""
        gradient = np.zeros(self._count)
        for layer in range(len(self._kinds) - 1, -1, -1):
            slopes = slopes * _slope(self._kinds[layer], values[layer + 1])
            a, b, c = self._at[layer]
            gradient[a:b] = (slopes @ values[layer].T).reshape(-1, order="F")
            gradient[b:c] = slopes.sum(axis=1)
            slopes = self.GetWeights(context, layer).T @ slopes
        return gradient, slopes

    def Backpropagation(self, context: Context, X: ArrayLike, loss: Callable, dloss_dparams: np.ndarray) -> float:
        """The loss of the outputs for columns of inputs, and its gradient by the parameters, into `dloss_dparams`.

        Args:
            context: The parameters.
            X: Inputs, shape (num inputs, N).
            loss: `loss(Y, dloss_dY)` gives a number and fills its gradient.
            dloss_dparams: Shape (num_parameters,).
        """
        self.ValidateContext(context)
        writable("Backpropagation", "dloss_dparams", dloss_dparams)
        values = self._forward(context, np.asarray(X, float))
        slopes = np.zeros_like(values[-1], order="F")
        value = loss(values[-1], slopes)
        dloss_dparams[:] = self._backward(context, values, slopes)[0]
        return float(value)

    def BackpropagationMeanSquaredError(
        self, context: Context, X: ArrayLike, Y_desired: ArrayLike, dloss_dparams: np.ndarray
    ) -> float:
        """`Backpropagation` with the mean over samples of the squared distance to `Y_desired`."""
        wanted = np.asarray(Y_desired, float)

        def loss(Y: np.ndarray, slopes: np.ndarray) -> float:
            slopes[...] = 2.0 * (Y - wanted) / Y.shape[1]
            return float(np.sum((Y - wanted) ** 2) / Y.shape[1])

        return self.Backpropagation(context, X, loss, dloss_dparams)
