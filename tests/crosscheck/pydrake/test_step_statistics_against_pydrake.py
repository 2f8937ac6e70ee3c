"""What integrators say of the steps that they took is what those of pydrake say."""

import importlib

import pytest

pytest.importorskip("pydrake")

pytestmark = pytest.mark.peer

SCHEMES = [
    "bogacki_shampine3",
    "explicit_euler",
    "implicit_euler",
    "radau1",
    "radau3",
    "runge_kutta2",
    "runge_kutta3",
    "runge_kutta5",
    "semi_explicit_euler",
    "velocity_implicit_euler",
]
WITHOUT_ERRORS = {"explicit_euler", "radau1", "runge_kutta2", "semi_explicit_euler"}
QUESTIONS = [
    "get_actual_initial_step_size_taken",
    "get_largest_step_size_taken",
    "get_smallest_adapted_step_size_taken",
    "get_num_steps_taken",
    "get_num_step_shrinkages_from_error_control",
]


def answers(library, scheme, fixed):
    m = importlib.import_module(f"{library}.all")
    builder = m.DiagramBuilder()
    source, integrator = builder.AddSystem(m.Sine(1, 3, 0, 1)), builder.AddSystem(m.Integrator(1))
    builder.Connect(source.get_output_port(0), integrator.get_input_port())
    simulator = m.Simulator(builder.Build())
    integrator = m.ResetIntegratorFromFlags(simulator, scheme, 0.1)
    if scheme not in WITHOUT_ERRORS:
        integrator.set_fixed_step_mode(fixed)
        integrator.set_target_accuracy(1e-4)
    found = []
    for T in (0.25, 0.5, 1.0, 1.03):
        simulator.AdvanceTo(T)
        x = simulator.get_context().get_continuous_state_vector().GetAtIndex(0)
        found.append([*(round(float(getattr(integrator, ask)()), 9) for ask in QUESTIONS), round(x, 9)])
    return found


@pytest.mark.parametrize("fixed", [True, False])
@pytest.mark.parametrize("scheme", SCHEMES)
def test_steps_are_told_alike(scheme, fixed):
    ours, theirs = answers("sheldrake", scheme, fixed), answers("pydrake", scheme, fixed)
    assert str(ours) == str(theirs)  # nan is nan
