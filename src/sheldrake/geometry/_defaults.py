"""Defaults that a program (or the pydrake alias) may change before it builds a model."""

#: How many contact points a pair of touching geometries reports when its proximity properties do not say:
#: "multi_point" (up to four well-spread points of a touching face or edge) or "single_point" (one point, as Drake).
point_contact_algorithm = "multi_point"

#: The property that overrides it, and its values.
POINT_CONTACT_ALGORITHM = ("material", "point_contact_algorithm")
POINT_CONTACT_ALGORITHMS = ("multi_point", "single_point")
