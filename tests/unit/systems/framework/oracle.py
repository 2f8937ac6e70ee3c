"""A slow, obvious second opinion: no slab, no rows, no order, no cache. Pulls every value recursively, every time."""

import numpy as np

from sheldrake.common.kernel import Kernel
from sheldrake.systems.framework import BasicVector, Diagram

ORDER = ("unrestricted", "discrete", "publish")


class FakeContext:
    """What a leaf's callback is given."""

    def __init__(self, oracle, leaf):
        self.oracle, self.leaf = oracle, leaf

    def get_time(self):
        return self.oracle.t

    def get_discrete_state(self, k):
        return BasicVector(self.oracle.xd[self.leaf][k])

    def get_continuous_state_vector(self):
        return BasicVector(self.oracle.xc[self.leaf])


class FakeState:
    """What an update fills."""

    def __init__(self, groups):
        self.groups = [BasicVector._view(g) for g in groups]

    def get_mutable_vector(self, k=0):
        return self.groups[k]

    get_mutable_discrete_state = get_mutable_vector


def read(system, context, i):
    """Value of input port `i`, in a real context or a fake one."""
    if isinstance(context, FakeContext):
        return context.oracle.input(system, i)
    return system.get_input_port(i).Eval(context)


class Oracle:
    """A simulator. Initialized on construction."""

    def __init__(self, root, fixed, h, scheme):
        self.root, self.fixed, self.h, self.scheme, self.t = root, fixed, h, scheme, 0.0
        self.leaves = self.find(root)
        self.xc = {s: s._xc_model.CopyToVector() for s in self.leaves}
        self.xd = {s: [g.CopyToVector() for g in s._xd_models] for s in self.leaves}
        self.events = [[s, e, 0] for s in self.leaves for e in s._all_events() if e.trigger != "forced"]
        self.log = {s: [] for s in self.leaves}
        self.wires = {}
        self.publish()

    def find(self, s):
        return [x for c in s.GetSystems() for x in self.find(c)] if isinstance(s, Diagram) else [s]

    def input(self, s, i):
        if s is self.root:
            return self.fixed[i]
        if (s, i) not in self.wires:
            self.wires[s, i] = self.find_source(s, i)
        find, system, k = self.wires[s, i]
        return find(system, k)

    def find_source(self, s, i):
        diagram = s._parent()
        for (target, k), (source, j) in diagram.connection_map().items():
            if target is s and k == i:
                return self.output, source, int(j)
        for own in range(diagram.num_input_ports()):
            if any(x is s and k == i for x, k in diagram.GetInputPortLocators(own)):
                return self.input, diagram, own
        raise AssertionError("not connected")

    def output(self, s, j):
        if isinstance(s, Diagram):
            system, k = s.get_output_port_locator(j)
            return self.output(system, int(k))
        port = s._outputs[j]
        if port.state is not None:
            kind, group = port.state
            return (self.xc[s] if kind == "xc" else self.xd[s][group]).copy()
        out = np.zeros(port.size)
        self.call(s, port.calc, out, BasicVector._view(out), s._output_models.get(j, {}))
        return out

    def call(self, s, f, out, wrapped, models=None):
        if not isinstance(f, Kernel):
            f(s, FakeContext(self, s), wrapped)
            return
        sees = dict(
            t=self.t,
            xc=self.xc[s].copy(),
            xd=np.concatenate([*self.xd[s], np.empty(0)]),
            p=np.concatenate([*(g._v for g in s._pn_models), np.empty(0)]),
            work=np.zeros(s._scratch_prototype),
        )
        sees |= s._kernel_models(None) | (models or {})
        if "u" in f.names:
            sees["u"] = tuple(np.ascontiguousarray(self.input(s, i)) for i in range(s.num_input_ports()))
        assert f.native(*[sees[name] for name in f.names[:-1]], out) == 0

    def time_of(self, event):
        return event[1].offset + event[2] * event[1].period if event[1].trigger == "periodic" else self.t

    def due(self, kind):
        return [e for e in self.events if ORDER[e[1].kind] == kind and self.time_of(e) <= self.t]

    def update(self, kind):
        new = {s: [g.copy() for g in groups] for s, groups in self.xd.items()}
        for event in self.due(kind):
            s, declaration = event[:2]
            flat = np.concatenate([*new[s], np.empty(0)])
            if isinstance(declaration.handler, Kernel):
                self.call(s, declaration.handler, flat, None)
                at = 0
                for group in new[s]:
                    group[:] = flat[at : at + len(group)]
                    at += len(group)
            else:
                self.call(s, declaration.handler, None, FakeState(new[s]))
            event[2] += declaration.trigger == "periodic"
        self.xd = new

    def publish(self):
        for event in self.due("publish"):
            event[2] += event[1].trigger == "periodic"
            self.log[event[0]].append((self.t, *self.input(event[0], 0)))

    def slopes(self, t, x):
        self.t, self.xc, found = t, x, {}
        for s in x:
            found[s] = np.zeros(len(x[s]))
            if len(x[s]):
                calc = s._derivatives_calc()
                self.call(s, calc, found[s], BasicVector._view(found[s]))
        return found

    def integrate(self, t1):
        t, x, h = self.t, self.xc, t1 - self.t
        k1 = self.slopes(t, x)
        if self.scheme == "explicit_euler":
            self.xc = {s: v + h * k1[s] for s, v in x.items()}
        elif self.scheme == "runge_kutta2":
            trial = {s: v + h * k1[s] for s, v in x.items()}
            k2 = self.slopes(t + h, trial)
            self.xc = {s: v + h * 0.5 * k2[s] - h * 0.5 * k1[s] for s, v in trial.items()}
        else:
            k2 = self.slopes(t + h * 0.5, {s: v + h * 0.5 * k1[s] for s, v in x.items()})
            k3 = self.slopes(t + h, {s: v - h * k1[s] + 2.0 * h * k2[s] for s, v in x.items()})
            a, b = h * (1.0 / 6.0), h * (2.0 / 3.0)
            self.xc = {s: v + a * k1[s] + b * k2[s] + a * k3[s] for s, v in x.items()}

    def advance(self, T):
        while True:
            self.update("unrestricted")
            self.update("discrete")
            times = [self.time_of(e) for e in self.events if e[1].trigger == "periodic"]
            event = min([np.inf, *times])
            t1 = min(event, T)
            if any(len(v) for v in self.xc.values()):
                if (T < event and self.t + self.h < t1) or (T >= event and self.t + self.h * 1.01 < t1):
                    t1 = self.t + self.h
                self.integrate(t1)
            self.t = t1
            self.publish()
            if t1 >= T:
                return
