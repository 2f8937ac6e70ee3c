"""Messages about contacts: the same as Drake's, read by Drake's own message classes."""

import numpy as np
import pytest

pytest.importorskip("pydrake")
drake = pytest.importorskip("drake")
pytestmark = pytest.mark.peer

from contact_messages import publish  # noqa: E402


def close(ours, theirs):
    np.testing.assert_allclose(ours, theirs, rtol=0, atol=1e-7 * max(1.0, np.abs(theirs).max()))


def test_contact_messages_equal_drakes():
    ours, theirs = (drake.lcmt_contact_results_for_viz.decode(publish(name)) for name in ("sheldrake", "pydrake"))
    assert (ours.timestamp, ours.num_point_pair_contacts, ours.num_hydroelastic_contacts) == (100000, 1, 1)
    (our_point,), (their_point,) = ours.point_pair_contact_info, theirs.point_pair_contact_info
    assert (our_point.body1_name, our_point.body2_name) == (their_point.body1_name, their_point.body2_name)
    for name in ("contact_point", "contact_force", "normal"):
        close(getattr(our_point, name), getattr(their_point, name))
    (our_surface,), (their_surface,) = ours.hydroelastic_contacts, theirs.hydroelastic_contacts
    for i in "12":
        for name in ("geometry{}_name", "body{}_name", "model{}_name", "body{}_unique", "collision_count{}"):
            assert getattr(our_surface, name.format(i)) == getattr(their_surface, name.format(i))
    for name in ("centroid_W", "force_C_W", "moment_C_W"):
        close(getattr(our_surface, name), getattr(their_surface, name))
    assert our_surface.num_vertices == their_surface.num_vertices
    assert our_surface.poly_data_int_count == their_surface.poly_data_int_count
    close(sorted(our_surface.pressure), sorted(their_surface.pressure))
