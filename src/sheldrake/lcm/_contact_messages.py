"""Messages about contacts, for viewers in other processes."""

from __future__ import annotations

from typing import ClassVar

from sheldrake.lcm._messages import Message


class lcmt_point(Message):
    """A point [m]."""

    _fields: ClassVar[list[tuple]] = [("x", "double"), ("y", "double"), ("z", "double")]


class lcmt_point_pair_contact_info_for_viz(Message):
    """A contact point, the force on body 2 there, and the normal from body 2 to body 1."""

    _fields: ClassVar[list[tuple]] = [
        ("timestamp", "int64_t"),
        ("body1_name", "string"),
        ("body2_name", "string"),
        ("contact_point", "double", 3),
        ("contact_force", "double", 3),
        ("normal", "double", 3),
    ]


class lcmt_hydroelastic_quadrature_per_point_data_for_viz(Message):
    """Slip and traction at a point of a contact surface."""

    _fields: ClassVar[list[tuple]] = [("p_WQ", "double", 3), ("vt_BqAq_W", "double", 3), ("traction_Aq_W", "double", 3)]


class lcmt_hydroelastic_contact_surface_for_viz(Message):
    """A contact surface: whose it is, its resultant force, its polygons with their pressure."""

    _fields: ClassVar[list[tuple]] = [
        *(
            field
            for i in "12"
            for field in (
                (f"geometry{i}_name", "string"),
                (f"body{i}_name", "string"),
                (f"model{i}_name", "string"),
                (f"body{i}_unique", "boolean"),
                (f"collision_count{i}", "int32_t"),
            )
        ),
        ("centroid_W", "double", 3),
        ("force_C_W", "double", 3),
        ("moment_C_W", "double", 3),
        ("num_quadrature_points", "int32_t"),
        ("quadrature_point_data", lcmt_hydroelastic_quadrature_per_point_data_for_viz, "num_quadrature_points"),
        ("num_vertices", "int32_t"),
        ("p_WV", lcmt_point, "num_vertices"),
        ("pressure", "double", "num_vertices"),
        ("poly_data_int_count", "int32_t"),
        ("poly_data", "int32_t", "poly_data_int_count"),
    ]


class lcmt_contact_results_for_viz(Message):
    """All contacts at one time [us]."""

    _fields: ClassVar[list[tuple]] = [
        ("timestamp", "int64_t"),
        ("num_point_pair_contacts", "int32_t"),
        ("point_pair_contact_info", lcmt_point_pair_contact_info_for_viz, "num_point_pair_contacts"),
        ("num_hydroelastic_contacts", "int32_t"),
        ("hydroelastic_contacts", lcmt_hydroelastic_contact_surface_for_viz, "num_hydroelastic_contacts"),
    ]
